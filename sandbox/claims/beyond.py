"""Section V, beyond the paper: its study in double precision, on real arms, with W other than I, and for every QP backend.

The task error of an answer is |J qdot - xdot| / |xdot|, evaluated with twice the digits, so that it is the answer's own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from problems import robots
from problems.robots.robot import Robot
from problems.sets import construct as make
from sandbox import plan, run_folder
from sandbox.backends import BACKENDS
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import CLOSED_FORM, read_table
from sandbox.reference import truth
from sandbox.solution import Solution, Status
from sandbox.stacked import solve, symmetric, times, transpose
from sandbox.tolerances import FORWARD, UNIT
from sandbox.yardstick import Yardstick

Array = np.ndarray
Generator = np.random.Generator

ARMS = {"planar_3r": "planar 3R", "panda": "Panda", "seven_joint": "7R"}
"""Arms by the name they are loaded by, the paper's own first."""

DECADES = 3.0
"""The eigenvalues of a random weight lie within so many decades."""

TAIL = 200
"""As few members tell a slope of 1 from one of 2."""

MIDWAY = 1.5
"""A slope on one side of this is nearer 1, on the other nearer 2."""

SPLITTER = 2.0**27 + 1.0
"""Cuts the 53 bits of a float64 into halves whose products are exact (Dekker)."""

FORMS = tuple(name for name, form in CLOSED_FORMS.items() if form.task == "exact")
NORMAL_EQUATIONS = ("eq2_5", "finsler")
"""The closed forms that form J V J' for some V; their error grows as the square of a condition number."""

WORDS = {"eq6": "(6)", "eq2_5": "(2)–(5)", "printed": "(2)–(5), explicit inverses"}

FAMILIES = ("active set", "interior point", "augmented Lagrangian", "operator splitting", "KKT system")
"""Kinds of backends, as the words of their rows tell them; what is none of these is a nonlinear programme's solver."""

FAST = (
    "numpy:lstsq", "osqp", "proxsuite:dense", "qpsolvers:quadprog", "qpsolvers:daqp", "qpsolvers:piqp",
)  # fmt: skip
"""Backends of the reduced size."""

LEVELS = np.concatenate([np.linspace(0, 0.98, 50), 1 - np.geomspace(0.01, 1e-4, 12)])
"""Shares at which a distribution is drawn."""


# ---- situations and their errors -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Situation:
    """Configurations q (B, n) [rad] of one arm and task velocities of unit length, under one kind of weight; a = 0."""

    arm: str
    weight: str
    q: Array
    problem: VelocityProblem

    @property
    def words(self) -> str:
        """The arm and its weight."""
        return f"{ARMS[self.arm]}, W {'= I' if self.weight == 'identity' else self.weight}"


def situations(rng: Generator, count: int) -> list[Situation]:
    """Every arm with W = I, a random W > 0 and its inertia matrix, at the same `count` configurations.

    q uniform within the joint limits (at most a turn), xdot uniform on the unit sphere of R^m (section V).
    """
    found = []
    for arm in ARMS:
        robot = robots.load(arm)
        q = rng.uniform(np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi), (count, robot.n))
        xdot = rng.standard_normal((count, robot.m))
        xdot = xdot / np.linalg.norm(xdot, axis=1, keepdims=True)
        J = robot.jacobian(q)
        for weight, W in weights(robot, q, rng).items():
            found.append(Situation(arm, weight, q, VelocityProblem(J=J, xdot=xdot, W=W, a=np.zeros_like(q))))
    return found


def weights(robot: Robot, q: Array, rng: Generator) -> dict[str, Array]:
    """W (B, n, n) by name; random: Q diag(w) Q', Q orthogonal, log w uniform over DECADES."""
    shape = (*q.shape, robot.n)
    Q = np.linalg.qr(rng.standard_normal(shape))[0]
    w = 10.0 ** rng.uniform(-DECADES / 2, DECADES / 2, q.shape)
    return {
        "identity": np.broadcast_to(np.eye(robot.n), shape),
        "random": symmetric((Q * w[:, None, :]) @ transpose(Q)),
        "inertia": robot.inertia(q),
    }


