"""The identities of the framework (methods.md section 7), by seeded sweeps; tolerances are the forms' own bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from sandbox.closed_form import CLOSED_FORMS
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import times, transpose
from sandbox.tolerances import UNIT
from sandbox.weight import Weight

Array = np.ndarray
COUNT = 12
EXACT = [name for name, form in CLOSED_FORMS.items() if form.task == "exact"]
ANY_WEIGHT = [name for name in EXACT if CLOSED_FORMS[name].domain == "condition (7)"]


class Bench:
    """A form, and how far apart two of its answers to the same question may be."""

    def __init__(self, name: str, reach: Callable) -> None:
        self.form, self.reach = CLOSED_FORMS[name], reach

    def solve(self, problem: VelocityProblem) -> Solution:
        """Answers to every member; none may be refused."""
        answer = self.form.function(problem)
        assert all(status.answered for status in answer.status), answer.said
        return answer

    def slack(self, *problems: VelocityProblem) -> Array:
        """Absolute error (B,) that the forms' bounds allow over all of `problems`."""
        total = np.zeros(len(problems[0]))
        for problem in problems:
            x = self.solve(problem).x
            total += self.form.bound(problem) * self.reach(problem, x)
        assert (total < 1e-3 * (1 + total)).all()
        return total

    def same(self, x: Array, other: Array, *problems: VelocityProblem) -> None:
        """X and `other` agree within the bounds of `problems`."""
        assert (np.abs(x - other).max(axis=1) <= self.slack(*problems)).all()


@pytest.fixture(params=EXACT)
def bench(request: pytest.FixtureRequest, reach: Callable) -> Bench:
    """Every exact form in turn."""
    return Bench(request.param, reach)


@pytest.fixture
def problem(bench: Bench, manufactured: Callable, size: tuple[int, int]) -> VelocityProblem:
    """Manufactured problems in the form's domain: an indefinite W wherever it is admitted, C != 0 always (I4's warning)."""
    n, m = size
    positive = bench.form.domain == "W > 0"
    made = manufactured(np.random.default_rng(100 * n + m), n, m, COUNT, tangent=0.5, positive=positive)
    if not positive:
        assert (np.linalg.eigvalsh(made.W.base)[:, 0] < 0).any()
    return made


def changed(problem: VelocityProblem, **fields: object) -> VelocityProblem:
    """The same problem with other fields."""
    return VelocityProblem(**{"J": problem.J, "xdot": problem.xdot, "W": problem.W, "a": problem.a, **fields})


def null_basis(problem: VelocityProblem) -> Array:
    """Orthonormal N (B, n, n - m)."""
    return transpose(np.linalg.svd(problem.J)[2][:, problem.m :])


def random(problem: VelocityProblem, *shape: int, seed: int = 0) -> Array:
    """Normal entries, one block per member."""
    return np.random.default_rng(seed).normal(size=(len(problem), *shape))


def test_i1_and_stationarity(bench: Bench, problem: VelocityProblem) -> None:
    """I1: J qdot = xdot; and W qdot + a + J'y = 0, N'(W qdot + a) = 0."""
    answer = bench.solve(problem)
    slack = bench.slack(problem)
    size = np.abs(problem.J).sum(axis=2).max(axis=1)
    assert (np.abs(times(problem.J, answer.x) - problem.xdot).max(axis=1) <= slack * size).all()
    gradient = times(problem.W.base, answer.x) + problem.a
    weight = np.abs(problem.W.base).sum(axis=2).max(axis=1)
    assert (np.abs(gradient + times(transpose(problem.J), answer.y)).max(axis=1) <= 2 * problem.n * weight * slack).all()
    assert (np.abs(times(transpose(null_basis(problem)), gradient)).max(axis=1) <= 2 * problem.n * weight * slack).all()


def test_i4_tangent_weight_is_invisible(bench: Bench, problem: VelocityProblem) -> None:
    """I4: W + J'AJ gives the same qdot and y - A xdot."""
    A = random(problem, problem.m, problem.m)
    A = A @ transpose(A) if bench.form.domain == "W > 0" else A + transpose(A)
    other = changed(problem, W=problem.W.base + _symmetric(transpose(problem.J) @ A @ problem.J))
    one, two = bench.solve(problem), bench.solve(other)
    bench.same(one.x, two.x, problem, other)
    _same_multipliers(bench, problem, other, one.y - times(A, problem.xdot), two.y)


