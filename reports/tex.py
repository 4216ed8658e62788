"""TeX as MathML: `$...$` inside a text, and displayed formulae. What cannot be read stands as its source; nothing raises."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from xml.etree import ElementTree

from latex2mathml.converter import convert
from markupsafe import Markup, escape

Element = ElementTree.Element

_INLINE = re.compile(r"(?<!\\)\$(.+?)(?<!\\)\$", re.DOTALL)

_POWER = re.compile(r"(?<=\d)e([+-])0*(\d+)\b")

_MARKS = re.compile(r"[.,;:!?)\]’”-]+")

_RELATIONS = "=<>≤≥≠≈∈×·→±≪≫∼≡≺≻⪰⪯∩∪⊂⊆"

_LONGEST = 4000
"""Letters of TeX: what is longer is no formula."""

_CHILDREN = {
    "math": None, "mrow": None, "mi": 0, "mn": 0, "mo": 0, "mtext": 0, "mspace": 0, "mfrac": 2, "msqrt": None, "mroot": 2,
    "msub": 2, "msup": 2, "msubsup": 3, "munder": 2, "mover": 2, "munderover": 3, "mtable": None, "mtr": None, "mtd": None,
    "mstyle": None, "mpadded": None, "mphantom": None,
}  # fmt: skip
"""The elements of MathML that a page may hold, and how many children each has."""

_ATTRIBUTES = {
    "accent": r"true|false", "stretchy": r"true|false", "fence": r"true|false", "separator": r"true|false",
    "movablelimits": r"true|false", "largeop": r"true|false", "symmetric": r"true|false", "displaystyle": r"true|false",
    "form": r"prefix|infix|postfix", "mathvariant": r"normal", "scriptlevel": r"[+-]?\d", "width": r"-?[\d.]+em",
    "lspace": r"-?[\d.]+em", "rspace": r"-?[\d.]+em", "linethickness": r"[\d.]+(em|px)?", "columnalign": r"[a-z ]+",
    "minsize": r"[\d.]+em", "maxsize": r"[\d.]+em",
}  # fmt: skip
"""Attributes that say how a formula is set, with the values they may have."""

_ACCENTS = {
    "˙": "\u0307", "¨": "\u0308", "¯": "\u0304", "ˉ": "\u0304", "―": "\u0304", "~": "\u0303", "˜": "\u0303",
    "^": "\u0302", "ˆ": "\u0302", "→": "\u20d7",
}  # fmt: skip
"""Accents, and the mark that sets each above a letter in plain text."""

_SIGNS = ("−", "-", "+", "±", "∓")
_CLOSING = (")", "]", "}", "|", "‖", "!", "′")

_SUPERSCRIPTS = str.maketrans("0123456789+−-=()nTij⊤′", "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻⁻⁼⁽⁾ⁿᵀⁱʲᵀ′")
_SUBSCRIPTS = str.maketrans("0123456789+−-=()aehijklmnoprstuvx", "₀₁₂₃₄₅₆₇₈₉₊₋₋₌₍₎ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ")


class _Unreadable(Exception):
    """TeX that gives no sound MathML."""


def text(words: str) -> Markup:
    r"""Words with their `$...$` as inline MathML, all else escaped; `\$` is a dollar."""
    out, parts = Markup(""), _parts(words)
    for k, (part, math) in enumerate(parts):
        if not math:
            out += escape(part)
        elif k + 1 < len(parts) and (mark := _MARKS.match(parts[k + 1][0])):  # no line begins with a comma
            out += Markup('<span class="held">{}{}</span>').format(_math(part, "inline"), mark[0])
            parts[k + 1] = (parts[k + 1][0][mark.end() :], False)
        else:
            out += _math(part, "inline")
    return out


def formula(tex: str) -> Markup:
    """A displayed formula."""
    return _math(tex, "block")


def plain(words: str) -> str:
    r"""Words with their `$...$` in letters and marks alone, for a title or the label of an axis: q̇, J⁻¹, N_J."""
    return unicodedata.normalize("NFC", "".join(_flat(part) if math else part for part, math in _parts(words)))


def _parts(words: str) -> list[tuple[str, bool]]:
    """Text and TeX in turns; a dollar without its second is a dollar, and a power of ten as the page has it, 8e−6."""
    out: list[tuple[str, bool]] = []
    place = 0
    for found in _INLINE.finditer(words):
        out += [(words[place : found.start()], False), (found[1], True)]
        place = found.end()
    out.append((words[place:], False))
    return [(part if math else _POWER.sub(_power, part.replace(r"\$", "$")), math) for part, math in out if part]


def _power(found: re.Match[str]) -> str:
    return f"e{'−' if found[1] == '-' else ''}{found[2]}"


@lru_cache(maxsize=4096)
def _math(tex: str, display: str) -> Markup:
    try:
        root = _read(tex)
    except _Unreadable:
        return Markup('<code class="tex">{}</code>').format(tex)
    root.set("display", display)
    root.set("alttext", tex.strip())
    return Markup(ElementTree.tostring(root, encoding="unicode"))


@lru_cache(maxsize=4096)
def _flat(tex: str) -> str:
    try:
        return re.sub(r"(?<=[(\[{]) | (?=[)\]}])", "", " ".join(_told(_read(tex)).split()))
    except _Unreadable:
        return tex


def _read(tex: str) -> Element:
    """Sound MathML, each element one that a page may hold."""
    if len(tex) > _LONGEST or not tex.strip():
        raise _Unreadable
    try:
        return _checked(_mended(_stripped(ElementTree.fromstring(_declared(convert(tex))))))
    except _Unreadable:
        raise
    except (Exception, RecursionError) as error:  # whatever a reader of TeX meets in what is no TeX
        raise _Unreadable from error


def _declared(xml: str) -> str:
    """The converter leaves an ampersand that it was given as it is."""
    return re.sub(r"&(?!#x[0-9A-Fa-f]+;|#\d+;|(?:amp|lt|gt|quot|apos);)", "&amp;", xml)


def _stripped(element: Element) -> Element:
    """Without the name space: inside HTML the elements are MathML by their name."""
    for part in element.iter():
        part.tag = part.tag.rsplit("}", 1)[-1]
    return element


def _mended(element: Element) -> Element:
    """What the converter gets wrong: scripts of a matrix, its brackets, upright words letter by letter, accents."""
    for part in list(element):
        _mended(part)
    wanted = _CHILDREN.get(element.tag)
    if element.tag in ("msub", "msup", "msubsup") and wanted and len(element) > wanted:
        _wrap(element, 0, len(element) - wanted + 1)  # [ table ] and its scripts
    if element.tag in ("mrow", "math", "mtd", "msqrt", "mstyle"):
        _bracketed(element)
        _joined(element)
        _spaced(element)
    if element.tag == "mi" and element.text and element.text in _RELATIONS:  # typed as it is
        element.tag = "mo"
    if element.tag == "mover" and len(element) == 2 and element[1].tag == "mo" and element[1].text in _ACCENTS:
        element.set("accent", "true")
        element[1].set("stretchy", "false")
    return element


def _wrap(element: Element, first: int, last: int) -> None:
    """Children first, ..., last - 1 in a row of their own."""
    row = ElementTree.Element("mrow")
    for part in list(element)[first:last]:
        element.remove(part)
        row.append(part)
    element.insert(first, row)
    _bracketed(row)


def _bracketed(element: Element) -> None:
    """Brackets around a table stretch: they open and close a row."""
    for k in range(len(element) - 3, -1, -1):
        first, table, last = list(element)[k : k + 3]
        if (first.tag, table.tag, last.tag) == ("mo", "mtable", "mo"):
            for part, form in ((first, "prefix"), (last, "postfix")):
                part.attrib |= {"form": form, "stretchy": "true", "fence": "true"}
            if len(element) > 3:
                _wrap(element, k, k + 3)
                return _bracketed(element)


def _joined(element: Element) -> None:
    """A word set upright is one name; a comma between thousands is no separator."""
    word: Element | None = None
    for part in list(element):
        if not _upright(part):
            word = None
        elif word is None:
            word = part
        else:
            word.text = f"{word.text}{part.text}"
            element.remove(part)
    for part in element:
        if _upright(part) and len(part.text or "") > 1:
            del part.attrib["mathvariant"]  # as any name of several letters
    if len(element) == 1 and element[0].tag == "mo" and element[0].text == ",":
        element[0].attrib |= {"lspace": "0em", "rspace": "0em"}


def _spaced(element: Element) -> None:
    """Space as TeX sets it: none after a sign, a gradient or a bar, a thin one around the name of a function."""
    before: Element | None = None
    for part in list(element):
        if part.tag == "mo" and not part.get("form"):
            if part.text in ("∇", "∂"):
                part.tag, part.attrib = "mi", {"mathvariant": "normal"}
            elif part.text in ("|", "‖", "∣", "∥"):
                part.attrib |= {"stretchy": "false", "lspace": "0em", "rspace": "0em"}
            elif part.text in _SIGNS and (before is None or (before.tag == "mo" and before.text not in _CLOSING)):
                part.set("form", "prefix")
        after = before is not None and _named(before) and part.tag not in ("mo", "mspace")
        if after or (before is not None and _letter(before) and _named(part)):
            element.insert(list(element).index(part), Element("mspace", {"width": "0.167em"}))
        before = part


def _named(element: Element) -> bool:
    """The name of a function, with or without its index."""
    first = element[0] if element.tag in ("msub", "msup", "msubsup") else element
    return first.tag == "mi" and len(first.text or "") > 1


def _letter(element: Element) -> bool:
    return element.tag in ("mi", "mn", "msub", "msup", "msubsup", "mover")


def _upright(element: Element) -> bool:
    return element.tag == "mi" and element.get("mathvariant") == "normal" and (element.text or "").isalpha()


def _checked(element: Element) -> Element:
    for part in element.iter():
        wanted = _CHILDREN.get(part.tag, -1)
        if wanted == -1 or (wanted is not None and len(part) != wanted):
            raise _Unreadable
        if "\\" in (part.text or "") or (part.tail or "").strip():  # a command that the converter does not know
            raise _Unreadable
        for name, value in list(part.attrib.items()):
            if name not in _ATTRIBUTES or not re.fullmatch(_ATTRIBUTES[name], value):
                del part.attrib[name]
    return element


def _told(element: Element) -> str:
    """A formula in letters and marks."""
    tag, parts = element.tag, [_told(part) for part in element]
    if tag in ("msub", "msup", "msubsup", "munder", "munderover"):
        base, *scripts = parts
        for script, kind in zip(scripts, ("up",) if tag == "msup" else ("down", "up"), strict=False):
            base += _script(script, kind)
        return base
    if tag == "mover":
        return parts[0] + (_ACCENTS.get(parts[1].strip()) or f"^{parts[1]}")
    if tag == "mfrac":
        return f" {'/'.join(f'({part})' if len(part) > 2 else part for part in parts)} "
    if tag in ("msqrt", "mroot"):
        return f"√({''.join(parts)})"
    if tag == "mtable":
        return "; ".join(parts)
    if tag == "mtr":
        return ", ".join(parts)
    if tag == "mspace":
        return " "
    if tag == "mo" and (element.text or "") in _RELATIONS and element.text:
        return f" {element.text} "
    if tag in ("mi", "mo") and len(element.text or "") > 1:
        return f" {element.text} "
    return (element.text or "") + "".join(parts)


def _script(words: str, kind: str) -> str:
    words = words.strip()
    table = _SUPERSCRIPTS if kind == "up" else _SUBSCRIPTS
    if words and all(ord(letter) in table for letter in words):
        return words.translate(table)
    return f"{'^' if kind == 'up' else '_'}{words}" if len(words) == 1 else f"{'^' if kind == 'up' else '_'}({words})"
