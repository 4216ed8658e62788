"""The part per method: its counts against counts made another way, its drawings, and what it survives."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from reports import aggregate, cases, drawing
from reports.figure import write_drift_figure
from reports.findings import findings
from reports.methods import ROOM, mathematics, methods, postures, traced
from reports.run_data import RunData
from reports.verification import write_report
from sandbox.errors import EmptyPlanError, InputFileError, UnknownNameError
from sandbox.records import METHODS, MOTIONS, read_table, write_parquet
from tests.reports.conftest import Report
from tests.reports.synthetic_methods import CARDS, TAGS
from tests.reports.synthetic_methods import motions as synthetic_motions
from tests.reports.synthetic_run import WARM, write_run


@pytest.fixture(scope="module")
def run(report: Report) -> Iterator[RunData]:
    """The run folder opened."""
    data = RunData(report.run)
    yield data
    data.close()


@pytest.fixture(scope="module")
def sections(run: RunData) -> dict[str, Any]:
    """What the page shows of each method."""
    return {section["name"]: section for section in methods(run)}


def records(report: Report) -> list[dict[str, Any]]:
    """Records as Python sees them."""
    names = ["problem", "set", "method", "backend", "formulation", "settings", "task", "mode", "verdict", "blame", "attainable"]
    return read_table(report.run, "records", [*names, "iterations", "solve_time"]).to_pylist()


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A small run folder to spoil."""
    write_run(tmp_path / "run", scale=0.03, backends=("osqp",), default=False)
    return tmp_path / "run"


def respoiled(run: Path, kind: str, schema: pa.Schema, **changes: Any) -> None:
    """Change columns of the first row of a table of the method study."""
    path = run / kind / "part-0.parquet"
    rows = pq.read_table(path).to_pylist()
    rows[0] |= changes
    write_parquet(pa.Table.from_pylist(rows, schema=schema), path)


def test_every_method_has_its_part_in_the_order_of_the_table(sections: dict[str, Any]) -> None:
    """Whether or not it was studied."""
    assert list(sections) == [card["name"] for card in CARDS]


def test_the_overview_adds_up_the_study(sections: dict[str, Any], report: Report) -> None:
    """Agreed, held and refused are sums over robots and forms of W; a method without an original has no agreement."""
    rows = read_table(report.run, "methods").to_pylist()
    for name, section in sections.items():
        own = [row for row in rows if row["method"] == name]
        if not own:
            assert section["situations"] is section["compared"] is section["refused"] is None
            continue
        for key in ("situations", "held", "refused"):
            assert section[key] == sum(row[key] for row in own) > 0 or (key == "refused" and section[key] == 0)
        witnessed = [row for row in own if row["agreed"] is not None]
        assert section["agreed"] == (sum(row["agreed"] for row in witnessed) if witnessed else None)
    assert sections["transpose"]["compared"] is None and sections["transpose"]["held"] == 600
    assert sections["inertia"]["agreed"] == sections["inertia"]["compared"] - 2
    assert dict(sections["integrable"]["refusals"]) == {"N'WN is not positive definite " + TAGS: 18, "off equilibrium": 9}


