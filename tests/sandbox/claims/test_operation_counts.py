"""Tables I and II, the text of Section IV added up by hand, and the projection method that is counted beside (6)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sandbox.claims import equations
from sandbox.claims import operation_counts as counts
from sandbox.claims.operation_counts import ROWS, TABLE_I, TABLE_II, Count, Row
from sandbox.tolerances import FORWARD, UNIT

CELLS = [(n, m) for n in range(2, 31) for m in range(1, n)]


@pytest.mark.parametrize("row", ROWS)
def test_the_text_adds_up_to_table_one(row: Row) -> None:
    """The description of Section IV costs what Table I says, for every 1 <= m < n <= 30."""
    assert all(
        counts.accounting(row[0], *cell, weighted=row[1]) == counts.table_1(row[0], *cell, weighted=row[1]) for cell in CELLS
    )


@pytest.mark.parametrize("row", ROWS)
def test_table_two_is_table_one_at_seven_and_six(row: Row) -> None:
    """The printed tables agree with each other."""
    assert counts.table_1(row[0], 7, 6, weighted=row[1]).both == TABLE_II[row]


def test_a_polynomial_that_is_no_integer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A misprint would be noticed, not rounded away."""
    wrong = (((1, 0, 0), *TABLE_I["eq6", True][0]), TABLE_I["eq6", True][1])
    monkeypatch.setitem(TABLE_I, ("eq6", True), wrong)
    with pytest.raises(ValueError, match="no integer at n = 7, m = 6"):
        counts.table_1("eq6", 7, 6, weighted=True)


def test_another_method_has_no_steps() -> None:
    """Section IV describes two methods."""
    with pytest.raises(KeyError, match="kkt"):
        counts.steps("kkt", 7, 6, weighted=False)


@pytest.mark.parametrize("weighted", [False, True])
def test_sparing_the_identity_block_saves_its_products(weighted: bool) -> None:
    """With k = n - m: m k^2 products and m k (k - 1) sums in the null vectors, and with n for m as many in N'W."""
    for n, m in CELLS:
        dense, spared = (counts.accounting("eq6", n, m, weighted=weighted, identity=identity) for identity in (False, True))
        k, rows = n - m, m + n * weighted
        assert dense == spared + Count(rows * k**2, rows * k * (k - 1))


def test_counts_with_the_identity_block_spared() -> None:
    """189 / 154 and 231 / 196 at (7, 6), 201 / 157 at (7, 3)."""
    found = [counts.accounting("eq6", 7, m, weighted=w, identity=True).both for m, w in ((6, False), (6, True), (3, False))]
    assert found == [(189, 154), (231, 196), (201, 157)]


@pytest.mark.parametrize("cheaper, dearer", [(ROWS[2], ROWS[0]), (ROWS[3], ROWS[1]), (ROWS[3], ROWS[0])])
def test_crossings_tend_to_the_limiting_share(cheaper: Row, dearer: Row) -> None:
    """With 2,000 joints the first m at which (6) takes fewer operations is the limiting share of n, up to a thousandth."""
    n = 2000
    fewer = [
        counts.table_1(cheaper[0], n, m, weighted=cheaper[1]).total < counts.table_1(dearer[0], n, m, weighted=dearer[1]).total
        for m in range(1, n)
    ]
    first = fewer.index(True)
    assert all(fewer[first:])
    assert (first + 1) / n == pytest.approx(counts.limiting_share(cheaper, dearer), abs=1e-3)


@pytest.mark.parametrize("identity", [False, True])
def test_the_projection_method_solves_the_problem(identity: bool) -> None:
    """Its joint rates are those of eqs. (2)-(5) as printed with W = I, up to rounding."""
    rng = np.random.default_rng(71)
    for n, m in [cell for cell in CELLS if cell[0] <= 8]:
        J, xdot, gradf = rng.normal(size=(m, n)), rng.normal(size=m), rng.normal(size=n)
        rates = counts.projected(float, J, xdot, gradf, 0.5, identity).astype(float)
        expected = equations.liegeois(J, xdot, np.eye(n), gradf, 0.5)
        assert np.abs(rates - expected).max() <= 2 * FORWARD * n * UNIT * np.linalg.cond(J) ** 2 * np.abs(expected).max()


@pytest.mark.parametrize("identity", [False, True])
def test_the_projection_method_is_exact_on_rationals(identity: bool) -> None:
    """J qdot = xdot, and qdot + alpha grad f lies in the rows of J, with no error at all."""
    J = np.array([[1, 2, 0, 1, 3], [0, 1, 1, -1, 2]])
    xdot, gradf, alpha = np.array([1, -2]), np.array([1, 0, -1, 2, 1]), Fraction(2, 3)
    qdot = counts.projected(Fraction, J, xdot, gradf, alpha, identity)
    assert list(J @ qdot) == list(xdot)
    # null vectors of J, with the first two entries solved for the others
    null = [[2, -1, 1, 0, 0], [-3, 1, 0, 1, 0], [1, -2, 0, 0, 1]]
    assert not (J @ np.array(null).T).any()
    assert all(np.array(vector) @ (qdot + alpha * gradf) == 0 for vector in null)


def test_the_projection_method_counted_is_the_sum_by_hand() -> None:
    """Run on numbers that keep a log, it takes what its steps add up to."""
    for n, m in [cell for cell in CELLS if cell[0] <= 9]:
        for identity in (False, True):
            assert counts.projection_operations(n, m, identity=identity) == counts.projection_accounting(
                n, m, identity=identity
            )


def test_one_degree_of_redundancy_needs_one_division_by_the_length_of_n() -> None:
    """At (7, 6), after LU, qp and n: 7 products for alpha grad f, 6 each for n'z, n'n and the step along n, and a division."""
    lu, particular, null = Count(85, 70), Count(36, 30), Count(21, 15)
    rest = Count(7 + 6 + 6 + 6 + 1, 6 + 6 + 6 + 6)
    assert counts.projection_operations(7, 6, identity=True) == lu + particular + null + rest


def test_a_tally_logs_what_costs_and_nothing_else() -> None:
    """Products, quotients, sums and differences are logged; negation, absolute value and comparison are free."""
    log: list[str] = []
    a, b = counts.Tally(3.0, log), counts.Tally(-2.0, log)
    assert [(a * b).value, (a / b).value, (a + b).value, (a - b).value] == [-6.0, -1.5, 1.0, 5.0]
    assert log == ["*", "*", "+", "+"]
    assert (-a).value == -3.0 and abs(b).value == 2.0 and a > b and not b > a
    assert len(log) == 4
