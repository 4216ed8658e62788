"""Eq. (6) from N'W and N'a alone: the explicit answer, its bound, and what is refused."""

from __future__ import annotations

import time
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from sandbox import truth
from sandbox.closed_form import null_basis
from sandbox.closed_form.bounds import six
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq6_implicit import NullBasisError, eq6_implicit, implicit_bound
from sandbox.closed_form.uncompiled import Counted, Operations, eq6_exact, eq6_implicit_on, operations
from sandbox.errors import AsymmetricWeightError, NonFiniteError, RangeError, ShapeError
from sandbox.problem import VelocityProblem
from sandbox.solution import Status
from sandbox.stacked import transpose
from sandbox.tolerances import FORWARD, UNIT
from sandbox.weight import Weight

Array = np.ndarray

BASES = {"pivoted": null_basis.pivoted, "orthonormal": null_basis.orthonormal}

KNOBS: list[dict[str, float]] = [{}, {"cond_J": 5}, {"tangent": 4}, {"cross": 3}, {"cond_S": 5}, {"rows": 4}]
KNOBS.append({"cond_J": 5, "tangent": 4})  # where the error of N alone is beyond what the condition of [J; N'W] allows

# F1 of methods.md: J, N, and W = diag(-1, 1, 1), which is indefinite where (7) holds
J1, N1 = np.array([[-1.0, -1, 0], [2, 1, 1]]), np.array([[-1.0], [1], [1]])
W1 = np.diag([-1.0, 1, 1])


def parts(problem: VelocityProblem, N: Array) -> dict[str, Array]:
    """What eq6_implicit is given of an explicit problem."""
    size = np.linalg.norm(problem.W.dense(), axis=(-1, -2))
    return {"N": N, "NtW": problem.W.left(N), "Nta": (transpose(N) @ problem.a[..., None])[..., 0], "size": size}


def implicit(problem: VelocityProblem, N: Array, **changed: Any) -> Any:
    """The implicit answer to an explicit problem."""
    return eq6_implicit(problem.J, problem.xdot, **{**parts(problem, N), **changed})


def bound_of(problem: VelocityProblem, N: Array) -> Array:
    """Its bound."""
    given = parts(problem, N)
    return implicit_bound(problem.J, N, given["NtW"], size=given["size"])


def test_indefinite_weight_by_hand() -> None:
    """F1 with W = diag(-1, 1, 1): (1, -2, 1) from N'W = (1, 1, 1) alone; one problem has plain shapes and no multipliers."""
    s = eq6_implicit(J1, [1, 1], N1, N1.T @ W1, [0.0])
    np.testing.assert_allclose(s.x, [1, -2, 1], rtol=0, atol=50 * 3 * UNIT * 2)
    assert s.status is Status.SOLVED
    assert s.said == ""
    assert s.y.shape == (2,)
    assert np.isnan(s.y).all()
    np.testing.assert_allclose(s.evidence["lambda_min_reduced"], 1 / 3, rtol=1e-14)  # N'WN = 1, |N|^2 = 3


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("knobs", KNOBS, ids=lambda knobs: "-".join(knobs) or "plain")
def test_within_its_bound(
    basis: str, knobs: dict, size: tuple[int, int], manufactured: Callable, exact: Callable, reach: Callable
) -> None:
    """The implicit answer is within its bound of the exact rational one, for either basis and however W is conditioned."""
    problem = manufactured(np.random.default_rng(7), *size, 12, **knobs)
    N = BASES[basis](problem.J)
    found = implicit(problem, N)
    assert all(status is Status.SOLVED for status in found.status)
    x = exact(problem)[0]
    error = np.abs(found.x - x).max(axis=1) / reach(problem, x)
    assert (error <= bound_of(problem, N)).all()


def test_the_bound_is_no_empty_promise(manufactured: Callable) -> None:
    """Where everything is well conditioned the bound stays below 1e3 of its factor 50 n u."""
    problem = manufactured(np.random.default_rng(8), 7, 6, 50)
    bound = bound_of(problem, null_basis.orthonormal(problem.J))
    assert (bound < 1e3 * FORWARD * 7 * UNIT).all()


