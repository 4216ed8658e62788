"""Two runs side by side as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def write_comparison(found: dict[str, Any], out: Path) -> Path:
    """x."""
    raise NotImplementedError
