"""TeX becomes sound MathML, and nothing else."""

from __future__ import annotations

import re
import unicodedata
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports import tex

SIX = r"\dot q = \begin{bmatrix} J \\ N_J^T W \end{bmatrix}^{-1} \begin{bmatrix} \dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
SOUND = [
    SIX, r"\dot q", r"N_J^T W N_J > 0", r"\frac{1}{2} \dot q^T W \dot q", r"\bar N_J \tilde W \hat J", r"10^{-3}",
    r"\sqrt{\kappa}", r"\|x\|_2", r"W_{\dot x}", r"\ne 0",
    r"\left(\frac{a}{b}\right)", r"\mathrm{cond}\,J", r"\sum_{i=1}^{n-m} \gamma_i \nabla g_i",
]  # fmt: skip
BROKEN = [r"\frac{1", r"\nothing{x}", r"\begin{bmatrix} 1", "{" * 3000, "x" * 10_000, " ", r"\hline", r"\left( x"]


def elements(markup: str) -> list[ElementTree.Element]:
    """All elements of what was made; a value that is no XML fails here."""
    return list(ElementTree.fromstring(f"<x>{markup}</x>").iter())[1:]


@pytest.mark.parametrize("source", SOUND)
def test_a_formula_is_mathml_that_names_its_source(source: str) -> None:
    """Every element has the children that MathML gives it, and the TeX stands beside for who does not see it."""
    found = elements(tex.formula(source))
    assert found[0].tag == "math" and found[0].get("display") == "block" and found[0].get("alttext") == source.strip()
    children = {"msub": 2, "msup": 2, "mover": 2, "mfrac": 2, "msubsup": 3}
    assert all(len(part) == children[part.tag] for part in found if part.tag in children)
    assert elements(tex.text(f"${source}$"))[0].get("display") == "inline"


@pytest.mark.parametrize("source", BROKEN)
def test_broken_tex_stands_as_its_source(source: str) -> None:
    """What cannot be read is shown as it was written, escaped, in a code element."""
    assert tex.formula(source) == f'<code class="tex">{source}</code>'


def test_a_matrix_with_an_exponent_keeps_brackets_that_stretch() -> None:
    """In (6) the inverse stands on the whole matrix, and the brackets of both open and close a row of their own."""
    found = elements(tex.formula(SIX))
    power = next(part for part in found if part.tag == "msup" and part.find(".//mtable") is not None)
    assert [part.tag for part in power[0]] == ["mo", "mtable", "mo"] and "".join(power[1].itertext()) == "−1"
    fences = [part for part in found if part.tag == "mo" and part.text in ("[", "]")]
    assert [part.get("form") for part in fences] == ["prefix", "postfix"] * 2
    assert all(part.get("stretchy") == "true" for part in fences)


def test_accents_names_and_signs_are_set_as_tex_sets_them() -> None:
    """Dots hug their letter, an upright word is one name with a thin space, a gradient and a first sign stand close."""
    assert elements(tex.formula(r"\dot q"))[2].get("accent") == "true"
    assert [part.text for part in elements(tex.formula(r"\mathrm{cond} J")) if part.tag == "mi"] == ["cond", "J"]
    assert [part.tag for part in elements(tex.formula(r"\ln x")) if part.tag != "mrow"] == ["math", "mi", "mspace", "mi"]
    assert [part.tag for part in elements(tex.formula(r"a \nabla f"))][2:] == ["mi", "mi", "mi"]
    minus = [part.get("form") for part in elements(tex.formula(r"a = -b - c")) if part.text == "−"]
    assert minus == ["prefix", None]


def test_text_outside_the_dollars_is_escaped() -> None:
    """Tags are shown, not obeyed; an escaped dollar and a lone one are dollars."""
    assert tex.text(r"<b> & \$5 $x") == "&lt;b&gt; &amp; $5 $x"
    made = tex.text(r"for $a < b$ <i>")
    assert [part.tag for part in elements(made)] == ["math", "mrow", "mi", "mo", "mi"] and made.endswith("&lt;i&gt;")


@given(st.text(alphabet=r"\{}[]$^_&<>'\"ab1+-=fracdotqmatrixbegin " + "é\u0000\u202e", max_size=60))
def test_no_text_raises_or_leaves_mathml(source: str) -> None:
    """What comes out are MathML elements without links, scripts or styles, code, or what holds a comma to its formula."""
    for made in (tex.text(source), tex.text(f"${source}$"), tex.formula(source)):
        tags = set(re.findall(r"<([a-zA-Z]\w*)", made))
        assert tags <= {*tex._CHILDREN, "code", "span"}
        assert not re.search(r"<[^>]*\s(on\w+|href|style|src)\s*=", re.sub(r'alttext="[^"]*"|<code.*?</code>', "", made))
    assert isinstance(tex.plain(source), str)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (r"$\dot q$ of $J^{-1}$", "q̇ of J⁻¹"),
        ("$W > 0$", "W > 0"),
        (r"$\lambda_{\min}$", "λₘᵢₙ"),
        (SIX.join("$$"), "q̇ = [J; N_JᵀW]⁻¹[ẋ; −αN_Jᵀ∇f]"),
        (r"a $\frac{1$ b", r"a \frac{1 b"),
        ("cond J [m/s]", "cond J [m/s]"),
    ],
)
def test_a_title_has_letters_and_marks_alone(source: str, words: str) -> None:
    """Where MathML cannot stand, TeX is told in plain letters."""
    assert tex.plain(source) == unicodedata.normalize("NFC", words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("up to 1.3e-03 m", "up to 1.3e−3 m"), ("1e+06 samples", "1e6 samples"), ("4.0e-10, 2e-7", "4.0e−10, 2e−7"),
        ("table-1, v2e, the-3", "table-1, v2e, the-3"), ("1e-00", "1e−0"),
    ],
)  # fmt: skip
def test_a_power_of_ten_is_written_as_numbers_of_the_page_are(words: str, said: str) -> None:
    """Captions and labels say 8e−6 where a program would print 8e-06."""
    assert tex.plain(words) == said and str(tex.text(words)) == said
