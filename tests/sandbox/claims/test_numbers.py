"""Rows of numbers as a page tells them."""

from __future__ import annotations

import numpy as np

from sandbox.claims.numbers import told


def test_rows_of_numbers_are_told_without_rounding_s_dust():
    """Six digits, a true minus, and zero for what is a rounding."""
    assert told([-1.6, 1e-17, 2 / 3]) == "(−1.6, 0, 0.666667)"


def test_vectors_and_matrices_in_words():
    """Rounding of zero is written as zero; a matrix is written by its rows."""
    assert told([1e-17, 0.5]) == "(0, 0.5)"
    assert told(np.eye(2)) == "(1, 0); (0, 1)"