def test_the_answers_of_a_method_are_those_of_its_two_sets(sections: dict[str, Any], report: Report) -> None:
    """Verdict counts by formulation, cold and warm apart, are those of the records; a backend with one wrong has not all."""
    expected: Counter = Counter()
    right: dict[tuple, dict[str, list[bool]]] = {}
    for row in records(report):
        if row["set"] in ("methods", "trajectories") and row["settings"] in (None, "high_accuracy"):
            key = (row["method"], row["formulation"], row["mode"])
            if row["verdict"] not in ("undecidable", "not_run"):
                good = row["verdict"] in ("verified", "right_refusal")
                right.setdefault(key, {}).setdefault(row["backend"], []).append(good)
            own = row["verdict"] in ("verified", "crashed", "timed_out", "not_run")
            declined = row["verdict"] in ("limit", "right_refusal", "wrong_refusal", "out_of_scope")
            if own or (row["blame"] != "formulation" and not (declined and row["attainable"] is False)):
                expected[*key, row["verdict"]] += 1
    found = Counter(
        {
            (name, cell["formulation"], cell["mode"], verdict): n
            for name, section in sections.items()
            for cell in section["posed"]
            for verdict, n in cell["counts"].items()
        }
    )
    assert found == expected and len({key[2] for key in found}) == 2
    for name, section in sections.items():
        for cell in section["posed"]:
            backends = right[name, cell["formulation"], cell["mode"]]
            assert (cell["backends"], cell["whole"]) == (len(backends), sum(all(good) for good in backends.values()))
        cold = [cell for cell in section["posed"] if cell["mode"] == "cold" and cell["formulation"]]
        assert section["verified"] == sum(cell["counts"].get("verified", 0) for cell in cold) > 0


def test_warm_solves_count_nowhere_but_beside_the_cold(report: Report, tmp_path: Path) -> None:
    """With the warm records taken out of the run folder every other table stays what it was."""
    shutil.copytree(report.run, tmp_path / "cold")
    warm = 0
    for part in (tmp_path / "cold" / "records").glob("*.parquet"):
        table = pq.read_table(part)
        kept = table.filter(pc.equal(table["mode"], "cold"))
        warm += table.num_rows - kept.num_rows
        write_parquet(kept, part)
    with_warm, without = RunData(report.run), RunData(tmp_path / "cold")
    assert with_warm.one("select count(*) from warm") == warm > 0 and without.one("select count(*) from warm") == 0
    for table_of in (
        aggregate.counts, aggregate.matrices, aggregate.measured, aggregate.distributions, aggregate.accuracy,
        aggregate.repairs, aggregate.closed_forms, aggregate.recommendations, aggregate.failures, aggregate.worst,
        aggregate.effective_settings,
        aggregate.ran, cases.totals, cases.choose, lambda run: aggregate.breakdown(run, "sigma_min_J"),
    ):  # fmt: skip
        assert table_of(with_warm) == table_of(without)
    assert len(aggregate.warm_starts(with_warm)) == len(WARM) and aggregate.warm_starts(without) == []
    with_warm.close()
    without.close()


def test_cold_against_warm_compares_the_same_solves(run: RunData, report: Report) -> None:
    """Medians over pairs, time as the ratio of medians, and every verdict that differs."""
    pairs: dict[tuple, dict[str, dict[str, Any]]] = {}
    for row in records(report):
        if row["settings"] == "high_accuracy" and row["verdict"] != "not_run":
            key = tuple(row[name] for name in ("backend", "problem", "set", "formulation", "task"))
            pairs.setdefault(key, {})[row["mode"]] = row
    rows = aggregate.warm_starts(run)
    assert [row["backend"] for row in rows] == list(WARM)
    for row in rows:
        both = [pair for key, pair in pairs.items() if key[0] == row["backend"] and len(pair) == 2]
        assert row["n"] == len(both) > 3
        for mode in ("cold", "warm"):
            assert row[f"{mode}_iterations"] == median(pair[mode]["iterations"] for pair in both)
            assert row[f"{mode}_verified"] == sum(pair[mode]["verdict"] == "verified" for pair in both)
        times = [median(pair[mode]["solve_time"] for pair in both) for mode in ("warm", "cold")]
        assert row["ratio"] == pytest.approx(times[0] / times[1])
        changed = Counter((pair["cold"]["verdict"], pair["warm"]["verdict"]) for pair in both)
        assert row["changed"] == {key: n for key, n in changed.items() if key[0] != key[1]}


