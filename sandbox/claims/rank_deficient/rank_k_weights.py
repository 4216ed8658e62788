"""The weights (8) and (11), of rank n - m, in eq. (13)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from problems import robots
from problems.methods.least_squares_rank_deficient import singular
from problems.sets import construct as make
from sandbox.claims.arms import ARMS
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.rank_deficient.posed import SANDBOX, answered, drawn, error, exact_bases, posed
from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.solution import Solution, Status
from sandbox.tolerances import ROBOT_RANK
from sandbox.weight import Weight

Array = np.ndarray

DAMPING = 2.0**-6
"""W~ = DAMPING I, beside gradients of whole numbers: small, and exact."""


class Weighed(NamedTuple):
    """Where an undamped weight W = E' Gamma E, k rows in E, meets a Jacobian of rank r: n - r directions are to be weighed."""

    name: str
    m: int
    n: int
    r: int
    rank: int  # of N'WN, exactly; -1 where J is not exact
    undamped: bool
    damped: bool


def rank_k_weights_never_qualify(trial: Trial, thirteen: Answer, exact: Answer) -> Evidence:
    """Weights (8) and (11) at kinematic singularities: over integers with the rationals beside, and on robots."""
    rng = trial.rng("rank_k_weights_never_qualify")
    found: list[Weighed] = []
    sound, reasons, ratios, ranks, regular, series, curvature = [], [], [], [], [], [], []
    for m, n in ((2, 3), (2, 4), (4, 6), (6, 7)) if trial.full else ((2, 3), (4, 6)):
        for r in range(m + 1):
            for repeat in range(trial.of(8, 3)):
                plain = drawn(rng, m, n, r, "unachievable" if r < m else "achievable", "identity", "positive definite")
                problem = augmented(plain, make.nonzero_integers(rng, n - m, n), make.nonzero_integers(rng, n - m), rng)
                told, status = exact(problem, "least_squares"), answered(thirteen, problem)[1]
                if r == m:
                    regular.append((status is Status.SOLVED) == (told.expected == "unique_minimum"))
                    found.append(Weighed("full rank", m, n, r, told.inertia[0], status is Status.SOLVED, True))
                    continue
                one = posed(damped(problem, DAMPING), exact)
                x, then = answered(thirteen, one.problem)
                ranks.append(told.inertia[0] + told.inertia[1] <= n - m < n - r and told.expected != "unique_minimum")
                reasons.append(status is Status.CONDITION_SEVEN)
                sound.append(then is Status.SOLVED and one.told.expected == "unique_minimum")
                ratios.append(error(x, one) / one.bound)
                found.append(Weighed("integers, (8)", m, n, r, told.inertia[0], status is Status.SOLVED, sound[-1]))
                if not repeat and r == m - 1:
                    missed, eigenvalues = _damping_scan(problem, thirteen)
                    series.append(missed)
                    curvature.append(eigenvalues)
    for problem in stretched_extended(rng, trial.of(8, 3)):
        told, status = exact(problem, "least_squares"), answered(thirteen, problem)[1]
        one = posed(damped(problem, DAMPING), exact)
        x, then = answered(thirteen, one.problem)
        ranks.append(told.inertia[0] + told.inertia[1] <= 1 and told.expected != "unique_minimum")
        reasons.append(status is Status.CONDITION_SEVEN)
        sound.append(then is Status.SOLVED and one.told.expected == "unique_minimum")
        ratios.append(error(x, one) / one.bound)
        found.append(Weighed("planar 3R in a line, (11)", 2, 3, 1, told.inertia[0], status is Status.SOLVED, sound[-1]))
    for name in ("planar_3r", "planar_4r", "seven_joint", "panda") if trial.full else ("planar_3r", "panda"):
        weighed = _on_robot(name, rng, trial.of(20, 4), thirteen)
        found += weighed
        reasons += [not one.undamped for one in weighed]
        sound += [one.damped for one in weighed]
    lost = [one for one in found if one.r < one.m]
    usable = sum(one.undamped for one in lost)
    checks = (
        every("at a kinematic singularity, (13) can be used with the weights (8) and (11), as (6) elsewhere",
              [w.undamped for w in lost],
              role=Role.REACH, range=(
            f"With weights damped by $\\tilde W > 0$ (13) has its minimum at {sum(w.damped for w in lost):,} of {len(lost):,} "
            f"singularities, and with (8) and (11) as they are at {usable:,}: $N_J^T W N_J$ has rank $n-m$ at most, and size "
            f"$n-r$."
        )),
        every(r"it can with these weights damped by $\tilde W > 0$, as the paper does at algorithmic singularities", sound),
        at_most("damped, over integers: error of (13) against the exact minimiser / bound", ratios, 1.0),
        every("over the rationals, the rank of $N_J^T W N_J$ is at most $n - m < n - r$, and there is no unique minimum", ranks,
              role=Role.OURS),
        every(r"(13) refuses each of them, for $N_J^T W N_J$ not being positive definite", reasons, role=Role.OURS),
        every("where $J$ keeps its rank the same weights are answered just where the rationals have one minimum", regular,
              role=Role.OURS),
    )  # fmt: skip
    share, lowest = np.concatenate(curvature, axis=1)
    eigenvalue = Series("smallest eigenvalue of $N^T W N$ / $|W|$", share, lowest, "line", "bound")
    plot = Plot(
        r"What damping $\tilde W = w I$ does at a kinematic singularity, rank one less than full: $N_J^T W N_J$ becomes "
        r"positive "
        "definite, and the secondary task is missed in proportion",
        Axis("damping $w$ / $|W|$", log=True), Axis("rate missed / rate asked for", log=True), (*series, eigenvalue),
    )  # fmt: skip
    return Evidence(checks, (plot, _weighed_table(found)))


