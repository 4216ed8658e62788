"""The page of a paper's claims says what the run folder holds."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from reports import page, paper
from reports.paper import write_paper
from sandbox.claims.claim import Check, Role, State
from sandbox.claims.exhibit import Axis, Plot, Series
from sandbox.errors import InputFileError
from sandbox.records import CHECKS, CLAIMS, EXHIBITS, write_json, write_parquet
from tests.reports.synthetic_paper import HOSTILE, LONG, Row, rows, write_paper_run


class Outline(HTMLParser):
    """Elements that are open at the end, ids, links inside the page, and the text."""

    VOID = ("meta", "img", "br", "link", "input", "hr", "wbr")

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tags: set[str] = set()
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep id, link and tag."""
        held = dict(attrs)
        self.tags.add(tag)
        self.ids += [held["id"]] if held.get("id") else []
        self.links += [held["href"] or ""] if tag == "a" else []
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """What closes is what was open."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Keep what a reader sees."""
        if not {"script", "style"} & set(self.open):
            self.text += data


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page of the made-up run."""
    folder = tmp_path_factory.mktemp("paper")
    write_paper_run(folder / "run")
    return write_paper(folder / "run", folder / "paper.html").read_text()


def article(text: str, name: str) -> str:
    """The part of one claim."""
    return re.search(rf'<article [^>]*id="{name}".*?</article>', text, re.DOTALL)[0]  # type: ignore[index]


def test_the_page_is_one_sound_file_without_addresses(text: str) -> None:
    """Elements close, ids are unique, every link leads somewhere in the page, and nothing is fetched."""
    outline = Outline(text)
    assert outline.open == [] and len(outline.ids) == len(set(outline.ids))
    assert all(link.startswith("#") and link[1:] in outline.ids for link in outline.links)
    assert page.CONTENT_SECURITY_POLICY in text.replace("&#39;", "'")
    head = text.split('<script type="application/octet-stream"')[0]
    assert not re.search(r"https?://", head) and len(text.encode()) < paper.LARGEST


def test_every_claim_is_an_article_in_the_order_of_the_paper(text: str) -> None:
    """Sections follow one another as in the paper, and each claim stands in the section that its place names."""
    assert re.findall(r'<article [^>]*id="(\w+)"', text) == [
        "holds", "with_an_erratum", "refuted", "in_a_range", "broken", "hostile", "bare"
    ]  # fmt: skip
    assert re.findall(r'<section id="section-(\w+)" class="part"', text) == ["ii", "iii", "iv", "v", "vii"]


@pytest.mark.parametrize(
    ("where", "section"),
    [
        ("Section II, eqs. (2)–(6)", "II"), ("Section VII", "VII"), ("Section III, after eq. (10)", "III"),
        ("eq. (6)", "II"), ("eqs. (8)–(10)", "III"), ("eq. (13)", "VI"), ("Table II", "IV"), ("Table III", "V"),
        ("Fig. 1", "V"), ("footnote 2", "II"), ("footnote 3", "IV"), ("Abstract", ""), ("beyond the paper", "beyond"),
        ("Section V, beyond the paper", "V"), ("?", None),
    ],
)  # fmt: skip
def test_a_place_lies_in_a_section(where: str, section: str | None) -> None:
    """Where a place names no section, its equation, table or figure does."""
    assert paper.section(where) == section


def test_the_summary_counts_the_states_and_the_faults(text: str) -> None:
    """Each state has its count, its letter and its words; faults that were not noticed are seen."""
    counts = {state: sum(row.state is state for row in rows()) for state in State}
    for state, count in counts.items():
        kind, letter, _ = paper.STATES[state]
        tile = re.search(rf'<div class="tile s-{kind}[^>]*>(.*?)</div>', text, re.DOTALL)[1]  # type: ignore[index]
        assert f'<span class="figure">{count}</span> <span class="words">{state}</span>' in tile and letter in tile
    assert '<span class="figure">6<small> of 7</small></span> <span class="words">planted faults noticed' in text
    assert "Of 7 claims 2 reproduced, 1 reproduced with a range" in text
    assert "not noticed" in article(text, "broken") and "not noticed" not in article(text, "holds")
    assert len({letter for _, letter, _ in paper.STATES.values()}) == len(State)


def test_each_claim_shows_what_it_rests_on(text: str) -> None:
    """State, place, sentence, formula, test, acceptance, both paths, checks, fault, command, seed and time."""
    said = Outline(article(text, "holds")).text
    for words in (
        "reproduced", "Section II, eq. (6)", "has full row rank", "of every size", "the sum of the bounds", "eq. (6)",
        "sandbox.closed_form.eq6:eq6", "sandbox.claims.equations:liegeois", "0.0310", "≤ 1", "1,600", "the claim", "holds",
        "turned", "not reproduced", "noticed", "sandbox paper --claim holds --seed 0", "seed 0, 1.25 s", "A work, 1977",
    ):  # fmt: skip
        assert words in said, words
    assert '<math display="block"' in article(text, "holds")


def test_a_range_and_a_correction_stand_out(text: str) -> None:
    """The sentence of a check that limits or corrects the claim stands above its checks; one that holds is only a note."""
    limited, corrected = article(text, "in_a_range"), article(text, "with_an_erratum")
    assert "Where it holds:" in limited and limited.index("Where it holds:") < limited.index("What is asked")
    assert "As corrected:" in corrected and "outcome" not in article(text, "holds")
    assert '<span class="no expected">' in limited and '<span class="no">' in article(text, "refuted")


def test_many_checks_of_one_pattern_fold_into_a_line(text: str) -> None:
    """Twelve alike make one line with their range and the sum of their cases, and unfold; what fails stays outside."""
    own = article(text, "holds")
    assert re.search(r'<tr class="fold">.*12 checks.*3.00e−3.* to .*8.00e−3.*≤ 1.*600.*all hold', own)
    assert re.search(r"<details.*?</details>", own, re.DOTALL)[0].count("<tr><th") == 1 + 12  # type: ignore[index]
    many = [Check(f"agreement, $n = {n}$", n != 5, 0.1 * n, "≤ 1", 10) for n in range(12)]
    groups = list(paper._groups([check.__dict__ for check in many]))
    assert [len(group["rows"]) for group in groups] == [1, 11] and not groups[0]["rows"][0]["holds"]
    assert [len(group["rows"]) for group in paper._groups([check.__dict__ for check in many[6:]])] == [6]


def test_tables_mark_what_the_paper_prints(text: str) -> None:
    """A printed column has its tag, numbers are set right and read well, and what is no number is a dash."""
    own = article(text, "hostile")
    assert re.search(r'<th scope="col" class="num paper">printed <span class="tag">paper</span></th>', own)
    assert '<td class="num paper"><span class="number">330</span></td>' in own
    assert '<span class="number">1.00e−300</span>' in own and '<span class="number">−7</span>' in own
    assert '<td class="num "><span class="number">–</span></td>' in own or '<td class="num ">–</td>' in own
    assert LONG in own and "no rows" in own


def test_no_text_of_a_run_becomes_markup(text: str) -> None:
    """Whatever a claim holds is shown as it stands."""
    outline = Outline(text)
    assert not outline.tags & {"img", "b"} and text.count("<script") == 4
    assert "onerror='window.hacked" not in text and HOSTILE in outline.text and "{{ 7 * 7 }}" in outline.text
    assert '<code class="tex">\\nothing{x}</code>' in text


def test_every_plot_is_drawn_and_described_without_a_script(text: str) -> None:
    """As many drawings as plots, each inside a figure with a caption, and its data for the script under its key."""
    shown = [one for row in rows() for one in row.exhibits if one.kind != "table"]
    assert text.count('<svg class="drawing"') == text.count("<figcaption>") == len(shown)
    assert len(re.findall(r"<desc>[^<]{20,}", text)) == len(shown)


def test_a_page_too_large_draws_fewer_points_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where points do not fit, each series keeps as many as fit, and the caption counts them."""
    import numpy as np

    x = np.random.default_rng(0).random((2, 9000))
    heavy = Plot("Heavy", Axis("x"), Axis("y"), (Series("s", x[0], x[1]),))  # type: ignore[arg-type]
    write_paper_run(tmp_path / "run", [replace(rows()[0], exhibits=(heavy,))])
    whole = write_paper(tmp_path / "run", tmp_path / "a.html").read_text()
    assert "drawn:" not in whole
    monkeypatch.setattr(paper, "LARGEST", len(whole) - 60_000)
    fewer = write_paper(tmp_path / "run", tmp_path / "b.html").read_text()
    assert len(fewer) <= len(whole) - 60_000 and re.search(r"drawn: [\d,]+ of 9,000 of s", fewer)