def test_a_motion_keeps_its_arrays_and_says_its_extremes(sections: dict[str, Any]) -> None:
    """Shapes as stored; largest error, least eigenvalues, drift after the first and the last cycle; null where not closed."""
    told = {(row["method"], row["robot"], row["path"]): row for row in synthetic_motions()}
    damped = {key for key, row in told.items() if row["damping"] is not None}
    for section in sections.values():
        for motion in section["motions"]:
            row = told.pop((section["name"], motion["robot"], motion["path"]))
            T = len(row["t"])
            assert motion["q"].shape == (T, row["n"]) and motion["hand"].shape == (T, 3)
            assert np.array_equal(motion["q"].ravel(), row["q"]) and motion["arm"].shape == (row["frames"], row["n"] + 2, 3)
            assert np.isnan(motion["lambda_min_reduced"][3]) and motion["lambda"] == np.nanmin(row["lambda_min_reduced"])
            ends = row["drift"] if row["drift"] is not None and len(row["drift"]) else [None]
            assert (motion["first"], motion["last"]) == (ends[0], ends[-1])
    assert set(told) == damped  # they are in the table of what damping costs
    assert sections["augmented"]["drift"] < 1e-3 < 0.05 < sections["gradient_projection"]["drift"]


def test_singularities_have_a_line_each(sections: dict[str, Any], report: Report) -> None:
    """Every singularity of every motion, in the letters of the page; the table counts them."""
    text = report.page.read_text(encoding="utf-8")
    part = text[text.index('id="methods"') : text.index('id="which"')]
    told = [json.loads(row["singularities"]) for row in synthetic_motions()]
    lines = re.findall(r"<li>([^\n]*) at t = ([\d.]+) s", part)
    assert len(lines) == sum(map(len, told)) == 9
    assert sorted(float(t) for _, t in lines) == sorted(round(one["t"], 4) for own in told for one in own)
    (end,) = [words for words, _ in lines if words.startswith("planar_3r, circle: algorithmic")]
    assert end.endswith("σ<sub>min</sub>(NᵀEᵀ) = 3.3e−8") and "at the end of the motion" in part
    for section in sections.values():
        for motion in section["motions"]:
            assert len(motion["singularities"]) == (2 if motion["stopped"] else 1)


def test_damping_has_a_table_of_its_own(sections: dict[str, Any], report: Report) -> None:
    """Undamped first, in the part of the method that damps; linked from the other; neither part's overview knows of it."""
    assert [section["name"] for section in sections.values() if section["costs"]] == ["transpose"]
    (cost,) = sections["transpose"]["costs"]
    assert [(one["method"], one["damping"]) for one in cost["motions"]] == [
        ("augmented", 0.0), ("transpose", 0.01), ("transpose", 0.1),
    ]  # fmt: skip
    linked = {name: [one["name"] for one in section["damped_in"]] for name, section in sections.items()}
    assert {name: others for name, others in linked.items() if others} == {"augmented": ["transpose"]}
    assert sections["transpose"]["motions"] == [] and sections["transpose"]["bracket"] is None
    assert len(sections["augmented"]["motions"]) == 1 and sections["augmented"]["stopped"] == 0
    text = report.page.read_text(encoding="utf-8")
    part = text[text.index("What damping costs</strong>") :]
    rows = [re.sub(r"<[^>]*>", "|", row) for row in re.findall(r"<tr>.*?</tr>", part[: part.index("</table>")], re.DOTALL)[1:]]
    assert [row.split("|")[2] for row in rows] == ["0", "0.010", "0.10"]
    for row, words in zip(rows, ("|1.5|", "|1.9e−3|", "|0.019|"), strict=True):
        assert words in row
    assert "after " in rows[0] and "N&#39;WN is not positive definite" in rows[0] and "|100 %|" in rows[1]
    assert f'<a href="#method-{sections["transpose"]["place"]}">Jacobian transpose</a>.</p>' in text
    # the undamped motion rises out of the drawing, and ends where it stopped
    assert len(re.findall(r'class="c\d w"', cost["drawing"])) == 3 and "1.5 at damping 0;" in cost["drawing"]


