"""Published fixtures and hand-derived cases, answers rational.

Decimal fixtures are multiplied until their data are exact in float64: the answer is homogeneous in (xdot, a) and
unchanged by a factor on (W, a). F0, F1, F1b (planar 3R) and F2 (planar 4R) are
the arms of methods.md, section 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from problems.sets.collect import Member, grouped
from sandbox.problem_set import Group
from sandbox.weight import Weight

Array = np.ndarray
Numbers = Sequence[float]

PI = 3.141592653589793


class Arm(NamedTuple):
    """A fixture: which robot, where, and its Jacobian there."""

    robot: str | None
    q: tuple[float, ...] | None
    J: tuple[tuple[float, ...], ...]


F0 = Arm("planar_3r", (0.0, 0.0, 0.0), ((0, 0, 0), (3, 2, 1)))
F1 = Arm("planar_3r", (0.0, PI / 2, -PI / 2), ((-1, -1, 0), (2, 1, 1)))
F1B = Arm("planar_3r", (0.0, PI / 2, 0.0), ((-2, -2, -1), (1, 0, 0)))
F2 = Arm("planar_4r", (0.0, PI / 2, -PI / 2, PI / 2), ((-2, -2, -1, -1), (2, 1, 1, 0)))


class Case(NamedTuple):
    """One problem and its answer, fractions as text; None where there is nothing to find.

    With `freedom` the answer is one of the minimisers, not the only one.
    """

    name: str
    arm: Arm
    W: Any
    xdot: Numbers
    answer: str | tuple[Fraction, ...] | None
    a: Numbers | None = None
    Wx: Any = None
    task: str = "exact"
    freedom: int = 0


def rows(*J: Numbers) -> Arm:
    """A Jacobian of no robot."""
    return Arm(None, None, tuple(tuple(row) for row in J))


def diag(*entries: float) -> Array:
    """A diagonal matrix."""
    return np.diag(np.array(entries, dtype=float))


def factored(E: Any, gamma: Any = None, base: Any = None) -> Weight:
    """W = base + E'gamma E, kept in factors."""
    E = np.array(E, dtype=float)
    return Weight(np.zeros((E.shape[1], E.shape[1])) if base is None else base, E, gamma)


def squares(*terms: Numbers) -> Array:
    """Hessian of a sum of squares (t'x - c)^2."""
    T = np.array(terms, dtype=float)
    return 2 * T.T @ T


INERTIA_F1 = np.array([[8.0, 4, 2], [4, 3, 1], [2, 1, 1]])  # unit point masses at the link ends, at F1
HS51 = ((1, -1, 0, 0, 0), (0, 1, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1))
HS52 = ((4, -1, 0, 0, 0), *HS51[1:])
HS_ROWS = rows((1, 3, 0, 0, 0), (0, 0, 1, 1, -2), (0, 1, 0, 0, -1))
GENHS28 = rows(*([0.0] * i + [1, 2, 3] + [0.0] * (7 - i) for i in range(8)))
GENHS28_W = squares(*([0.0] * i + [1, 1] + [0.0] * (8 - i) for i in range(9)))
WLN = (1.565884242105, 1.090541478737)  # joint-limit weights of joints 2 and 3, joint 1 has 1
D = tuple(2.0**-p for p in (13, 20, 26))  # near 1e-4, 1e-6, 1e-8; 1 - d^2 is exact


def weighted_least_norm(w2: Fraction, w3: Fraction) -> tuple[Fraction, ...]:
    """F1, W = diag(1, w2, w3), xdot = (1, 1): (0, -1, 2) + y (-1, 1, 1) with n'W qdot = 0."""
    y = (w2 - 2 * w3) / (1 + w2 + w3)
    return -y, y - 1, y + 2