def test_a_run_without_claims_and_one_broken_off_say_so(tmp_path: Path) -> None:
    """No claim, no time, no exhibit: the page stands and says what is missing; a part without its claim is left out."""
    write_paper_run(tmp_path / "none", [], complete=False, finished=None, timing={}, packages=None, started=None)
    orphan = pa.Table.from_pylist([{"claim": "lost", "place": 0, "kind": "table", "content": "{}"}], EXHIBITS)
    write_parquet(orphan, tmp_path / "none" / "exhibits" / "00-lost.parquet")
    empty = Outline(write_paper(tmp_path / "none", tmp_path / "none.html").read_text())
    assert "This run was broken off and is incomplete: 0 claims had" in empty.text and "No claim was examined" in empty.text
    write_paper_run(tmp_path / "one", [Row("only", State.REPRODUCED, (Check("c", True, 1, "1"),))], full=False)
    said = Outline(write_paper(tmp_path / "one", tmp_path / "one.html").read_text()).text
    assert "The claim is reproduced." in said and "reduced size" in said


def test_a_run_of_some_claims_says_so(tmp_path: Path) -> None:
    """How many were asked for of how many there are, and how many of those were examined where it was broken off."""
    for about, said in (
        ({"planned": 7, "ledger": 63}, "Only 7 of the 63 claims of the paper were asked for: --claim."),
        ({"planned": 9, "ledger": 9, "complete": False}, "broken off and is incomplete: 7 of 9 claims had been"),
        ({"planned": 9, "ledger": 63, "complete": False}, "Only 9 of the 63 claims of the paper were asked for"),
    ):
        write_paper_run(tmp_path / "run", **about)
        assert said in " ".join(Outline(write_paper(tmp_path / "run", tmp_path / "p.html").read_text()).text.split())
    write_paper_run(tmp_path / "run", planned=7, ledger=7)
    whole = Outline(write_paper(tmp_path / "run", tmp_path / "p.html").read_text()).text
    assert "asked for" not in whole and "broken off" not in whole


