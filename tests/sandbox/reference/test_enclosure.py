"""What is proved in floats is so: minimisers, multipliers, rank and inertia against exact rationals, never once wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox import lanes
from sandbox.certificate_study import FAMILIES, faults
from sandbox.problem import VelocityProblem
from sandbox.reference import enclosure, truth
from sandbox.reference.certified import proved
from sandbox.reference.enclosure import enclosed, inertias
from sandbox.weight import Weight

Array = np.ndarray


def wrong(problem: VelocityProblem, truths: Any = None) -> list[str]:
    """What certificates say of a stack that is not so."""
    return faults(enclosed(problem), proved(problem), truth(problem) if truths is None else truths)


@pytest.fixture
def afresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Machine code of an altered text is kept apart from that of the text."""
    monkeypatch.setattr(lanes, "CACHE", tmp_path)
    enclosure.machine.cache_clear()
    yield
    enclosure.machine.cache_clear()


# ---- never wrong -----------------------------------------------------------------------------------------------


def test_no_certificate_is_wrong(decided: list[Any]) -> None:
    """On 5,000 problems of all sets and families class, rank, inertia and every entry are as certified, or nothing is said."""
    assert sum(len(problem) for _, problem, _ in decided) >= 5000
    for name, problem, truths in decided:
        if problem.m <= problem.n:
            assert not wrong(problem, truths), (name, problem.m, problem.n)


def test_certificates_close(decided: list[Any]) -> None:
    """Not by silence: every well-conditioned minimum is enclosed, and most of the others; saddles and maxima are told."""
    closing: dict[str, list[bool]] = {}
    for name, problem, truths in decided:
        if problem.m > problem.n:
            continue
        found = enclosed(problem)
        up, down = inertias(problem) if problem.m < problem.n else np.full((2, len(problem)), -1)
        for i, one in enumerate(truths):
            if one.expected == "unique_minimum" and one.rank == problem.m:
                closing.setdefault(name, []).append(bool(found.proved[i]))
            elif one.reason in ("saddle", "maximum") and one.rank == problem.m:
                closing.setdefault(f"{name}, no minimum", []).append((up[i], down[i]) == one.inertia[:2])
    shares = {name: float(np.mean(each)) for name, each in closing.items()}
    for name in (
        "manufactured",
        "indefinite",
        "near_singular",
        "badly_scaled",
        "planar",
        "seven_joint",
        "methods",
        "trajectories",
    ):
        assert shares[name] == 1.0, name
    for name in ("no_minimum, no minimum", "manufactured, no minimum"):
        assert shares[name] == 1.0, name
    assert min(shares["units"], shares["factored"], shares["indefinite, no minimum"], shares["integer"]) > 0.9
    assert 0.5 < shares["conditioning"] < 1 and 0.2 < shares["edge"] < 1 and 0.2 < shares["extreme"] < 1


def test_one_joint_and_one_row() -> None:
    """The smallest problem, W of either sign or zero: x = xdot / J, y = -(W x + a) / J."""
    rng = np.random.default_rng(72)
    problem = VelocityProblem(
        J=rng.normal(size=(40, 1, 1)),
        xdot=rng.normal(size=(40, 1)),
        W=rng.integers(-1, 2, (40, 1, 1)) / 3,
        a=rng.normal(size=(40, 1)),
    )
    assert enclosed(problem).proved.all() and not wrong(problem)


def test_a_motion_at_rest_is_enclosed() -> None:
    """With xdot = 0 and a = 0 zero is within every radius, and the radii are next to nothing."""
    rng = np.random.default_rng(73)
    problem = VelocityProblem(J=rng.normal(size=(9, 2, 4)), xdot=np.zeros(2), W=np.eye(4))
    found = enclosed(problem)
    assert found.proved.all() and (np.abs(found.x) <= found.x_radius).all() and found.x_radius.max() < 1e-100
    assert not wrong(problem)


def test_an_enclosure_is_as_narrow_as_twice_the_precision(decided: list[Any]) -> None:
    """Of the planar arms the radius is below 1e-24 of the largest joint rate: the centre x + x_low is known to 80 bits."""
    for name, problem, _ in decided:
        if name == "planar":
            found = enclosed(problem)
            assert (found.x_radius.max(axis=1) < 1e-24 * np.abs(found.x).max(axis=1)).all()


# ---- where nothing is proved ------------------------------------------------------------------------------------


