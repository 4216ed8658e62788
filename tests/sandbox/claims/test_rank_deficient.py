"""What the claims about eq. (13) compute for themselves: exact bases, exact determinants, and data of a known rank."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.sets import construct as make
from sandbox.claims import equations, rank_deficient
from sandbox.claims.claim import Trial
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.solution import Status
from sandbox.tolerances import DIFFERENCE, GRADIENT_STEP, ORIGINAL, UNIT

RNG = Trial().rng("tests of rank_deficient")


@pytest.mark.parametrize(("m", "n"), rank_deficient.SHAPES)
def test_exact_bases_span_the_null_space_and_complete_it(m: int, n: int) -> None:
    """J N = 0 to the last bit, N has n - rank columns, and [R N] is nonsingular."""
    for r in range(min(m, n) + 1):
        J = rank_deficient.drawn(RNG, m, n, r, *rank_deficient.KINDS[0]).J
        N, R = rank_deficient.exact_bases(J)
        assert N.shape == (n, n - r) and R.shape == (n, r)
        assert not (J @ N).any()
        assert np.linalg.matrix_rank(np.hstack([R, N])) == n


def test_determinants_are_those_of_the_four_matrices() -> None:
    """Exact, so that rounding them is what floats are off by."""
    one = rank_deficient.posed(rank_deficient.drawn(RNG, 4, 6, 3, *rank_deficient.KINDS[4]))
    J, _, W, _, _, Wx = one.parts
    image = J @ one.R
    first = np.vstack([one.R.T @ J.T @ Wx @ J, one.N.T @ W])
    matrices = (first, np.hstack([one.R, one.N]), image.T @ Wx @ image, one.N.T @ W @ one.N)
    for exact, matrix in zip(rank_deficient.determinants(one.problem, one.N, one.R), matrices, strict=True):
        assert np.linalg.det(matrix) == pytest.approx(exact, rel=ORIGINAL * 6 * UNIT * np.linalg.cond(matrix))


def test_errors_are_relative_to_what_the_data_can_move() -> None:
    """The size of the stretched arm is that of its answer: W is nearly the identity there."""
    one = rank_deficient.posed(rank_deficient.flat(Wx=rank_deficient.COUPLED))
    assert one.size >= np.abs(one.x).max()
    assert rank_deficient.error(one.x, one) == 0
    assert rank_deficient.error(one.x + one.size * np.eye(3)[0], one) == pytest.approx(1)


def test_where_nothing_is_asked_only_zero_is_right() -> None:
    """J, xdot and a vanish: no error is small beside them."""
    one = rank_deficient.posed(VelocityProblem(J=np.zeros((1, 2)), xdot=np.zeros(1), W=np.eye(2)))
    assert rank_deficient.error(np.zeros(2), one) == 0
    assert rank_deficient.error(np.array([0.0, UNIT]), one) == np.inf


def test_scipy_and_tikhonov_find_the_minimiser_without_eq_13() -> None:
    """The stretched arm of the worked example, (-6/7, -4/7, 40/7)."""
    one = rank_deficient.posed(rank_deficient.flat(Wx=rank_deficient.COUPLED))
    x, bound = rank_deficient.by_scipy(one)
    assert rank_deficient.error(x, one) <= bound
    far, near = (rank_deficient.error(rank_deficient.tikhonov(one, epsilon), one) for epsilon in (1e-3, 1e-6))
    assert near < far / 100


def test_graded_data_have_the_rank_they_are_said_to_have() -> None:
    """A row stands there twice, to the last bit; the smallest singular value kept is 10^-depth of the largest."""
    problem = rank_deficient.graded(RNG, 3, 6, 5.0)
    N, _ = rank_deficient.exact_bases(np.round(problem.J * 2**20))  # of rank 3 too: rounding is the same for both rows
    assert N.shape == (6, 3)
    sigma = np.linalg.svd(problem.J, compute_uv=False)
    assert 1e-6 < sigma[2] / sigma[0] < 1e-4


@pytest.mark.parametrize("choice", rank_deficient.CHOICES)
def test_every_choice_completes_the_null_space(choice: str) -> None:
    """R has as many columns as J has rank, and [R N] is nonsingular."""
    problem = rank_deficient.graded(RNG, 3, 6, 1.0)
    R = rank_deficient.CHOICES[choice](problem.J, 3)
    assert R.shape == (6, 3)
    assert np.linalg.matrix_rank(np.hstack([R, equations.null_space(problem.J, 3)])) == 6


def test_null_vector_derivative_is_that_of_the_cross_product() -> None:
    """Central differences of (s3, -s3 - s23, s2 + s23) with the links in one line; J is that of the robot."""
    robot = robots.load("planar_3r")
    for q2 in (0.0, np.pi):
        for q3 in (0.0, np.pi):
            q = np.array([0.0, q2, q3])
            steps = [np.cross(*np.swapaxes(robot.jacobian(q + GRADIENT_STEP * np.array([[s], [-s]]) * e), 0, 1)) for s, e in
                     ((1.0, row) for row in np.eye(3))]  # fmt: skip
            difference = np.stack([(plus - minus) / 2 / GRADIENT_STEP for plus, minus in steps], axis=1)
            found = rank_deficient.null_vector_derivative(np.cos(q2), np.cos(q3))
            assert np.abs(np.cross(*robot.jacobian(q))).max() <= ORIGINAL * UNIT
            assert np.abs(found - difference).max() <= DIFFERENCE


def test_stretched_arms_are_those_of_the_robot() -> None:
    """Their J is the robot's at q2, q3 of 0 or pi, and their weight has rank one at most."""
    robot = robots.load("planar_3r")
    known = [robot.jacobian([0.0, q2, q3]) for q2 in (0.0, np.pi) for q3 in (0.0, np.pi)]
    for problem in rank_deficient.stretched_extended(RNG, 5):
        assert min(np.abs(problem.J - J).max() for J in known) <= ORIGINAL * UNIT
        assert np.linalg.matrix_rank(problem.W.dense()) <= 1