def test_a_damping_without_an_undamped_motion_is_shown(small: Path) -> None:
    """Of one method alone, at one damping, along two paths: a table each, at home with it."""
    row = next(row for row in synthetic_motions() if row["damping"] == 0.1)
    table = pa.Table.from_pylist([row, row | {"path": "elsewhere", "qdot": None, "t": None}], schema=MOTIONS)
    write_parquet(table, small / "motions" / "part-0.parquet")
    data = RunData(small)
    section = next(one for one in methods(data) if one["name"] == "transpose")
    data.close()
    assert [cost["title"] for cost in section["costs"]] == ["planar_3r, elsewhere", "planar_3r, into"]
    assert section["costs"][0]["drawing"] == "" and section["costs"][1]["drawing"] and section["damped_in"] == []


def test_the_drift_figure_takes_the_arms_whose_hand_is_back(sections: dict[str, Any]) -> None:
    """One posture at the start and one after each cycle; a frame in between is left out; the path is drawn once around."""
    motion = sections["gradient_projection"]["motions"][1]
    assert motion["cycles"] == 6 and len(postures(motion)) == 7
    other = motion | {"arm": np.concatenate([motion["arm"][:1], motion["arm"][:1] + 0.5, motion["arm"][1:]])}
    assert np.array_equal(postures(other), motion["arm"])
    crossing = motion | {"arm": motion["arm"][[0, 0, *range(1, 7)]]}  # a figure eight is at its start half way round
    assert len(postures(crossing)) == 7
    once = traced(motion)
    assert len(once) == 61 and np.linalg.norm(once[-1] - once[0]) < 1e-2
    for odd in ({"error": 0.1}, {"error": None}, {"stopped": "in the third cycle"}, {"closed": False}):
        assert traced(motion | odd) is motion["hand"]


def test_drawings_share_the_room_by_turns(run: RunData) -> None:
    """With little room every method has its first motion drawn before any has its second, and the rest is counted."""
    whole = methods(run)
    sizes = [
        [sum(len(svg.encode()) for column in motion["drawings"] for svg in column) for motion in s["motions"]] for s in whole
    ]
    assert sum(map(sum, sizes)) < ROOM and all(section["undrawn"] == 0 for section in whole)
    firsts = [own for own in sizes if own]
    costs = sum(len(cost["drawing"].encode()) for section in whole for cost in section["costs"])
    assert costs > 0
    tight = methods(run, room=costs + sum(max(own) for own in firsts))
    assert all(section["undrawn"] < len(section["motions"]) for section in tight if section["motions"])
    assert sum(section["undrawn"] for section in tight) > 0
    none = methods(run, room=0)
    assert [section["undrawn"] for section in none] == [len(section["motions"]) for section in none]
    assert [cost["drawing"] for section in none for cost in section["costs"]] == [""]


def test_many_motions_keep_the_page_small(tmp_path: Path) -> None:
    """Two hundred motions of long paths: the drawings stay within their room, the tables list all."""
    write_run(tmp_path / "run", scale=0.03, backends=("osqp",), default=False)
    rows = [row | {"robot": f"{row['robot']}_{k}"} for k in range(30) for row in synthetic_motions()]
    rows[0] |= {"singularities": json.dumps(400 * json.loads(rows[0]["singularities"]))}
    write_parquet(pa.Table.from_pylist(rows, schema=MOTIONS), tmp_path / "run" / "motions" / "part-0.parquet")
    text = write_report(tmp_path / "run", tmp_path / "page.html").read_text(encoding="utf-8")
    drawn = re.findall(r'<svg class="drawing".*?</svg>', text, re.DOTALL)
    assert 100 < len(drawn) and 0.8 * ROOM < sum(len(svg.encode()) for svg in drawn) <= ROOM
    assert "stand in the table and in the run folder alone" in text and "planar_<wbr>3r_<wbr>29" in text
    assert "380 more, in the run folder" in text