@pytest.mark.parametrize("entry", [2.0**-201, 2.0**201, -(2.0**-210), 1e-140, 1e140])
@pytest.mark.parametrize("field", ["J", "xdot", "W", "E", "gamma", "a"])
def test_an_entry_out_of_range_goes_to_exact_arithmetic(field: str, entry: float) -> None:
    """One entry of any array beyond 2^-200..2^200: nothing is said of that member, and its neighbours are as before."""
    rng = np.random.default_rng(74)
    parts = {
        "J": rng.normal(size=(6, 2, 3)), "xdot": rng.normal(size=(6, 2)), "a": rng.normal(size=(6, 3)),
        "W": np.tile(np.eye(3), (6, 1, 1)), "E": rng.normal(size=(6, 1, 3)), "gamma": np.ones((6, 1, 1)),
    }  # fmt: skip

    def built() -> VelocityProblem:
        return VelocityProblem(J=parts["J"], xdot=parts["xdot"], a=parts["a"], W=Weight(parts["W"], parts["E"], parts["gamma"]))

    before = enclosed(built())
    parts[field] = parts[field].copy()
    parts[field][2].flat[0] = entry
    after = enclosed(built())
    others = np.arange(6) != 2
    assert before.proved.all() and (after.proved == others).all()
    for part in ("x", "x_low", "x_radius", "y", "y_low", "y_radius"):
        np.testing.assert_array_equal(getattr(after, part)[others], getattr(before, part)[others])
        assert np.isnan(getattr(after, part)[2]).all()
    assert list(inertias(built())[0]) == [1 if ok or field in ("xdot", "a") else -1 for ok in others]


@pytest.mark.parametrize(
    "J, W, why",
    [
        ([[1.0, 2, 3], [2, 4, 6]], np.eye(3), "rows that depend on each other"),
        ([[0.1, 0.2, 0.3], [0.3, 0.6, 0.9]], np.eye(3), "rows that depend on each other, but for rounding"),
        ([[0.0, 0, 0], [3, 2, 1]], np.eye(3), "a row of zeros"),
        ([[1.0, 1, 0], [0, 1, 1]], np.ones((3, 3)), None),
        ([[1.0, 1, 0], [0, 1, 1]], np.diag([1.0, -2, 1]), "N'WN = 0"),
        ([[1.0, 1, 0], [0, 1, 1]], np.diag([1.0, -4, 1]), "a maximum"),
    ],
)
def test_no_minimum_is_enclosed_where_there_is_none(J: Any, W: Array, why: str | None) -> None:
    """Lower rank and curvature that is not positive are refused."""
    problem = VelocityProblem(J=J, xdot=[0.0, 1.0], W=W, a=[1.0, 0, 0]).stacked()
    assert enclosed(problem).proved[0] == (why is None)


def test_arithmetic_that_overflows_proves_nothing() -> None:
    """Entries at the ends of the range whose answer leaves that of float64: refused, not infinite."""
    near, far = 2.0**-199, 2.0**199
    problem = VelocityProblem(J=[[[near]]], xdot=[[far]], W=Weight([[[0.0]]], [[[far]]], [[[far]]]), a=[[1.0]])
    assert not enclosed(problem).proved.any()


# ---- approximations may come from anywhere ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["eq6", "multipliers", "transposed_substitute", "backward", "null_vectors"])
def test_a_poor_approximation_spoils_nothing(name: str, monkeypatch: pytest.MonkeyPatch, afresh: None) -> None:
    """Answer, multipliers, inverses and null vectors off by 2^-20: certificates are other ones, or silent, and right."""
    kernels = enclosure.traced()
    sound = kernels[name]
    place = {"eq6": -1, "multipliers": -1, "transposed_substitute": 1, "backward": 1, "null_vectors": 2}[name]

    def worse(*arguments: Any) -> Any:
        result = sound(*arguments)
        values = arguments[place]
        for at in np.ndindex(values.shape if name != "null_vectors" else (arguments[1], values.shape[1])):
            values[at] = values[at] * (1 + 2.0**-20)
        return result

    rng = np.random.default_rng(75)
    stacks = [FAMILIES[family](rng, 2, 4, 60) for family in ("units", "indefinite", "factored")]
    before = [enclosed(problem) for problem in stacks]
    monkeypatch.setitem(kernels, name, worse)
    enclosure.machine.cache_clear()
    for path in lanes.CACHE.iterdir():
        path.unlink()
    closed, other = 0, 0
    for problem, old in zip(stacks, before, strict=True):
        found = enclosed(problem)
        assert not faults(found, proved(problem), truth(problem))  # type: ignore[arg-type]
        assert not (found.proved & ~old.proved).any()
        closed += int(found.proved.sum())
        other += int(((found.x_radius != old.x_radius) | (found.y_radius != old.y_radius)[:, :1]).any(axis=1).sum())
    assert closed > 60 and other > 120


@pytest.mark.parametrize("what", ["identity", "zeros", "turned"])
def test_eigenvectors_may_come_from_anywhere(what: str, monkeypatch: pytest.MonkeyPatch, decided: list[Any]) -> None:
    """The inertia proved with whatever stands for eigenvectors is the exact one; a singular Q proves nothing."""
    eigh, rng = np.linalg.eigh, np.random.default_rng(76)

    def other(S: Array) -> tuple[Array, Array]:
        values, Q = eigh(S)
        k = S.shape[-1]
        stand = {
            "identity": np.eye(k) + 0 * Q,
            "zeros": np.where(np.arange(k) == 0, 0.0, Q),
            "turned": Q + 1e-3 * rng.normal(size=Q.shape),
        }
        return values, stand[what]

    monkeypatch.setattr(np.linalg, "eigh", other)
    told = 0
    for name, problem, truths in decided:
        if name in ("no_minimum", "indefinite", "edge") and problem.m < problem.n:
            up, down = inertias(problem)
            for i in np.flatnonzero(up >= 0):
                assert (up[i], down[i], 0) == truths[i].inertia and truths[i].rank == problem.m
                told += 1
    assert told == 0 if what == "zeros" else told > 50