def test_a_state_that_its_checks_do_not_say_is_refused(tmp_path: Path) -> None:
    """A state typed into the run, or checks that were lost, are found out."""
    for row in rows()[:4]:
        other = State.REPRODUCED if row.state is not State.REPRODUCED else State.RANGE
        write_paper_run(tmp_path / row.name, [replace(row, state=other)])
        with pytest.raises(InputFileError, match=f"{row.name} is kept as {other}; its checks say {row.state}"):
            write_paper(tmp_path / row.name)


def test_a_row_that_is_silent_or_a_plot_without_numbers_is_refused(tmp_path: Path) -> None:
    """By the column that says nothing; by the claim whose exhibit holds words for numbers."""
    for kind, schema, column in (("claims", CLAIMS, "title"), ("claims", CLAIMS, "place"), ("checks", CHECKS, "says")):
        folder = tmp_path / f"{kind}-{column}"
        write_paper_run(folder, rows()[:1])
        part = next((folder / kind).glob("*.parquet"))
        table = [{**row, column: None} for row in pa.parquet.read_table(part).to_pylist()]
        write_parquet(pa.Table.from_pylist(table, schema), part)
        with pytest.raises(InputFileError, match=f"{kind}: a row has no {column}"):
            write_paper(folder)
    axis, line = {"title": "x"}, {"name": "s", "y": [1]}
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("plot", {"x": axis, "y": axis, "series": [{**line, "x": "words"}]}),
        ("plot", {"x": axis, "y": axis, "series": [{**line, "x": [[1], [2, 3]]}]}),
        ("plot", {"x": axis, "y": axis, "series": [{**line, "x": [1], "role": "theirs"}]}),
        ("plot", {"x": {"title": 7}, "y": axis, "series": []}),
        ("heat", {"x": "x", "y": "y", "columns": ["a"], "rows": ["b"], "values": 3}),
        ("table", {"columns": ["a"], "rows": [["1", "2"]]}), ("table", {"columns": 4, "rows": []}),
    ]  # fmt: skip
    for number, (kind, content) in enumerate(wrong):
        folder = tmp_path / str(number)
        write_paper_run(folder, rows()[:1])
        bad = {"claim": "holds", "place": 9, "kind": kind, "content": json.dumps({"caption": "c"} | content)}
        write_parquet(pa.Table.from_pylist([bad], EXHIBITS), folder / "exhibits" / "99-bad.parquet")
        with pytest.raises(InputFileError, match="an exhibit of holds is not one that this version knows"):
            write_paper(folder)


