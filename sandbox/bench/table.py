"""The benchmarks: one row each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sandbox.bench import closed_forms, enclosures, records, solvers
from sandbox.bench.measured import Measured
from sandbox.bench.race import Effort
from sandbox.reference.certified import certified
from sandbox.reference.enclosure import enclosed


@dataclass(frozen=True)
class Benchmark:
    """One figure.

    name : how `--only` calls it; what : it in words; unit : of its value, "times" for a ratio
    measure : takes an Effort and gives the figure
    target, stretch : in the same unit; None where it is only shown. `at_least`: the value should be no less, else no more
    needs : packages that must be installed, by module and by what pip calls it
    """

    name: str
    what: str
    unit: str
    measure: Callable[[Effort], Measured]
    target: float | None = None
    stretch: float | None = None
    at_least: bool = False
    needs: tuple[tuple[str, str], ...] = ()

    def verdict(self, value: float) -> str:
        """Met, met with its stretch, missed; or shown where there is no target."""
        if self.target is None:
            return "shown"
        for bound, word in ((self.stretch, "stretch met"), (self.target, "met")):
            if bound is not None and (value >= bound if self.at_least else value <= bound):
                return word
        return "missed"


def _ik(peer: str, *, stacked: bool) -> Callable[[Effort], Measured]:
    def measure(effort: Effort) -> Measured:
        from sandbox.bench.differential_ik import against

        return against(peer, stacked=stacked)(effort)

    return measure


COPY = "time over np.copyto of the same bytes"

PINK = (("pink", "pin-pink"),)
MINK = (("mink", "mink"), ("mujoco", "mujoco"))

BENCHMARKS = {
    row.name: row
    for row in (
        Benchmark(
            "eq6_7x6", f"eq. (6), x and multipliers: {COPY}", "times", closed_forms.against_copy("eq6", 7, 6), 5, 3
        ),
        Benchmark(
            "eq6_7x6_pivots", f"the same with pivots and their roundings: {COPY}", "times",
            closed_forms.against_copy("eq6", 7, 6, judged=True), 5, 3,
        ),
        Benchmark(
            "eq2_5_7x6", f"eqs. (2)-(5), x and multipliers: {COPY}", "times",
            closed_forms.against_copy("eq2_5", 7, 6), 5, 3,
        ),
        Benchmark(
            "eq6_12x6", f"eq. (6), x and multipliers: {COPY}", "times", closed_forms.against_copy("eq6", 12, 6), 9, 6
        ),
        Benchmark(
            "eq6_12x6_pivots", f"the same with pivots and their roundings: {COPY}", "times",
            closed_forms.against_copy("eq6", 12, 6, judged=True), 9, 6,
        ),
        Benchmark(
            "eq2_5_12x6", f"eqs. (2)-(5), x and multipliers: {COPY}", "times",
            closed_forms.against_copy("eq2_5", 12, 6), 9, 6,
        ),
        Benchmark(
            "solvers", "7 x 6: time of the fastest QP solver's bare loop over eq. (6), same stack", "times",
            solvers.against_solvers, 25, 40, at_least=True,
        ),
        Benchmark(
            "kkt", "7 x 6: time of numpy.linalg.solve on stacked KKT systems over eq. (6)", "times",
            closed_forms.against_kkt, 5, at_least=True,
        ),
        Benchmark(
            "table_1_7x6", "7 x 6: time of eq. (6) over eqs. (2)-(5); Table I's ratio below", "times",
            closed_forms.against_each_other(7, 6),
        ),
        Benchmark(
            "table_1_12x6", "12 x 6: time of eq. (6) over eqs. (2)-(5); Table I's ratio below", "times",
            closed_forms.against_each_other(12, 6),
        ),
        Benchmark("solve", "7 x 6: sandbox.solve, statuses and refusals included", "us per problem", closed_forms.whole_solve),
        Benchmark(
            "enclosure", "7 x 6: rigorous enclosures of x and y, rank and condition (7) decided", "us per problem",
            enclosures.time_of(enclosed), 3,
        ),
        Benchmark("certified", "7 x 6: the same with margins, and a Truth made of each", "us per problem",
                  enclosures.time_of(certified)),
        Benchmark(
            "fallback_manufactured", "decided by exact arithmetic: manufactured, N'WN not singular", "%",
            enclosures.fallback(["manufactured"], full=True), 1,
        ),
        Benchmark(
            "fallback_planar", "decided by exact arithmetic: planar", "%", enclosures.fallback(["planar"], full=True), 1
        ),
        Benchmark(
            "fallback_seven_joint", "decided by exact arithmetic: seven_joint", "%",
            enclosures.fallback(["seven_joint"], full=True), 1,
        ),
        Benchmark(
            "fallback_others", "decided by exact arithmetic: all other sets", "%",
            enclosures.fallback(enclosures.OTHERS, full=False),
        ),
        Benchmark("campaign", "7 x 6: a run kept on disk, one core", "records/s", records.campaign),
        Benchmark(
            "qpbenchmark", "7 x 6: records per second of a run over those of qpbenchmark's runner", "times",
            records.against_qpbenchmark, needs=(("qpbenchmark", "qpbenchmark"),),
        ),
        Benchmark("pink", "Panda: time of pink.solve_ik over law.rates, one configuration to a call", "times",
                  _ik("pink", stacked=False), needs=PINK),
        Benchmark("pink_stacked", "Panda: time of pink.solve_ik over law.rates on a stack", "times",
                  _ik("pink", stacked=True), needs=PINK),
        Benchmark("mink", "Panda: time of mink.solve_ik over law.rates, one configuration to a call", "times",
                  _ik("mink", stacked=False), needs=MINK),
        Benchmark("mink_stacked", "Panda: time of mink.solve_ik over law.rates on a stack", "times",
                  _ik("mink", stacked=True), needs=MINK),
    )
}  # fmt: skip
"""By name, in the order of the printed table."""