def test_i5_cross_weight_moves_with_the_gradient(bench: Bench, problem: VelocityProblem) -> None:
    """I5: W + J'B + B'J with a - B'xdot gives the same qdot and y - B qdot."""
    B = random(problem, problem.m, problem.n) / 8
    W = problem.W.base + _symmetric(transpose(problem.J) @ B + transpose(B) @ problem.J)
    if bench.form.domain == "W > 0":
        W = W + 4 * transpose(problem.J) @ problem.J + 0.5 * transpose(B) @ B
        W, kept = _symmetric(W), np.linalg.eigvalsh(W)[:, 0] > 1e-3
        B2, A = 0.5 * transpose(B) @ B, 4 * np.eye(problem.m)
        problem, W, B, B2 = problem[kept], W[kept], B[kept], B2[kept]
        base = changed(problem, W=_symmetric(problem.W.base + B2 + transpose(problem.J) @ (A @ problem.J)))
    else:
        base = problem
    other = changed(base, W=W, a=base.a - times(transpose(B), base.xdot))
    one, two = bench.solve(base), bench.solve(other)
    bench.same(one.x, two.x, base, other)
    _same_multipliers(bench, base, other, one.y - times(B, one.x), two.y)


def test_i6_gradient_along_the_task_is_invisible(bench: Bench, problem: VelocityProblem) -> None:
    """I6: a + J'mu gives the same qdot and y - mu."""
    mu = random(problem, problem.m)
    other = changed(problem, a=problem.a + times(transpose(problem.J), mu))
    one, two = bench.solve(problem), bench.solve(other)
    bench.same(one.x, two.x, problem, other)
    _same_multipliers(bench, problem, other, one.y - mu, two.y)


def test_i7_task_coordinates_do_not_matter(bench: Bench, problem: VelocityProblem) -> None:
    """I7: J -> TJ, xdot -> T xdot gives the same qdot and T^-T y."""
    T = np.eye(problem.m) + random(problem, problem.m, problem.m) / (2 * problem.m)
    other = changed(problem, J=T @ problem.J, xdot=times(T, problem.xdot))
    one, two = bench.solve(problem), bench.solve(other)
    bench.same(one.x, two.x, problem, other)
    _same_multipliers(bench, problem, other, one.y, times(transpose(T), two.y))


def test_i7b_powers_of_two_on_rows_change_no_bit(manufactured: Callable, size: tuple[int, int]) -> None:
    """I7B: rows of J and xdot scaled by powers of two leave the qdot of eq6, and of kkt and the SVD forms, bit for bit."""
    problem = manufactured(np.random.default_rng(7), *size, COUNT, tangent=0.5)
    T = 2.0 ** np.random.default_rng(8).integers(-20, 21, (COUNT, size[1]))
    other = changed(problem, J=T[:, :, None] * problem.J, xdot=T * problem.xdot)
    for name in ("eq6", "eq6_orthonormal", "null_space", "kkt", "eq13"):
        one, two = CLOSED_FORMS[name].function(problem), CLOSED_FORMS[name].function(other)
        np.testing.assert_array_equal(one.x, two.x, err_msg=name)
        np.testing.assert_array_equal(one.y, T * two.y, err_msg=name)


def test_i8_powers_of_two_on_the_objective_change_no_bit(manufactured: Callable, size: tuple[int, int]) -> None:
    """I8: (W, a) scaled by a power of two leaves qdot bit for bit, and scales y by it."""
    problem = manufactured(np.random.default_rng(9), *size, COUNT, tangent=0.5)
    for c in (2.0**-30, 0.5, 2.0**41):
        other = changed(problem, W=c * problem.W.base, a=c * problem.a)
        for name in ("eq6", "eq6_orthonormal", "null_space"):
            one, two = CLOSED_FORMS[name].function(problem), CLOSED_FORMS[name].function(other)
            np.testing.assert_array_equal(one.x, two.x, err_msg=name)
            np.testing.assert_array_equal(c * one.y, two.y, err_msg=name)


