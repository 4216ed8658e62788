"""The methods that the introduction speaks of."""

from __future__ import annotations

from sandbox.claims import introduction


def test_nineteen_methods_are_exact():
    """M1 to M19; the two that the paper names are outside."""
    assert [method.id for method in introduction.EXACT] == [f"M{i}" for i in range(1, 20)]
    assert [method.id for method in introduction.OUTSIDE] == ["C1", "C2"]
