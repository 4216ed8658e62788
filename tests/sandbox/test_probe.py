"""The probe counts what is right by exact truth, and nobody's word."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO
from math import sqrt
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from sandbox import probe as probing
from sandbox.backends import SILENCE
from sandbox.backends.backend import Engine, Promise
from sandbox.errors import UnknownNameError
from sandbox.probe import CLAIMS, Claim, Trial, probe, table, wilson
from sandbox.qp import QP
from sandbox.reference.truth import Truth, truth_of_qp
from sandbox.solution import CODE, Status
from sandbox.worker import Answers, Workers

INSTANCES = 20
SOLVABLE = {claim.sentence for claim in CLAIMS if claim.success == "verified"}
WEIGHT_IS = {
    "pd H is solved": lambda positive, negative, zero: negative == zero == 0,
    "psd H with full-rank rows is solved": lambda positive, negative, zero: negative == 0 < zero,
    "valid indefinite H (condition (7)) is solved directly": lambda positive, negative, zero: positive * negative > 0,
}


class Pretender:
    """Stands where Workers stand; `answer` decides what comes back."""

    def __enter__(self) -> Pretender:
        return self

    def __exit__(self, *_: Any) -> None:
        pass

    def solve(
        self, backend: str, qp: QP, *, settings: str, time_limit: float, patience: int | None, follows: None = None,
        start: None = None,
    ) -> Answers:  # fmt: skip
        """Answers with an engine of tolerance 1e-6."""
        engine = Engine(lambda *_: None, {}, (1e-6, 0.0, 1e-6, 0.0), "0", "0")  # type: ignore[arg-type, return-value]
        answers = replace(Answers.empty(qp), engine=engine)
        self.answer(qp, answers)
        return answers

    def answer(self, qp: QP, answers: Answers) -> None:
        """Fill in what this one says."""
        raise NotImplementedError


class Liar(Pretender):
    """Says solved whatever happens, with a point that meets the rows where it can."""

    def answer(self, qp: QP, answers: Answers) -> None:  # noqa: D102
        answers.status[:] = CODE[Status.SOLVED]
        answers.x[:] = (np.linalg.pinv(qp.A) @ qp.b[..., None])[..., 0]
        answers.y[:] = 0.0


class Naysayer(Pretender):
    """Refuses everything."""

    def answer(self, qp: QP, answers: Answers) -> None:  # noqa: D102
        answers.status[:] = CODE[Status.FAILED]


class Oracle(Pretender):
    """Knows the exact answer, and refuses what has none."""

    def answer(self, qp: QP, answers: Answers) -> None:  # noqa: D102
        answers.status[:] = CODE[Status.FAILED]
        for i in np.flatnonzero(np.isfinite(qp.H).all(axis=(1, 2))):
            right = truth_of_qp(qp.H[i], qp.g[i], qp.A[i], qp.b[i])
            assert isinstance(right, Truth)
            if right.x is not None:
                answers.status[i], answers.x[i], answers.y[i] = CODE[Status.SOLVED], right.x, right.y


class Diverging(Naysayer):
    """Refuses, and hands over the far end of its ray."""

    def solve(self, backend: str, qp: QP, **others: Any) -> Answers:  # noqa: D102
        answers = super().solve(backend, qp, **others)
        answers.x[:], answers.y[:] = 1e12, 1e12
        return replace(answers, engine=answers.engine and answers.engine._replace(eps=(1e-6,) * 4))


class Crasher(Pretender):
    """Dies until patience is at its end."""

    def answer(self, qp: QP, answers: Answers) -> None:  # noqa: D102
        answers.fail(np.arange(probing.PATIENCE), Status.CRASHED, "its process died of SIGSEGV")


class Absent(Pretender):
    """Cannot be opened."""

    def solve(self, backend: str, qp: QP, **_: Any) -> Answers:  # noqa: D102
        return replace(Answers.empty(qp), absent="ImportError: no osqp; install it with: pip install osqp")


def successes(monkeypatch: pytest.MonkeyPatch, pretender: type[Pretender]) -> dict[str, dict[str, Any]]:
    """Rows of the probe by sentence, with `pretender` behind the name osqp."""
    monkeypatch.setattr(probing, "Workers", pretender)
    return {row["claim"]: row for row in probe(["osqp"], INSTANCES)}


def drawn(rows: list[dict[str, Any]]) -> str:
    """The table as the terminal shows it."""
    console = Console(width=160, file=StringIO())
    console.print(table(rows))
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.sentence)
def test_instances_are_what_the_sentence_says(claim: Claim) -> None:
    """By exact arithmetic every instance is of its class, in integers, and no two are the same."""
    trial = Trial.of(claim, 100)
    problem = trial.problem
    for part in (problem.J, problem.xdot, problem.W.base, problem.a):
        assert (part == np.round(part)).all()
    assert len({problem.W.base[i].tobytes() + problem.J[i].tobytes() + problem.a[i].tobytes() for i in range(100)}) == 100
    if trial.yardstick is None:
        assert np.isnan(trial.posed.qp.H).any(axis=(1, 2)).all()
        return
    for i in range(100):
        right = truth_of_qp(problem.W.base[i], problem.a[i], problem.J[i], problem.xdot[i])
        free = truth_of_qp(problem.W.base[i], problem.a[i], np.zeros((0, problem.n)), np.zeros(0))
        assert isinstance(right, Truth)
        assert isinstance(free, Truth)
        assert right.expected == claim.expected
        assert (right.rank == problem.m) == claim.full_rank
        if claim.sentence in WEIGHT_IS:
            assert WEIGHT_IS[claim.sentence](*free.inertia)


def test_instances_are_always_the_same() -> None:
    """Seeds are fixed, and more instances begin with the fewer."""
    few, many = Trial.of(CLAIMS[2], 5), Trial.of(CLAIMS[2], 9)
    assert few.problem.W.base.tobytes() == many.problem.W.base[:5].tobytes()


def test_a_liar_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """A backend that always says solved bears out nothing: its refusals are false successes, its answers wrong."""
    rows = successes(monkeypatch, Liar)
    assert [row["successes"] for row in rows.values()] == [0] * len(CLAIMS)
    for sentence in rows.keys() - SOLVABLE:
        assert rows[sentence]["verdicts"] == {"false_success": INSTANCES}


def test_refusing_everything_bears_out_refusals_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """A backend that refuses everything is right where there is nothing to solve, and there only."""
    rows = successes(monkeypatch, Naysayer)
    assert {sentence for sentence, row in rows.items() if row["successes"] == INSTANCES} == rows.keys() - SOLVABLE
    assert all(rows[sentence]["successes"] == 0 for sentence in SOLVABLE)
    assert rows["pd H is solved"]["verdicts"] == {"wrong_refusal": INSTANCES}  # osqp promises it


def test_exact_answers_bear_out_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    """A backend that is always right succeeds in every instance of every claim."""
    rows = successes(monkeypatch, Oracle)
    assert [row["successes"] for row in rows.values()] == [INSTANCES] * len(CLAIMS)


def test_a_diverging_iterate_does_not_loosen_the_judgement(monkeypatch: pytest.MonkeyPatch) -> None:
    """Relative tolerances are not scaled by the point that comes with a refusal."""
    rows = successes(monkeypatch, Diverging)
    assert rows["no minimum (saddle) is refused"]["verdicts"] == {"right_refusal": INSTANCES}


def test_crashes_end_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """After five crashes a claim stops, and the row says how many instances were left out."""
    row = successes(monkeypatch, Crasher)["pd H is solved"]
    assert (row["instances"], row["successes"], row["stopped"]) == (5, 0, INSTANCES - 5)
    assert row["verdicts"] == {"crashed": 5}


def test_what_is_absent_is_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A backend that cannot be opened has no instances, and the table says why."""
    rows = successes(monkeypatch, Absent)
    assert {(row["instances"], row["low"], row["high"], row["stopped"]) for row in rows.values()} == {(0, 0.0, 1.0, 0)}
    assert "not run: osqp: ImportError" in drawn(list(rows.values()))