def test_i8_homogeneity(bench: Bench, problem: VelocityProblem) -> None:
    """I8: (W, a) -> c (W, a) keeps qdot; W -> cW alone divides the part along null J by c."""
    other = changed(problem, W=3 * problem.W.base, a=3 * problem.a)
    bench.same(bench.solve(problem).x, bench.solve(other).x, problem, other)
    still, half = changed(problem, a=0 * problem.a), changed(problem, W=2 * problem.W.base)
    x, x0, x2 = (bench.solve(p).x for p in (problem, still, half))
    assert (np.abs((x2 - x0) - (x - x0) / 2).max(axis=1) <= 2 * bench.slack(problem, still, half)).all()


def test_i9_joint_coordinates_do_not_matter(bench: Bench, problem: VelocityProblem) -> None:
    """I9, I10: q = S p with S any nonsingular matrix, or a permutation: J -> JS, W -> S'WS, a -> S'a gives S^-1 qdot."""
    n = problem.n
    mild = np.eye(n) + random(problem, n, n) / (3 * n)
    permutation = np.broadcast_to(np.eye(n)[np.random.default_rng(3).permutation(n)], mild.shape)
    for S in (mild, permutation):
        W = _symmetric(transpose(S) @ problem.W.base @ S)
        other = changed(problem, J=problem.J @ S, W=W, a=times(transpose(S), problem.a))
        answer = times(S, bench.solve(other).x)
        slack = bench.slack(problem) + 4 * bench.slack(other)
        assert (np.abs(answer - bench.solve(problem).x).max(axis=1) <= slack).all()


def test_i11_linear_in_the_data(bench: Bench, problem: VelocityProblem) -> None:
    """I11: affine in alpha; SOL(x1 + x2, a1 + a2) = SOL(x1, a1) + SOL(x2, a2); SOL(-xdot, -a) = -SOL(xdot, a)."""
    x2, a2 = random(problem, problem.m), random(problem, problem.n)
    other, both = changed(problem, xdot=x2, a=a2), changed(problem, xdot=problem.xdot + x2, a=problem.a + a2)
    x, y, z = (bench.solve(p).x for p in (problem, other, both))
    assert (np.abs(x + y - z).max(axis=1) <= 2 * bench.slack(problem, other, both)).all()
    mirrored = bench.solve(changed(problem, xdot=-problem.xdot, a=-problem.a)).x
    bench.same(mirrored, -x, problem)
    alphas = [changed(problem, a=alpha * problem.a) for alpha in (0.0, 1.0, 2.0)]
    x0, x1, x2 = (bench.solve(p).x for p in alphas)
    assert (np.abs(x2 - 2 * x1 + x0).max(axis=1) <= 4 * bench.slack(*alphas)).all()


def inverse_of(bench: Bench, problem: VelocityProblem) -> tuple[Array, Array]:
    """(G, slack): the generalised inverse column by column, and what its entries may be off by."""
    columns, slack = [], 0.0
    for i in range(problem.m):
        basis = np.zeros((len(problem), problem.m))
        basis[:, i] = 1
        unit = changed(problem, xdot=basis, a=np.zeros_like(problem.a))
        columns.append(bench.solve(unit).x)
        slack = slack + bench.slack(unit)
    return np.stack(columns, axis=2), np.asarray(slack)


def test_i12_generalised_inverse(bench: Bench, problem: VelocityProblem) -> None:
    """I12: JG = I, JGJ = J, GJG = G, (GJ)^2 = GJ, WGJ symmetric, N'WG = 0, GJ = I - N S_N^-1 N'W; indefinite W too."""
    G, slack = inverse_of(bench, problem)
    J, W, N = problem.J, problem.W.base, null_basis(problem)
    S = transpose(N) @ W @ N
    GJ = G @ J
    size = np.prod([1 + np.abs(A).sum(axis=2).max(axis=1) for A in (W, G, J)], axis=0)
    projector = np.eye(problem.n) - N @ np.linalg.solve(S, transpose(N) @ W)
    for difference in (
        J @ G - np.eye(problem.m), J @ GJ - J, GJ @ G - G, GJ @ GJ - GJ, W @ GJ - transpose(W @ GJ),
        transpose(N) @ W @ G, GJ - projector,
    ):  # fmt: skip
        assert (np.abs(difference).max(axis=(1, 2)) <= problem.n * size**2 * slack).all()