def test_a_folder_that_is_no_run_of_claims_is_refused(tmp_path: Path) -> None:
    """No run.json, a run of another kind, an unknown state, role or exhibit, a content that is no JSON: each is named."""
    with pytest.raises(InputFileError, match=r"run\.json"):
        write_paper(tmp_path)
    write_paper_run(tmp_path / "other", [], kind="campaign")
    with pytest.raises(InputFileError, match="no run of a paper's claims"):
        write_paper(tmp_path / "other")
    for column, value, words in (("state", "so-so", "'so-so'"), ("fault_state", "?", "'\\?'")):
        folder = tmp_path / column
        write_paper_run(folder, rows()[:1])
        part = next((folder / "claims").glob("*.parquet"))
        table = pa.Table.from_pylist([{**pa.parquet.read_table(part).to_pylist()[0], column: value}], CLAIMS)
        write_parquet(table, part)
        with pytest.raises(InputFileError, match=words):
            write_paper(folder)
    for content, kind in (("{", "table"), ("{}", "plot"), ("[]", "heat"), (json.dumps({"caption": "c"}), "picture")):
        folder = tmp_path / kind
        write_paper_run(folder, rows()[:1])
        bad = pa.Table.from_pylist([{"claim": "holds", "place": 0, "kind": kind, "content": content}], EXHIBITS)
        write_parquet(bad, folder / "exhibits" / "99-bad.parquet")
        with pytest.raises(InputFileError, match="exhibit"):
            write_paper(folder)


def test_the_same_run_gives_the_same_page(tmp_path: Path) -> None:
    """Two pages of one run are equal byte by byte."""
    write_paper_run(tmp_path / "run")
    one, other = (write_paper(tmp_path / "run", tmp_path / name).read_bytes() for name in ("a.html", "b.html"))
    assert one == other


def test_the_page_is_made_without_a_solver(tmp_path: Path) -> None:
    """Neither numba nor a solver, a closed form or a problem is imported to render a run."""
    write_paper_run(tmp_path / "run")
    code = (
        "import sys; from pathlib import Path; from reports.paper import write_paper; "
        f"write_paper(Path({str(tmp_path / 'run')!r}), Path({str(tmp_path / 'p.html')!r})); print(sorted(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(ast.literal_eval(done.stdout))
    solvers = {"numba", "flint", "osqp", "proxsuite", "qpsolvers", "cvxpy", "casadi", "pinocchio", "problems"}
    assert not loaded & {*solvers, "sandbox.closed_form", "sandbox.claims.table", "sandbox.claims.ledger", "sandbox.backends"}


def test_every_state_and_role_has_its_words() -> None:
    """A state or a role that is added has to be explained on the page."""
    assert set(paper.STATES) == set(State) and set(paper.ROLES) == set(Role)


def test_run_json_may_be_silent(tmp_path: Path) -> None:
    """What run.json does not say is a dash."""
    write_paper_run(tmp_path / "run", rows()[:1])
    write_json({"format": 1, "kind": "paper"}, tmp_path / "run" / "run.json")
    assert "Of 1" not in write_paper(tmp_path / "run", tmp_path / "p.html").read_text()