@pytest.mark.parametrize("basis", BASES)
def test_truth_of_the_explicit_twin(basis: str, size: tuple[int, int], manufactured: Callable, reach: Callable) -> None:
    """Implicit, explicit and exact answers agree within their bounds, shifts that make W indefinite included."""
    rng = np.random.default_rng(9)
    n, m = size
    plain = manufactured(rng, n, m, 6, positive=True)
    A = np.linalg.norm(plain.W.base, axis=(1, 2))[:, None, None] / np.linalg.norm(plain.J, axis=(1, 2))[:, None, None] ** 2
    B = rng.normal(size=(6, m, n))
    JtB = transpose(plain.J) @ B
    shifts = (plain.W.base - 8 * A * transpose(plain.J) @ plain.J, plain.W.base + JtB + transpose(JtB))
    for W in (plain.W.base, *shifts):
        problem = VelocityProblem(J=plain.J, xdot=plain.xdot, W=(W + transpose(W)) / 2, a=plain.a)
        true = [t.x for t in truth(problem)]
        N = BASES[basis](problem.J)
        scale = reach(problem, np.array(true))
        ours, theirs = implicit(problem, N).x, eq6(problem).x
        own = bound_of(problem, N)
        assert (np.abs(ours - true).max(axis=1) <= own * scale).all()
        assert (np.abs(ours - theirs).max(axis=1) <= (own + six(problem)) * scale).all()


def test_any_basis_gives_the_same_rates(manufactured: Callable, reach: Callable, exact: Callable) -> None:
    """N T for any nonsingular T, scaled or mixed, changes qdot by no more than the bounds (methods I2)."""
    problem = manufactured(np.random.default_rng(10), 7, 3, 10, cross=1)
    N = null_basis.orthonormal(problem.J)
    x = exact(problem)[0]
    scale = reach(problem, x)
    rng = np.random.default_rng(11)
    for T in (np.diag([1e6, -1e-6, 3.0, 1.0]), rng.normal(size=(4, 4)), np.vander([1.0, 1.1, 1.2, 1.3])):
        found = implicit(problem, N @ T)
        assert (np.abs(found.x - x).max(axis=1) <= bound_of(problem, N @ T) * scale).all()


def test_factored_weight_keeps_its_digits() -> None:
    """(N'E') Gamma E at F1 with g = (1 + d) q1 + q2: 1e-10 at d = 1e-6, where W formed first is off by 1e-5 (methods 4.4)."""
    d, xdot, rate = 1e-6, np.array([0.3, -0.7]), np.array([0.9])
    E = np.array([[1 + d, 1.0, 0.0]])
    right = np.linalg.solve(np.vstack([J1, E]), np.concatenate([xdot, rate]))
    factored = eq6_implicit(J1, xdot, N1, (N1.T @ E.T) @ E, -(N1.T @ E.T) @ rate).x
    formed = eq6_implicit(J1, xdot, N1, N1.T @ (E.T @ E), -(N1.T @ E.T) @ rate).x
    size = np.abs(right).max()
    assert np.abs(factored - right).max() < 1e-9 * size
    assert np.abs(formed - right).max() > 1e-7 * size


@pytest.mark.parametrize(
    ("W", "words"),
    [
        (np.diag([-2.0, 1, 1]), "N'WN is singular"),
        (np.diag([-3.0, 1, 1]), "the stationary point is a maximum"),
        (J1.T @ J1, "N'WN is singular"),
        (np.zeros((3, 3)), "N'WN is singular"),
    ],
)
def test_condition_seven_is_refused(W: Array, words: str) -> None:
    """Singular and negative N'WN are refused, with the eigenvalue, though [J; N'W] may be nonsingular."""
    s = eq6_implicit(J1, [1, 1], N1, N1.T @ W, [0.0])
    assert s.status is Status.CONDITION_SEVEN
    assert words in s.said
    assert np.isnan(s.x).all()


def test_saddle_is_refused() -> None:
    """F2 with W = diag(1, 1, 1, -2): eigenvalues of both signs are a saddle."""
    J = np.array([[-2.0, -2, -1, -1], [2, 1, 1, 0]])
    N = null_basis.orthonormal(J)
    s = eq6_implicit(J, [1, 1], N, N.T @ np.diag([1.0, 1, 1, -2]), [0.0, 0.0])
    assert s.status is Status.CONDITION_SEVEN
    assert "saddle" in s.said


