"""Every closed form in double precision: (6) beside (2)-(5), on real arms and with any weight."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sandbox.claims import equations
from sandbox.claims.beyond.beside_six import FORMS, WORDS, heat
from sandbox.claims.beyond.deviation import exact, nearer, rate_error, ratios, task_error, worst
from sandbox.claims.beyond.situation import Situation, situations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.printed import each
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import solve, times, transpose
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray

TAIL = 200
"""As few members tell a slope of 1 from one of 2."""

MIDWAY = 1.5
"""A slope on one side of this is nearer 1, on the other nearer 2."""

NORMAL_EQUATIONS = ("eq2_5", "finsler")
"""The closed forms that form J V J' for some V; their error grows as the square of a condition number."""


def normal_equations_of(six: Answer) -> Answer:
    """Eq. (6) solved by normal equations of its own matrix A, qdot = A'(AA')^-1 b: JJ' stands in AA'."""

    def planted(problem: VelocityProblem) -> Solution:
        Nt = np.linalg.svd(problem.J)[2][:, problem.m :]
        A = np.concatenate([problem.J, Nt @ problem.W.dense()], axis=1)
        b = np.concatenate([problem.xdot, -times(Nt, problem.a)], axis=1)
        return replace(six(problem), x=times(transpose(A), solve(A @ transpose(A), b[..., None])[..., 0]))

    return planted


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
        says = f"task error of (6) / of (2)–(5), both ways of computing these, median and 99 %: {one.situation.words}"
        checks.append(at_most(says, both, 1.0))
    tails = {name: slope([one.condition for one in plain], [one.task[name] for one in plain]) for name in (*FORMS, "printed")}
    power = r"power of $\mathrm{cond}\,J$ with which the task error grows, $W = I$: "
    checks += [
        at_most(f"{power}(6), nearer 1 than 2", tails["eq6"], MIDWAY),
        at_least(f"{power}(2)–(5) both ways, nearer 2 than 1", [tails["eq2_5"], tails["printed"]], MIDWAY),
        every(
            rf"{power}nearer 2 for every other closed form that forms $J V J^T$, and nearer 1 for those that do not",
            [(tails[name] > MIDWAY) == (name in NORMAL_EQUATIONS) for name in FORMS if name not in ("eq6", "eq2_5")],
            role=Role.OURS,
        ),
        reach(found),
        at_most(
            r"task error of (6) / $50\,n\,u\,|J|\,|\dot q|\,/\,|\dot x|$, the bound of a backward stable solution",
            np.concatenate([one.steady for one in found]), 1.0, role=Role.OURS,
        ),
        at_most(
            "error of the joint rates against the exact minimiser / bound, every closed form, arm and weight",
            [np.nanmax(one.shares[name]) for one in found for name in FORMS], 1.0, role=Role.OURS,
        ),
    ]  # fmt: skip
    return Evidence(tuple(checks), (_against_condition(plain[1]), _forms_heat(found), _section_v(found), _forms(found, tails)))


def reach(found: Sequence[Accuracy]) -> Check:
    """(6) at most as far off as (2)-(5) in median and 99 %, for every arm and weight; says where it is."""
    by_words = {one.situation.words: max(ratios(one.task["eq6"], one.task["eq2_5"])) for one in found}
    least = max(by_words, key=lambda words: by_words[words])
    lost = [words for words, ratio in by_words.items() if not ratio <= 1]
    held = "For every arm and weight tried" if not lost else f"For all but {'; '.join(lost)}"
    return every(
        "under every weight, too, median and 99 % of the task error of (6) are at most those of (2)–(5)",
        [ratio <= 1 for ratio in by_words.values()],
        role=Role.REACH,
        range=f"{held}; where it is closest, {least}, (6) has {by_words[least]:.2g} times the error of (2)–(5).",
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
            f"{WORDS[name]}, median", centres, [float(np.nanmedian(one.task[name][bins == i])) for i in kept],
            "line", "ours" if name in ("eq6", "eq2_5") else "other",
        )
        for name in FORMS
    ]  # fmt: skip
    ends = np.array([edges[0], edges[-1]])
    rules = [
        Series(r"$u\,\mathrm{cond}\,J$", ends, UNIT * ends, "line", "bound"),
        Series(r"$u\,\mathrm{cond}(J)^2$", ends, UNIT * ends**2, "line", "bound"),
    ]
    return Plot(
        f"Task error against the condition of $J$, double precision: {one.situation.words}",
        Axis(r"$\mathrm{cond}\,J$", log=True),
        Axis(r"$|J\dot q - \dot x| \,/\, |\dot x|$", log=True),
        (*cloud, *medians, *rules),
    )