# ---- planted faults ---------------------------------------------------------------------------------------------


def hard(family: str, m: int, n: int, count: int = 150) -> VelocityProblem:
    """Problems of one family that bring a fault to light."""
    return FAMILIES[family](np.random.default_rng(5), m, n, count)


def ends() -> VelocityProblem:
    """One joint, one row, a factored weight, at the ends of the range: y is about 1e-354."""
    near, far = 1.1 * 2.0**-199, 1.3 * 2.0**199
    return VelocityProblem(J=[[[far]]], xdot=[[near]], W=Weight([[[0.0]]], [[[near]]], [[[near]]]), a=[[0.0]])


def radii(share: float) -> Callable[..., Any]:
    whole = enclosure.enclose
    return lambda **given: tuple(part * share if i in (2, 5) else part for i, part in enumerate(whole(**given)))


def pair(change: Callable[[Array, Array, Array], tuple[Array, Array, Array]]) -> Callable[..., Any]:
    whole = enclosure._pair
    return lambda *given: change(*whole(*given))


def plain_cholesky() -> Callable[..., Any]:
    """Cholesky without shift, and its inverse believed."""

    def positive(S: Array, radius: Array, run: Any) -> Any:
        L = S.copy()
        enclosure.demand(run["cholesky"](L))
        H = enclosure.identity_below(0, len(S))
        for row in H:
            run["forward"](L, row)
            run["backward"](L, row)
        return enclosure._Inverse(H, 0.0, 0.0)

    return positive


def without_drift() -> Any:
    whole = enclosure._Frame.of.__func__  # type: ignore[attr-defined]

    def of(cls: Any, *given: Any) -> Any:
        frame = whole(cls, *given)
        return replace(frame, drift=frame.drift * 0.0)

    return classmethod(of)


def reduced_without_radius() -> Any:
    whole = enclosure._Frame.reduced
    return lambda self, weight: (whole(self, weight)[0], whole(self, weight)[1] * 0.0)


PLANTED: dict[str, tuple[Any, str, Callable[[], Any], Callable[[], VelocityProblem]]] = {
    "radii are halved": (enclosure, "enclose", lambda: radii(0.5), lambda: hard("units", m=3, n=3, count=1500)),
    "radii are zero": (enclosure, "enclose", lambda: radii(0.0), lambda: hard("indefinite", m=2, n=3)),
    "rounding is dropped": (enclosure, "_gamma", lambda: lambda terms: 0.0, lambda: hard("factored", m=2, n=3)),
    "any inverse will do": (enclosure, "CONTRACTION", lambda: 10.0, lambda: hard("conditioning", m=2, n=4)),
    "underflow is dropped": (enclosure, "FLOOR", lambda: 0.0, ends),
    "residuals are of single precision": (
        enclosure, "_pair", lambda: pair(lambda s, low, off: (s, low * 0.0, off)), lambda: hard("units", m=2, n=3),
    ),
    "the low part has the wrong sign": (
        enclosure, "_pair", lambda: pair(lambda s, low, off: (s, -low, off)), lambda: hard("units", m=2, n=3),
    ),
    "Cholesky goes without its shift": (enclosure, "_positive", plain_cholesky, lambda: hard("edge", m=2, n=4)),
    "null vectors are taken for exact": (enclosure._Frame, "of", without_drift, lambda: hard("conditioning", m=2, n=4)),
    "N'WN is taken for exact": (enclosure._Frame, "reduced", reduced_without_radius, lambda: hard("conditioning", m=2, n=4)),
    "inverses bound nothing": (
        enclosure._Inverse, "bound", lambda: lambda self, v: v * 0.0, lambda: hard("indefinite", m=3, n=3),
    ),
    "multipliers are taken for exact": (
        enclosure._Inverse, "transposed_bound", lambda: lambda self, v: v * 0.0, lambda: hard("indefinite", m=2, n=3),
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", PLANTED)
def test_a_planted_fault_is_caught(fault: str, monkeypatch: pytest.MonkeyPatch, afresh: None) -> None:
    """Each bound is needed: without it a hard case is certified wrongly, and the comparison with exact rationals says so."""
    where, name, plant, cases = PLANTED[fault]
    problem = cases()
    truths = truth(problem)
    assert not wrong(problem, truths)
    monkeypatch.setattr(where, name, plant())
    enclosure.machine.cache_clear()
    for path in lanes.CACHE.iterdir():
        path.unlink()
    assert wrong(problem, truths)


def test_a_fault_in_the_inertia_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Signs of eigenvalues in floats, believed without bounds: wrong at the edge, and seen to be."""
    problem = hard("integer", 3, 7)
    truths = truth(problem)
    assert not wrong(problem, truths)
    proved(problem)  # the machine code is as it was
    monkeypatch.setattr(enclosure, "UP", 0.0)  # what stands beside the diagonal then does not count
    assert any("inertia" in line for line in wrong(problem, truths))