CASES = (
    # methods.md, section 1: the simplest indefinite weights
    Case("F1, W = diag(-1, 1, 1)", F1, diag(-1, 1, 1), (1, 1), "1 -2 1"),
    Case("F1, W = diag(-2, 1, 1): algorithmic singularity, descending", F1, diag(-2, 1, 1), (1, 1), None),
    Case("F1, W = diag(-2, 1, 1): algorithmic singularity, level", F1, diag(-2, 1, 1), (1, 0), "-1 0 2", freedom=1),
    Case("F1, W = diag(-3, 1, 1): maximum", F1, diag(-3, 1, 1), (1, 1), None),
    Case("F2, W = diag(-1, 1, 1, 1)", F2, diag(-1, 1, 1, 1), (1, 1), "8/5 -7/5 -4/5 -3/5"),
    Case("F2, W = diag(1, 1, 1, -2): saddle", F2, diag(1, 1, 1, -2), (1, 1), None),
    Case("F2, W = 3 diag(-8/3, 1, 1, 1): singular, descending", F2, diag(-8, 3, 3, 3), (1, 1), None),
    Case("F1, W = I - J'J/2", F1, [[-1.5, -1.5, -1], [-1.5, 0, -0.5], [-1, -0.5, 0.5]], (1, 1), "1/3 -4/3 5/3"),
    Case("F1, W = J'AJ: level", F1, [[2, 1, 1], [1, 1, 0], [1, 0, 1]], (1, 1), "1/3 -4/3 5/3", freedom=1),
    Case("F1, W = J'AJ: descending", F1, [[2, 1, 1], [1, 1, 0], [1, 0, 1]], (1, 1), None, a=(-1, 1, 1)),
    Case("F1, symmetric part of an asymmetric W", F1, [[20, 8, 3], [8, 40, -5], [3, -5, 60]], (1, 1), "7/8 -15/8 9/8"),
    # methods.md, section 3: one entry per method
    Case("M1: F1, W = I", F1, diag(1, 1, 1), (1, 1), "1/3 -4/3 5/3"),
    Case("M1: F1b, W = I", F1B, diag(1, 1, 1), (1, 1), "1 -6/5 -3/5"),
    Case("M1: F2, W = I", F2, diag(1, 1, 1, 1), (1, 1), "8/11 -9/11 4/11 -13/11"),
    Case("M1: F1, W = diag(1, 2, 3), with a gradient", F1, diag(1, 2, 3), (3, -7), "-17/6 -1/6 -7/6", a=(1, -2, 4)),
    Case("M2: F1, first column of G", F1, diag(1, 2, 3), (1, 0), "1/6 -7/6 5/6"),
    Case("M2: F1, second column of G", F1, diag(1, 2, 3), (0, 1), "1/2 -1/2 1/2"),
    Case("M3: F1, joint limits, times 12 pi", F1, diag(1, 1, 1), (0, 0), "1 -1 -1", a=(0, 4, -1)),
    Case("M4: F1, weighted least norm", F1, diag(1, *WLN), (1, 1), weighted_least_norm(*map(Fraction, WLN))),
    Case("M5: F1b, manipulability, times sqrt 5", F1B, diag(1, 1, 1), (0, 0), "0 -2/5 4/5", a=(0, 0, -1)),
    Case("M6: F1b, static torque", F1B, diag(1, 1, 1), (0, 0), "0 3/5 -6/5", a=(-9, -9, -3)),
    Case(
        "M6: F1, accelerations of least torque",
        F1,
        INERTIA_F1 @ INERTIA_F1,
        (0, 0),
        "-2 2 2",
        a=INERTIA_F1 @ np.array([4.0, 1, 1]),
    ),
    Case("M7: F1, obstacle", F1, diag(1, 1, 1), (0, 0), "-1/3 1/3 1/3", a=(1, 0, 0)),
    Case("M8: F1, obstacle as second task", F1, factored([[1, 0, 0]]), (3, -7), "5 -8 -9", a=(-5, 0, 0)),
    Case(
        "M8: F1, obstacle out of reach of self-motion",
        F1,
        factored([[-1, -1, 0]]),
        (3, -7),
        "-7/3 -2/3 -5/3",
        a=(5, 5, 0),
        freedom=1,
    ),
    Case("M11: F1, tip angle, gamma = 1", F1, factored([[1, 1, 1]]), (3, -7), "-16 13 12", a=(-9, -9, -9)),
    Case(
        "M11: F1, tip angle, gamma = 2^-10", F1, factored([[1, 1, 1]], [2.0**-10]), (3, -7), "-16 13 12", a=(-9 * 2.0**-10,) * 3
    ),
    Case("M11: F1, tip angle, gamma = 57", F1, factored([[1, 1, 1]], [57.0]), (3, -7), "-16 13 12", a=(-513,) * 3),
    Case(
        "M11: F1, g = q1 + q2 is fixed by the task",
        F1,
        factored([[1, 1, 0]]),
        (3, -7),
        "-7/3 -2/3 -5/3",
        a=(-9, -9, 0),
        freedom=1,
    ),
    Case("M11: F1, tip angle with feedback", F1, factored([[1, 1, 1]]), (5, 5), "2 -7 8", a=(-3, -3, -3)),
    Case(
        "M11: F2, two functions",
        F2,
        factored([[1, 0, 0, 0], [1, 1, 1, 1]], [1.0, 2.0]),
        (3, -7),
        "5 -10 -7 14",
        a=(-9, -4, -4, -4),
    ),
    Case(
        "M11: F1, two functions for one freedom, gamma = (1, 1)",
        F1,
        factored([[1, 1, 1], [1, 0, 0]]),
        (3, -7),
        "-7 4 3",
        a=(-11, -9, -9),
    ),
    Case(
        "M11: F1, two functions for one freedom, gamma = (10, 1)",
        F1,
        factored([[1, 1, 1], [1, 0, 0]], [10.0, 1.0]),
        (3, -7),
        "-158/11 125/11 114/11",
        a=(-92, -90, -90),
    ),
    *(
        Case(
            f"M11: F1, g = (1 + d) q1 + q2, d = 2^{-p}",
            F1,
            factored([[1 + d, 1, 0]]),
            (1, 1),
            "1 -2 1",
            a=((1 + d) * (1 - d), 1 - d, 0),
        )
        for p, d in zip((13, 20, 26), D, strict=True)
    ),
    Case("M12: F1, extended Jacobian of the elastic energy", F1, factored([[-1, 0, 0]]), (2, 1), "0 -2 3"),
    Case("M12: F1, extended Jacobian of w", F1, factored([[0, 3, 2]]), (5, 10), "3 -8 12"),
    Case("M13: F1, Hessian of w, times sqrt 3", F1, [[0, 0, 0], [0, 1, 2], [0, 2, 0]], (1, 1), "1/5 -6/5 9/5"),
    Case("M13: F1, Hessian of w, rotation about the base", F1, [[0, 0, 0], [0, 1, 2], [0, 2, 0]], (-1, 2), "1 0 0"),
    Case("M16: F1, inertia", F1, INERTIA_F1, (1, 1), "0 -1 2"),
    Case("M16: F1, inertia - 3 J'J", F1, [[-7, -5, -4], [-5, -3, -2], [-4, -2, -2]], (1, 1), "0 -1 2"),
    Case(
        "M17: F1, load with inertia at the hand",
        F1,
        factored([[1, 1, 1]], [3.0], [[5, 3, 2], [3, 2, 1], [2, 1, 1]]),
        (2, 1),
        "1 -3 2",
    ),
    Case("M17: F1, point load at the hand", F1, [[5, 3, 2], [3, 2, 1], [2, 1, 1]], (1, 1), "1/3 -4/3 5/3", freedom=1),
    Case("M18: F1, F = (-1, -1): stable", F1, [[-2, -2, -1], [-2, -1, -1], [-1, -1, 0]], (1, 1), "0 -1 2"),
    Case("M18: F1, F = (-3/2, 0): buckling", F1, [[-2, -1.5, -1.5], [-1.5, -0.5, -1.5], [-1.5, -1.5, -0.5]], (1, 1), None),
    Case("M18: F1, F = (-2, 0): unstable", F1, [[-3, -2, -2], [-2, -1, -2], [-2, -2, -1]], (1, 1), None),
    Case(
        "M19: F1, damped tip angle",
        F1,
        factored([[1, 1, 1]], [100.0], diag(1, 2, 3)),
        (3, -7),
        "-809/53 650/53 597/53",
        a=(-900, -900, -900),
    ),
    Case(
        "M19: F1, damped at the algorithmic singularity",
        F1,
        factored([[1, 1, 0]], [100.0], diag(1, 1, 1)),
        (3, -7),
        "-7/3 -2/3 -5/3",
        a=(-900, -900, 0),
    ),
    # methods.md, section 6: eq. (13)
    Case("F0: achievable, indefinite W", F0, diag(20, 20, -1), (0, 1), "-3/7 -2/7 20/7"),
    Case("F0: achievable, W = I", F0, diag(1, 1, 1), (0, 14), "3 2 1"),
    Case("F0: not achievable, asked exactly", F0, diag(1, 1, 1), (1, 1), None),
    Case("F0: not achievable, W = I", F0, diag(1, 1, 1), (5, 14), "3 2 1", task="least_squares"),
    Case("F0: not achievable, indefinite W", F0, diag(20, 20, -1), (1, 1), "-3/7 -2/7 20/7", task="least_squares"),
    Case(
        "F0: not achievable, indefinite W, Wx couples the rows",
        F0,
        diag(20, 20, -1),
        (1, 1),
        "-6/7 -4/7 40/7",
        Wx=[[2, 1], [1, 1]],
        task="least_squares",
    ),
    Case("F0: the target is unbounded below", F0, diag(1, 1, 1), (1, 1), None, Wx=[[1, 0], [0, -1]], task="least_squares"),
    # methods.md, C1; lambda^2 = 1/64 is the default damping, so W = 64 I is the entry's lambda^2 = 1 with W = I
    Case("C1: F1, damped", F1, diag(64, 64, 64), (1, 1), "1/6 -1/3 1/2", task="damped"),
    # no freedom left
    Case("square J: W and a do not matter", rows((2, 1), (1, 1)), diag(-1, 1), (3, 2), "1 1", a=(5, -3)),
    # the literature of quadratic programming
    Case("x^2 + 4xy + y^2, x - y = 4", rows((1, -1)), [[2, 4], [4, 2]], (4,), "2 -2"),
    Case("x^2 + 4xy + y^2, x + y = 4: maximum", rows((1, 1)), [[2, 4], [4, 2]], (4,), None),
    Case(
        "Nocedal & Wright, example 16.2",
        rows((1, 0, 1), (0, 1, 1)),
        [[6, 2, 1], [2, 5, 2], [1, 2, 4]],
        (3, 0),
        "2 -1 1",
        a=(-8, -3, -3),
    ),
    Case("CasADi, regression test of equality rows", rows((1, 1)), [[1, -1], [-1, 2]], (2,), "2/5 8/5", a=(-2, -6)),
    Case(
        "Maros-Meszaros, GENHS28",
        GENHS28,
        GENHS28_W,
        (1,) * 8,
        "814/4957 -258/4957 1553/4957 703/4957 666/4957 974/4957 781/4957 807/4957 854/4957 814/4957",
    ),
    Case("Maros-Meszaros, HS51", HS_ROWS, squares(*HS51), (4, 0, 0), "1 1 1 1 1", a=(0, -4, -4, -2, -2)),
    Case(
        "Maros-Meszaros, HS52",
        HS_ROWS,
        squares(*HS52),
        (0, 0, 0),
        "-33/349 11/349 180/349 -158/349 11/349",
        a=(0, -4, -4, -2, -2),
    ),
    Case(
        "Hock & Schittkowski 53, without its bounds",
        HS_ROWS,
        squares(*HS51),
        (0, 0, 0),
        "-33/43 11/43 27/43 -5/43 11/43",
        a=(0, -4, -4, -2, -2),
    ),
)

