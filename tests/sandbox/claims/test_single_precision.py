"""Section V's experiment: single precision and nothing but, the samples, and what is counted over them."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims import single_elementwise
from sandbox.claims.claim import Trial
from sandbox.claims.single_compiled import by_kernels, planar_jacobian
from sandbox.claims.single_elementwise import by_elements
from sandbox.claims.single_precision import (
    BINS,
    LARGEST,
    SAMPLES,
    SIZES,
    _one,
    condition,
    near_singular,
    pooled_largest,
    study,
    tail_index,
    uniform,
)
from sandbox.tolerances import FORWARD

Array = np.ndarray

SINGLE_UNIT = 2.0**-24

both = pytest.mark.parametrize("path", [by_kernels, by_elements])
samples = pytest.mark.parametrize("sample", [uniform(3, 0, 20_000), near_singular(3, 20_000)], ids=["uniform", "near_singular"])


@samples
def test_the_kernels_round_to_float32_after_every_operation_and_fuse_none(sample: tuple[Array, Array]) -> None:
    """They agree bit for bit with numpy's elementwise float32, which rounds after each."""
    for ours, other in zip(by_kernels(*sample), by_elements(*sample), strict=True):
        assert ours.dtype == other.dtype
        assert np.array_equal(ours, other, equal_nan=True)


@both
def test_single_precision_is_in_the_types(path) -> None:
    """J, the rates and one of the evaluations are float32; the other evaluation is float64."""
    J, rates, single, double = path(*uniform(0, 0, 10))
    assert (J.dtype, rates.dtype, single.dtype, double.dtype) == (np.float32, np.float32, np.float32, np.float64)
    assert (J.shape, rates.shape, single.shape, double.shape) == ((10, 2, 3), (2, 10, 3), (2, 10), (2, 10))


def test_a_sum_kept_in_double_would_show() -> None:
    """J J' summed in double and rounded once, as fused operations do in part, changes the rates of most samples."""
    q, xdot = uniform(3, 1)
    J, rates, _, _ = by_kernels(q, xdot)
    columns = J.transpose(1, 2, 0)
    wide = single_elementwise.normal_equations(columns.astype(np.float64), xdot.T.astype(np.float64))
    assert (rates[0] != wide.T.astype(np.float32)).any(axis=1).mean() > 0.5


def test_one_product_kept_in_double_would_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single multiply-add fused, xdot_2 - l21 y_1, changes the rates of some samples."""
    q, xdot = uniform(3, 1)
    J, rates, _, _ = by_kernels(q, xdot)
    (a, b, c), (d, e, f) = J.transpose(1, 2, 0)
    l11 = np.sqrt(a * a + b * b + c * c)
    l21 = (d * a + e * b + f * c) / l11
    l22 = np.sqrt((d * d + e * e + f * f) - l21 * l21)
    y1 = xdot[:, 0] / l11
    for fused in (False, True):
        kind = np.float64 if fused else np.float32
        rest = (xdot[:, 1].astype(kind) - l21.astype(kind) * y1.astype(kind)).astype(np.float32)
        y2 = rest / l22 / l22
        z = (y1 - l21 * y2) / l11
        x = np.stack([a * z + d * y2, b * z + e * y2, c * z + f * y2], axis=1)
        assert x.dtype == np.float32
        assert (x == rates[0]).all() != fused


def test_samples_are_those_of_the_paper() -> None:
    """Angles fill [-pi, pi]^3 evenly, velocities have unit norm to rounding and every direction; seeds and samples differ."""
    q, xdot = uniform(0, 0)
    assert q.shape == (SAMPLES, 3) and q.dtype == xdot.dtype == np.float32
    assert np.abs(q).max() <= np.float32(np.pi)
    assert np.abs(np.linalg.norm(xdot.astype(float), axis=1) - 1).max() <= 4 * SINGLE_UNIT
    for values in (*q.T, np.arctan2(xdot[:, 1], xdot[:, 0])):
        share = np.histogram(values, 8, (-np.pi, np.pi))[0] / SAMPLES
        assert np.abs(share - 1 / 8).max() < 0.02
    assert not np.array_equal(q, uniform(0, 1)[0]) and not np.array_equal(q, uniform(1, 0)[0])
    assert np.array_equal(q, uniform(0, 0)[0])


def test_draws_near_singular_arms_cover_the_decades() -> None:
    """Each of the decades of cond(J) from 10 to 1000 holds a fifth of them or more."""
    cond = condition(planar_jacobian(near_singular(0, 10_000)[0]))
    for low in (10, 100):
        assert ((cond >= low) & (cond < 10 * low)).mean() > 0.2


@both
def test_the_jacobian_is_that_of_the_robot(path) -> None:
    """Of planar_3r at the same angles, to a few roundings of float32."""
    q, xdot = uniform(0, 5, 50)
    robot = robots.load("planar_3r")
    exact = np.stack([robot.jacobian(one)[:2] for one in q.astype(float)])
    assert np.abs(path(q, xdot)[0] - exact).max() <= 20 * SINGLE_UNIT


@both
def test_both_methods_solve_the_problem(path) -> None:
    """Their rates are the pseudoinverse's: (6) to cond(J) roundings, (2)-(5) to its square."""
    q, xdot = uniform(0, 6, 1000)
    J, rates, _, _ = path(q, xdot)
    exact = (np.linalg.pinv(J.astype(float)) @ xdot.astype(float)[:, :, None])[:, :, 0]
    off = np.linalg.norm(rates - exact, axis=2) / np.linalg.norm(exact, axis=1)
    cond = condition(J)
    assert (off[0] <= FORWARD * 3 * SINGLE_UNIT * cond**2).all()
    assert (off[1] <= FORWARD * 3 * SINGLE_UNIT * cond).all()


