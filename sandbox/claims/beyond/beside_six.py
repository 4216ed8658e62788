"""How answers are named, and their errors shown beside those of (6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sandbox.claims.exhibit import Heat
from sandbox.closed_form import CLOSED_FORMS

FORMS = tuple(name for name, form in CLOSED_FORMS.items() if form.task == "exact")
NORMAL_EQUATIONS = ("eq2_5", "finsler")
"""The closed forms that form J V J' for some V; their error grows as the square of a condition number."""

WORDS = {
    "eq6": "(6)", "eq6_orthonormal": "(6), orthonormal $N_J$", "eq2_5": "(2)–(5)", "printed": "(2)–(5), explicit inverses",
    "null_space": "null-space method", "kkt": "bordered (KKT) system", "weighted_pseudoinverse": "$L^{-T}(J L^{-T})^+$ by SVD",
    "finsler": "(2)–(5) on $W + c J^T J$",
}  # fmt: skip
"""The closed forms, and (2)-(5) as printed."""


def heat(caption: str, rows: Mapping[str, Sequence[float]], six: Sequence[float], columns: Sequence[str]) -> Heat:
    """Each number over that of (6), the number itself in the cell."""
    values = [[_ratio(a, b) for a, b in zip(row, six, strict=True)] for row in rows.values()]
    words = [[f"{a:.1e}" if np.isfinite(a) else "no answer" for a in row] for row in rows.values()]
    return Heat(caption, "arm and weight", "answered by", tuple(columns), tuple(rows), values, 1.0, words)


def _ratio(a: float, b: float) -> float | None:
    return a / b if np.isfinite(a) and np.isfinite(b) and a > 0 and b > 0 else None