def _forms_heat(found: Sequence[Accuracy]) -> Heat:
    rows = {WORDS[name]: [worst(one.task[name])[1] for one in found] for name in (*FORMS, "printed")}
    caption = "The 99th percentile of the task error, coloured by its ratio to that of (6)"
    return heat(caption, rows, rows["(6)"], [one.situation.words for one in found])


def _section_v(found: Sequence[Accuracy]) -> Table:
    """Table III, in double precision: the paper's percentages beside the one row that it has."""
    rows = []
    for one in found:
        six, normal = one.task["eq6"], one.task["eq2_5"]
        own = one.situation.arm == "planar_3r" and one.situation.weight == "identity"
        a, b = nearer(six, normal), nearer(normal, six)
        shares = f"{a:.1f} / {b:.1f} / {max(100 - a - b, 0.0):.1f}", "79 / 12 / 9" if own else None
        rows.append((one.situation.words, len(six), *worst(normal), *worst(six), *shares))
    return Table(
        "Task errors in double precision, evaluated with twice the digits. The paper's percentages are those of single "
        "precision, in which the error was evaluated, too",
        (
            "arm, weight", "problems", "(2)–(5): median", "(2)–(5): 99 %", "(2)–(5): worst", "(6): median", "(6): 99 %",
            "(6): worst", "(2)–(5) worse / (6) worse / equal, %", "Table III",
        ),
        tuple(rows), ("Table III",),
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
                WORDS[name], tails[name], expected, None if name == "eq6" else nearer(six, task), worst(rates)[0],
                worst(rates)[2], share, int(np.isnan(task).sum()),
            )
        )  # fmt: skip
    return Table(
        "Every closed form, all arms and weights; the slopes with $W = I$, over the worst conditioned tenth",
        (
            "closed form", "power of cond J in the task error", "predicted", "(6) has the smaller one, %",
            "error of the joint rates: median", "worst", "worst / its bound", "no answer",
        ),
        tuple(rows),
    )  # fmt: skip


CLAIM = Claim(
    name="closed_forms_in_double",
    title="The same study in double precision, on real arms, with any weight",
    place="Section V, beyond the paper",
    says=(
        r"(6) tends to suffer less from numerical errors than (2)–(5), because the conditioning of $J$ is compounded in "
        r"$J W^{-1} J^T$: in double precision, too, and for arms of seven joints. The paper shows it for one arm in single "
        "precision."
    ),
    formula=r"\mathrm{cond}(J W^{-1} J^T) = \mathrm{cond}(J L^{-T})^2, \quad W = L L^T",
    tested=(
        r"Every closed form of the exact task is computed on planar 3R, Panda and 7R with $W = I$, random $W > 0$ (eigenvalues "
        r"over three decades) and the inertia matrix $W = M$: 10,000 random configurations and unit velocities each, "
        r"$\alpha = 0$. $J\dot q - \dot x$ is evaluated in twice the precision, and joint rates are compared with those of "
        r"exact "
        "rational arithmetic."
    ),
    accepted=(
        r"With $W = I$, on each arm, median and 99 % of the task error of (6) are at most those of (2)–(5), and the errors "
        r"grow as $\mathrm{cond}\,J$ and as its square. As far as the words go: under every weight."
    ),
    paths=(
        CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$, in float64", eq6),
        CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
    ),
    examine=closed_forms_in_double,
    fault=Fault(r"(6) solved by the normal equations of its matrix, which hold $J J^T$", normal_equations_of),
    sources=("T. Ogita, S. M. Rump, S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26(6), 2005",),
)
