"""What the implicit forms save, counted and timed: formulas where there are any, and where nothing is saved."""

from __future__ import annotations

import json
from functools import cache

import casadi as ca
import numpy as np
import pytest

from sandbox import cli
from sandbox.errors import InputFileError, RangeError, UnknownNameError
from sandbox.implicit_study import (
    COUNTS,
    ROWS,
    Row,
    arm,
    best,
    dynamics,
    implicit_study,
    instructions,
    product_count,
)

PER_JOINT = {"planar": (15, 12), "spatial": (49, 42)}
"""Multiplications and additions that one more joint costs a recursion, by hand. Spatial: four vectors turned about z (16, 8),
p x force and turning x p with one entry of p zero (8, 2), I turning and two products with m c (21, 12), m moving (3, 0),
rotor (1, 1), sums (0, 19). Planar: what is left of it with two axes of
motion, one of rotation, p and m c along x and no rotor."""


@cache
def counts(family: str, n: int) -> tuple[int, int]:
    """All operations of the inertia matrix, and of one recursion."""
    matrix, recursion = dynamics(family, n)
    return matrix.multiplications + matrix.additions, recursion.multiplications + recursion.additions


@pytest.mark.parametrize("family", ["planar", "spatial"])
def test_recursion_is_linear_and_matrix_quadratic_in_n(family: str) -> None:
    """One recursion costs the same for every further joint; the inertia matrix's cost is a quadratic in n."""
    matrix, recursion = np.array([counts(family, n) for n in range(4, 15)]).T
    assert set(np.diff(recursion)) == {sum(PER_JOINT[family])}
    assert len(set(np.diff(matrix, 2))) == 1
    assert (np.diff(matrix, 2) > 0).all()
    step = [dynamics(family, n)[1] for n in (8, 9)]
    more = step[1].multiplications - step[0].multiplications, step[1].additions - step[0].additions
    assert more == PER_JOINT[family]


@pytest.mark.parametrize("family", ROWS)
def test_inertia_counts_are_their_formula(family: str) -> None:
    """Explicitly the matrix and k n (2 n - 1), implicitly k recursions; the break-even k is where the two meet."""
    for n, k in ((4, 1), (7, 1), (7, 4), (10, 7)):
        explicit, implicit, even = COUNTS["inertia"](family, n, k)
        matrix, recursion = counts("spatial" if family == "spatial" else "planar", n)
        whole, part = (c.multiplications + c.additions for c in (explicit, implicit))
        assert whole == matrix + k * n * (2 * n - 1)
        assert part == k * recursion
        assert even is not None
        assert (part < whole) == (k < even)


def test_augmented_counts_are_their_formula() -> None:
    """K (3 n^2 + n) - n (n + 1)/2 operations explicitly, k n (4 k - 1) implicitly, and the k where they meet."""
    for n in (3, 7, 10):
        for k in range(1, n):
            explicit, implicit, even = COUNTS["augmented"]("planar", n, k)
            whole, part = (c.multiplications + c.additions for c in (explicit, implicit))
            assert whole == k * (3 * n * n + n) - n * (n + 1) // 2
            assert part == k * n * (4 * k - 1)
            assert even is not None
            assert (part < whole) == (k < even)


def test_products_are_counted_as_they_run() -> None:
    """A dense product of (r, s) by (s, t) takes r s t multiplications and r (s - 1) t additions."""
    count = product_count(2, 5, 3)
    assert (count.multiplications, count.additions) == (30, 24)