def test_i13_null_response(bench: Bench, problem: VelocityProblem) -> None:
    """I13 and 1.2: qdot answers a with -N S_N^-1 N'a, whatever basis N; for W > 0 that is (GJ - I) W^-1 a."""
    moving, still = changed(problem, xdot=0 * problem.xdot), changed(problem, a=0 * problem.a)
    N = null_basis(problem) @ (np.eye(problem.n - problem.m) + random(problem, *(2 * [problem.n - problem.m])) / 8)
    expected = -times(N, np.linalg.solve(transpose(N) @ problem.W.base @ N, transpose(N) @ problem.a[:, :, None])[:, :, 0])
    slack = bench.slack(moving)
    assert (np.abs(bench.solve(moving).x - expected).max(axis=1) <= slack).all()
    response = bench.solve(problem).x - bench.solve(still).x
    assert (np.abs(response - expected).max(axis=1) <= slack + bench.slack(problem, still)).all()
    if bench.form.domain == "W > 0":
        G, off = inverse_of(bench, problem)
        step = np.linalg.solve(problem.W.base, problem.a[:, :, None])[:, :, 0]
        allowed = slack + problem.n**2 * off * np.abs(step).max(axis=1)
        assert (np.abs(times(G @ problem.J, step) - step - expected).max(axis=1) <= allowed).all()


def test_i14_the_answer_is_the_minimum(bench: Bench, problem: VelocityProblem) -> None:
    """I14: phi(qdot + N y) - phi(qdot) = 1/2 y'S_N y > 0: no step along null J does better."""
    x, N = bench.solve(problem).x, null_basis(problem)
    W = problem.W.base
    for seed in range(3):
        y = random(problem, problem.n - problem.m, seed=seed)
        step = times(N, y)
        rise = _value(problem, x + step) - _value(problem, x)
        expected = (step * times(W, step)).sum(axis=1) / 2
        reached = 1 + np.abs(x).max(axis=1) + np.abs(step).max(axis=1)
        size = np.abs(W).sum(axis=(1, 2)) * reached**2 + np.abs(problem.a).sum(axis=1)
        assert (np.abs(rise - expected) <= 100 * UNIT * size + problem.n * size * bench.slack(problem)).all()
        assert (expected > 0).all() and (rise > 0).all()


def test_i15_multiplier_is_the_price(bench: Bench, problem: VelocityProblem) -> None:
    """I15: d phi*/d xdot = -y: phi* is quadratic, so a symmetric difference gives it exactly but for rounding."""
    answer = bench.solve(problem)
    direction = random(problem, problem.m)
    up, down = (changed(problem, xdot=problem.xdot + sign * direction) for sign in (1, -1))
    slope = (_value(problem, bench.solve(up).x) - _value(problem, bench.solve(down).x)) / 2
    weight = np.abs(problem.W.base).sum(axis=(1, 2)) + np.abs(problem.a).sum(axis=1)
    size = weight * (1 + np.abs(bench.solve(up).x).max(axis=1) + np.abs(bench.solve(down).x).max(axis=1)) ** 2
    assert (np.abs(slope + (answer.y * direction).sum(axis=1)) <= problem.n**2 * size * bench.slack(problem, up, down)).all()


def test_i16_determinants_and_inertia(manufactured: Callable, size: tuple[int, int]) -> None:
    """I16: det [J; N'W]^2 = det(S_N)^2 det(JJ')/det(N'N); inertia of the KKT matrix and of W; Finsler's threshold."""
    n, m = size
    problem = manufactured(np.random.default_rng(16), n, m, COUNT, tangent=0.5)
    J, W, N = problem.J, problem.W.base, null_basis(problem)
    S = transpose(N) @ W @ N
    left = np.linalg.det(np.concatenate([J, transpose(N) @ W], axis=1)) ** 2
    right = np.linalg.det(S) ** 2 * np.linalg.det(J @ transpose(J))
    np.testing.assert_allclose(left, right, rtol=1e-8)
    K = np.block([[W, transpose(J)], [J, np.zeros((COUNT, m, m))]])
    assert ((np.linalg.eigvalsh(K) > 0).sum(axis=1) == n).all() and ((np.linalg.eigvalsh(K) < 0).sum(axis=1) == m).all()
    Y = np.linalg.pinv(J)
    S_tangent = transpose(Y) @ W @ Y - transpose(Y) @ W @ N @ np.linalg.solve(S, transpose(N) @ W @ Y)
    negative = (np.linalg.eigvalsh(W) < 0).sum(axis=1)
    np.testing.assert_array_equal(negative, (np.linalg.eigvalsh(_symmetric(S_tangent)) < 0).sum(axis=1))
    threshold = -np.linalg.eigvalsh(_symmetric(S_tangent))[:, 0]
    step = 1e-6 * (1 + np.abs(threshold))
    for sign in (1, -1):
        shifted = W + (threshold + sign * step)[:, None, None] * (transpose(J) @ J)
        assert ((np.linalg.eigvalsh(shifted)[:, 0] > 0) == (sign > 0)).all()


