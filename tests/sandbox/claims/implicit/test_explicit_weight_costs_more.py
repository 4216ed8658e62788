"""Operation formulas, and the ranges found by counting."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.implicit.explicit_weight_costs_more import FORMS, counted, formulas, percent, reach
from sandbox.implicit_study import ROWS

FRESH = (9, 11, 14)
"""Numbers of joints that the page does not show."""


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("family", ROWS)
def test_formulas_hold_at_sizes_they_were_not_made_from(form, family):
    """Counted operations and polynomials in n are equal to the last one at other numbers of joints and columns."""
    for n in FRESH:
        for k in (1, 2, 5):
            assert counted(form, family, n, k) == formulas(np.polyval, form, family, n, k)


def test_formulas_are_those_of_products():
    """At n = 3, k = 2: E'E takes 2 * 30 - 6 operations with the product, (N'E')E 2 * 3 * 7."""
    assert formulas(np.polyval, "augmented", "planar", 3, 2) == (54, 42)


def test_the_range_is_found_by_counting():
    """A count under which two columns save and three do not is told as k <= 2, from the first n that saves on."""

    def count(form, family, n, k):
        return 10, (12 if n < 4 or k > 2 else 8)

    assert all(reach(count, form, (7, 10)) == (4, "k ≤ 2", "k ≤ 2") for form in FORMS)
    assert reach(lambda form, family, n, k: (1, int(n < 3)), "inertia", (7,)) == (3, "any k < 7")


def test_per_cent_with_a_true_minus():
    """Three digits, and the sign of a loss."""
    assert (percent(0.26244), percent(-0.62)) == ("26.2 %", "−62 %")
