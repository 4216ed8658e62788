"""What alpha trades."""

from __future__ import annotations

import numpy as np

from problems import robots
from problems.measures.manipulability import volume
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Trial, at_most
from sandbox.claims.exhibit import Axis, Exhibit, Plot, Series
from sandbox.claims.framework.reach import reach
from sandbox.claims.situations import SIZES, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.null_basis import orthonormal
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import symmetric, times, transpose

Array = np.ndarray


def weight_forgotten(six: Answer) -> Answer:
    """The joint-rate measure is taken for qdot'qdot."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(problem.n), a=problem.a))

    return planted


ALPHAS = (-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 4.0)


def tradeoff(trial: Trial, six: Answer, weighted_inverse: Answer) -> Evidence:
    """(6) for several alpha beside the least measure that any motion with the same fdot has."""
    rng, count = trial.rng("tradeoff"), trial.of(20, 3)
    checks: list[Check] = []
    affine, falling, slopes = [], [], []
    for m, n in SIZES:
        problem, ratios = positive(rng, m, n, count, decades=1.0), []
        W, J, gradf, N = problem.W.dense(), problem.J, problem.a, orthonormal(problem.J)
        swept = {alpha: VelocityProblem(J=J, xdot=problem.xdot, W=problem.W, a=alpha * gradf) for alpha in ALPHAS}
        rates = {alpha: six(one).x for alpha, one in swept.items()}
        bound = {alpha: CLOSED_FORMS["eq6"].bound(one) * reach(one, rates[alpha]) for alpha, one in swept.items()}
        steepness = np.einsum(
            "bi,bi->b", gradf, times(N @ np.linalg.solve(symmetric(problem.W.left(N) @ N), transpose(N)), gradf)
        )
        for alpha, x in rates.items():
            line = rates[0.0] + alpha * (rates[1.0] - rates[0.0])
            allowed = bound[alpha] + (1 + 2 * abs(alpha)) * (bound[0.0] + bound[1.0])
            affine.append(np.abs(x - line).max(axis=-1) / allowed)
            length = np.linalg.norm(gradf, axis=-1) * np.sqrt(n)
            drop = np.einsum("bi,bi->b", gradf, x - rates[0.0]) + alpha * steepness
            falling.append(np.abs(drop) / (length * (bound[alpha] + bound[0.0])) if alpha else drop * 0)
            rows = np.concatenate([J, gradf[:, None, :]], axis=1)
            target = np.concatenate([problem.xdot, np.einsum("bi,bi->b", gradf, x)[:, None]], axis=1)
            front = VelocityProblem(J=rows, xdot=target, W=problem.W)
            best = np.stack([weighted_inverse(rows[i], W[i]) @ target[i] for i in range(count)])
            limit = CLOSED_FORMS["eq2_5"].bound(front) * reach(front, best)
            ratios.append(np.abs(x - best).max(axis=-1) / (bound[alpha] + limit))
            # the multiplier of the last row: what fdot costs in 1/2 qdot'W qdot
            stiffness = np.linalg.inv(rows @ np.linalg.solve(W, transpose(rows)))
            price = np.linalg.norm(stiffness[:, -1], axis=-1) * np.linalg.norm(rows, 2, axis=(-1, -2)) * np.sqrt(n)
            slopes.append(np.abs(times(stiffness, target)[:, -1] + alpha) / (price * (bound[alpha] + limit)))
        checks.append(
            at_most(f"(6) = the least measure at its own $\\dot f$, difference / bounds, $m = {m}$, $n = {n}$", ratios, 1.0)
        )
    checks += [
        at_most(r"$\dot q(\alpha)$ is affine: distance from the line through $\alpha = 0, 1$ / bounds", affine, 1.0),
        at_most(r"$\dot f$ falls by $\alpha\nabla f^TN(N^TWN)^{-1}N^T\nabla f \geq 0$, difference / bounds", falling, 1.0),
        at_most(r"slope of the curve, $d(\frac{1}{2}\dot q^TW\dot q)/d\dot f = -\alpha$, difference / bounds", slopes, 1.0),
    ]
    return Evidence(tuple(checks), _tradeoff_of_an_arm(six, weighted_inverse, rng))


def _tradeoff_of_an_arm(six: Answer, weighted_inverse: Answer, rng: np.random.Generator) -> tuple[Exhibit, ...]:
    """A planar 4R arm that trades joint rates for manipulability: f = -w."""
    robot, q = robots.load("planar_4r"), np.array([0.3, 1.1, -0.7, 0.5])
    J, gradf, W, xdot = robot.jacobian(q), -volume().gradient(robot, q), np.diag([4.0, 3, 2, 1]), np.array([0.5, -0.3])
    alphas = np.linspace(0.0, 1.5, 31)
    x = six(VelocityProblem(J=J, xdot=xdot, W=W, a=alphas[:, None] * gradf)).x
    fdot, measure = x @ gradf, np.einsum("bi,ij,bj->b", x, W, x) / 2
    values = np.linspace(fdot.min() - 0.4, fdot.max() + 0.8, 61)
    rows = np.vstack([J, gradf])
    front = np.stack([weighted_inverse(rows, W) @ np.append(xdot, value) for value in values])
    cloud = x[rng.integers(0, len(x), 400)] + 0.6 * rng.standard_normal((400, 2)) @ equations.null_space(J).T
    shown = cloud[np.einsum("bi,ij,bj->b", cloud, W, cloud) / 2 < 2.5 * measure.max()]
    plot = Plot(
        "The trade-off of a planar 4R arm between the joint-rate measure and manipulability, $f = -w$. Every motion with "
        "$J\\dot q = \\dot x$ lies on or above the curve; (6) moves along it with $\\alpha$, and its slope there is "
        "$-\\alpha$. $\\dot f$ has no least value: it falls as long as $\\alpha$ grows.",
        Axis("ḟ = −dw/dt [m²/s]"), Axis("½ q̇ᵀW q̇"),
        (
            Series("random motions with the same ẋ", shown @ gradf, np.einsum("bi,ij,bj->b", shown, W, shown) / 2),
            Series("(6), α from 0 to 1.5", fdot, measure, text=[f"α = {alpha:.2f}" for alpha in alphas]),
            Series(
                "least measure at a given ḟ, (5) on J and ∇fᵀ", values, np.einsum("bi,ij,bj->b", front, W, front) / 2,
                "line", "other",
            ),
        ),
    )  # fmt: skip
    joints = Plot(
        "The joint rates of (6) for this arm: each is a straight line in $\\alpha$",
        Axis("α"), Axis("joint rate [rad/s]"),
        tuple(Series(f"joint {i + 1}", alphas, x[:, i], "line") for i in range(4)),
    )  # fmt: skip
    return plot, joints


CLAIM = Claim(
    name="tradeoff",
    title="The scalar trades the joint-rate measure against the derivative of f",
    place="Section II, after eq. (7)",
    says=r"(6) makes a trade-off, based on $\alpha$, between minimising the joint-rate measure and extremising $\dot f$.",
    formula=r"\dot q(\alpha) = \dot q(0) - \alpha\, N_J (N_J^T W N_J)^{-1} N_J^T \nabla f",
    tested=(
        r"Random problems in eight sizes at seven $\alpha$; each answer beside the least $\dot q^T W\dot q$ that any motion "
        r"with the same $\dot x$ and the same $\dot f$ has. A planar 4R arm as a picture."
    ),
    accepted=(
        r"Every answer of (6) lies on the curve of least measure over $\dot f$, whose slope there is $-\alpha$; $\dot q$ is "
        r"affine in $\alpha$, and $\dot f$ falls as $\alpha$ grows, by the amount predicted: it is minimised for $\alpha > 0$ "
        r"and maximised for $\alpha < 0$."
    ),
    paths=(
        CodePath(r"eq. (6) for each $\alpha$", eq6),
        CodePath(r"(5) as printed, with $\nabla f^T$ as one more task row", equations.generalized_inverse),
    ),
    examine=tradeoff,
    fault=Fault(r"the measure taken for $\dot q^T\dot q$, $W$ forgotten", weight_forgotten),
)
