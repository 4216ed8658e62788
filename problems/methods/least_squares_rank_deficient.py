"""M20: eq. (13), for Jacobians that have lost rank."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.draw import anywhere, centre, gathered, scattered
from problems.original import least_squares_rank_deficient
from problems.robots.robot import Robot
from problems.weightings.identity import one_unit
from sandbox import check
from sandbox.method import Draw, Method
from sandbox.parameters import matrix, number, scalar, within
from sandbox.problem import VelocityProblem
from sandbox.tolerances import RANK, ROBOT_RANK, UNIT

Array = np.ndarray

FEWEST, STEPS, ROUNDS = 200, 20, 20
"""Starts at a time (or as many as are wanted), steps from each, and times, of the search for singular configurations."""

FAR = 0.3
"""Longest step of the search, per joint [rad, m]."""

LOST, KEPT = 1e-14, 1e-2
"""Singular values and rows of J at drawn configurations lie below the one or above the other, as shares of |J|."""


def cast(
    robot: Robot, q: Array, xdot: Array, *,
    weight: Any = 1.0, gradient: Array | None = None, task_weight: Any = 1.0, rank_tolerance: float | None = None,
) -> VelocityProblem:  # fmt: skip
    """W, a and Wx as given.

    weight : W, a number, (n,) or (n, n) symmetric; only N'WN > 0 is asked, N the whole null space (condition 7)
    gradient : a, (n,) or (B, n); zero if left out
    task_weight : Wx, a number, (m,) or (m, m) symmetric, positive definite on range J
    rank_tolerance : share of the largest singular value up to which one counts as zero, of eq13; a row of J within this
        share of |J| (of rounding, if left out) is no row: eq13 scales all rows alike
    """
    if scalar(weight):
        one_unit(robot, "give weight, its diagonal (n,) or all of it")
    W, Wx = matrix(weight, "weight", robot.n), matrix(task_weight, "task_weight", robot.m)
    J, a = robot.jacobian(q), np.zeros(robot.n) if gradient is None else check.real(gradient, "gradient")
    for name, lead in (("weight", W.shape[:-2]), ("task_weight", Wx.shape[:-2]), ("gradient", a.shape[:-1])):
        within(J.shape[:-2], lead, name)
    share = RANK * robot.n * UNIT if rank_tolerance is None else number(rank_tolerance, "rank_tolerance", least=0)
    lost = np.linalg.norm(J, axis=-1, keepdims=True) <= share * np.linalg.norm(J, 2, axis=(-2, -1), keepdims=True)
    return VelocityProblem(J=np.where(lost, 0.0, J), xdot=xdot, W=W, a=a, Wx=Wx)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Singular configurations, J of lower rank up to rounding, with W and Wx positive definite and full."""
    q = singular(robot, rng, count)
    parameters = {
        "weight": scattered(rng, robot.n), "gradient": rng.uniform(-1.0, 1.0, (count, robot.n)),
        "task_weight": scattered(rng, robot.m), "rank_tolerance": ROBOT_RANK,
    }  # fmt: skip
    return Draw(q, rng.uniform(-1.0, 1.0, (count, robot.m)), parameters)


def singular(robot: Robot, rng: np.random.Generator, count: int) -> Array:
    """Configurations (count, n) within the limits at which J has lost rank to rounding, and clearly.

    From random starts, Gauss-Newton steps of least norm on J'u = 0, u'u = 1 in the unknowns q and u (m,).
    Raises EmptyPlanError where hardly any is found.
    """
    middle, half = centre(robot)
    n, m, starts = robot.n, robot.m, max(count, FEWEST)

    def once() -> tuple[Array]:
        q = anywhere(robot, rng, starts)
        u = np.linalg.svd(robot.jacobian(q))[0][:, :, -1]
        for _ in range(STEPS):
            J = robot.jacobian(q)
            left = np.concatenate([np.einsum("bmn,bm->bn", J, u), (np.square(u).sum(axis=1, keepdims=True) - 1) / 2], axis=1)
            derivative = np.zeros((starts, n + 1, n + m))
            derivative[:, :n, :n] = np.einsum("bm,bjmn->bnj", u, robot.jacobian_derivative(q))
            derivative[:, :n, n:], derivative[:, n, n:] = np.swapaxes(J, 1, 2), u
            step = np.einsum("bij,bj->bi", np.linalg.pinv(derivative, rcond=ROBOT_RANK), left)
            step *= np.minimum(1.0, FAR / np.maximum(np.abs(step).max(axis=1, keepdims=True), FAR))
            q, u = q - step[:, :n], u - step[:, n:]
        J = robot.jacobian(q)
        sigma = np.linalg.svd(J, compute_uv=False)
        # lost or not, singular values and rows alike: a rank that nobody can tell is no use here
        with np.errstate(invalid="ignore"):  # J = 0 is no use either
            sizes = np.concatenate([sigma, np.linalg.norm(J, axis=2)], axis=1) / sigma[:, :1]
        clear = ~((sizes > LOST) & (sizes < KEPT)).any(axis=1)
        inside = (np.abs(q - middle) <= half).all(axis=1)
        return (q[(sizes[:, m - 1] < LOST) & clear & inside],)

    return gathered(once, count, f"singular configurations of {robot.name}", attempts=ROUNDS)[0]


METHOD = Method(
    id="M20",
    name="least_squares_rank_deficient",
    title="Least squares at rank-deficient J, eq. (13)",
    formula="qdot = q_p + N y, q_p of least (J qdot - xdot)'Wx(J qdot - xdot), y of least qdot'W qdot / 2 + a'qdot",
    weight="any",
    vector="any",
    condition="N'WN > 0 on the enlarged null space, Wx > 0 on range J",
    number="eq. (13)",
    certainty="certain",
    works=("J. D. English, A. A. Maciejewski, eq. (13) of the paper itself",),
    cast=cast,
    original=least_squares_rank_deficient.original,
    draw=draw,
    form="eq13",
    task="least_squares",
    refuses=(
        "singular values without a clear gap",
        "Wx not positive definite on range J",
        "N'WN not positive definite; weights of rank n - m never are where J has lost rank",
    ),
)
