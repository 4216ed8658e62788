"""Section VII: any technique that is cast can be verified against what it minimises."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.introduction import ARMS, EXACT, ON_ARMS, listed, situations
from sandbox.claims.scatter import beside, drawable, thinned
from sandbox.law import answer
from sandbox.method import Method, Robot
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import Solution
from sandbox.stacked import eigenvalues, symmetric, times, transpose
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def gradient_left_out(six: Answer) -> Answer:
    """The secondary function forgotten: a = 0."""

    def planted(method: Method, robot: Robot, problem: VelocityProblem, *rest: Any, **options: Any) -> Solution:
        return six(method, robot, VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W), *rest, **options)

    return planted


def verified_by_meaning(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """First- and second-order conditions of the minimum in null J, and the exact minimiser, for every exact method."""
    rng, count = trial.rng("verified_by_meaning"), trial.of(25, 2)
    names = ("gradient", "rounding", "curvature", "flat", "ratio", "W")
    columns: dict[str, dict[str, list[Array]]] = {name: {method.id: [] for method in EXACT} for name in names}
    minimum: list[bool] = []
    for method, robot, drawn, problem in situations(EXACT, ARMS, rng, count):
        x = six(method, robot, problem, drawn.parameters, on_refusal="status").x
        truths = exact(problem)
        minimum += [one.expected == "unique_minimum" for one in truths]
        N = np.stack([equations.null_space(J) for J in problem.J])
        W, sigma = problem.W.dense(), np.linalg.svd(problem.J, compute_uv=False)
        size_W = np.linalg.norm(W, 2, axis=(-1, -2))
        size = size_W * np.linalg.norm(x, axis=-1) + np.linalg.norm(problem.a, axis=-1)
        gradient = times(problem.W.left(N), x) + times(transpose(N), problem.a)
        found = {
            "gradient": np.linalg.norm(gradient, axis=-1) / size,
            "rounding": FORWARD * problem.n * UNIT * sigma[:, 0] / sigma[:, -1],  # of N, which W x + a is carried by
            "curvature": eigenvalues(symmetric(problem.W.left(N) @ N))[:, 0] / size_W,
            "flat": problem.n * UNIT * sigma[:, 0] / sigma[:, -1],
            "W": eigenvalues(W)[:, 0] / size_W,
            "ratio": np.abs(x - np.array([one.x for one in truths])).max(axis=-1)
            / bounds(method, problem, np.array([one.x for one in truths]), drawn.parameters)[0],
        }
        for name, values in found.items():
            columns[name][method.id].append(values)
    of = {name: {key: np.concatenate(parts) for key, parts in rows.items()} for name, rows in columns.items()}
    whole = {name: np.concatenate(list(rows.values())) for name, rows in of.items()}
    checks = (
        at_most(
            r"$|N^T(W\dot q + a)|$, relative to $|W||\dot q| + |a|$ / rounding of $N$",
            whole["gradient"] / whole["rounding"],
            1.0,
        ),
        every(r"$\lambda_{min}(N^T W N) > 0$ beyond rounding of $N$", whole["curvature"] > whole["flat"]),
        every("in rational arithmetic: a unique minimum", minimum),
        at_most(r"$|\dot q - \dot q^*|$ / error bound, $\dot q^*$ the rational minimiser", whole["ratio"], 1.0),
        every(
            r"some of the weights are indefinite: $W > 0$ is not what makes it a minimum",
            [(whole["W"] < -whole["flat"]).any()], role=Role.OURS,
        ),
    )  # fmt: skip
    places = thinned(np.concatenate([beside(i, of["gradient"][m.id].size) for i, m in enumerate(EXACT)]))
    shown = {name: thinned(values) for name, values in whole.items()}
    axis = Axis("method", categories=listed(EXACT))
    plots = (
        Plot(
            "First order: what is left of the gradient of $\\frac{1}{2}\\dot q^T W\\dot q + \\alpha\\dot f$ along the "
            "self-motion, relative to its size, in some of the situations; zero is drawn at the foot",
            axis, Axis("|Nᵀ(W q̇ + a)| / (|W||q̇| + |a|)", log=True),
            (
                Series("reduced gradient", places, drawable(shown["gradient"])),
                Series("rounding of N", places, shown["rounding"], role="bound"),
            ),
        ),
        Plot(
            "Second order: condition (7), $N^T W N > 0$, and the weight itself, in some of the situations. (7) holds also "
            "where $W$ is singular or indefinite.",
            axis, Axis("smallest eigenvalue, relative to |W|"),
            (
                Series("of NᵀWN", places, shown["curvature"]),
                Series("of W", places, shown["W"], role="other"),
                Series("zero", (0.0,), (0.0,), "horizontal", "bound"),
            ),
        ),
    )  # fmt: skip
    table = Table(
        f"Every exact method, in {count} situations on each of {ON_ARMS}",
        (
            "id", "method", "situations", "largest reduced gradient / rounding", "least eigenvalue of $N^TWN$ / $|W|$",
            "largest error / bound", "$W$ indefinite in",
        ),
        tuple(
            (
                m.id, m.title, of["ratio"][m.id].size, float((of["gradient"][m.id] / of["rounding"][m.id]).max()),
                float(of["curvature"][m.id].min()), float(of["ratio"][m.id].max()),
                int((of["W"][m.id] < -of["flat"][m.id]).sum()),
            )
            for m in EXACT
        ),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


CLAIMS = (
    Claim(
        name="verified_by_meaning",
        title="What is cast can be verified by what it minimises",
        place="Section VII",
        says=(
            r"Any technique that is cast can be verified against its meaning: it minimises "
            r"$\frac{1}{2}\dot q^T W\dot q + \alpha\dot f$ in the null space of the Jacobian."
        ),
        formula=r"N_J^T (W\dot q + \alpha\nabla f) = 0, \qquad N_J^T W N_J > 0",
        tested=(
            "The 19 methods that can be cast, on three arms. The rates that (6) gives are put into both conditions of a "
            "minimum, $N_J$ by singular values, and beside the minimiser that rational arithmetic finds from the same $J$, "
            "$W$, $a$."
        ),
        accepted=(
            r"In every situation the gradient along the self-motion is rounding, $N_J^T W N_J$ is positive definite, and the "
            "rational minimiser exists and is met within the error bound."
        ),
        paths=(
            CodePath("the method as cast, answered by eq. (6)", answer),
            CodePath("the minimiser by exact elimination over the rationals", truth),
        ),
        examine=verified_by_meaning,
        fault=Fault(r"$\alpha\nabla f$ left out", gradient_left_out),
    ),
)