def residual(J: Array, x: Array, xdot: Array) -> Array:
    """J x - xdot (B, m) as if in twice the precision, then rounded: off by u |J x - xdot| + (n u)^2 (|J||x| + |xdot|).

    Source: T. Ogita, S. M. Rump, S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26(6), 2005 (Dot2).
    """
    total, lost = -xdot, np.zeros_like(xdot)
    for j in range(x.shape[-1]):
        product, below = two_product(J[..., j], x[..., j, None])
        total, rest = two_sum(total, product)
        lost = lost + (below + rest)
    return total + lost


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """fl(a + b) and what it lost: their sum is a + b exactly (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """fl(a b) and what it lost: their sum is a b exactly (Dekker), far from overflow and underflow."""
    product = a * b
    (a1, a2), (b1, b2) = halves(a), halves(b)
    return product, a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2)


def halves(a: Array) -> tuple[Array, Array]:
    """The number a as the sum of two numbers of 26 bits (Dekker, Veltkamp)."""
    big = SPLITTER * a
    high = big - (big - a)
    return high, a - high


def task_error(problem: VelocityProblem, x: Array) -> Array:
    """|J x - xdot| / |xdot| (B,), 2-norms; NaN where there is no answer."""
    off: Array = np.linalg.norm(residual(problem.J, x, problem.xdot), axis=-1)
    return off / np.linalg.norm(problem.xdot, axis=-1)


def disagreement(problem: VelocityProblem, x: Array, recorded: Array) -> Array:
    """Largest entry of |J x - xdot| as `recorded` (B,) against twice the digits, over what rounding explains of it (B,)."""
    found = np.abs(residual(problem.J, x, problem.xdot)).max(axis=-1)
    terms = (times(np.abs(problem.J), np.abs(x)) + np.abs(problem.xdot)).max(axis=-1)
    share: Array = np.abs(recorded - found) / (FORWARD * problem.n * UNIT * terms)
    return share


def exact(problem: VelocityProblem) -> Yardstick:
    """The exact minimisers, and what errors are relative to in the records and in the bounds of the closed forms."""
    return Yardstick.of(problem, "exact", truth(problem))  # type: ignore[arg-type]


def rate_error(yardstick: Yardstick, x: Array) -> Array:
    """Distance of x (B, n) from the exact minimisers, relative (B,)."""
    off: Array = np.abs(x - yardstick.x).max(axis=-1)
    return off / yardstick.size


def each(equation: Answer, problem: VelocityProblem) -> Array:
    """The rates (B, n) of a printed equation, one problem after the other; alpha = 0."""
    W = problem.W.dense()
    return np.stack([equation(problem.J[i], problem.xdot[i], W[i], problem.a[i], 0.0) for i in range(len(problem))])


def compounded(problem: VelocityProblem) -> Array:
    """cond(J L^-T) (B,), W = L L', whose square is the condition of J W^-1 J'; cond J where W = I."""
    condition: Array = np.linalg.cond(transpose(solve(np.linalg.cholesky(problem.W.dense()), transpose(problem.J))))
    return condition


def slope(condition: Sequence[Array], error: Sequence[Array]) -> float:
    """Slope of log error over log condition, of the worst conditioned tenth of each stack or TAIL members; a factor each."""
    x, y = [], []
    for c, e in zip(condition, error, strict=True):
        kept = (c >= np.sort(c)[-max(len(c) // 10, min(TAIL, len(c)))]) & (e > 0)  # NaN compares as wrong
        logs = np.log(c[kept]), np.log(e[kept])
        x.append(logs[0] - logs[0].mean())
        y.append(logs[1] - logs[1].mean())
    X, Y = np.concatenate(x), np.concatenate(y)
    return float(X @ Y / (X @ X))


def ratios(six: Array, other: Array) -> tuple[float, float]:
    """Median and 99 % of the error of (6), each divided by the other's, over the problems that both answered."""
    both = np.isfinite(six) & np.isfinite(other)
    if not both.any():
        return float("nan"), float("nan")
    ours, theirs = (np.quantile(error[both], (0.5, 0.99)) for error in (six, other))
    return float(ours[0] / theirs[0]), float(ours[1] / theirs[1])