def test_curvature_that_n_leaves_open_is_refused() -> None:
    """Near a kinematic singularity N'WN > 0 by less than the error of N is no pass, where N'W meets range J'."""
    J = np.array([[1.0, 0, 0], [1, 2.0**-30, 0]])
    W = np.array([[1.0, 0, 0], [0, 1, 1], [0, 1, 2.0**-25]])
    N = np.array([[0.0], [0], [1]])
    s = eq6_implicit(J, [1, 1], N, N.T @ W, [0.0])
    assert s.status is Status.ILL_CONDITIONED
    assert "within rounding" in s.said


def test_bad_members_leave_their_neighbours_unharmed() -> None:
    """In one stack a good member is solved, a rank-deficient J and a failing (7) are refused, nothing raises."""
    J = np.stack([J1, [[1.0, 2, 3], [2, 4, 6]], J1, np.zeros((2, 3))])
    W = np.stack([W1, np.eye(3), np.diag([-3.0, 1, 1]), np.eye(3)])
    N = null_basis.pivoted(J)
    s = eq6_implicit(J, np.ones((4, 2)), N, transpose(N) @ W, np.zeros((4, 1)))
    assert list(s.status) == [Status.SOLVED, Status.RANK_DEFICIENT, Status.CONDITION_SEVEN, Status.RANK_DEFICIENT]
    assert np.isfinite(s.x[0]).all()
    assert np.isnan(s.x[1:]).all()
    assert "full row rank" in s.said[1]


def test_leading_axes_broadcast(manufactured: Callable) -> None:
    """Any leading shape is kept, and a stack is its members bit for bit."""
    problem = manufactured(np.random.default_rng(12), 5, 3, 6)
    N = null_basis.pivoted(problem.J)
    given = parts(problem, N)
    flat = eq6_implicit(problem.J, problem.xdot, **given)
    shaped = {name: value.reshape(2, 3, *value.shape[1:]) for name, value in given.items()}
    s = eq6_implicit(problem.J.reshape(2, 3, 3, 5), problem.xdot.reshape(2, 3, 3), **shaped)
    assert s.x.shape == (2, 3, 5)
    assert s.y.shape == (2, 3, 3)
    assert s.status.shape == (2, 3)
    np.testing.assert_array_equal(s.x.reshape(6, 5), flat.x)
    one = eq6_implicit(problem.J[4], problem.xdot[4], **{name: value[4] for name, value in given.items()})
    np.testing.assert_array_equal(one.x, flat.x[4])
    many = eq6_implicit(problem.J[0], problem.xdot, given["N"][0], given["NtW"][0], given["Nta"][0])
    assert many.x.shape == (6, 5)
    bound = implicit_bound(problem.J.reshape(2, 3, 3, 5), shaped["N"], shaped["NtW"])
    assert bound.shape == (2, 3)


def test_square_jacobian_needs_no_weight() -> None:
    """With n = m N is empty and qdot = J^-1 xdot."""
    J = np.array([[2.0, 1], [1, 1]])
    s = eq6_implicit(J, [3.0, 2.0], np.zeros((2, 0)), np.zeros((0, 2)), np.zeros(0))
    np.testing.assert_allclose(s.x, [1, 1], rtol=1e-14)
    assert np.isnan(s.evidence["lambda_min_reduced"])


def test_more_rows_than_joints_are_refused() -> None:
    """With n < m the status is that of a rank-deficient J."""
    s = eq6_implicit(np.ones((3, 2)), [1.0, 1, 1], np.zeros((2, 0)), np.zeros((0, 2)), np.zeros(0))
    assert s.status is Status.RANK_DEFICIENT


@pytest.mark.parametrize(
    ("changed", "error", "words"),
    [
        ({"N": N1 + np.array([[1e-9], [0], [0]])}, NullBasisError, "no basis of null J"),
        ({"N": np.array([[1.0], [1], [1]])}, NullBasisError, "no basis of null J"),
        ({"N": np.zeros((3, 1))}, NullBasisError, "do not span null J"),
        ({"N": np.ones((3, 2))}, ShapeError, "N has shape"),
        ({"NtW": np.ones((3, 1))}, ShapeError, "NtW has shape"),
        ({"Nta": np.ones(3)}, ShapeError, "Nta has shape"),
        ({"Nta": 1.0}, ShapeError, "Nta has shape"),
        ({"xdot": np.ones(3)}, ShapeError, "xdot has shape"),
        ({"N": np.ones((5, 3, 1)), "NtW": np.ones((4, 1, 3))}, ShapeError, "stacks do not agree"),
        ({"NtW": [[np.nan, 1, 1]]}, NonFiniteError, "NtW"),
        ({"Nta": [np.inf]}, NonFiniteError, "Nta"),
        ({"NtW": [[1e200, 1, 1]]}, RangeError, "NtW"),
        ({"size": -1.0}, RangeError, "size"),
    ],
)
def test_what_is_none_is_refused_at_the_door(changed: dict, error: type, words: str) -> None:
    """A wrong shape, a number that is none and an N that is no basis each raise by name."""
    given: dict[str, Any] = {"J": J1, "xdot": [1, 1], "N": N1, "NtW": N1.T @ W1, "Nta": [0.0], **changed}
    with pytest.raises(error, match=words):
        eq6_implicit(**given)


