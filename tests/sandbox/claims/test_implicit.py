"""What the claims on implicit forms compute by themselves: operation formulas, exact rates, gradients by calculus."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.implicit.augmented import augmented_along
from problems.methods.draw import generic
from problems.robots.twin import twin
from sandbox.claims import equations
from sandbox.claims.claim import Trial
from sandbox.claims.implicit import (
    FAR,
    FORMS,
    MEASURES,
    counted,
    formulas,
    half_projected,
    near_singular,
    nearest,
    percent,
    plain_volume,
    reach,
    system,
)
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

    words = reach(count, (7,))
    assert words.count("saves from n = 4 on, for k ≤ 2 (n = 7)") == len(FORMS)


def test_near_a_singularity_the_explicit_weight_loses_the_square():
    """Halfway to rounding, at d = 1e-6, the explicit W has lost about ten more digits' worth of 1/d than the factors."""
    distances, errors = near_singular(Trial(full=False), augmented_along, equations.augmented, np.random.default_rng(0))
    at = int(np.argmin(np.abs(distances - 1e-6)))
    assert errors["explicit"][at] > 1e3 * errors["factored"][at]
    assert (errors["factored"] < 1e-6).all()
    wrong = near_singular(Trial(full=False), half_projected(augmented_along), equations.augmented, np.random.default_rng(0))[1]
    assert (wrong["factored"][1:] > 1e-2).all()


def test_d_is_the_distance_from_singularity():
    """The determinant of [J; E] is -d, and there is a decade of d at least beyond which the explicit weight is judged."""
    for d in (1.0, 1e-3, 2.0**-20):
        assert np.linalg.det(system(d)) == pytest.approx(-d, rel=1e-9)
    assert FAR <= 1e-3


def test_the_error_nearest_to_a_distance():
    """The entry whose distance is nearest by ratio; what is not finite is told in words."""
    distances = np.array([1.0, 1e-4, 1e-8])
    assert nearest(distances, np.array([1.0, 2.0, np.inf]), 2e-4) == 2.0
    assert nearest(distances, np.array([1.0, 2.0, np.inf]), 1e-8) == "singular"


def test_manipulability_squared_of_the_planar_arm():
    """Its trigonometric form is det JJ' of the Jacobian."""
    robot = robots.load("planar_3r")
    q = generic(robot, np.random.default_rng(4), 30).q
    J = robot.jacobian(q)
    np.testing.assert_allclose(plain_volume(q), np.linalg.det(J @ np.swapaxes(J, 1, 2)), rtol=1e-12)


@pytest.mark.parametrize("name", ["planar_4r", "panda"])
@pytest.mark.parametrize("what, expression, explicit, alpha", MEASURES, ids=[row[0] for row in MEASURES])
def test_explicit_gradients_are_those_of_the_expressions(name, what, expression, explicit, alpha):
    """Central differences of the CasADi expression find the gradient that the other side forms."""
    robot = robots.load(name)
    q, step = generic(robot, np.random.default_rng(5), 5).q, 1e-5
    value = twin(robot).evaluator(expression(twin(robot)))
    along = [(value(q + step * e)[0] - value(q - step * e)[0]) / (2 * step) for e in np.eye(robot.n)]
    gradient = explicit(robot, q)
    np.testing.assert_allclose(np.stack(along, axis=-1), gradient, atol=1e-6 * np.abs(gradient).max())


def test_per_cent_with_a_true_minus():
    """Three digits, and the sign of a loss."""
    assert (percent(0.26244), percent(-0.62)) == ("26.2 %", "−62 %")