def augmented(plain: VelocityProblem, E: Array, gbar: Array, rng: np.random.Generator) -> VelocityProblem:
    """W = E' Gamma E of eq. (8) and a = -E' Gamma gbar of eqs. (9)-(10), Gamma of small whole numbers, kept factored."""
    gamma = rng.integers(1, 3, len(E), endpoint=True).astype(float)
    W = Weight(np.zeros((plain.n, plain.n)), E, gamma)
    return VelocityProblem(J=plain.J, xdot=plain.xdot, W=W, a=-E.T @ (gamma * gbar), Wx=plain.Wx)


def damped(problem: VelocityProblem, base: float) -> VelocityProblem:
    """The same with W~ = base I added to W."""
    W = Weight(problem.W.base + base * np.eye(problem.n), problem.W.E, problem.W.gamma)
    return VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a, Wx=problem.Wx)


def stretched_extended(rng: np.random.Generator, count: int) -> list[VelocityProblem]:
    """Weights (11) of the planar 3R with its links in one line: H = d(n'grad g)/dq, n the cross product of the rows of J.

    g = 1/2 |q - q0|^2 has grad g = whole numbers here, n = (s3, -s3 - s23, s2 + s23) vanishes, and so H = grad g' dn/dq.
    """
    problems = []
    for _ in range(count):
        c2, c3 = rng.choice([-1.0, 1.0], 2)  # cosines of q2 and q3, each 0 or pi
        c23 = c2 * c3
        J = np.array([[0.0, 0.0, 0.0], [1 + c2 + c23, c2 + c23, c23]])
        H = make.nonzero_integers(rng, 3) @ null_vector_derivative(c2, c3)
        W = Weight(np.zeros((3, 3)), H[None], np.ones(1))
        problems.append(VelocityProblem(J=J, xdot=make.nonzero_integers(rng, 2), W=W))
    return problems


def null_vector_derivative(c2: float, c3: float) -> Array:
    """dn/dq (3, 3) of n(q) = (sin q3, -sin q3 - sin(q2 + q3), sin q2 + sin(q2 + q3)), by cosines where the sines vanish."""
    c23 = c2 * c3
    return np.array([[0.0, 0.0, c3], [0.0, -c23, -c3 - c23], [0.0, c2 + c23, c23]])


def _on_robot(name: str, rng: np.random.Generator, count: int, thirteen: Answer) -> list[Weighed]:
    """Random gradients as E at singular configurations of a robot."""
    robot = robots.load(name)
    J = robot.jacobian(singular(robot, rng, count))
    # what rounding leaves of a row of J is no row: eq13 scales all rows to one
    size = np.linalg.norm(J, 2, axis=(1, 2))[:, None, None]
    J = np.where(np.linalg.norm(J, axis=2, keepdims=True) > ROBOT_RANK * size, J, 0.0)
    E, xdot = rng.uniform(-1, 1, (count, robot.k, robot.n)), rng.uniform(-1, 1, (count, robot.m))
    W = Weight(np.zeros((count, robot.n, robot.n)), E, np.ones((count, robot.k)))
    problem = VelocityProblem(J=J, xdot=xdot, W=W, a=-E.sum(axis=1))
    plain, more = (thirteen(p, rank_tolerance=ROBOT_RANK).status for p in (problem, damped(problem, DAMPING)))
    sigma = np.linalg.svd(J, compute_uv=False)
    rank = (sigma > ROBOT_RANK * sigma[:, :1]).sum(axis=1)
    return [
        Weighed(f"{ARMS[name]}, (8)", robot.m, robot.n, int(r), -1, one.answered, other.answered)
        for r, one, other in zip(rank, plain, more, strict=True)
    ]