ANSWERS: dict[str, tuple[Fraction, ...] | None] = {
    case.name: tuple(Fraction(part) for part in case.answer.split()) if isinstance(case.answer, str) else case.answer
    for case in CASES
}
"""The answer of each case, None where there is none; of cases in FREEDOM it is one of many."""

FREEDOM = {case.name: case.freedom for case in CASES if case.freedom}
"""Dimension of what is left free, where the minimum is not unique."""

VALUES = {
    "x^2 + 4xy + y^2, x - y = 4": (-8.0, 0.0),
    "CasADi, regression test of equality rows": (-8.4, 0.0),
    "Maros-Meszaros, GENHS28": (0.92717369, 0.0),
    "Maros-Meszaros, HS51": (0.0, 6.0),
    "Maros-Meszaros, HS52": (5.32664756, 6.0),
    "Hock & Schittkowski 53, without its bounds": (4.09302326, 6.0),
}
"""Published optimal value, and the constant that 1/2 x'Wx + a'x leaves out of it."""


def member(case: Case) -> Member:
    """One case; nothing is drawn, so it has no seed."""
    J = np.array(case.arm.J, dtype=float)
    W = case.W if isinstance(case.W, Weight) else np.array(case.W, dtype=float)
    a = np.zeros(J.shape[1]) if case.a is None else np.array(case.a, dtype=float)
    Wx = None if case.Wx is None else np.array(case.Wx, dtype=float)
    q = None if case.arm.q is None else list(case.arm.q)
    labels = {"robot": case.arm.robot, "q": q, "case": case.name}
    return Member(J, np.array(case.xdot, dtype=float), W, a, Wx, labels)


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set; `seed` and `full` change nothing."""
    tasks = dict.fromkeys(case.task for case in CASES)
    return tuple(g for t in tasks for g in grouped((member(c) for c in CASES if c.task == t), (t,)))
