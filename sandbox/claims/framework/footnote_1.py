"""Footnote 1: what a weighted generalised inverse is."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from problems import robots
from problems.sets import construct as make
from problems.sets.textbook import F1
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.framework.small_arms import ASKED, J1, J2
from sandbox.claims.numbers import told
from sandbox.claims.situations import SIZES, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.null_basis import orthonormal
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import Solution
from sandbox.stacked import symmetric, times
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def weight_not_inverted(five: Answer) -> Answer:
    """G = W J'(J W J')^-1: W in the place of W^-1."""

    def planted(problem: VelocityProblem) -> Solution:
        W = symmetric(np.linalg.inv(problem.W.dense()))
        return five(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a))

    return planted


def inverse_of(five: Answer, problem: VelocityProblem) -> Array:
    """G (B, n, m): the answers to unit task velocities, grad f left out."""
    columns = []
    for i in range(problem.m):
        unit = VelocityProblem(J=problem.J, xdot=np.eye(problem.m)[i], W=problem.W)
        columns.append(five(unit).x)
    return np.stack(columns, axis=-1)


def footnote_1(trial: Trial, five: Answer, exact: Answer) -> Evidence:
    """G xdot beside the exact minimiser of qdot'W qdot, and beside random motions with the same xdot."""
    rng, count = trial.rng("footnote_1"), trial.of(30, 4)
    checks: list[Check] = []
    excess, found = [], []
    for m, n in SIZES:
        drawn = positive(rng, m, n, count, decades=1.5)
        problem = VelocityProblem(J=drawn.J, xdot=drawn.xdot, W=drawn.W)
        G, W, N = inverse_of(five, problem), problem.W.dense(), orthonormal(problem.J)
        x, best = times(G, problem.xdot), np.stack([one.x for one in exact(problem)])
        allowed = CLOSED_FORMS["eq2_5"].bound(problem) * times(np.abs(G).max(axis=1, keepdims=True), np.abs(problem.xdot))[:, 0]
        checks.append(at_most(f"$G\\dot x$ and the exact minimiser, difference / bound, $m = {m}$, $n = {n}$",
                              np.abs(x - best).max(axis=-1) / allowed, 1.0))  # fmt: skip
        y = rng.standard_normal((10, count, n - m)) * 10.0 ** rng.uniform(-1.0, 1.0, (10, count, 1))
        step = np.einsum("bik,rbk->rbi", N, y)
        more = _measure(W, x + step) - _measure(W, x)
        rounding = FORWARD * n * UNIT * (_measure(W, x + step) + _measure(W, x))
        drift = 2 * n * np.linalg.norm(step, axis=-1) * np.linalg.norm(W, 2, axis=(-1, -2)) * allowed
        found.append(np.abs(more - _measure(W, step)) / (rounding + drift))
        excess.append(more / _measure(W, step))
    checks += [
        at_least("random motions with the same $\\dot x$ cost more: excess / $\\delta^TW\\delta$", excess, 0.5),
        at_most("their excess is $\\delta^TW\\delta$, $\\delta = \\dot q - G\\dot x$: difference / rounding", found, 1.0),
        _deficient(trial, exact),
    ]
    literal, table = _literal(five)
    return Evidence((*checks, *literal), (_competitors(five, rng), table))


def _measure(W: Array, x: Array) -> Array:
    """The measure qdot'W qdot (..., B) of rates (..., B, n)."""
    return np.einsum("...bi,bij,...bj->...b", x, W, x)


def _deficient(trial: Trial, exact: Answer) -> Check:
    """The footnote asks for a solution of J qdot = xdot, not for full rank: (13) gives the minimiser there."""
    rng, ratios = trial.rng("footnote_1, deficient"), []
    for m, n in ((2, 3), (3, 6), (6, 7)):
        for _ in range(trial.of(10, 2)):
            J = make.integer_basis(rng, m - 1, n).J
            J = np.vstack([J, J.sum(axis=0)])
            F = make.integers(rng, n, n)
            problem = VelocityProblem(J=J, xdot=J @ make.integers(rng, n), W=F.T @ F + np.eye(n)).stacked()
            (known,) = exact(problem)
            form = CLOSED_FORMS["eq13"]
            size = max(np.abs(known.x).max(), 1.0)
            ratios.append(np.abs(form(problem).x[0] - known.x).max() / (form.bound(problem)[0] * size))
    return at_most(
        "$J$ of lower rank, $\\dot x$ in its range: (13) and the exact minimiser, difference / bound",
        ratios,
        1.0,
        role=Role.OURS,
    )