def test_dependent_columns_of_n_are_refused() -> None:
    """Two null vectors that are one do not span null J; the member is named."""
    J = np.broadcast_to([[-2.0, -2, -1, -1], [2, 1, 1, 0]], (3, 2, 4))
    N = null_basis.pivoted(J).copy()
    N[1, :, 1] = 2 * N[1, :, 0]
    with pytest.raises(NullBasisError, match=r"member \[1\]"):
        eq6_implicit(J, np.ones(2), N, transpose(N), np.zeros(2))


def test_a_wrong_reduced_weight_is_refused(manufactured: Callable) -> None:
    """N'W of a W that is not symmetric, or of another basis, makes N'WN asymmetric, which is refused with its index."""
    problem = manufactured(np.random.default_rng(13), 6, 3, 4)
    N = null_basis.orthonormal(problem.J)
    skew = np.zeros((4, 6, 6))
    skew[2] = np.triu(np.ones((6, 6)), 1)
    wrong = transpose(N) @ (problem.W.base + 1e-6 * (skew - transpose(skew)))
    with pytest.raises(AsymmetricWeightError, match=r"member \[2\]"):
        implicit(problem, N, NtW=wrong)
    with pytest.raises(AsymmetricWeightError, match="another N"):
        implicit(problem, N, NtW=problem.W.left(null_basis.pivoted(problem.J)))


def test_right_weights_are_not_taken_for_wrong(manufactured: Callable) -> None:
    """A task-space shift 1e10 times W leaves rounding in N'W that only `size` explains: with it nothing is refused as wrong."""
    problem = manufactured(np.random.default_rng(14), 6, 3, 4)
    huge = VelocityProblem(
        J=problem.J, xdot=problem.xdot, a=problem.a, W=problem.W.base + 1e10 * transpose(problem.J) @ problem.J
    )
    N = null_basis.orthonormal(huge.J)
    implicit(huge, N)
    with pytest.raises(AsymmetricWeightError):
        implicit(huge, N, size=None)


@pytest.mark.parametrize("basis", BASES)
def test_bases_span_the_null_space(basis: str, size: tuple[int, int], manufactured: Callable) -> None:
    """JN vanishes to rounding row by row, N has full rank, and row scales of J change nothing of it."""
    J = manufactured(np.random.default_rng(15), *size, 20, rows=6).J
    N = BASES[basis](J)
    rows, columns = np.linalg.norm(J, axis=2), np.linalg.norm(N, axis=1)
    assert (np.abs(J @ N) <= 100 * size[0] * UNIT * rows[:, :, None] * columns[:, None, :]).all()
    assert (np.linalg.svd(N / columns[:, None, :], compute_uv=False)[:, -1] > 1e-6).all()


def test_pivoted_basis_is_the_identity_on_free_joints() -> None:
    """The paper's N of F1 is (-1, 1, 1)' up to the joint that no row pivots on, where it is one."""
    N = null_basis.pivoted(J1)
    np.testing.assert_allclose(N / N[2], N1, rtol=1e-15)
    assert (N == 1).any()


def test_orthonormal_basis_is_orthonormal(size: tuple[int, int], manufactured: Callable) -> None:
    """N'N = I to rounding."""
    N = null_basis.orthonormal(manufactured(np.random.default_rng(16), *size, 10).J)
    np.testing.assert_allclose(transpose(N) @ N, np.broadcast_to(np.eye(N.shape[2]), (10, N.shape[2], N.shape[2])), atol=1e-14)


