"""From tables to one HTML file: templates, number formats, and data embedded so that no request leaves the page."""

from __future__ import annotations

import base64
import gzip
import json
import math
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

import jinja2
from markupsafe import Markup, escape

_HERE = Path(__file__).parent
ASSETS = _HERE / "assets"

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' blob:; img-src data: blob:; font-src data:"
)
"""Nothing is fetched; plots are drawn by the embedded script."""

_KEYS = {
    "verdict": "v", "backend": "b", "formulation": "f", "task": "t", "settings": "s", "expected": "x", "set": "set",
    "apart": "p", "case": "case",
}  # fmt: skip


def embedded(content: bytes) -> str:
    """`content` as gzip in base64: safe inside a script element, unpacked by DecompressionStream."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def embedded_json(content: Any) -> str:
    """JSON, embedded."""
    return embedded(json.dumps(content, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode())


def asset(name: str) -> str:
    """A style sheet or script of this package that stands inside its element as it is."""
    text = (ASSETS / name).read_text(encoding="utf-8")
    if "</script" in text.lower() or "</style" in text.lower():
        raise ValueError(f"{name} would end the element that holds it")
    return text


def number(value: float | None, digits: int = 2) -> str:
    """A number to read, a dash where there is none: 0.25, 12.3, 3.1e−9."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if 1e-2 <= abs(value) < 1e4:
        return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}".replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "−")


def seconds(value: float | None) -> str:
    """A time with its unit: 82 µs, 1.4 ms, 2.0 s."""
    if value is None or not math.isfinite(value):
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value * 1e9:.3g} ns"


def percent(part: float | None, whole: float | None = 1.0) -> str:
    """A share; 100 % and 0 % only where it is all or none."""
    if part is None or not whole:
        return "–"
    share = 100 * part / whole
    if 0 < share < 1 or 99 < share < 100:
        return f"{math.floor(share * 10) / 10:.1f} %" if share > 50 else f"{max(share, 0.1):.1f} %"
    return f"{share:.0f} %"


def count(value: float | None) -> str:
    """A count with thousands set apart."""
    return "–" if value is None else f"{value:,.0f}"


def counted(words: str, value: int) -> str:
    """The words of a verdict for so many answers: 1 refusal, 2 refusals."""
    if value == 1 or not words.endswith(("success", "refusal", "limit")):
        return words
    return words + ("es" if words.endswith("s") else "s")


def plural(value: int, noun: str, nouns: str | None = None) -> str:
    """A count with its noun: 1 problem, 2,000 problems, 2 crashes."""
    return f"{count(value)} {noun if value == 1 else nouns or noun + 's'}"


def breakable(name: str) -> Markup:
    """A name that may break after its underscores and colons."""
    return Markup(str(escape(name)).replace("_", "_<wbr>").replace(":", ":<wbr>"))


def link(**filters: Any) -> str:
    """The fragment that shows the cases which pass the filters."""
    present = {_KEYS[name]: value for name, value in filters.items() if value is not None}
    return "#" + urlencode(present, quote_via=quote, safe=":+" if "case" not in present else ":")


def case_key(row: Mapping[str, Any]) -> str:
    """The name of one case in links: it is the same in every page made from the run."""
    parts = [row["problem"], row["backend"], row.get("formulation") or "", row.get("settings") or "", row.get("task") or ""]
    return "~".join([*parts, *([str(row["repeat"])] if row.get("repeat") else [])])


def web_address(text: Any) -> bool:
    """Whether `text` may stand in a link."""
    return isinstance(text, str) and text.startswith(("https://", "http://"))


def render(template: str, **context: Any) -> str:
    """A template of this package with its data; every value is escaped."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE / "templates"), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {
        "number": number, "seconds": seconds, "percent": percent, "count": count, "case_key": case_key, "web": web_address,
        "counted": counted, "plural": plural, "breakable": breakable,
    }  # fmt: skip
    environment.globals |= {"link": link, "policy": CONTENT_SECURITY_POLICY}
    return environment.get_template(template).render(**context)


def write(text: str, path: Path) -> None:
    """Write a page whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