def test_i17_alpha_drives_f_down(bench: Bench, problem: VelocityProblem) -> None:
    """I17: grad f'(qdot(alpha) - qdot(0)) = -alpha grad f'N S_N^-1 N'grad f < 0 for alpha > 0."""
    N = null_basis(problem)
    still = changed(problem, a=0 * problem.a)
    x0 = bench.solve(still).x
    inner = times(transpose(N), problem.a)
    curvature = np.linalg.solve(transpose(N) @ problem.W.base @ N, inner[:, :, None])[:, :, 0]
    expected = -(inner * curvature).sum(axis=1)
    for alpha in (0.5, 2.0):
        moved = changed(problem, a=alpha * problem.a)
        drop = (problem.a * (bench.solve(moved).x - x0)).sum(axis=1)
        assert (np.abs(drop - alpha * expected) <= np.abs(problem.a).sum(axis=1) * 4 * bench.slack(moved, still)).all()
        assert (drop < 0).all()


def test_i18_all_forms_agree(bench: Bench, problem: VelocityProblem, reach: Callable) -> None:
    """I18: every form gives the answer of every other in their common domain, multipliers included."""
    one = bench.solve(problem)
    others = [*EXACT, "eq13"] if bench.form.domain == "W > 0" else [*ANY_WEIGHT, "eq13"]
    for name in others:
        other = Bench(name, reach)
        two = other.solve(problem)
        slack = bench.slack(problem) + other.slack(problem)
        assert (np.abs(one.x - two.x).max(axis=1) <= slack).all(), name
        weight = np.abs(problem.W.base).sum(axis=2).max(axis=1)
        assert (np.abs(times(transpose(problem.J), one.y - two.y)).max(axis=1) <= 2 * problem.n * weight * slack).all(), name


def test_i2_any_basis_of_the_null_space(manufactured: Callable, size: tuple[int, int]) -> None:
    """I2: with N -> NC the rows N'W span the same: the kernel's basis and an orthonormal one give one answer (see I18);
    written out with C drawn at random, [J; C'N'W]^-1 [xdot; -C'N'a] is eq6's answer too.
    """
    n, m = size
    problem = manufactured(np.random.default_rng(2), n, m, COUNT, tangent=0.5)
    C = np.eye(n - m) + random(problem, n - m, n - m) / (2 * n)
    N = null_basis(problem) @ C
    A = np.concatenate([problem.J, transpose(N) @ problem.W.base], axis=1)
    b = np.concatenate([problem.xdot, -times(transpose(N), problem.a)], axis=1)
    x = np.linalg.solve(A, b[:, :, None])[:, :, 0]
    form = CLOSED_FORMS["eq6"]
    difference = np.abs(form.function(problem).x - x).max(axis=1)
    assert (difference <= 2 * form.bound(problem) * np.abs(x).max(axis=1) * 10).all()