def _damping_scan(problem: VelocityProblem, thirteen: Answer) -> tuple[Series, Array]:
    """Smallest eigenvalue of N'WN and error of the secondary task by the damping, as shares of |W| and |gbar|."""
    N, _ = exact_bases(problem.J)
    N = np.linalg.qr(N)[0]
    E, gamma = problem.W.E, problem.W.gamma
    assert E is not None and gamma is not None
    gbar = -np.linalg.solve(gamma, np.linalg.lstsq(E.T, problem.a)[0])
    size = np.linalg.norm(problem.W.dense(), 2)
    shares = np.geomspace(1e-9, 1.0, 28)
    lowest, missed = [], []
    for share in shares:
        more = damped(problem, share * size)
        lowest.append(float(np.linalg.eigvalsh(more.W.left(N) @ N)[0] / size))
        missed.append(float(np.linalg.norm(E @ answered(thirteen, more)[0] - gbar) / np.linalg.norm(gbar)))
    name = f"{problem.m} × {problem.n}"
    # NaN ends a line
    return Series(f"secondary rate missed, {name}", shares, missed), np.array([[*shares, np.nan], [*lowest, np.nan]])


def _weighed_table(found: Sequence[Weighed]) -> Table:
    """One row for every place and size."""
    kinds: dict[tuple[str, int, int], list[Weighed]] = {}
    for one in found:
        kinds.setdefault((one.name, one.m, one.n), []).append(one)
    rows = tuple(
        (
            name, f"{m} × {n}", _span([one.r for one in ones]), _span([n - one.r for one in ones]),
            max(one.rank for one in ones) if ones[0].rank >= 0 else None, len(ones), sum(one.undamped for one in ones),
            sum(one.damped for one in ones) if ones[0].r < m else None,
        )
        for (name, m, n), ones in sorted(kinds.items(), key=lambda item: (item[0][0] == "full rank", item[0]))
    )  # fmt: skip
    columns = (
        "weight", "m × n", "ranks of J", "rank wanted of $N_J^T W N_J$", "largest rank found", "cases", "answered undamped",
        "answered damped",
    )  # fmt: skip
    return Table("Weights of rank $n - m$ in (13); the last rows are the same weights where $J$ keeps its rank", columns, rows)


def _span(values: Sequence[int]) -> str:
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"


def jittered(thirteen: Answer) -> Answer:
    """Condition (7) tested, and (13) solved, with 1e-8 |W| I slipped in."""

    def planted(problem: VelocityProblem, **options: float) -> Solution:
        size = np.linalg.norm(problem.W.dense(), 2, axis=(-2, -1))[:, None, None]
        W = Weight(problem.W.base + ROBOT_RANK * size * np.eye(problem.n), problem.W.E, problem.W.gamma)
        return thirteen(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a, Wx=problem.Wx), **options)

    return planted


CLAIM = Claim(
    name="rank_k_weights_never_qualify",
    title="The weights (8) and (11) do not serve in (13) unless damped",
    place="Section VI, eq. (13), with eqs. (8) and (11)",
    says="When $J$ is not of full rank, the augmented form of (6) can still be used, modified to (13). The paper excepts no "
    "weight; those of (8) and (11) have rank $n-m$ at most.",
    formula=r"\operatorname{rank} N_J^T W N_J \le n - m < n - r",
    tested="Weights (8) on integer problems of every rank and (11) on the planar 3R with its links in one line, both over the "
    "rationals; weights (8) at singular configurations of four robots; each also damped as Section III suggests.",
    accepted="Damped weights give the minimum at every kinematic singularity. As far as the words go: undamped ones do so, "
    "too.",
    paths=(SANDBOX, CodePath("rank and class of each problem over the rationals", truth)),
    examine=rank_k_weights_never_qualify,
    fault=Fault("a small multiple of the identity slipped into the test of condition (7)", jittered),
)