@pytest.mark.parametrize("basis", BASES)
def test_bases_want_as_many_joints_as_rows(basis: str) -> None:
    """With n < m a basis is refused, as its size would depend on the numbers."""
    with pytest.raises(ShapeError, match="more rows than joints"):
        BASES[basis](np.ones((3, 2)))


def test_on_rationals_it_is_exact(manufactured: Callable) -> None:
    """On Fractions, with the exact N completed from J, implicit and explicit eq. (6) are the same numbers."""
    one = Fraction(1)
    N = [[-one], [one], [one]]
    problem = VelocityProblem(J=J1, xdot=[0.3, -0.7], W=np.diag([-1.0, 1, 1.5]), a=[0.1, -0.2, 0.4])
    W, a = np.diag(problem.W.base), problem.a
    NtW = [[N[j][0] * Fraction(float(W[j])) for j in range(3)]]
    Nta = [sum(N[j][0] * Fraction(float(a[j])) for j in range(3))]
    _, x = eq6_implicit_on(Fraction, problem.J, problem.xdot, NtW, Nta)
    np.testing.assert_array_equal(x, eq6_exact(problem)[1])


def test_compiled_and_uncompiled_agree_bitwise(manufactured: Callable) -> None:
    """One source, one order of operations: the compiled stack gives the bits of the plain loops."""
    problem = manufactured(np.random.default_rng(17), 6, 4, 10, cross=1)
    N = null_basis.orthonormal(problem.J)
    N = N / np.linalg.norm(N, axis=1)[:, None, :]
    given = parts(problem, N)
    found = eq6_implicit(problem.J, problem.xdot, **given).x
    length = np.linalg.norm(N, axis=1)
    for i, p in enumerate(problem):
        _, x = eq6_implicit_on(float, p.J, p.xdot, given["NtW"][i] / length[i][:, None], given["Nta"][i] / length[i])
        np.testing.assert_array_equal(x.astype(float), found[i])


def test_counts_are_a_square_lu() -> None:
    """Given N'W and N'a it takes an LU of n rows and n^2: sum (n-k)(n-k+1) + n^2, as eq. (6) without N'W and null vectors."""
    for n, m in ((3, 2), (7, 6), (7, 3), (10, 4)):
        total = Operations()
        J = np.vander(np.arange(1.0, n + 1) / n, m, increasing=True).T
        N = null_basis.pivoted(J)
        eq6_implicit_on(lambda value, total=total: Counted(value, total), J, np.ones(m), N.T, np.zeros(n - m))
        elimination = sum((n - k) * (n - k + 1) for k in range(1, n + 1))
        assert total.multiplications == elimination + n**2
        assert total.additions == sum((n - k) ** 2 for k in range(1, n + 1)) + n**2 - n
        # eq. (6) with W = I: the same, null vectors, N' grad f and alpha
        null = sum(n - i - 1 + 1 for i in range(m)) * (n - m)
        whole = operations("eq6", n, m, weighted=False)
        assert whole.multiplications == total.multiplications + null + (n - m) * (m + 1)


def test_a_large_stack_is_quick(manufactured: Callable) -> None:
    """10,000 problems of 7 joints and 6 rows take well below two seconds."""
    problem = manufactured(np.random.default_rng(18), 7, 6, 10)
    N = null_basis.pivoted(problem.J)
    given = {name: np.concatenate([value] * 1000) for name, value in parts(problem, N).items()}
    J, xdot = np.concatenate([problem.J] * 1000), np.concatenate([problem.xdot] * 1000)
    eq6_implicit(problem.J, problem.xdot, **parts(problem, N))  # compiles
    start = time.perf_counter()
    found = eq6_implicit(J, xdot, **given)
    assert time.perf_counter() - start < 2
    assert all(status is Status.SOLVED for status in found.status)


def test_factored_twin_is_one_problem(manufactured: Callable) -> None:
    """A factored Weight gives its N'W by `left`: implicit and explicit eq. (6) agree within their bounds."""
    rng = np.random.default_rng(19)
    plain = manufactured(rng, 7, 4, 8)
    W = Weight(np.eye(7) / 64, rng.normal(size=(8, 3, 7)), rng.uniform(1, 2, (8, 3)))
    problem = VelocityProblem(J=plain.J, xdot=plain.xdot, W=W, a=plain.a)
    N = null_basis.pivoted(problem.J)
    allowed = bound_of(problem, N) + six(problem)
    x = eq6(problem).x
    reach = np.abs(x).max(axis=1)
    assert (np.abs(implicit(problem, N).x - x).max(axis=1) <= 10 * allowed * reach).all()