def test_i3_secondary_weights_do_not_matter(size: tuple[int, int]) -> None:
    """I3: with exactly n - m functions the gamma_i of (8), (9) change nothing, and [J; E] qdot = [xdot; gbar]."""
    n, m = size
    rng = np.random.default_rng(33)
    J, E = rng.normal(size=(COUNT, m, n)), rng.normal(size=(COUNT, n - m, n))
    xdot, gbar = rng.normal(size=(COUNT, m)), rng.normal(size=(COUNT, n - m))
    direct = np.linalg.solve(np.concatenate([J, E], axis=1), np.concatenate([xdot, gbar], axis=1)[:, :, None])[:, :, 0]
    condition = np.linalg.cond(np.concatenate([J, E], axis=1))
    for gamma in (np.ones((COUNT, n - m)), 10.0 ** rng.uniform(-3, 3, (COUNT, n - m))):
        a = -times(transpose(E), gamma * gbar)
        problem = VelocityProblem(J=J, xdot=xdot, W=Weight(np.zeros((n, n)), E, gamma), a=a)
        form = CLOSED_FORMS["eq6"]
        answer, bound = form.function(problem), form.bound(problem)
        N = null_basis(problem)
        spread = gamma.max(axis=1) / gamma.min(axis=1) if n - m > 1 else np.ones(COUNT)
        allowed = bound + 50 * n * UNIT * condition * np.linalg.cond(E @ N) * spread
        assert (np.abs(answer.x - direct).max(axis=1) <= allowed * np.abs(direct).max(axis=1)).all()


def test_i19_diagonal_weight_is_scaled_joints(bench: Bench) -> None:
    """I19: W diagonal: qdot = W^-1/2 (J W^-1/2)^+ xdot."""
    rng = np.random.default_rng(19)
    d = rng.uniform(0.5, 4, (COUNT, 5))
    problem = VelocityProblem(J=rng.normal(size=(COUNT, 3, 5)), xdot=rng.normal(size=(COUNT, 3)), W=d[:, :, None] * np.eye(5))
    root = np.sqrt(d)
    expected = times(np.linalg.pinv(problem.J / root[:, None, :]), problem.xdot) / root
    bench.same(bench.solve(problem).x, expected, problem)


def test_i20_payload_at_the_tip_changes_nothing(bench: Bench) -> None:
    """I20: the inertia matrix M and M + mu J'J give the same rates, also at mu = -3 where it is indefinite."""
    M, J = np.array([[8.0, 4, 2], [4, 3, 1], [2, 1, 1]]), np.array([[-1.0, -1, 0], [2, 1, 1]])
    mus = (0.0, 5.0) if bench.form.domain == "W > 0" else (0.0, 5.0, -3.0)
    for mu in mus:
        problem = VelocityProblem(J=J, xdot=[0.25, 0.5], W=M + mu * J.T @ J).stacked()
        bench.same(bench.solve(problem).x, np.array([[0, -0.25, 0.75]]), problem)


def test_i25_damping_goes_to_the_pseudoinverse_and_to_the_transpose() -> None:
    """I25: DLS -> J^+ xdot as O(lambda^2); lambda^2 DLS -> J'xdot; and the formula (J'J + lambda^2)^-1 J'xdot."""
    rng = np.random.default_rng(25)
    problem = VelocityProblem(J=rng.normal(size=(COUNT, 3, 5)), xdot=rng.normal(size=(COUNT, 3)), W=np.eye(5))
    damped = CLOSED_FORMS["damped_least_squares"].function
    exact = times(np.linalg.pinv(problem.J), problem.xdot)
    off = [np.abs(damped(problem, damping=damping).x - exact).max(axis=1) for damping in (2.0**-6, 2.0**-7)]
    np.testing.assert_allclose(off[0] / off[1], 4, rtol=2e-2)
    transposed = times(transpose(problem.J), problem.xdot)
    np.testing.assert_allclose(damped(problem, damping=2.0**12).x * 2.0**24, transposed, rtol=1e-5, atol=1e-5)
    H = transpose(problem.J) @ problem.J + 0.25 * np.eye(5)
    np.testing.assert_allclose(damped(problem, damping=0.5).x, np.linalg.solve(H, transposed[:, :, None])[:, :, 0], atol=1e-12)


def test_weighted_damping_is_its_normal_equations() -> None:
    """With W, a and Wx: (lambda^2 W + J'Wx J) qdot = J'Wx xdot - lambda^2 a, and y = Wx (J qdot - xdot)."""
    rng = np.random.default_rng(26)
    G, H = rng.normal(size=(COUNT, 3, 3)), rng.normal(size=(COUNT, 5, 5))
    Wx, W = _symmetric(G @ transpose(G) + np.eye(3)), _symmetric(H @ transpose(H) + np.eye(5))
    problem = VelocityProblem(
        J=rng.normal(size=(COUNT, 3, 5)), xdot=rng.normal(size=(COUNT, 3)), W=W, a=rng.normal(size=(COUNT, 5)), Wx=Wx
    )
    answer = CLOSED_FORMS["damped_least_squares"].function(problem, damping=0.5)
    J = problem.J
    left = 0.25 * W + transpose(J) @ Wx @ J
    right = times(transpose(J) @ Wx, problem.xdot) - 0.25 * problem.a
    np.testing.assert_allclose(answer.x, np.linalg.solve(left, right[:, :, None])[:, :, 0], atol=1e-10)
    np.testing.assert_allclose(answer.y, times(Wx, times(J, answer.x) - problem.xdot), atol=1e-10)