def _literal(five: Answer) -> tuple[tuple[Check, ...], Table]:
    """What is printed, "G x": x the position of the hand of a planar 3R arm."""
    robot, W = robots.load("planar_3r"), np.diag([1.0, 2, 3])
    position = robot.forward(np.array(F1.q))[0][:2]
    G = inverse_of(five, VelocityProblem(J=J1, xdot=ASKED, W=W).stacked())[0]
    hand = (("1/6", "1/2"), ("-7/6", "-1/2"), ("5/6", "1/2"))
    off = np.abs(G - [[float(Fraction(word)) for word in row] for row in hand])
    rounding = FORWARD * 3 * UNIT * np.linalg.cond(J1) ** 2 * 3
    moves = [J1 @ G @ v for v in (position, ASKED)]
    checks = (
        at_most("planar 3R, $W$ = diag(1, 2, 3): $G$ as worked out by hand", off, rounding),
        at_most(
            r"as printed, $\dot q = Gx$, $x$ the hand's position: $|J\dot q - \dot x|$",
            np.abs(moves[0] - ASKED).max(), rounding, role=Role.PRINTED,
            range=(
                f"Read $G\\dot x$, with the dot, which may have been lost in our copy of the text. $G\\dot x$ moves the hand "
                f"at {told(moves[1])}, as asked; $Gx$ at {told(moves[0])}, which is where the hand is."
            ),
        ),
    )  # fmt: skip
    rows = [(f"$G$, row {i + 1}", f"({', '.join(hand[i])})".replace("-", "−"), told(G[i])) for i in range(3)]
    rows += [
        ("$J G x$, as printed, $x$ the hand's position", told(ASKED), told(moves[0])),
        ("$J G \\dot x$, with the dot", told(ASKED), told(moves[1])),
    ]
    return checks, Table(
        "Planar 3R at (0, π/2, −π/2), $W$ = diag(1, 2, 3), $\\dot x$ = (1, 1), hand at (2, 1)",
        ("quantity", "by hand, or asked", "found"), tuple(rows),
    )  # fmt: skip


def _competitors(five: Answer, rng: np.random.Generator) -> Plot:
    problem = VelocityProblem(J=J2, xdot=ASKED, W=np.diag([1.0, 2, 3, 8])).stacked()
    W, N = problem.W.dense(), equations.null_space(J2)
    x = times(inverse_of(five, problem), problem.xdot)
    step = (rng.standard_normal((500, 2)) * 10.0 ** rng.uniform(-3.0, 1.0, (500, 1)) @ N.T)[:, None, :]
    length = np.linalg.norm(step[:, 0], axis=-1)
    low, high = np.linalg.eigvalsh(N.T @ W[0] @ N)
    return Plot(
        "500 random motions of a planar 4R arm with the same $\\dot x$: what each costs more than $G\\dot x$, over the square "
        "of its distance. It lies between the least and the largest eigenvalue of $N^TWN$, which are positive.",
        Axis("|q̇ − Gẋ| [rad/s]", log=True), Axis("excess of q̇ᵀW q̇ / |q̇ − Gẋ|²", low=0.0),
        (
            Series("random motions", length, (_measure(W, x + step) - _measure(W, x))[:, 0] / length**2),
            Series("largest eigenvalue", (), (float(high),), "horizontal", "bound"),
            Series("least eigenvalue", (), (float(low),), "horizontal", "bound"),
        ),
    )  # fmt: skip


CLAIM = Claim(
    name="footnote_1",
    title="What a weighted generalised inverse is",
    place="Section II, footnote 1 and eq. (5)",
    says=(
        r"If $J\dot q = \dot x$ has a solution, the unique one minimising $\dot q^T W\dot q$ is $G\dot x$ (printed: $Gx$); for "
        "$J$ of full row rank, $G$ is that of (5)."
    ),
    formula=r"G = W^{-1} J^T (J W^{-1} J^T)^{-1}",
    tested=(
        r"$G\dot x$, $G$ by (5), beside the exact minimiser and beside ten random motions with the same $\dot x$ for each "
        r"problem, in eight sizes; $J$ of lower rank with $\dot x$ in its range, where (5) does not apply; and $Gx$ to the "
        "letter, $x$ the position of the hand."
    ),
    accepted=(
        r"The difference to the exact minimiser is within the error bound; every other motion costs more by $\delta^T W\delta "
        r"> 0$, $\delta$ its difference from $G\dot x$."
    ),
    paths=(
        CodePath("(5) by two Cholesky factorisations, asked for unit task velocities", eq2_5),
        CodePath("the minimiser by exact elimination over the rationals", truth),
    ),
    examine=footnote_1,
    fault=Fault("$W$ in the place of $W^{-1}$", weight_not_inverted),
)