@pytest.mark.parametrize("fault", ["sign of N'a", "entries above the diagonal", "another member's W"])
def test_planted_faults_leave_the_bound(fault: str, manufactured: Callable, exact: Callable, reach: Callable) -> None:
    """With k = 1, where no check sees asymmetry: -N'a, N'W of an asymmetric W, and another W's are all beyond the bound."""
    problem = manufactured(np.random.default_rng(20), 7, 6, 10)
    N = null_basis.orthonormal(problem.J)
    given = parts(problem, N)
    changed = {
        "sign of N'a": {"Nta": -given["Nta"]},
        "entries above the diagonal": {"NtW": given["NtW"] + transpose(N) @ np.diag(np.full(6, 1e-6), 1)},
        "another member's W": {"NtW": transpose(N) @ np.roll(problem.W.base, 1, axis=0)},
    }[fault]
    found = implicit(problem, N, **changed)
    x = exact(problem)[0]
    error = np.abs(found.x - x).max(axis=1) / reach(problem, x)
    assert not (error <= bound_of(problem, N)).any()


def test_the_bound_holds_the_condition_of_what_is_solved(manufactured: Callable) -> None:
    """It is never below 50 n u times the 2-norm condition of the row-equilibrated [J; N'W]; of a stack it is its members'."""
    problem = manufactured(np.random.default_rng(4), 5, 3, 12, positive=True, cond_J=4)
    N = null_basis.orthonormal(problem.J)
    A = np.concatenate([problem.J, problem.W.left(N)], axis=1)
    A /= np.linalg.norm(A, axis=2, keepdims=True)
    bound = bound_of(problem, N)
    assert (bound > FORWARD * 5 * UNIT * np.linalg.cond(A) / np.sqrt(5)).all()
    alone = [implicit_bound(one.J, N[i], one.W.left(N[i]), size=np.linalg.norm(one.W.dense())) for i, one in enumerate(problem)]
    np.testing.assert_allclose(bound, alone, rtol=1e-9)


def test_a_size_that_n_w_outgrows_changes_nothing() -> None:
    """Size 0 is no error: N'W shows at least its own size, and stands for W."""
    given = {"J": J1, "xdot": [1.0, 1.0], "N": N1, "NtW": N1.T @ W1, "Nta": [0.0]}
    np.testing.assert_array_equal(eq6_implicit(**given, size=0.0).x, eq6_implicit(**given).x)


def test_a_basis_counts_as_one_up_to_a_thousand_roundings() -> None:
    """A column of N that J turns into 1800 u of itself is taken for a null vector, one of 2200 u is not."""
    J = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for off, taken in ((1800 * UNIT, True), (2200 * UNIT, False)):
        N = np.array([[off], [0.0], [1.0]])
        if taken:
            assert eq6_implicit(J, [1.0, 1.0], N, N.T, [0.0]).status is Status.SOLVED
        else:
            with pytest.raises(NullBasisError):
                eq6_implicit(J, [1.0, 1.0], N, N.T, [0.0])


def test_a_basis_that_is_nearly_dependent_leaves_condition_seven_open() -> None:
    """With W = I but columns of N 1e-7 apart, N'WN shows no eigenvalue beyond rounding times cond(N)^2: refused as (7)."""
    J, W = np.array([[0.0, 0.0, 1.0]]), np.diag([1.0, 1e-2, 1.0])
    for apart, status in ((1e-3, Status.SOLVED), (1e-7, Status.CONDITION_SEVEN)):
        N = np.array([[1.0, 1.0], [0.0, apart], [0.0, 0.0]])
        assert eq6_implicit(J, [1.0], N, N.T @ W, [0.0, 0.0]).status is status


@pytest.mark.parametrize("basis", BASES)
def test_bases_of_square_and_empty_jacobians(basis: str) -> None:
    """With n = m the basis has no columns; an empty stack, and J without rows, are refused."""
    assert BASES[basis](np.stack([np.eye(3), 2 * np.eye(3)])).shape == (2, 3, 0)
    for J in (np.zeros((0, 2, 3)), np.zeros((0, 3))):
        with pytest.raises(ShapeError, match=r"^J "):
            BASES[basis](J)