def test_instructions_leave_out_zeros_and_ones() -> None:
    """Zeros and ones of constants cost nothing, a common part is computed once, and an unknown operation is refused."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    count = instructions([x, y], 0.0 * x + 1.0 * y + x * y + (x * y) ** 2)
    assert (count.multiplications, count.additions) == (2, 2)
    with pytest.raises(UnknownNameError, match="not counted"):
        instructions([x, y], ca.atan2(x, y))


def test_one_degree_of_redundancy_saves() -> None:
    """With k = 1 the inertia form saves from n = 4 on, more the longer the arm: a quarter at 7, three quarters at 30 joints."""
    saved = []
    for n in (4, 7, 12, 20, 30):
        explicit, implicit, _ = COUNTS["inertia"]("spatial", n, 1)
        saved.append(1 - (implicit.multiplications + implicit.additions) / (explicit.multiplications + explicit.additions))
    assert (np.diff(saved) > 0).all()
    assert saved[0] > 0
    assert 0.2 < saved[1] < 0.3
    assert saved[-1] > 0.7


def test_where_nothing_is_saved() -> None:
    """Many columns: k recursions cost more than one matrix up to n = 30; reverse mode makes grad f as cheap as one slope."""
    for n in (10, 20, 30):
        explicit, implicit, even = COUNTS["inertia"]("spatial", n, n - 6)
        assert implicit.multiplications + implicit.additions > explicit.multiplications + explicit.additions
        assert even is not None
        assert even < n - 6
    for n, k in ((7, 1), (7, 5)):
        explicit, implicit, _ = COUNTS["gradient"]("planar", n, k)
        ratio = (implicit.multiplications + implicit.additions) / (explicit.multiplications + explicit.additions)
        assert ratio > 0.9
        assert (ratio > 1) == (k > 1)


def test_a_black_box_is_asked_k_times_and_not_n() -> None:
    """Without derivatives k evaluations stand against n: the saving is 1 - k/n and a little."""
    explicit, implicit, even = COUNTS["black_box"]("planar", 8, 2)
    ratio = (implicit.multiplications + implicit.additions) / (explicit.multiplications + explicit.additions)
    assert 0.15 < ratio < 0.25
    assert even is None


def test_rows_are_complete() -> None:
    """One row per form, family, size and k; shares follow from the counts, ratios from the times."""
    rows = implicit_study((4, 7), families=("planar", "spatial"), repeat=1)
    keys = [(row["form"], row["family"], row["n"], row["k"]) for row in rows]
    assert len(set(keys)) == len(keys)
    assert {(family, n, k) for _, family, n, k in keys} == {
        ("planar", 4, 1), ("planar", 4, 2), ("planar", 7, 1), ("planar", 7, 5), ("spatial", 4, 1), ("spatial", 7, 1),
    }  # fmt: skip
    for row in rows:
        assert set(row) == set(Row.__dataclass_fields__)
        whole = row["explicit_multiplications"] + row["explicit_additions"]
        part = row["implicit_multiplications"] + row["implicit_additions"]
        rest = row["rest_multiplications"] + row["rest_additions"]
        assert row["m"] == row["n"] - row["k"]
        assert row["saved"] == 1 - part / whole
        assert row["saved_of_all"] == pytest.approx(row["saved"] * whole / (whole + rest), rel=1e-12)
        assert row["time_ratio"] == row["implicit_time"] / row["explicit_time"]
        assert 0 < row["explicit_time"] < 1e-2
        assert 0 < row["implicit_time"] < 1e-2


def test_times_are_told_apart() -> None:
    """A function that does ten times the work takes several times as long, whichever comes first."""
    A = np.ones((60, 60))

    def once() -> object:
        return A @ A

    def often() -> object:
        return [A @ A for _ in range(10)]

    first, second = best((once, often, 1), 3)
    assert second > 2 * first
    first, second = best((often, once, 1), 3)
    assert first > 2 * second


def test_names_and_sizes_are_checked() -> None:
    """Unknown families and forms and an arm of one joint are refused."""
    with pytest.raises(UnknownNameError, match="family"):
        implicit_study((3,), families=("snake",))
    with pytest.raises(UnknownNameError, match="form"):
        implicit_study((3,), forms=("guess",))
    with pytest.raises(RangeError, match="no redundancy"):
        implicit_study((1,))


def test_the_arms_are_what_they_say() -> None:
    """Families have their task rows and n joints; the spatial one has rotors and full inertias."""
    for family, m in ROWS.items():
        assert (arm(family, 9).m, arm(family, 9).n) == (m, 9)
    assert (np.asarray(arm("spatial", 9).model.armature) > 0).all()
    assert np.count_nonzero(arm("spatial", 9).bodies()[0][3]) == 9


def test_the_command_prints_the_rows(capsys: pytest.CaptureFixture[str]) -> None:
    """`sandbox implicit` prints the counts of the study, form after form, as a table or as JSON; --sizes are whole numbers."""
    cli.implicit(sizes="3", as_json=True)
    rows = json.loads(capsys.readouterr().out)
    assert list(dict.fromkeys(row["form"] for row in rows)) == ["inertia", "augmented", "gradient", "black_box"]
    cli.implicit(sizes="3")
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("│")]
    explicit, implicit = (
        rows[0][f"{side}_multiplications"] + rows[0][f"{side}_additions"] for side in ("explicit", "implicit")
    )
    assert lines[0][1:14:2] == ["inertia", "planar", "3", "1", str(explicit), str(implicit), f"{rows[0]['saved']:.0%}"]
    assert len(lines) == len(rows)
    with pytest.raises(InputFileError, match="whole numbers"):
        cli.implicit(sizes="3,x")