def test_the_page_shows_every_part_of_a_method(report: Report) -> None:
    """Formula in the letters of the page, works, agreement per robot and shift, refusals, QPs, motions, drawings."""
    text = report.page.read_text(encoding="utf-8")
    part = text[text.index('id="methods"') : text.index('id="which"')]
    assert part.count('<details class="method">') == len(CARDS)
    for words in (
        "q̇ = J⁺ ẋ − α (I − J⁺J) ∇f", "q̇ = M⁻¹ Jᵀ (J M⁻¹ Jᵀ)⁻¹ ẋ", "Σ γ<sub>i</sub> ∇g<sub>i</sub> ∇g<sub>i</sub>ᵀ",
        "attribution: very likely", "doi 10.1000/1", "off equilibrium", "JᵀB + BᵀJ", "no original to compare with",
        "no situations in this run", "stopped early", "which minimises nothing", "convexified", "closed forms",
    ):  # fmt: skip
        assert words in part, words
    drawn = re.findall(r'<svg class="drawing".*?</svg>', part, re.DOTALL)
    assert len(drawn) == 34
    for svg in drawn:
        root = ElementTree.fromstring(svg)
        assert root[0].tag == "title" and root[1].tag == "desc" and len(root[1].text or "") > 5
    assert len({ElementTree.fromstring(svg)[0].text for svg in drawn}) == len(drawn)


def test_text_of_the_study_is_never_markup(report: Report) -> None:
    """Tags in titles, works, refusals and reasons arrive as text, in tables and in drawings."""
    text = report.page.read_text(encoding="utf-8")
    assert "<script>window.hacked" not in text and "<b>&#34;bold" not in text and '<b>"bold' not in text
    assert text.count("&lt;script&gt;window.hacked = 2&lt;/script&gt;") > 10