@both
def test_errors_are_those_of_the_rates(path) -> None:
    """|xdot - J qdot| in float64, and in float32 the same but for rounding of its terms."""
    q, xdot = uniform(0, 7, 1000)
    J, rates, single, double = path(q, xdot)
    for x, one, two in zip(rates.astype(float), single, double, strict=True):
        exact = np.linalg.norm(xdot - np.einsum("bij,bj->bi", J.astype(float), x), axis=1)
        terms = 1 + np.einsum("bij,bj->b", np.abs(J).astype(float), np.abs(x))
        assert (np.abs(two - exact) <= 1e-14 * terms).all()
        assert (np.abs(one - exact) <= 4 * SINGLE_UNIT * terms).all()


@both
def test_where_the_cholesky_factor_is_lost_there_are_no_rates(path) -> None:
    """Near enough to a singularity J J' is not positive definite in float32: (2)-(5) gives NaN there, (6) rates everywhere."""
    J, rates, single, _ = path(*near_singular(0, 20_000))
    lost = np.isnan(rates).any(axis=2)
    assert lost[0].any() and not lost[1].any()
    assert (np.isnan(single) == lost).all()
    assert condition(J)[lost[0]].min() > 1e3


def test_the_condition_number_is_numpys() -> None:
    """By entries and minors, also near singular arms."""
    J = planar_jacobian(near_singular(1, 2000)[0])
    cond = condition(J)
    assert (np.abs(cond / np.linalg.cond(J.astype(float)) - 1) <= 1e-14 * cond).all()


def _made(errors: Array) -> tuple:
    count = errors.shape[1]
    J = np.tile(np.array([[1, 0, 0], [0, 1, 0]], np.float32), (count, 1, 1))
    rates = np.zeros((2, count, 3), np.float32)
    rates[1, count // 2 :] = 1
    return _one(J, rates, errors.astype(np.float32), errors)


def test_what_is_counted() -> None:
    """Shares, means, worst cases and growth of errors made for it, cond(J) = 1 throughout, one sample lost by (2)-(5)."""
    errors = np.ones((2, SAMPLES))
    errors[0, : SAMPLES // 4], errors[1, SAMPLES // 2 : 3 * SAMPLES // 4] = 2, 4
    errors[0, 0], errors[0, 1] = np.nan, 8
    single, double, _, same, growing_mean, growing_worst, largest, counts, lost = _made(errors)
    mean, median, high, worst, shares = single
    assert shares.tolist() == [25, 25, 50] and same == 50 and lost == 1
    assert worst.tolist() == [8, 4] and median.tolist() == [1, 1] and high.tolist() == [2, 4]
    given = errors[:, 1:]
    assert np.allclose(mean, given.mean(axis=1), rtol=1e-12) and all(map(np.array_equal, single, double))
    assert np.allclose(growing_mean, [given[:, : size - 1].mean(axis=1) for size in SIZES], rtol=1e-12)
    assert [row.tolist() for row in growing_worst] == [[8, 1], [8, 1], [8, 1], [8, 1], [8, 4]]
    assert largest.shape == (3, LARGEST) and largest[:, :2].tolist() == [[8, 2], [4, 4], [1, 1]]
    assert counts.shape == (len(BINS), 3) and counts[0].tolist() == [SAMPLES // 4, SAMPLES // 4, SAMPLES // 2]


def test_digests_tell_every_bit_and_no_sign_of_zero() -> None:
    """One error by one bit, or one rate, is another digest; a zero of the other sign, or a NaN of another pattern, is not."""
    errors = np.zeros((2, SAMPLES))
    errors[0, 0] = np.nan
    digest = _made(errors)[2]
    signed, turned = errors.copy(), errors.copy()
    signed[1, 5], turned[0, 0] = -0.0, -np.nan
    assert _made(signed)[2] == _made(turned)[2] == digest
    signed[1, 5] = np.nextafter(np.float32(0), np.float32(1))
    assert _made(signed)[2] != digest


def test_a_study_is_its_samples_one_after_the_other() -> None:
    """Row k is sample k; the tails of all are pooled."""
    found = study(by_elements, Trial(full=False, seed=4))
    _, _, single, _ = by_elements(*uniform(4, 2))
    assert found.single.worst[2].tolist() == single.max(axis=1).tolist()
    values, share = pooled_largest(found, 0)
    assert values[0] == found.single.worst[:, 0].max() and (np.diff(values) <= 0).all()
    assert share[0] == 1 / (len(found) * SAMPLES)
    # half of what a seed keeps is enough: no seed fills the pool alone
    assert found.largest[:, 0, -1].max() < values[-1]


@pytest.mark.parametrize("index", [1.0, 2.0])
def test_the_tail_index_of_a_power_is_its_exponent(index: float) -> None:
    """Of values whose share above x is x^-s, the largest 1 % of 100,000."""
    drawn = np.sort(np.random.default_rng(0).uniform(size=100_000) ** (-1 / index))[::-1]
    assert abs(tail_index(drawn[:1000]) - index) < 0.1 * index
