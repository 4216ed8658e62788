"""The closed forms: one row each. Importing this loads no compiler."""

from __future__ import annotations

from sandbox.closed_form.damped_least_squares import DAMPED_LEAST_SQUARES
from sandbox.closed_form.eq2_5 import EQ2_5
from sandbox.closed_form.eq6 import EQ6
from sandbox.closed_form.eq6_orthonormal import EQ6_ORTHONORMAL
from sandbox.closed_form.eq13 import EQ13
from sandbox.closed_form.finsler import FINSLER
from sandbox.closed_form.form import ClosedForm
from sandbox.closed_form.kkt import KKT
from sandbox.closed_form.null_space import NULL_SPACE
from sandbox.closed_form.weighted_pseudoinverse import WEIGHTED_PSEUDOINVERSE

CLOSED_FORMS: dict[str, ClosedForm] = {
    form.name: form
    for form in (
        EQ2_5, EQ6, EQ6_ORTHONORMAL, NULL_SPACE, KKT, WEIGHTED_PSEUDOINVERSE, FINSLER, EQ13, DAMPED_LEAST_SQUARES,
    )
}  # fmt: skip
"""All closed forms by name."""