def nearer(six: Array, other: Array) -> float:
    """Share of the problems that both answered at which (6) has the smaller error [%]."""
    both = np.isfinite(six) & np.isfinite(other)
    return 100 * float(np.mean(six[both] < other[both])) if both.any() else float("nan")


def worst(error: Array) -> tuple[float, float, float]:
    """Median, 99 % and largest of the answers there are."""
    found = error[np.isfinite(error)]
    if not len(found):
        return (float("nan"),) * 3
    median, high, largest = np.quantile(found, (0.5, 0.99, 1))
    return float(median), float(high), float(largest)


# ---- every closed form in double precision -------------------------------------------------------------------


def normal_equations_of(six: Answer) -> Answer:
    """Eq. (6) solved by normal equations of its own matrix A, qdot = A'(AA')^-1 b: JJ' stands in AA'."""

    def planted(problem: VelocityProblem) -> Solution:
        Nt = np.linalg.svd(problem.J)[2][:, problem.m :]
        A = np.concatenate([problem.J, Nt @ problem.W.dense()], axis=1)
        b = np.concatenate([problem.xdot, -times(Nt, problem.a)], axis=1)
        return replace(six(problem), x=times(transpose(A), solve(A @ transpose(A), b[..., None])[..., 0]))

    return planted


@dataclass(frozen=True, eq=False)
class Accuracy:
    """What the closed forms made of one situation: task errors by form (B,), those of (2)-(5) as printed beside them.

    shares : by form, the error of the joint rates / its bound, of a few members against the exact minimiser
    rates : the same errors themselves
    steady : |J qdot - xdot| of (6) / 50 n u |J||qdot|, the bound of a backward stable solution (methods 7)
    refused : by form, how many it gave no answer to
    """

    situation: Situation
    condition: Array
    task: dict[str, Array]
    rates: dict[str, Array]
    shares: dict[str, Array]
    steady: Array

    @classmethod
    def of(cls, situation: Situation, few: int, six: Answer, printed: Answer) -> Accuracy:
        """All closed forms and the printed equation on one situation; the first `few` members against exact truth."""
        problem = situation.problem
        first = problem[np.arange(few)]
        yardstick = exact(first)
        forms: dict[str, Callable[[VelocityProblem], Solution]] = {name: CLOSED_FORMS[name].function for name in FORMS}
        forms["eq6"] = six
        x = {name: form(problem).x for name, form in forms.items()} | {"printed": each(printed, problem)}
        rates = {name: rate_error(yardstick, rates[:few]) for name, rates in x.items()}
        shares = {name: rates[name] / CLOSED_FORMS[name].bound(first) for name in FORMS}
        task = {name: task_error(problem, rates) for name, rates in x.items()}
        size = np.linalg.norm(problem.J, 2, axis=(1, 2)) * np.linalg.norm(x["eq6"], axis=1)
        steady = task["eq6"] * np.linalg.norm(problem.xdot, axis=1) / (FORWARD * problem.n * UNIT * size)
        return cls(situation, compounded(problem), task, rates, shares, steady)


