"""The algebra of the formulations: curvature and conditioning, refusals with their evidence, multipliers, second stages."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

from sandbox.formulation import FORMULATIONS
from sandbox.formulation.convexified import AUGMENTED_LAGRANGIAN, CONVEXIFIED
from sandbox.formulation.direct import DIRECT
from sandbox.formulation.formulation import Posed
from sandbox.formulation.least_squares import HIERARCHICAL, NORMAL_EQUATIONS, RANGE_SPACE
from sandbox.formulation.null_space import NULL_SPACE
from sandbox.formulation.slack import SLACK
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import Status
from sandbox.stacked import symmetric
from sandbox.task import TASKS
from sandbox.tolerances import CONDITION_SEVEN, CONSISTENCY, CONVEXITY_SHARE, DAMPING, UNIT
from sandbox.weight import Weight
from tests.oracle import oracle

Array = np.ndarray

F1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
F2 = np.array([[-2.0, -2, -1, -1], [2, 1, 1, 0]])


def stacked(J: Array, W: Array, xdot: Array, a: Array | None = None, Wx: Array | None = None) -> VelocityProblem:
    """A stack, of one where J is one matrix."""
    return VelocityProblem(J, xdot, W, a, Wx).stacked()


def curved(J: Array, seed: int) -> tuple[Array, Array]:
    """A weight with (7) and m negative eigenvalues, cross terms included, and S = Y'WY - Y'WN (N'WN)^-1 N'WY."""
    rng = np.random.default_rng(seed)
    n = J.shape[1]
    A = rng.standard_normal((n, n))
    W = A @ A.T + np.eye(n) - (3 + rng.random()) * n * J.T @ J
    Y, N = np.linalg.pinv(J), np.linalg.svd(J)[2][len(J) :].T
    S = Y.T @ W @ Y - Y.T @ W @ N @ np.linalg.solve(N.T @ W @ N, N.T @ W @ Y)
    assert np.linalg.eigvalsh(W)[0] < 0
    return W, S


def added(posed: Posed, problem: VelocityProblem) -> Array:
    """H - W of one posed problem."""
    return (posed.qp.H - problem.W.dense()[posed.index])[0]


def test_every_formulation_is_registered_under_its_name() -> None:
    """Name, task and build / recover of each row belong together."""
    for name, row in FORMULATIONS.items():
        assert row.name == name and row.task in TASKS and row.about
        assert (row.then is not None) == (name == "hierarchical")
    assert [name for name, row in FORMULATIONS.items() if row.task == "exact"] == [
        "direct", "convexified", "augmented_lagrangian", "null_space",
    ]  # fmt: skip


@pytest.mark.parametrize("formulation", [CONVEXIFIED, AUGMENTED_LAGRANGIAN], ids=lambda f: f.name)
def test_positive_definite_exactly_where_condition_seven_holds(formulation) -> None:
    """Of the same arm with N'WN = 1, 0, -1, and of saddles, only the first gets an H, and that is positive definite."""
    W = np.array([np.diag([-1.0, 1, 1]), np.diag([-2.0, 1, 1]), np.diag([-3.0, 1, 1])])  # methods, indefinite examples
    posing = formulation.build(stacked(F1, W, np.array([1.0, 1])))
    assert [posed.index.tolist() for posed in posing.parts] == [[0]]
    assert np.linalg.eigvalsh(posing.parts[0].qp.H)[0, 0] > 0
    assert set(posing.refused) == {1, 2}
    for i, value in ((1, 0.0), (2, -1 / 3)):  # over N orthonormal: -1/|N|^2
        status, words = posing.refused[i]
        assert status is Status.CONDITION_SEVEN and words.startswith("condition (7) fails")
        assert abs(float(words.split(" is ")[1].split(",")[0]) - value) < 1e-5
    flat = formulation.build(stacked(F1, np.zeros((3, 3)), np.array([1.0, 1])))
    assert not flat.parts and flat.refused[0][0] is Status.CONDITION_SEVEN
    saddles = np.array([np.diag([1.0, 1, 1, -2]), np.diag([-1.0, 1, 1, 1]), np.diag([-8 / 3, 1, 1, 1])])
    posing = formulation.build(stacked(F2, saddles, np.array([1.0, 1])))
    assert [posed.index.tolist() for posed in posing.parts] == [[1]] and set(posing.refused) == {0, 2}


def test_condition_seven_turns_at_its_tolerance() -> None:
    """N'WN counts as positive from n k eps |W|_2 on, eps = 2u."""
    turn = CONDITION_SEVEN * 4 * 3 * 2 * UNIT * 8.0
    for share, posed in ((0.9, False), (1.1, True)):
        problem = stacked(np.eye(1, 4), np.diag([1.0, 8, 8, share * turn]), np.array([1.0]))
        assert bool(CONVEXIFIED.build(problem).parts) == bool(AUGMENTED_LAGRANGIAN.build(problem).parts) == posed


@pytest.mark.parametrize("seed", range(3))
def test_the_added_curvature_is_its_formula(seed: int) -> None:
    """H = W + cVV' and W + cJ'J, c = max(0, -2 lambda_min) + a share of |W|: twice Finsler's threshold (methods 1.5)."""
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((2, 5)) * [[1.0], [3.0]]
    W, S = curved(J, seed)
    xdot, a = rng.standard_normal(2), rng.standard_normal(5)
    problem = stacked(J, W, xdot, a)
    size, sigma = np.linalg.norm(W, 2), np.linalg.svd(J)[1]
    V, qp = np.linalg.pinv(J) @ J, np.linalg.pinv(J) @ xdot
    lowest = np.linalg.eigvalsh(S)[0]
    posed = AUGMENTED_LAGRANGIAN.build(problem).parts[0]
    c = -2 * lowest + CONVEXITY_SHARE * size / sigma[0] ** 2
    np.testing.assert_allclose(added(posed, problem), c * J.T @ J, rtol=1e-9, atol=1e-9 * size)
    np.testing.assert_allclose(posed.qp.g[0], a - c * J.T @ xdot, rtol=1e-9)
    # just below the threshold W + cJ'J is not definite, so that c is no accident
    assert (
        np.linalg.eigvalsh(W - lowest * (1 - 1e-6) * J.T @ J)[0] < 0 < np.linalg.eigvalsh(W - lowest * (1 + 1e-6) * J.T @ J)[0]
    )
    U = np.linalg.svd(J)[0]
    S_V = np.diag(sigma) @ U.T @ S @ U @ np.diag(sigma)
    c = -2 * np.linalg.eigvalsh(S_V)[0] + CONVEXITY_SHARE * size
    posed = CONVEXIFIED.build(problem).parts[0]
    np.testing.assert_allclose(added(posed, problem), c * V, rtol=1e-8, atol=1e-9 * size)
    np.testing.assert_allclose(posed.qp.g[0], a - c * V @ qp, rtol=1e-8, atol=1e-9 * size)
    for formulation in (CONVEXIFIED, AUGMENTED_LAGRANGIAN):
        posed = formulation.build(problem).parts[0]
        np.testing.assert_array_equal(posed.qp.A, problem.J)
        np.testing.assert_array_equal(posed.qp.b, problem.xdot)
        np.testing.assert_array_equal(posed.qp.H, np.swapaxes(posed.qp.H, -1, -2))


def test_a_positive_weight_gets_only_the_share() -> None:
    """With W > 0 the threshold is negative, and c is the share of |W|_2 alone."""
    problem = stacked(2 * np.eye(1, 3), np.diag([1.0, 2, 4]), np.array([6.0]), np.array([1.0, 2, 3]))
    share = CONVEXITY_SHARE * 4
    for formulation, c in ((CONVEXIFIED, share), (AUGMENTED_LAGRANGIAN, share)):  # c/sigma^2 times J'J
        posed = formulation.build(problem).parts[0]
        np.testing.assert_allclose(added(posed, problem), np.diag([c, 0, 0]), rtol=1e-12)
        np.testing.assert_allclose(posed.qp.g[0], [1 - 3 * c, 2, 3], rtol=1e-12)


def test_conditioning_near_a_singularity() -> None:
    """As sigma_min(J) goes to 0 the condition of W + cVV' stays bounded, that of W + cJ'J grows as 1/sigma_min^2."""
    conditions = {CONVEXIFIED.name: [], AUGMENTED_LAGRANGIAN.name: []}
    W = np.array([[1.0, 0, 2, 0], [0, -3, 0, 1], [2, 0, 8, 0], [0, 1, 0, 2]])
    depths = (1.0, 1e-2, 1e-4, 1e-6)
    for depth in depths:
        J = np.array([[1.0, 0, 0, 0], [0, depth, 0, 0]])
        for formulation in (CONVEXIFIED, AUGMENTED_LAGRANGIAN):
            H = formulation.build(stacked(J, W, np.array([1.0, depth]))).parts[0].qp.H[0]
            assert np.linalg.eigvalsh(H)[0] > 0
            conditions[formulation.name].append(np.linalg.cond(H))
    assert max(conditions["convexified"]) < 1e3
    grown = conditions["augmented_lagrangian"]
    np.testing.assert_allclose([grown[i] * depths[i] ** 2 / grown[1] / depths[1] ** 2 for i in (2, 3)], 1, rtol=0.05)


def test_rank_deficient_rows_are_convexified_in_their_range() -> None:
    """With r < m, and with J = 0, V has r columns: the rest of the rows bends nothing."""
    J = np.array([[[1.0, 0, 0], [2, 0, 0]], [[0.0, 0, 0], [0, 0, 0]], [[1, 0, 0], [0, 1, 0]]])
    W = np.array([np.diag([-4.0, 1, 2]), np.diag([4.0, 1, 2]), np.diag([-4.0, -1, 2])])
    problem = stacked(J, W, np.array([[1.0, 2], [0, 0], [1, 1]]))
    share = CONVEXITY_SHARE * 4
    wanted = {0: np.diag([8 + share, 0, 0]), 1: np.zeros((3, 3)), 2: np.diag([8 + share, 8 + share, 0])}
    posing = CONVEXIFIED.build(problem)
    assert sorted(int(i) for posed in posing.parts for i in posed.index) == [0, 1, 2]
    for posed in posing.parts:
        np.testing.assert_allclose(added(posed, problem), wanted[int(posed.index[0])], atol=1e-12)


@pytest.mark.parametrize("formulation", [DIRECT, CONVEXIFIED, AUGMENTED_LAGRANGIAN], ids=lambda f: f.name)
def test_adding_curvature_moves_neither_minimiser_nor_multipliers(formulation) -> None:
    """The KKT conditions of the posed QP hold at x and y of the problem as they are, to rounding."""
    W, _ = curved(F2, 3)
    problem = stacked(F2, W, np.array([1.0, -2]), np.array([1.0, 2, 0, -1]))
    t = truth(problem)[0]
    qp = formulation.build(problem).parts[0].qp
    np.testing.assert_allclose(
        qp.H[0] @ t.x + qp.g[0] + qp.A[0].T @ t.y, 0, atol=1e-11 * np.abs(qp.H).max() * np.abs(t.x).max()
    )
    np.testing.assert_allclose(qp.A[0] @ t.x, qp.b[0], atol=1e-13)
    x, y = formulation.recover(problem, formulation.build(problem).parts[0], t.x[None], t.y[None])
    assert (x[0] == t.x).all() and (y[0] == t.y).all()


def test_null_space_is_the_reduced_problem() -> None:
    """H = N'WN, g = N'(a + W q_p), no rows; qdot = q_p + N z and y = -J^+'(W qdot + a), for W with factors."""
    rng = np.random.default_rng(5)
    W = Weight(np.diag([-1.0, 1, 1, 1]), rng.standard_normal((2, 4)), [2.0, 0.5])
    a, xdot = rng.standard_normal(4), np.array([1.0, -2])
    problem = VelocityProblem(F2, xdot, W, a).stacked()
    posed = NULL_SPACE.build(problem).parts[0]
    N, q_p, dense = posed.keep["N"][0], posed.keep["q_p"][0], W.dense()
    np.testing.assert_allclose(F2 @ N, 0, atol=1e-14)
    np.testing.assert_allclose(N.T @ N, np.eye(2), atol=1e-14)
    np.testing.assert_allclose(q_p, np.linalg.pinv(F2) @ xdot, atol=1e-14)
    np.testing.assert_allclose(posed.qp.H[0], N.T @ dense @ N, atol=1e-13)
    np.testing.assert_allclose(posed.qp.g[0], N.T @ (a + dense @ q_p), atol=1e-13)
    assert posed.qp.A.shape == (1, 0, 2) and posed.qp.b.shape == (1, 0) and posed.qp.p == 0
    z = rng.standard_normal((1, 2))
    qdot, y = NULL_SPACE.recover(problem, posed, z, np.zeros((1, 0)))
    np.testing.assert_allclose(qdot[0], q_p + N @ z[0], atol=1e-14)
    np.testing.assert_allclose(y[0], -np.linalg.pinv(F2).T @ (dense @ qdot[0] + a), atol=1e-13)


def test_null_space_refuses_what_it_cannot_pose() -> None:
    """An xdot outside range J is refused with the miss; with no null space there is no QP; the rest is posed, by rank."""
    J = np.array([[[3.0, 0], [0, 0]], [[3.0, 0], [0, 0]], [[1, 0], [0, 1]], [[0, 0], [0, 0]], [[0, 0], [0, 0]]])
    xdot = np.array([[3.0, 0], [3, 0.25], [1, 1], [0, 0], [0, 2]])
    posing = NULL_SPACE.build(stacked(J, np.eye(2), xdot))
    assert sorted(tuple(posed.index.tolist()) for posed in posing.parts) == [(0,), (3,)]
    assert {posed.qp.n for posed in posing.parts} == {1, 2}
    assert posing.refused[1] == (Status.INFEASIBLE, "xdot misses the range of J by 0.25")
    assert posing.refused[4] == (Status.INFEASIBLE, "xdot misses the range of J by 2")
    assert posing.refused[2] == (Status.NOT_RUN, "J leaves no null space: there is no QP to pose")
    tall = np.array([[1.0, 0], [0, 1], [1, 1]])
    posing = NULL_SPACE.build(stacked(tall, np.eye(2), np.array([[1.0, 2, 3], [1, 2, 4]])))
    assert not posing.parts
    assert [posing.refused[i][0] for i in (0, 1)] == [Status.NOT_RUN, Status.INFEASIBLE]
    assert not NULL_SPACE.build(stacked(J[0], np.eye(2), xdot[1])).parts  # not even an empty stack


def test_null_space_consistency_turns_at_its_tolerance() -> None:
    """A miss of xdot counts from 50 n u (sigma_1 |q_p| + |xdot|) on."""
    J = np.array([[4.0, 0, 0], [0, 0, 0]])
    edge = CONSISTENCY * 3 * UNIT * (4 * 2 + 8)  # q_p = (2, 0, 0)
    for there in (8.0, -8.0):
        posing = NULL_SPACE.build(stacked(J, np.eye(3), np.array([[there, 0.99 * edge], [there, 1.01 * edge]])))
        assert posing.parts[0].index.tolist() == [0] and set(posing.refused) == {1}


def least_squares_problem() -> VelocityProblem:
    """Ranks 1 and 2 in one stack, xdot out of reach, Wx with cross terms."""
    J = np.array([[[1.0, 2, 0], [2, 4, 0], [0, 0, 0]], [[1, 0, 1], [0, 1, 1], [1, 1, 2]], [[0, 1, 0], [0, 3, 0], [0, 1, 0]]])
    Wx = np.array([[2.0, 1, 0], [1, 3, 1], [0, 1, 2]])
    W = np.array([[-1.0, 0, 1], [0, 9, 0], [1, 0, 7]])
    return stacked(J, W + 4 * np.eye(3), np.array([[1.0, 0, 2], [3, 1, 1], [-1, 2, 0]]), np.array([1.0, -1, 2]), Wx)


@pytest.mark.parametrize("formulation", [RANGE_SPACE, NORMAL_EQUATIONS], ids=lambda f: f.name)
def test_least_squares_rows(formulation) -> None:
    """The rows hold at the least-squares answer, are r or n in number, and y in Wx range J is recovered from theirs."""
    problem = least_squares_problem()
    truths = truth(problem, "least_squares")
    seen = 0
    for posed in formulation.build(problem).parts:
        for i, at in enumerate(posed.index):
            t, A, b = truths[at], posed.qp.A[i], posed.qp.b[i]
            assert posed.qp.p == (t.rank if formulation is RANGE_SPACE else 3)
            assert np.linalg.matrix_rank(A) == t.rank
            np.testing.assert_allclose(A @ t.x, b, atol=1e-13)
            np.testing.assert_array_equal(posed.qp.H[i], problem.W.dense()[at])
            np.testing.assert_array_equal(posed.qp.g[i], problem.a[at])
            slope = problem.W.dense()[at] @ t.x + problem.a[at]
            mu = np.linalg.lstsq(A.T, -slope, rcond=None)[0]
            x, y = formulation.recover(problem[posed.index[[i]]], posed[np.array([i])], t.x[None], mu[None])
            assert (x[0] == t.x).all()
            np.testing.assert_allclose(y[0], t.y, atol=1e-12)
            seen += 1
    assert seen == 3


def test_the_first_stage_is_the_target_alone() -> None:
    """Hierarchical poses 1/2 (J qdot - xdot)'Wx(J qdot - xdot) without its constant: singular H, no rows."""
    problem = least_squares_problem()
    seen = 0
    for posed in HIERARCHICAL.build(problem).parts:
        assert posed.qp.A.shape == (len(posed.index), 0, 3) and posed.qp.b.shape == (len(posed.index), 0)
        for i, at in enumerate(posed.index):
            J, Wx, xdot = problem.J[at], problem.Wx[at], problem.xdot[at]
            np.testing.assert_array_equal(posed.qp.H[i], J.T @ Wx @ J)
            np.testing.assert_array_equal(posed.qp.g[i], -J.T @ Wx @ xdot)
            seen += 1
    assert seen == 3


def test_what_is_posed_is_symmetric() -> None:
    """H of every formulation equals its transpose to the last bit, whatever rounding made of the products."""
    np.testing.assert_array_equal(symmetric(np.array([[[0.0, 2], [0, 1]]])), [[[0, 1], [1, 1]]])
    rng = np.random.default_rng(7)
    A, B = rng.standard_normal((4, 7, 7)), rng.standard_normal((4, 5, 5))
    J, Wx = rng.standard_normal((4, 5, 7)), B @ np.swapaxes(B, -1, -2)
    problem = stacked(J, A @ np.swapaxes(A, -1, -2), np.ones(5), None, Wx + np.swapaxes(Wx, -1, -2))
    product = np.swapaxes(J, -1, -2) @ problem.Wx @ J
    assert (product != np.swapaxes(product, -1, -2)).any()  # rounding does differ here
    for formulation in FORMULATIONS.values():
        for posed in formulation.build(problem).parts:
            np.testing.assert_array_equal(posed.qp.H, np.swapaxes(posed.qp.H, -1, -2))


def test_the_second_stage_holds_what_the_first_reached() -> None:
    """Whatever first answer comes in, the second has r rows that hold there, and the weight; y comes back as Wx U mu."""
    problem = least_squares_problem()
    rng = np.random.default_rng(0)
    for posed in HIERARCHICAL.build(problem).parts:
        part = problem[posed.index]
        first = rng.standard_normal((len(posed.index), 3))
        then = HIERARCHICAL.then(part, posed, first)
        r = np.linalg.matrix_rank(part.J[0])
        assert then.qp.A.shape == (len(posed.index), r, 3) and then.index.tolist() == posed.index.tolist()
        np.testing.assert_allclose((then.qp.A @ first[..., None])[..., 0], then.qp.b, atol=1e-13)
        np.testing.assert_array_equal(then.qp.H, part.W.dense())
        np.testing.assert_array_equal(then.qp.g, part.a)
        mu = rng.standard_normal((len(posed.index), r))
        _, y = HIERARCHICAL.recover(part, then, first, mu)
        for i in range(len(posed.index)):  # A'mu = J'y, and y is in Wx range J
            np.testing.assert_allclose(then.qp.A[i].T @ mu[i], part.J[i].T @ y[i], atol=1e-12)
            inside = np.linalg.solve(part.Wx[i], y[i])
            np.testing.assert_allclose(part.J[i] @ np.linalg.pinv(part.J[i]) @ inside, inside, atol=1e-12)
            # rows of the same span as those of the range-space form
            stack = np.vstack([then.qp.A[i], part.J[i].T @ part.Wx[i] @ part.J[i]])
            assert np.linalg.matrix_rank(stack) == r


def test_slack_is_the_augmented_arm() -> None:
    """H = blkdiag(lambda^2 W, Wx), g = (lambda^2 a, 0), rows [J I]; the fixture of methods C1 in fractions."""
    W, Wx, a = np.diag([1.0, 2, 3]), np.array([[2.0, 1], [1, 3]]), np.array([1.0, -1, 2])
    problem = stacked(F1, W, np.array([1.0, 1]), a, Wx)
    qp = SLACK.build(problem).parts[0].qp
    np.testing.assert_array_equal(qp.H[0], np.block([[DAMPING**2 * W, np.zeros((3, 2))], [np.zeros((2, 3)), Wx]]))
    np.testing.assert_array_equal(qp.g[0], [*(DAMPING**2 * a), 0, 0])
    np.testing.assert_array_equal(qp.A[0], np.hstack([F1, np.eye(2)]))
    np.testing.assert_array_equal(qp.b[0], [1, 1])
    plain = SLACK.build(stacked(F1, W, np.array([1.0, 1]), a)).parts[0].qp
    np.testing.assert_array_equal(plain.H[0, 3:, 3:], np.eye(2))


def test_the_multipliers_of_the_slack_rows_keep_their_sign() -> None:
    """Of min lambda^2 (1/2 x'Wx + a'x) + 1/2 s'Wx s, y = -Wx (xdot - J x): minus what the slack joints carry."""
    problem = stacked(F1, np.diag([1.0, 2, 3]), np.array([1.0, 1]), np.array([1.0, -1, 2]), np.array([[2.0, 1], [1, 3]]))
    posed = SLACK.build(problem).parts[0]
    answer = oracle.qp(*(f(v[0]) for f, v in zip(
        (oracle.rational, oracle.vector, oracle.rational, oracle.vector),
        (posed.qp.H, posed.qp.g, posed.qp.A, posed.qp.b), strict=True,
    )))  # fmt: skip
    x, y = SLACK.recover(problem, posed, np.array([answer.x], dtype=float), np.array([answer.y], dtype=float))
    assert x.shape == (1, 3)
    exact = oracle.damped(F1, [1, 1], np.diag([1.0, 2, 3]), [1, -1, 2], DAMPING, problem.Wx[0])
    assert answer.x == exact.x
    slack = [F(1) - v for v in oracle.apply(oracle.rational(F1), answer.x[:3])]
    assert answer.y == [-v for v in oracle.apply(oracle.rational(problem.Wx[0]), slack)]
    t = truth(problem, "damped")[0]
    np.testing.assert_allclose(x[0], t.x, rtol=1e-15)
    np.testing.assert_allclose(y[0], t.y, rtol=1e-15)


def test_some_of_the_posed() -> None:
    """Indexing a posed stack takes QPs, members and what is kept for recovery together."""
    problem = stacked(np.tile(F1, (3, 1, 1)), np.eye(3), np.array([[1.0, 1], [2, 0], [0, 3]]))
    posed = NULL_SPACE.build(problem).parts[0]
    some = posed[np.array([2, 0])]
    assert some.index.tolist() == [2, 0] and len(some.qp) == 2
    np.testing.assert_array_equal(some.keep["q_p"], posed.keep["q_p"][[2, 0]])
    np.testing.assert_array_equal(some.qp.g, posed.qp.g[[2, 0]])
