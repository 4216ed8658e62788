"""The study of certificates draws what it says, sees what is wrong, and says so with its exit status."""

from __future__ import annotations

import json
from dataclasses import replace
from io import StringIO
from typing import Any

import numpy as np
import pytest
import typer
from rich.console import Console

from problems.sets import SETS
from sandbox import certificate_study as module
from sandbox import cli
from sandbox.certificate_study import FAMILIES, SIZES, Tally, compare, drawn, faults, redrawn, study, table
from sandbox.problem_set import problem_ids
from sandbox.reference import truth
from sandbox.reference.certified import REASON, proved
from sandbox.reference.enclosure import LARGEST, SMALLEST, enclosed
from sandbox.stacked import eigenvalues

Array = np.ndarray


def ids(stacks: Any) -> list[str]:
    return [name for stack in stacks for name in problem_ids(stack)]


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_is_drawn_in_every_size_from_its_seed(family: str) -> None:
    """The same seed gives the same problems, another gives others; as many as asked, or a few more."""
    once, again, other = (drawn(family, seed, 50) for seed in ((1, 2, 3), (1, 2, 3), (1, 2, 4)))
    assert [(stack.m, stack.n) for stack in once] == list(SIZES)
    assert 50 <= sum(map(len, once)) < 50 + len(SIZES)
    assert ids(once) == ids(again) and not set(ids(once)) & set(ids(other))


def test_families_go_where_they_say() -> None:
    """Conditions to 1e16, units 1e16 apart, every inertia, zeros and singular data, entries beyond the range."""
    rng = np.random.default_rng(91)
    well, apart, mixed, small, edge, far, rows = (
        FAMILIES[name](rng, 3, 5, 400)
        for name in ("conditioning", "units", "indefinite", "integer", "edge", "extreme", "factored")
    )
    sigma = np.linalg.svd(well.J)[1]
    assert (sigma[:, 0] / sigma[:, -1]).min() < 100 and (sigma[:, 0] / sigma[:, -1]).max() > 1e14
    assert np.ptp(np.log10(np.abs(apart.J).max(axis=2)), axis=1).max() > 12
    reasons = {t.reason for t in truth(mixed)}  # type: ignore[union-attr]
    assert reasons == {"condition_7", "saddle", "maximum"}
    exactly = [t.rank < 3 or t.inertia[2] > 0 for t in truth(small)]  # type: ignore[union-attr]
    assert 0.05 < np.mean(exactly) < 0.5 and (small.xdot == 0).all(axis=1).any() and (small.a == 0).all(axis=1).any()
    boundary = [(t.margin, t.inertia[2] > 0 or t.rank < 3) for t in truth(edge)]  # type: ignore[union-attr]
    assert np.mean([margin < 1e-14 for margin, _ in boundary]) > 0.7 and 0.02 < np.mean([on for _, on in boundary]) < 0.9
    sizes = np.abs(far.J[far.J != 0])
    assert sizes.min() < SMALLEST and sizes.max() > LARGEST and (far.J == 0).any()
    assert rows.W.factored and (eigenvalues(rows.W.gamma).max() > 1e10) and (rows.W.base == 0).all(axis=(1, 2)).any()


def test_sets_are_drawn_with_further_seeds() -> None:
    """Members of a set drawn anew are others than those frozen under its name; those of one size stand in one stack."""
    row = SETS["planar"]
    frozen = ids(group.problem for group in row.build(row.seed, False))
    stacks = redrawn(row.build, [module.FAR, module.FAR + module.APART])
    shapes = [(p.m, p.n, None if p.W.E is None else p.W.E.shape[-2]) for p in stacks]
    assert len(ids(stacks)) == 2 * len(frozen) and len(set(shapes)) == len(shapes)
    assert not set(ids(stacks)) & set(frozen) and len(set(ids(stacks))) == 2 * len(frozen)


def test_batches_share_the_count() -> None:
    """Every set and family gets its share in turns; published problems come once; every batch draws other ones."""
    sets = [SETS[name] for name in ("textbook", "planar")]
    batches = list(module._batches(sets, 9 * 5000, 3))
    sizes: dict[str, list[int]] = {}
    for name, _, size in batches:
        sizes.setdefault(name, []).append(size)
    assert list(sizes) == ["textbook", "planar", *FAMILIES] and sizes["textbook"] == [61]
    assert all(3500 <= sum(each) <= 6500 for name, each in sizes.items() if name != "textbook")
    drawn = [ids(draw()) for name, draw, _ in batches if name == "planar"]
    assert len(drawn) > 1 and sum(map(len, drawn)) == len({one for each in drawn for one in each}) == sum(sizes["planar"])