def test_i26_eq13_beside_its_neighbours() -> None:
    """I26: at full rank eq13 is eq6 and Wx is irrelevant; Wx -> c Wx changes nothing; consistent xdot makes Wx irrelevant;
    and it is the limit of (J'Wx J + eps W)^-1 (J'Wx xdot - eps a), off by O(eps).
    """
    rng = np.random.default_rng(27)
    eq6, eq13 = CLOSED_FORMS["eq6"].function, CLOSED_FORMS["eq13"].function
    G = rng.normal(size=(COUNT, 3, 3))
    Wx = _symmetric(G @ transpose(G) + np.eye(3))
    full = VelocityProblem(J=rng.normal(size=(COUNT, 3, 5)), xdot=rng.normal(size=(COUNT, 3)), W=np.eye(5), a=np.ones(5), Wx=Wx)
    np.testing.assert_allclose(eq13(full).x, eq6(full).x, atol=1e-10)
    J = (rng.integers(-3, 4, (COUNT, 3, 2)) @ rng.integers(-3, 4, (COUNT, 2, 5))).astype(float)
    keep = np.linalg.matrix_rank(J) == 2
    J, Wx = J[keep], Wx[keep]
    count = len(J)
    fields = {"J": J, "W": np.eye(5), "a": np.ones(5)}
    off = VelocityProblem(**fields, xdot=rng.normal(size=(count, 3)), Wx=Wx)
    np.testing.assert_allclose(eq13(off).x, eq13(VelocityProblem(**fields, xdot=off.xdot, Wx=4 * Wx)).x, atol=1e-10)
    on = times(J, rng.integers(-3, 4, (count, 5)).astype(float))
    weighted, plain = VelocityProblem(**fields, xdot=on, Wx=Wx), VelocityProblem(**fields, xdot=on)
    np.testing.assert_allclose(eq13(weighted).x, eq13(plain).x, atol=1e-10)
    limits = []
    for eps in (1e-3, 1e-4):
        left = transpose(J) @ Wx @ J + eps * np.eye(5)
        right = times(transpose(J) @ Wx, off.xdot) - eps * off.a
        limits.append(np.abs(np.linalg.solve(left, right[:, :, None])[:, :, 0] - eq13(off).x).max(axis=1))
    np.testing.assert_allclose(limits[1] / limits[0], 0.1, rtol=0.05)


def test_i32_any_rates_are_their_own_answer(bench: Bench, problem: VelocityProblem) -> None:
    """I32: SOL(J, W, -W qdot*, J qdot*) = qdot* for any qdot*."""
    wanted = random(problem, problem.n)
    posed = changed(problem, xdot=times(problem.J, wanted), a=-times(problem.W.base, wanted))
    answer = bench.solve(posed)
    bench.same(answer.x, wanted, posed)


def _symmetric(A: Array) -> Array:
    return (A + transpose(A)) / 2


def _value(problem: VelocityProblem, x: Array) -> Array:
    return (x * times(problem.W.base, x)).sum(axis=1) / 2 + (problem.a * x).sum(axis=1)


def _same_multipliers(bench: Bench, problem: VelocityProblem, other: VelocityProblem, y: Array, z: Array) -> None:
    """J'y and J'z agree to what the errors of both answers allow through W."""
    weight = (np.abs(problem.W.base) + np.abs(other.W.base)).sum(axis=2).max(axis=1)
    size = weight * bench.slack(problem, other) * problem.n
    J = np.abs(problem.J).sum(axis=1).max(axis=1)
    sigma = np.linalg.svd(problem.J)[1][:, -1]
    assert (np.abs(y - z).max(axis=1) * sigma <= 4 * size * np.maximum(1, J)).all()