@pytest.mark.parametrize("kinds", [("methods",), ("motions",), ("methods", "motions")])
def test_tables_may_be_missing(small: Path, tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """A run stopped before its study, or without motions, has its page."""
    for kind in kinds:
        shutil.rmtree(small / kind)
    text = write_report(small, tmp_path / "page.html").read_text(encoding="utf-8")
    assert ("Framework and original" in text) == ("methods" not in kinds)
    assert ("Along paths" in text) == ('<svg class="drawing"' in text) == ("motions" not in kinds)
    assert 'id="methods"' in text


def test_motions_alone_make_a_page(small: Path, tmp_path: Path) -> None:
    """A run that followed paths and solved nothing says so, and shows them."""
    for kind in ("records", "problems", "truth", "methods"):
        shutil.rmtree(small / kind)
    text = write_report(small, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "No problem was solved in this run: 6 velocity-control methods were studied" in text
    assert '<svg class="drawing"' in text and "0 velocity-control problems" not in text


def test_a_study_without_cards_goes_by_the_names(small: Path, tmp_path: Path) -> None:
    """Where run.json says nothing of a method its name stands for it."""
    about = json.loads((small / "run.json").read_text())
    del about["methods"]
    (small / "run.json").write_text(json.dumps(about))
    text = write_report(small, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<strong>Gradient projection</strong>" in text and "Never studied" not in text


@pytest.mark.parametrize(
    ("kind", "schema", "changes", "words"),
    [
        ("motions", MOTIONS, {"q": [1.0] * 7}, "gradient_projection on planar_3r along circle: q has 7 numbers"),
        ("motions", MOTIONS, {"frames": 4}, "arm has .* numbers, which do not fit 3 joints and 4 frames"),
        ("motions", MOTIONS, {"hand": [0.0] * 6}, "t, q, qdot and hand have different lengths"),
        ("motions", MOTIONS, {"qdot": [0.0] * 6}, "t, q, qdot and hand have different lengths"),
        ("motions", MOTIONS, {"singularities": "[{"}, "singularities of gradient_projection on planar_3r along circle are no"),
        ("motions", MOTIONS, {"singularities": '{"kind": 1}'}, "singularities of gradient_projection .* are no JSON of {kind,"),
        ("motions", MOTIONS, {"singularities": '[{"kind": "kinematic"}]'}, "singularities of gradient_projection .*'how'"),
        ("methods", METHODS, {"refusals": "{oops"}, "refusals of gradient_projection are no JSON"),
        ("methods", METHODS, {"refusals": "[1, 2]"}, "refusals of gradient_projection are no JSON"),
    ],
)
def test_a_spoiled_study_is_named(small: Path, kind: str, schema: pa.Schema, changes: dict[str, Any], words: str) -> None:
    """Arrays that do not fit each other and counts that are none: an error that says where, and no page."""
    respoiled(small, kind, schema, **changes)
    with pytest.raises(InputFileError, match=words):
        write_report(small, small / "page.html")
    assert not (small / "page.html").exists()


def test_arrays_may_be_null(small: Path, tmp_path: Path) -> None:
    """A motion that stopped before its first step has a line in the table and no drawing of what it lacks."""
    lists = ("t", "q", "qdot", "hand", "task_error", "lambda_min_reduced", "sigma_min_J", "arm", "drift")
    lists += ("singularities", "share", "peak_rate", "secondary_error")
    respoiled(small, "motions", MOTIONS, **dict.fromkeys(lists), frames=None, cycles=None, stopped="at once")
    text = write_report(small, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "at once" in text


def test_the_findings_say_which_methods_agree(run: RunData, sections: dict[str, Any]) -> None:
    """Methods with an original and every situation agreed, of all with an original; the others by name."""
    found = [one for one in findings(run, [], [], list(sections.values())) if one.href == "#methods"]
    assert [one.figure for one in found] == ["3 of 4"] and "not everywhere: Manipulator inertia." in found[0].sentence
    assert "7,171 of 7,173" in found[0].detail and found[0].kind == "bad"
    assert not [one for one in findings(run, [], [], []) if one.href == "#methods"]


def test_the_drift_figure_is_one_file(report: Report, tmp_path: Path) -> None:
    """The methods named, in their order, on the robot named; by default all that went round the first closed path."""
    path = write_drift_figure(report.run, tmp_path / "a.svg", names=("augmented", "inertia"), robot="planar_3r")
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    titles = [child.text for child in root.iter("{http://www.w3.org/2000/svg}text") if child.get("class") == "h"]
    assert titles == ["Augmented Jacobian", "Manipulator inertia"] and path.stat().st_size < 40_000
    stopped = write_drift_figure(report.run, tmp_path / "d.svg", names=("inertia", "integrable"), robot="planar_3r")
    assert "stopped before the first cycle ended" in stopped.read_text(encoding="utf-8")
    every = write_drift_figure(report.run, tmp_path / "b.svg", robot="planar_3r").read_text(encoding="utf-8")
    assert every.count('class="h"') == 3
    alone = write_drift_figure(report.run, tmp_path / "c.svg").read_text(encoding="utf-8")
    assert alone.count('class="h"') == 1  # the first closed path is the Panda's


def test_titles_of_the_drift_figure_stay_in_their_panels(report: Report) -> None:
    """Two lines at most and notes on one line; what is in brackets at the end goes first; many panels make a wider figure."""
    arm, hand = np.zeros((2, 3, 3)) + np.arange(3.0)[:, None] * [1, 0.5, 0], np.array([[0.0, 0, 0], [1, 1, 0]])
    titles = ["Inertia-weighted (Khatib's dynamically consistent inverse)", "Short (so)", "W" * 60, "Two words " * 9]
    panels = [drawing.Cycles(title, "drift in cycle 1: 0.13 rad", arm, hand, np.array([0.3, 0.1])) for title in titles]
    for count in (2, 4, 23):
        svg = drawing.drift_figure((panels * 6)[:count])
        width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg)[1])  # type: ignore[index]
        heads = [(float(x), words) for x, words in re.findall(r'class="h" x="([\d.]+)" y="\d+">([^<]+)<', svg)]
        places = sorted({x for x, _ in heads})
        each = min([b - a for a, b in pairwise(places)] + [width - places[-1]])
        assert len(places) == count and each >= 110
        assert all(drawing._BOLD * len(words) <= each + drawing._BOLD for _, words in heads)
        assert max(Counter(x for x, _ in heads).values()) <= 2
        assert len(set(re.findall(r'y="([\d.]+)">drift in', svg))) == 1
    four = drawing.drift_figure(panels)
    assert ">Inertia-weighted<" in four and "Khatib" not in four.split("</desc>")[1] and ">Short (so)<" in four
    assert "Khatib" in drawing.drift_figure(panels[:1]).split("</desc>")[1]


def test_the_last_drift_is_written_above_the_dots(report: Report) -> None:
    """Its number stands above every dot below it, and ends inside the panel; a legend names what is drawn."""
    for values in ([0.3, 0.2, 0.1], [0.1, 0.2, 0.3], [1e-13] * 3):
        svg = drawing.drift(np.array(values), title="t", about="a")
        x, y, words = re.search(r'class="n e" x="([\d.]+)" y="([\d.]+)">([^<]+)<', svg).groups()  # type: ignore[union-attr]
        dots = [tuple(map(float, at)) for at in re.findall(r'class="\w+ d" d="M([\d.]+) ([\d.]+)h0', svg)]
        assert words == drawing._number(values[-1]) and float(x) <= 170
        assert all(float(y) < dot[1] - 3.5 for dot in dots if dot[0] > float(x) - 6 * len(words))
    legend = drawing.drift_figure([drawing.Cycles("a", "b", np.zeros((1, 2, 3)), np.zeros((0, 3)), np.array([0.1, 0.2]))])
    assert all(f">{words}<" in legend for words in ("joints at the start", "after each cycle", "path of the hand"))
    assert len(re.findall(r'class="d s\d"', legend)) == 2


def test_a_figure_of_nothing_is_refused(report: Report, tmp_path: Path) -> None:
    """An unknown method, a method that went round nothing, a folder that is no run: said, and no file."""
    with pytest.raises(UnknownNameError, match="no method is called 'augmentd'"):
        write_drift_figure(report.run, tmp_path / "a.svg", names=("augmentd",))
    for what in ({"names": ("transpose",)}, {"robot": "planar_9r"}, {"path": "straight"}):
        with pytest.raises(EmptyPlanError, match="no motion of the run"):
            write_drift_figure(report.run, tmp_path / "a.svg", **what)
    with pytest.raises(InputFileError, match="no run folder"):
        write_drift_figure(tmp_path, tmp_path / "a.svg")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("qdot = J^+ xdot - alpha (I - J^+J) grad f", "q̇ = J⁺ ẋ − α (I − J⁺J) ∇f"),
        ("[J; N'W] qdot = [xdot; -N'a]", "[J; NᵀW] q̇ = [ẋ; −Nᵀa]"),
        ("(J'Wx J)^-1 J'Wx xdot, W' = W", "(JᵀWx J)⁻¹ JᵀWx ẋ, Wᵀ = W"),
        ("K_theta", "K<sub>θ</sub>"),
        ("-sum gamma_i gbar_i grad g_i", "−Σ γ<sub>i</sub> ḡ<sub>i</sub> ∇g<sub>i</sub>"),
        ("e_i' N, h' x", "e<sub>i</sub>ᵀ N, hᵀ x"),
        ("Hess L = Hess g - sum lambda_k Hess x_k", "Hess L = Hess g − Σ λ<sub>k</sub> Hess x<sub>k</sub>"),
        ("gradient of the task's summary", "gradient of the task&#39;s summary"),
        ("a < b & c", "a &lt; b &amp; c"),
        (None, ""),
    ],
)
def test_formulas_are_set_in_the_letters_of_the_page(typed: str | None, read: str) -> None:
    """Names become letters, primes transposes, indices go below; prose and markup stay what they are."""
    assert mathematics(typed) == read
