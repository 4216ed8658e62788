"""Powers fitted to what grows."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.power import fitted, scientific


def test_exponents_are_fitted_to_powers() -> None:
    """x^-3 has the exponent -3, whatever its factor."""
    x = np.geomspace(1e-3, 1.0, 7)
    assert fitted(x, 5 * x**-3.0) == pytest.approx(-3)


def test_numbers_have_two_digits_and_a_power_of_ten() -> None:
    """In TeX, whole powers and others, below one and above."""
    assert scientific(6.4e-8) == r"$6.4 \times 10^{-8}$"
    assert scientific(1.25e12) == r"$1.2 \times 10^{12}$"
