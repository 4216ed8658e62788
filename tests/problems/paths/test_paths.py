"""Curves: that displacement and velocity belong together, that corners are where the velocity jumps, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from problems.paths import PATHS, load
from problems.paths.path import Path
from problems.robots.planar import PLANAR_3R
from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError
from sandbox.tolerances import UNIT

NAMES = sorted(PATHS)
SIZES = {"straight": "length", "square": "side", "circle": "radius", "figure_eight": "size"}


@pytest.mark.parametrize("name", NAMES)
def test_velocity_is_the_derivative_of_displacement_on_every_piece(name: str) -> None:
    """Fourth-order central differences of the displacement inside each piece are the velocity."""
    path = load(name)
    h = 1e-3 * path.duration
    for a, b in path.pieces:
        t = np.linspace(a + 2 * h, b - 2 * h, 9)
        slope = (8 * (path.displacement(t + h) - path.displacement(t - h))
                 - (path.displacement(t + 2 * h) - path.displacement(t - 2 * h))) / (12 * h)  # fmt: skip
        # truncated: h^4/30 of the fifth derivative, (2 pi)^5 for a circle and 32 times that for the eight
        speed = np.abs(path.velocity(t)).max()
        truncated = 32 * (2 * np.pi) ** 4 * 1e-12 / 30
        np.testing.assert_allclose(slope, path.velocity(t), rtol=0, atol=(truncated + 1e3 * UNIT) * speed)


@pytest.mark.parametrize("name", NAMES)
def test_a_path_starts_where_the_hand_is_and_is_continuous(name: str) -> None:
    """Displacement is zero at 0, the same on both sides of a corner, and zero again at the end of a closed path."""
    path = load(name)
    np.testing.assert_array_equal(path.displacement(np.array(0.0)), np.zeros(3))
    size = np.abs(path.displacement(np.linspace(0, path.duration, 50))).max()
    for corner in path.corners:
        before, after = path.displacement(np.nextafter(corner, [0, np.inf]))
        np.testing.assert_allclose(before, after, rtol=0, atol=8 * UNIT * size)
    end = path.displacement(np.array(path.duration))
    assert path.closed == (np.abs(end).max() < 1e-12 * size)


def test_the_square_is_that_of_the_catalogue() -> None:
    """Sides (-s, 0), (0, s), (s, 0), (0, -s) in this order, a quarter of the time each; the velocity after a corner is its."""
    path = load("square", side=0.4, duration=8.0)
    assert path.corners == pytest.approx((2.0, 4.0, 6.0), abs=8 * UNIT)
    np.testing.assert_allclose(
        path.displacement(np.array([2.0, 4.0, 6.0, 8.0]))[:, :2], [[-0.4, 0], [-0.4, 0.4], [0, 0.4], [0, 0]], atol=1e-15
    )
    np.testing.assert_allclose(path.velocity(np.array([2.0, np.nextafter(2.0, 0)]))[:, :2], [[0, 0.2], [-0.2, 0]], atol=1e-15)


@pytest.mark.parametrize("name", ["square", "circle", "figure_eight"])
def test_a_plane_is_any_two_orthonormal_directions(name: str) -> None:
    """The same curve in a turned plane is the turned curve."""
    turned = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    t = np.linspace(0.0, 4.0, 13)
    flat, other = load(name), load(name, plane=turned[:2])
    np.testing.assert_allclose(other.displacement(t), flat.displacement(t)[:, :2] @ turned[:2], atol=1e-15)
    np.testing.assert_array_equal(load(name, plane="yz").velocity(t)[:, 1:], flat.velocity(t)[:, :2])


@pytest.mark.parametrize("name", sorted(SIZES))
def test_size_and_duration_scale_the_curve(name: str) -> None:
    """Twice the size is twice the displacement; twice the duration is half the velocity."""
    small, large, slow = (load(name, **{SIZES[name]: size}, duration=d) for size, d in ((0.1, 1.0), (0.2, 1.0), (0.1, 2.0)))
    t = np.linspace(0.0, 1.0, 7)
    np.testing.assert_allclose(large.displacement(t), 2 * small.displacement(t), atol=1e-15)
    np.testing.assert_allclose(slow.velocity(2 * t), small.velocity(t) / 2, atol=1e-15)


@pytest.mark.parametrize("name", sorted(SIZES))
@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf, [0.1, 0.2], "wide"])
def test_a_size_or_duration_that_is_not_one_positive_number_is_refused(name: str, bad: object) -> None:
    """Zero, negative, NaN, infinite, two numbers or a word: refused, and the message names the option."""
    for option in (SIZES[name], "duration"):
        with pytest.raises((RangeError, NonFiniteError, ShapeError), match=option):
            load(name, **{option: bad})


def test_unknown_names_and_shapes_are_refused() -> None:
    """A path, a plane or a direction that is none is refused and the message says what there is."""
    with pytest.raises(UnknownNameError, match="figure_eight"):
        load("triangle")
    with pytest.raises(UnknownNameError, match="xy"):
        load("circle", plane="zy")
    with pytest.raises(ShapeError, match="orthonormal"):
        load("circle", plane=[[1, 0, 0], [1, 1, 0]])
    with pytest.raises(ShapeError, match="direction"):
        load("straight", direction=(0, 0, 0))
    with pytest.raises(ShapeError, match="direction"):
        load("straight", direction=(1, 0))


def test_a_path_that_contradicts_itself_is_refused() -> None:
    """Closed but open, corners out of order, not starting at the hand, wrong shapes: each by its own words."""

    def line(t: np.ndarray) -> np.ndarray:
        return np.asarray(t)[..., None] * np.array([1.0, 0, 0])

    def rate(t: np.ndarray) -> np.ndarray:
        return np.zeros(np.shape(t))[..., None] + np.array([1.0, 0, 0])

    good = {"name": "mine", "duration": 1.0, "displacement": line, "velocity": rate, "closed": False}
    Path(**good)
    with pytest.raises(RangeError, match="said to be closed"):
        Path(**{**good, "closed": True})
    with pytest.raises(RangeError, match="ascend"):
        Path(**good, corners=(0.5, 0.5))
    with pytest.raises(RangeError, match="ascend"):
        Path(**good, corners=(1.0,))
    with pytest.raises(RangeError, match="start"):
        Path(**{**good, "displacement": lambda t: line(t) + 1})
    with pytest.raises(ShapeError, match="velocity"):
        Path(**{**good, "velocity": lambda t: rate(t)[..., :2]})
    with pytest.raises(RangeError, match="duration"):
        Path(**{**good, "duration": 0.0})


def test_the_singular_paths_meet_what_they_are_named_for() -> None:
    """From their start, full reach of planar_3r lies 3 - sqrt 5 m out, and det [J; 1 1 1] = 0 with the wrist 2 m out."""
    outward = load("through_kinematic_singularity", length=3 - np.sqrt(5))
    start = np.array(outward.start)
    tip = PLANAR_3R.forward(start)[0]
    reach = tip + outward.displacement(np.array(outward.duration))
    assert np.linalg.norm(reach) == pytest.approx(3.0, abs=8 * UNIT)
    across = load("through_algorithmic_singularity", length=2 - np.sqrt(2))
    wrist = tip - np.array([np.cos(start.sum()), np.sin(start.sum()), 0]) + across.displacement(np.array(across.duration))
    assert np.linalg.norm(wrist) == pytest.approx(2.0, abs=8 * UNIT)
    rows = np.vstack([PLANAR_3R.jacobian(start), np.ones(3)])
    assert np.linalg.det(rows) == pytest.approx(np.sin(start[1]), abs=16 * UNIT)


@pytest.mark.parametrize("wrong", ["double", "opposite", "still", "second side", "slightly"])
def test_a_velocity_that_is_not_the_derivative_is_refused(wrong: str) -> None:
    """Twice the velocity, its opposite, none, one wrong after a corner only, or a thousandth off: each is refused."""
    bent = load("square", side=0.4, duration=4.0)
    factor = {"double": 2.0, "opposite": -1.0, "still": 0.0, "second side": 1.0, "slightly": 1.001}[wrong]

    def velocity(t: np.ndarray) -> np.ndarray:
        late = (np.asarray(t) >= 1) & (np.asarray(t) < 2) & (wrong == "second side")
        return bent.velocity(t) * np.where(late, 0.5, factor)[..., None]

    given = {"name": "mine", "duration": 4.0, "displacement": bent.displacement, "closed": True, "corners": bent.corners}
    Path(**given, velocity=bent.velocity)
    with pytest.raises(RangeError, match="velocity of mine is not the derivative"):
        Path(**given, velocity=velocity)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_closing_is_a_share_of_the_path(size: float) -> None:
    """A millionth of its size off makes a path open and its start wrong, a rounding does not, be it a micrometre or a world."""
    eight = load("figure_eight", size=size)
    ahead = np.array([size, 0.0, 0.0])

    def off(by: float, ramp: bool) -> Path:
        def displacement(t: np.ndarray) -> np.ndarray:
            return eight.displacement(t) + by * ahead * (np.asarray(t)[..., None] / 4 if ramp else 1.0)

        def velocity(t: np.ndarray) -> np.ndarray:
            return eight.velocity(t) + (by / 4 * ahead if ramp else 0.0)

        return Path(name="mine", duration=4.0, displacement=displacement, velocity=velocity, closed=True)

    off(1e-15, True), off(1e-15, False)
    with pytest.raises(RangeError, match="said to be closed"):
        off(1e-6, True)
    with pytest.raises(RangeError, match="must start there"):
        off(1e-6, False)


def test_size_and_options_by_name() -> None:
    """A size is the curve's own, told apart from its other options; an option that is none, or the size again, is refused."""
    for name, option in SIZES.items():
        t = np.linspace(0.0, 1.0, 5)
        np.testing.assert_array_equal(load(name, 0.3).displacement(t), load(name, **{option: 0.3}).displacement(t))
        for size, unknown in ((None, "colour"), (0.3, "colour"), (0.3, option)):
            if unknown == "size":  # which is what load calls it
                continue
            with pytest.raises(UnknownNameError, match=f"no option of {name} is called '{unknown}'"):
                load(name, size, **{unknown: 0.3})


def test_curves_left_to_themselves() -> None:
    """Their sizes and durations where nothing is said: a line of .3 m in 1 s, the others in 4 s."""
    assert [load(name).duration for name in ("straight", "square", "circle", "figure_eight")] == [1.0, 4.0, 4.0, 4.0]
    assert load("straight").displacement(np.array(1.0)) == pytest.approx([0.3, 0, 0])
    assert load("square").displacement(np.array(1.0)) == pytest.approx([-0.4, 0, 0])
    assert load("circle").displacement(np.array(2.0)) == pytest.approx([-0.4, 0, 0])
    assert load("figure_eight").displacement(np.array(1.0)) == pytest.approx([0.2, 0, 0])
