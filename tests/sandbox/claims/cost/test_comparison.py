"""How counts are compared and shown."""

from __future__ import annotations

from fractions import Fraction

from sandbox.claims import operation_counts as counts
from sandbox.claims.cost import comparison, tables
from sandbox.claims.exhibit import Heat
from sandbox.claims.operation_counts import ROWS
from sandbox.closed_form.uncompiled import operations


def test_where_it_holds_is_said_by_redundancy_or_by_rows() -> None:
    """Nowhere, everywhere, runs that end at the largest n, that do not, and the shorter of the two ways to say it."""
    cells = comparison.cells(5)
    assert comparison.span(dict.fromkeys(cells, False), 5) == "nowhere"
    assert comparison.span(dict.fromkeys(cells, True), 5) == "everywhere"
    assert comparison.span({(n, m): n == m + 1 for n, m in cells}, 5) == "$n - m = 1$"
    assert comparison.span({(n, m): n == m + 1 and n != 3 for n, m in cells}, 5) == "$n - m = 1$ with $n = 2$ and $n ≥ 4$"
    assert comparison.span({(n, m): n == m + 1 and n < 5 for n, m in cells}, 5) == "$n - m = 1$ with $2 ≤ n ≤ 4$"
    assert comparison.span({(n, m): m == 1 for n, m in cells}, 5) == "$m = 1$"


def test_a_heat_has_n_across_and_redundancy_down() -> None:
    """Row k, column n holds the value at m = n - k; there is none where m < 1."""
    heat = comparison.heat("caption", {(n, m): Fraction(n, m) for n, m in comparison.cells(4)})
    assert isinstance(heat, Heat)
    assert (heat.columns, heat.rows) == (("2", "3", "4"), ("1", "2", "3"))
    assert heat.values == [[2.0, 1.5, 4 / 3], [None, 3.0, 2.0], [None, None, 4.0]]


def test_a_count_that_differs_is_shown() -> None:
    """Both kinds of operation must agree, and the first disagreement is named."""
    roots = tables.roots_counted(operations)
    check = comparison.same_count("says", roots, counts.table_1, ROWS, [(7, 6)])
    assert not check.holds and check.count == 8
    assert check.found == "2 of 4; the first that does not: (336, 275) against (330, 275)"
    assert comparison.same_count("says", operations, counts.table_1, ROWS, [(7, 6)]).holds
    assert not comparison.same_count("says", operations, counts.table_1, ROWS, []).holds


def test_square_roots_are_those_of_two_cholesky_factors() -> None:
    """There are m for J W^-1 J', n for W; (6) takes none."""
    for row, roots in zip(ROWS, (6, 13, 0, 0), strict=True):
        plain, with_roots = (comparison.counted(path, row, (7, 6)) for path in (operations, tables.roots_counted(operations)))
        assert with_roots == plain + counts.Count(roots)