def closed_forms_in_double(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """Every closed form on every arm under every weight; (6) against (2)-(5), compiled and as printed."""
    rng = trial.rng("closed_forms_in_double")
    drawn = situations(rng, trial.of(10_000, 1_000))
    found = [Accuracy.of(situation, trial.of(100, 10), six, printed) for situation in drawn]
    plain = [one for one in found if one.situation.weight == "identity"]
    checks = []
    for one in plain:
        both = [*ratios(one.task["eq6"], one.task["eq2_5"]), *ratios(one.task["eq6"], one.task["printed"])]
        says = f"{one.situation.words}: task error of (6) / of (2)–(5), both ways of computing these; median and 99 %"
        checks.append(at_most(says, both, 1.0))
    tails = {name: slope([one.condition for one in plain], [one.task[name] for one in plain]) for name in (*FORMS, "printed")}
    power = r"slope of $\log$ task error over $\log \mathrm{cond} J$, $W = I$: "
    checks += [
        at_most(f"{power}(6), nearer 1 than 2", tails["eq6"], MIDWAY),
        at_least(f"{power}(2)–(5) both ways, nearer 2 than 1", [tails["eq2_5"], tails["printed"]], MIDWAY),
        every(
            f"{power}on the same side for every closed form that does, or does not, form $J V J^T$",
            [(tails[name] > MIDWAY) == (name in NORMAL_EQUATIONS) for name in FORMS if name not in ("eq6", "eq2_5")],
            role=Role.OURS,
        ),
        reach(found),
        at_most(
            r"task error of (6) / $50\, n u\, |J||\dot q|$: as small as any solution in these digits can promise",
            np.concatenate([one.steady for one in found]), 1.0, role=Role.OURS,
        ),
        at_most(
            "error of the joint rates against the exact minimiser / bound, every closed form",
            [np.nanmax(one.shares[name]) for one in found for name in FORMS], 1.0, role=Role.OURS,
        ),
    ]  # fmt: skip
    return Evidence(tuple(checks), (_against_condition(plain[1]), _forms_heat(found), _section_v(found), _forms(found, tails)))


def reach(found: Sequence[Accuracy]) -> Check:
    """(6) at most as far off as (2)-(5) in median and 99 %, for every arm and weight; says where it is."""
    by_words = {one.situation.words: max(ratios(one.task["eq6"], one.task["eq2_5"])) for one in found}
    least = max(by_words, key=lambda words: by_words[words])
    lost = [words for words, ratio in by_words.items() if not ratio <= 1]
    held = "every arm and weight tried" if not lost else f"all but {'; '.join(lost)}"
    return every(
        "every arm and weight: (6) is at most as far off as (2)–(5) in median and 99 %",
        [ratio <= 1 for ratio in by_words.values()],
        role=Role.REACH,
        range=f"It holds for {held}; nearest to it, {least}, (6) has {by_words[least]:.2g} times the error of (2)–(5).",
    )


def _against_condition(one: Accuracy) -> Plot:
    """Task errors over cond J: a part of the points of (6) and (2)-(5), medians of all forms."""
    part = np.argsort(one.condition)
    part = part[:: max(1, len(part) // 600)]
    edges = np.geomspace(one.condition.min(), one.condition.max(), 25)
    bins = np.digitize(one.condition, edges[1:-1])
    kept = [i for i in range(24) if (bins == i).sum() >= 3]
    centres = np.sqrt(edges[kept] * edges[np.array(kept) + 1])
    cloud = [Series(WORDS[name], one.condition[part], one.task[name][part]) for name in ("eq2_5", "eq6")]
    medians = [
        Series(
            f"{WORDS.get(name, name)}, median", centres, [float(np.nanmedian(one.task[name][bins == i])) for i in kept],
            "line", "ours" if name in WORDS else "other",
        )
        for name in FORMS
    ]  # fmt: skip
    ends = np.array([edges[0], edges[-1]])
    rules = [
        Series("u cond J", ends, UNIT * ends, "line", "bound"),
        Series("u (cond J)²", ends, UNIT * ends**2, "line", "bound"),
    ]
    return Plot(
        f"Task error over the condition of the Jacobian, double precision; {one.situation.words}",
        Axis("cond J", log=True), Axis("|J qdot − xdot| / |xdot|", log=True), (*cloud, *medians, *rules),
    )  # fmt: skip


def _heat(caption: str, rows: Mapping[str, Sequence[float]], six: Sequence[float], columns: Sequence[str]) -> Heat:
    """Each number over that of (6), the number itself in the cell."""
    values = [[_ratio(a, b) for a, b in zip(row, six, strict=True)] for row in rows.values()]
    words = [[f"{a:.1e}" if np.isfinite(a) else "no answer" for a in row] for row in rows.values()]
    return Heat(caption, "arm and weight", "answered by", tuple(columns), tuple(rows), values, 1.0, words)


def _ratio(a: float, b: float) -> float | None:
    return a / b if np.isfinite(a) and np.isfinite(b) and a > 0 and b > 0 else None


def _forms_heat(found: Sequence[Accuracy]) -> Heat:
    rows = {WORDS.get(name, name): [worst(one.task[name])[1] for one in found] for name in (*FORMS, "printed")}
    caption = "99 % of the task errors lie below the number in the cell; coloured by its ratio to that of (6)"
    return _heat(caption, rows, rows["(6)"], [one.situation.words for one in found])


def _section_v(found: Sequence[Accuracy]) -> Table:
    """Table III, in double precision: the paper's percentages beside the one row that it has."""
    rows = []
    for one in found:
        six, normal = one.task["eq6"], one.task["eq2_5"]
        own = one.situation.arm == "planar_3r" and one.situation.weight == "identity"
        shares = (nearer(six, normal), 79.0 if own else None, nearer(normal, six), 12.0 if own else None)
        rows.append((one.situation.words, len(six), *worst(normal), *worst(six), *shares))
    return Table(
        "Task errors in double precision, evaluated with twice the digits; the paper's percentages are of single precision, "
        "evaluated in single precision too, which leaves 9 % of ties",
        (
            "arm, weight", "problems", "(2)–(5): median", "(2)–(5): 99 %", "(2)–(5): worst", "(6): median", "(6): 99 %",
            "(6): worst", "(2)–(5) worse, %", "paper: (2)–(5) worse, %", "(6) worse, %", "paper: (6) worse, %",
        ),
        tuple(rows), ("paper: (2)–(5) worse, %", "paper: (6) worse, %"),
    )  # fmt: skip


def _forms(found: Sequence[Accuracy], tails: Mapping[str, float]) -> Table:
    """Each closed form over all arms and weights."""
    rows = []
    for name in (*FORMS, "printed"):
        task = np.concatenate([one.task[name] for one in found])
        six = np.concatenate([one.task["eq6"] for one in found])
        rates = np.concatenate([one.rates[name] for one in found])
        share = max(float(np.nanmax(one.shares[name])) for one in found) if name in FORMS else None
        expected = 2 if name in (*NORMAL_EQUATIONS, "printed") else 1
        rows.append(
            (
                WORDS.get(name, name), tails[name], expected, None if name == "eq6" else nearer(six, task), worst(rates)[0],
                worst(rates)[2], share, int(np.isnan(task).sum()),
            )
        )  # fmt: skip
    return Table(
        "Every closed form, all arms and weights; the slopes with W = I, over the worst conditioned tenth",
        (
            "closed form", "slope of log task error over log cond J", "as the bounds have it", "(6) is nearer, %",
            "error of the joint rates: median", "error of the joint rates: worst", "worst / its bound", "no answer",
        ),
        tuple(rows),
    )  # fmt: skip


# ---- every QP backend ----------------------------------------------------------------------------------------


def single_precision(six: Answer) -> Answer:
    """Eq. (6) in single precision."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(problem, dtype=np.float32)

    return planted


def section_v(drawn: Sequence[Situation], seed: int) -> ProblemSet:
    """The situations as an ordinary set; numbers to 2**-30, so that the same seed names the same problems anywhere."""
    groups = []
    for one in drawn:
        labels: dict[str, Sequence[Any]] = {
            "robot": [one.arm] * len(one.q), "method": [one.weight] * len(one.q), "seed": [seed] * len(one.q),
            "q": one.q.tolist(), "case": [one.words] * len(one.q),
        }  # fmt: skip
        groups.append(Group(make.shortened(one.problem), labels))
    return ProblemSet("section_v", tuple(groups), "section V's random configurations and unit velocities, a = 0")


def ids(posed: ProblemSet) -> list[str]:
    """Content hashes of a set's problems, group after group."""
    return [name for group in posed.groups for name in group.ids()]


@dataclass(frozen=True, eq=False)
class Records:
    """The answers of a campaign, one entry each (R,).

    backend, verdict : names; problem : id; place : its number in the set
    task, rates : task error, and error of the joint rates as judged; NaN where none was given as a solution
    apart : how far the recorded residual is from the one found here, as a share of its own rounding
    """

    backend: Array
    verdict: Array
    problem: Array
    place: Array
    task: Array
    rates: Array
    apart: Array

    def __getitem__(self, rows: Array) -> Records:
        """Those that a mask or an index array names."""
        return Records(*(getattr(self, field.name)[rows] for field in fields(self)))

    @property
    def solved(self) -> Array:
        """Where an answer was given."""
        return np.isfinite(self.task)

    @classmethod
    def read(cls, folder: Path, posed: ProblemSet) -> Records:
        """The backends' records of a run of `posed`."""
        table = read_table(folder, "records", ["problem", "backend", "verdict", "status", "error", "primal_residual", "qdot"])
        table = table.filter([not name.startswith(CLOSED_FORM) for name in table["backend"].to_pylist()])
        columns = {name: table[name].to_pylist() for name in table.column_names}
        places = {name: place for place, name in enumerate(ids(posed))}
        place = np.array([places[name] for name in columns["problem"]], dtype=int)
        solved = np.array(columns["status"], dtype=str) == Status.SOLVED.name.lower()
        solved &= [qdot is not None for qdot in columns["qdot"]]  # some say so and give NaN
        rates, kept = (np.where(solved, np.array(columns[name], float), np.nan) for name in ("error", "primal_residual"))
        task, apart = np.full((2, len(place)), np.nan)
        first = 0
        for group in posed.groups:
            rows = np.flatnonzero(solved & (place >= first) & (place < first + len(group)))
            if len(rows):
                problem, x = group.problem[place[rows] - first], np.array([columns["qdot"][i] for i in rows])
                task[rows] = task_error(problem, x)
                apart[rows] = disagreement(problem, x, kept[rows])
            first += len(group)
        backend, verdict, hashes = (np.array(columns[name], dtype=str) for name in ("backend", "verdict", "problem"))
        return cls(backend, verdict, hashes, place, task, rates, apart)


def campaign(trial: Trial, posed: ProblemSet) -> Records:
    """`posed` through every backend (a few at the reduced size) as an ordinary run, kept where the trial keeps things."""
    wanted = None if trial.full else [*FAST, *(f"{CLOSED_FORM}{name}" for name in FORMS)]
    chosen = plan.chosen([posed], wanted, ["direct"], jobs=trial.jobs, sample_every=10, warm=False)
    command = f"sandbox paper --claim backends_in_double --seed {trial.seed}{'' if trial.full else ' --quick'}"
    with TemporaryDirectory() as passing:
        folder = (trial.folder or Path(passing)) / "accuracy"
        run_folder.carry_out(chosen, folder, command=command, overwrite=True)
        return Records.read(folder, posed)


def backends_in_double(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """(6) and (2)-(5) beside every QP backend on the same problems."""
    drawn = situations(trial.rng("backends_in_double"), trial.of(200, 1))
    posed = section_v(drawn, trial.seed)
    records = campaign(trial, posed)
    problems = [group.problem for group in posed.groups]
    x = {
        "eq6": [six(problem).x for problem in problems],
        "eq2_5": [CLOSED_FORMS["eq2_5"](problem).x for problem in problems],
        "printed": [each(printed, problem) for problem in problems],
    }
    truths = [exact(problem) for problem in problems]
    task = {name: np.concatenate(list(map(task_error, problems, answers))) for name, answers in x.items()}
    rates = {name: np.concatenate(list(map(rate_error, truths, answers))) for name, answers in x.items()}
    checks = (
        at_most(
            "task error of (6) / of (2)–(5), both ways of computing these; median and 99 %",
            [*ratios(task["eq6"], task["eq2_5"]), *ratios(task["eq6"], task["printed"])], 1.0,
        ),
        at_most(
            "the residual on record against the one evaluated here, over its own rounding; every answer of every backend",
            records.apart[records.solved], 1.0, role=Role.OURS,
        ),
        as_accurate_as_any("task error", task["eq6"], records, records.task),
        as_accurate_as_any("error of the joint rates", rates["eq6"], records, records.rates),
    )  # fmt: skip
    exhibits = (_distributions(task, records), _backends_heat(drawn, task, records), _table(task, rates, records, posed))
    return Evidence(checks, exhibits)


def answering(records: Records) -> list[str]:
    """Backends that gave at least one solution."""
    return list(dict.fromkeys(records.backend[records.solved].tolist()))


def as_accurate_as_any(words: str, six: Array, records: Records, error: Array) -> Check:
    """(6) at most as far off as every backend in median and 99 %, on the problems that the backend solved.

    six (B,) error of (6) by problem; error (R,) that of every record
    """
    names = answering(records)
    found = {}
    for name in names:
        own = records.backend == name
        found[name] = ratios(six[records.place[own]], error[own])
    held = [max(pair) <= 1 for pair in found.values()]
    median, high = (sum(pair[k] <= 1 for pair in found.values()) for k in (0, 1))
    ahead = sorted((pair for pair in found.items() if max(pair[1]) > 1), key=lambda pair: -max(pair[1]))
    beaten = ", ".join(f"{name} ({pair[0]:.2g} and {pair[1]:.2g})" for name, pair in ahead)
    more = f" Error of (6) over theirs, median and 99 %, where one exceeds 1: {beaten}." if ahead else ""
    return every(
        f"{words}: (6) is at most as far off as every backend, in median and 99 %",
        held, role=Role.REACH,
        range=f"(6) is at least as accurate as {median} of {len(names)} backends in median, {high} in 99 %, "
        f"{sum(held)} in both.{more}",
    )  # fmt: skip


def family(backend: str) -> str:
    """What kind of solver a backend is."""
    return next((words for words in FAMILIES if words in BACKENDS[backend].method), "nonlinear programming")


def _distributions(task: Mapping[str, Array], records: Records) -> Plot:
    """Which share of the answers is how near."""
    solved = records[records.solved]
    kinds = np.array([family(name) for name in solved.backend])
    lots = {WORDS[name]: task[name] for name in ("eq6", "eq2_5")}
    lots |= {kind: solved.task[kinds == kind] for kind in dict.fromkeys(kinds.tolist())}
    series = []
    for name, error in lots.items():
        found = error[np.isfinite(error)]
        series.append(Series(f"{name} ({len(found):,})", np.quantile(found, LEVELS), LEVELS, "line"))
    return Plot(
        "Share of the answers with a task error up to this: (6), (2)–(5), and the QP backends at high accuracy ($10^{-9}$ "
        "where they have a tolerance), all of one kind together; in brackets the number of answers",
        Axis("|J qdot − xdot| / |xdot|", log=True), Axis("share of the answers", low=0, high=1), tuple(series),
    )  # fmt: skip


def _backends_heat(drawn: Sequence[Situation], task: Mapping[str, Array], records: Records) -> Heat:
    """Median task error by backend, arm and weight."""
    which = np.repeat(np.arange(len(drawn)), [len(one.q) for one in drawn])
    cells = range(len(drawn))
    rows = {WORDS[name]: [worst(error[which == k])[0] for k in cells] for name, error in task.items()}
    at, lots = which[records.place], {name: records.backend == name for name in answering(records)}
    medians = {name: [worst(records.task[own & (at == k)])[0] for k in cells] for name, own in lots.items()}
    order = sorted(medians, key=lambda name: worst(records.task[lots[name]])[0])
    caption = "Median task error of the answers given as solutions; coloured by its ratio to that of (6)"
    return _heat(caption, rows | {name: medians[name] for name in order}, rows["(6)"], [one.words for one in drawn])


def _table(task: Mapping[str, Array], rates: Mapping[str, Array], records: Records, posed: ProblemSet) -> Table:
    """Every backend, and the closed forms compared, by the 99 % of the task error; those without an answer last."""
    rows: list[tuple[str | float | int | None, ...]] = []
    for name, error in task.items():
        share = None if name == "eq6" else nearer(task["eq6"], error)
        found = (WORDS[name], "closed form", len(error), *worst(error), share, *worst(rates[name])[:2])
        rows.append((*found, None, "", ids(posed)[_largest(error)]))
    for name in dict.fromkeys(records.backend.tolist()):
        own = records[records.backend == name]
        counts = Counter(own.verdict.tolist())
        others = ", ".join(f"{verdict} {count}" for verdict, count in counts.most_common() if verdict != "verified")
        share = nearer(task["eq6"][own.place], own.task)
        found = (name, family(name), len(own.place), *worst(own.task), share, *worst(own.rates)[:2])
        rows.append((*found, counts["verified"], others, own.problem[_largest(own.task)] if own.solved.any() else ""))
    rows.sort(key=lambda row: (np.isnan(row[4]), row[4]))  # type: ignore[arg-type]
    finite = tuple(tuple(None if isinstance(cell, float) and np.isnan(cell) else cell for cell in row) for row in rows)
    return Table(
        "By the 99 % of the task error; every case is kept: sandbox show RUN/accuracy PROBLEM, and sandbox report RUN/accuracy",
        (
            "answered by", "kind", "problems", "median", "99 %", "worst", "(6) is nearer, %", "joint rates: median",
            "joint rates: 99 %", "verified", "other verdicts", "worst problem",
        ),
        finite,
    )  # fmt: skip


def _largest(error: Array) -> int:
    return int(np.argmax(np.where(np.isfinite(error), error, -1.0)))


CLAIMS = (
    Claim(
        name="closed_forms_in_double",
        title="The same study in double precision, on real arms, with any weight",
        place="Section V, beyond the paper",
        says=(
            r"(6) tends to suffer less from numerical errors than (2)–(5), because the conditioning of $J$ is compounded in "
            r"$J W^{-1} J^T$: as true in double precision, for arms of seven joints, and with $W \ne I$."
        ),
        formula=r"\mathrm{cond}(J W^{-1} J^T) = \mathrm{cond}(J L^{-T})^2, \quad W = L L^T",
        tested=(
            r"Every closed form of the exact task on planar 3R, Panda and 7R with $W = I$, random $W > 0$ (eigenvalues over "
            r"three decades) and $W = M$; 10,000 random configurations and unit velocities each, $\alpha = 0$; "
            r"$J\dot q - \dot x$ evaluated in twice the precision, joint rates against exact rational arithmetic."
        ),
        accepted=(
            r"With $W = I$, on each arm, median and 99 % of the task error of (6) are at most those of (2)–(5), and the "
            r"errors grow as $\mathrm{cond} J$ and as its square. Its reach: every arm and weight."
        ),
        paths=(
            CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$, in float64", eq6),
            CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
        ),
        examine=closed_forms_in_double,
        fault=Fault(r"(6) solved by the normal equations of its matrix, which hold $J J^T$", normal_equations_of),
        sources=("T. Ogita, S. M. Rump, S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26(6), 2005",),
    ),
    Claim(
        name="backends_in_double",
        title="The same study for every QP solver",
        place="Section V, beyond the paper",
        says=(
            "The optimisation that (6) solves can be given to any QP solver: (6) stays at least as accurate as (2)–(5), and, "
            "which the paper does not say, as accurate as the solvers."
        ),
        formula=r"\min_{\dot q} \tfrac{1}{2} \dot q^T W \dot q \quad \text{subject to} \quad J \dot q = \dot x",
        tested=(
            "Random configurations and unit velocities of section V on planar 3R, Panda and 7R under three weights, given to "
            "every backend at high accuracy as an ordinary run (slow interfaces see every tenth problem); every answer "
            "judged against the exact minimiser."
        ),
        accepted=(
            "Median and 99 % of the task error of (6) are at most those of (2)–(5). Its reach: those of every backend, on the "
            "problems that it solved."
        ),
        paths=(
            CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$, in float64", eq6),
            CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
        ),
        examine=backends_in_double,
        fault=Fault("(6) answered in single precision", single_precision),
        alone=True,
    ),
)