def plants(told: Any, found: Any) -> dict[str, tuple[Any, Any]]:
    """Certificates that say something wrong of member 1."""

    def at(values: Array, value: Any) -> Array:
        changed = np.array(values)
        changed[1] = value
        return changed

    return {
        "exactly condition_7": (replace(told, reason=at(told.reason, REASON.index("saddle"))), found),
        "rank 1": (replace(told, rank=at(told.rank, 1)), found),
        "inertia (0, 1, 0)": (replace(told, inertia=at(told.inertia, [0, 1, 0])), found),
        "rounded x": (replace(told, x=at(told.x, told.x[1] * (1 + 1e-12))), found),
        "rounded y": (replace(told, y_radius=at(told.y_radius, 0.0)), found),
        "x is further": (told, replace(found, x_low=at(found.x_low, 0.0))),
        "y is further": (told, replace(found, y_radius=at(found.y_radius, 0.0))),
    }


def test_every_kind_of_fault_is_seen() -> None:
    """A wrong reason, rank or inertia, an entry beyond its radius: each is a line that names the member and what is wrong."""
    problem = FAMILIES["units"](np.random.default_rng(92), 2, 3, 40)
    told, found, truths = proved(problem), enclosed(problem), truth(problem)
    assert isinstance(truths, list) and told.reason[1] == REASON.index("condition_7") and not faults(found, told, truths)
    for words, planted in plants(told, found).items():
        lines = faults(*reversed(planted), truths)
        assert len(lines) == 1 and lines[0].startswith("member 1: ") and words in lines[0]
    singular = replace(truths[1], expected="no_minimum", reason="saddle", x=None, y=None, _x=None, _y=None)
    (line,) = faults(found, told, [truths[0], singular, *truths[2:]])
    assert "a unique minimum: exactly no_minimum, saddle" in line and "x is further off" in line


def test_a_batch_is_tallied_by_size() -> None:
    """Problems, certificates, singular ones and radii of each stack; no certificate where rows exceed joints."""
    row = SETS["rank_deficient"]
    tallies = compare(lambda: redrawn(row.build, [row.seed]))
    assert {at for at, _ in tallies} >= {(4, 3), (2, 3)}
    for (m, n), tally in tallies:
        assert tally.singular == tally.problems and not tally.certified and not tally.wrong
        assert tally.seconds > 0 if m <= n else tally.exact_seconds > 0
    ((_, small),) = compare(lambda: [FAMILIES["units"](np.random.default_rng(93), 2, 3, 30)])
    assert small.certified == small.problems == 30 and len(small.radii[0]) == 30 and small.radii[0].max() < 1e-13


def test_figures_of_a_row() -> None:
    """Shares are in percent, of all and of those that are not exactly singular; times in microseconds per problem."""
    tally = Tally(200, 50, 147, ["one"], [np.array([1.0, 3.0, 2.0])], 0.001, 0.1)
    tally.add(Tally())
    row = tally.row("f")
    assert (row["exact"], row["exact_of_regular"], row["wrong"]) == (26.5, 2.0, 1)
    assert (row["median_radius"], row["largest_radius"]) == (2.0, 3.0)
    assert row["certificate_us"] == pytest.approx(5.0) and row["exact_us"] == pytest.approx(500.0)
    assert Tally().row("nothing")["median_radius"] is None


def test_the_study_in_processes() -> None:
    """A small study of one set and all families: a row for each, one for 6 x 7 and one for all, and nothing wrong."""
    told: list[tuple[int, int]] = []
    rows, wrong = study([SETS["planar"]], 8 * 35, progress=lambda _, done, total: told.append((done, total)))
    assert [row["family"] for row in rows] == ["planar", *FAMILIES, "all 6 x 7", "all"] and not wrong
    assert rows[-1]["problems"] == sum(row["problems"] for row in rows[:-2]) == told[-1][0] == told[-1][1]
    assert rows[-2]["problems"] == sum(-(-35 // 7) for _ in FAMILIES) and rows[-1]["certified"] > 200
    console = Console(width=160, record=True, file=StringIO())
    console.print(table(rows))
    shown = console.export_text()
    assert all(name in shown for name in ("planar", *FAMILIES, "regular"))


@pytest.mark.parametrize("wrong", [[], ["edge: member 3: x is further off than its radius"]])
def test_a_wrong_certificate_is_exit_status_one(
    wrong: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`sandbox certify` prints the rows, and names what is wrong."""
    rows = [Tally(10, certified=9, wrong=wrong).row("edge")]
    monkeypatch.setattr(module, "study", lambda *_, **__: (rows, wrong))
    for as_json in (False, True):
        try:
            cli.certify(10, 0, 1, as_json)
            status = 0
        except typer.Exit as stop:
            status = stop.exit_code
        shown = capsys.readouterr().out
        assert status == len(wrong) and ("further off" in shown) == bool(wrong)
        assert json.loads(shown)["rows"] == rows if as_json else "edge" in shown