@pytest.mark.conformance
def test_real_backends_are_measured() -> None:
    """Three real backends: numpy mistakes stationary points for minima, OSQP and DAQP do not."""
    told: list[tuple[int, int]] = []
    rows = probe(["numpy", "osqp", "qpsolvers:daqp"], INSTANCES, lambda _, done, total: told.append((done, total)))
    assert [(row["backend"], row["claim"]) for row in rows] == [
        (name, claim.sentence) for name in ("numpy:lstsq", "osqp", "qpsolvers:daqp") for claim in CLAIMS
    ]
    count = {(row["backend"], row["claim"]): row["successes"] for row in rows}
    for name in ("numpy:lstsq", "osqp", "qpsolvers:daqp"):
        assert count[name, "pd H is solved"] == INSTANCES
    for sentence in ("no minimum (saddle) is refused", "no minimum (maximum) is refused"):
        assert count["numpy:lstsq", sentence] == 0
        assert count["osqp", sentence] == count["qpsolvers:daqp", sentence] == INSTANCES
    assert sorted(done for done, _ in told)[-1] == told[0][1] == 3 * len(CLAIMS) * INSTANCES
    assert f"{INSTANCES}/{INSTANCES}*" in drawn(rows)


def test_promises_cover_what_they_say() -> None:
    """A promise of psd covers pd but not indefinite; dependent rows need a promise of any A; refusals nobody promises."""
    by = {claim.sentence: claim for claim in CLAIMS}
    psd, any_rows = Promise("psd", None, "", "", ""), Promise("psd", "any", "", "", "")
    assert by["pd H is solved"].promised(psd)
    assert by["psd H with full-rank rows is solved"].promised(psd)
    assert not by["valid indefinite H (condition (7)) is solved directly"].promised(psd)
    assert not by["consistent redundant rows are solved"].promised(psd)
    assert by["consistent redundant rows are solved"].promised(any_rows)
    assert not any(claim.promised(any_rows) for claim in CLAIMS if claim.success == "right_refusal")
    assert not any(claim.promised(SILENCE) for claim in CLAIMS)


def test_wilson_is_the_root_of_its_equation() -> None:
    """The ends of the interval are where the normal test just fails: |p - share| = z sqrt(p (1 - p) / n)."""
    for successes_, instances in ((37, 50), (1, 50), (49, 50), (5, 7)):
        for end in wilson(successes_, instances):
            miss = abs(end - successes_ / instances)
            assert miss == pytest.approx(probing.QUANTILE * sqrt(end * (1 - end) / instances), rel=1e-12)
    assert wilson(50, 50) == (pytest.approx(50 / (50 + probing.QUANTILE**2)), 1.0)
    assert wilson(0, 50)[0] == 0.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_unknown_backends_are_refused() -> None:
    """A wrong name is refused with those that there are, before anything starts."""
    with pytest.raises(UnknownNameError, match=r"there are: .*osqp"):
        probe(["no_such"])


def test_workers_and_pretenders_have_one_signature() -> None:
    """The pretenders stand in for the real method, keyword by keyword."""
    from inspect import signature

    real, pretended = (set(signature(cls.solve).parameters) for cls in (Workers, Pretender))
    assert real == pretended