def test_a_damped_weight_is_the_weight_and_a_multiple_of_the_identity() -> None:
    """And the problem is otherwise the same."""
    plain = rank_deficient.drawn(RNG, 2, 4, 1, *rank_deficient.KINDS[0])
    problem = rank_deficient.augmented(plain, make.nonzero_integers(RNG, 2, 4), np.ones(2), RNG)
    more = rank_deficient.damped(problem, 0.5)
    assert np.array_equal(more.W.dense(), problem.W.dense() + 0.5 * np.eye(4))
    assert np.array_equal(more.J, problem.J) and np.array_equal(more.a, problem.a)


def test_a_saddle_is_beaten_and_a_minimum_is_not() -> None:
    """What eq. (13) as printed gives where W or Wx is not positive where it must be."""
    kinds = {"positive definite": False, "negative on null J": True}
    for W, beaten in kinds.items():
        one = rank_deficient.posed(rank_deficient.drawn(RNG, 3, 5, 2, "unachievable", "identity", W))
        assert rank_deficient._beaten(one) is beaten
    one = rank_deficient.posed(rank_deficient.drawn(RNG, 3, 5, 2, "unachievable", "P indefinite", "positive definite"))
    assert rank_deficient._beaten(one)


def test_the_fault_of_one_side_gives_another_target() -> None:
    """U'Wx J qdot = Sigma U'Wx xdot, U and Sigma of the range of J: rates that eq. (13) does not give."""
    one = rank_deficient.drawn(RNG, 3, 5, 2, "achievable", "positive definite", "positive definite")
    x = rank_deficient.one_sided(eq13)(one.stacked()).x[0]
    U, sigma, _ = np.linalg.svd(one.J)
    U, sigma, Wx = U[:, :2], sigma[:2], np.array(one.Wx)
    left, right = U.T @ Wx @ one.J @ x, sigma * (U.T @ Wx @ one.xdot)
    assert (
        np.abs(left - right).max()
        <= ORIGINAL * 5 * UNIT * np.linalg.cond(Wx) * np.linalg.norm(Wx) * sigma[0] ** 2 * np.abs(x).max()
    )


def test_the_fault_that_accepts_any_nonsingular_matrix_accepts_a_saddle() -> None:
    """The problem that eq13 refuses is answered."""
    one = rank_deficient.drawn(RNG, 3, 5, 2, "unachievable", "identity", "negative on null J")
    assert eq13(one.stacked()).status[0] is Status.CONDITION_SEVEN
    assert rank_deficient.any_nonsingular(eq13)(one.stacked()).status[0] is Status.SOLVED


def test_exponents_are_fitted_to_powers() -> None:
    """x^-3 has the exponent -3, whatever its factor."""
    x = np.geomspace(1e-3, 1.0, 7)
    assert rank_deficient.slope(x, 5 * x**-3.0) == pytest.approx(-3)


def test_zeros_are_left_out_of_logarithmic_axes() -> None:
    """They become NaN, which a page does not draw."""
    assert np.isnan(rank_deficient.shown([0.0, 1.0])).tolist() == [True, False]


def test_the_flat_arm_is_stretched() -> None:
    """Its J is that of the robot at zero."""
    problem = rank_deficient.flat()
    assert isinstance(problem, VelocityProblem)
    assert np.array_equal(problem.J, robots.load("planar_3r").jacobian(np.zeros(3)))
