"""A made-up method study: cards, agreement, and motions of toy arms along closed and open paths."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from sandbox.records import METHODS, MOTIONS, write_parquet

Array = np.ndarray

TAGS = "<script>window.hacked = 2</script> & <b>\"bold\"</b> 'quoted'"


def _card(id: str, name: str, title: str, **more: Any) -> dict[str, Any]:
    return {
        "id": id, "name": name, "title": title, "formula": "qdot = J^+ xdot - alpha (I - J^+J) grad f", "weight": "I",
        "vector": "alpha grad f", "condition": "always", "number": "[1], [16]", "certainty": "certain",
        "works": ["A. Author, A title of a work, A Journal 7(12), 1977, doi 10.1000/1"], "form": "eq6", "task": "exact",
        "refuses": ["a gradient of the wrong length"],
    } | more  # fmt: skip


CARDS: list[dict[str, Any]] = [
    _card("M1", "gradient_projection", "Liegeois gradient projection"),
    _card("M11", "augmented", "Augmented Jacobian", weight="sum gamma_i grad g_i grad g_i'",
          vector="-sum gamma_i gbar_i grad g_i", condition="iff det [J; E] is not 0", number="[17], [18]",
          certainty="very likely"),
    _card("M16", "inertia", "Manipulator inertia", weight="M(q)", vector="0", formula="qdot = M^-1 J' (J M^-1 J')^-1 xdot",
          number="[6]", certainty="guess", works=[TAGS, "A second work"]),
    _card("M18", "integrable", "Mussa-Ivaldi and Hogan " + TAGS, weight="C^-1 - Gamma", vector="0", condition="iff N'WN > 0",
          refuses=["off equilibrium", "C not positive definite"]),
    _card("C2", "transpose", "Jacobian transpose", number="", certainty="not identified", form="jacobian_transpose", task=None),
    _card("C3", "idle", "Never studied", works=[], refuses=[]),
]  # fmt: skip


def write_methods(folder: Path) -> None:
    """Write methods/ and motions/ of a run folder."""
    write_parquet(pa.Table.from_pylist(_study(), schema=METHODS), folder / "methods" / "part-0.parquet")
    write_parquet(pa.Table.from_pylist(motions(), schema=MOTIONS), folder / "motions" / "part-0.parquet")


def _study() -> list[dict[str, Any]]:
    rows = []
    for card in CARDS[:5]:
        for robot, n, m in (("planar_3r", 3, 2), ("planar_4r", 4, 2), ("panda", 7, 6)):
            for shift in (None, "J'AJ", "J'B + B'J") if card["form"] == "eq6" else (None,):
                refused = 3 if card["name"] == "integrable" else 0
                words = {"N'WN is not positive definite " + TAGS: 2, "off equilibrium": 1} if refused else {}
                short = int(card["name"] == "inertia" and robot == "panda" and shift is not None)
                row = dict(method=card["name"], robot=robot, n=n, m=m, shift=shift, situations=200, held=200 - refused)
                row |= dict(refused=refused, refusals=json.dumps(words), indefinite=200 if shift else 0, seconds=0.0123)
                if card["name"] != "transpose":  # it has no original
                    ratio = 1.7 if short else 0.031
                    row |= dict(agreed=200 - refused - short, difference_median=3e-16, difference_max=4.2e-13, ratio_max=ratio)
                rows.append(row)
    return rows


# ---- toy arms ---------------------------------------------------------------------------------------------------------------


def _planar(q: Array) -> Array:
    """Base, joints and hand (n + 2, 3) of an arm of unit links in the plane; base and first joint coincide."""
    turn = np.cumsum(q)
    steps = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(q))])
    return np.vstack([np.zeros((2, 3)), np.cumsum(steps, axis=0)])


def _spatial(q: Array) -> Array:
    """Base, joints and hand (9, 3) of an arm whose seven axes are by turns upright and across."""
    at, turn, points = np.zeros(3), np.eye(3), [np.zeros(3)]
    for k, angle in enumerate(q):
        points.append(at)
        c, s = np.cos(angle), np.sin(angle)
        turn = turn @ np.array([[[c, -s, 0], [s, c, 0], [0, 0, 1]], [[c, 0, s], [0, 1, 0], [-s, 0, c]]][k % 2])
        at = at + turn @ np.array([0.0, 0.0, (0.33, 0.0, 0.32, 0.08, 0.38, 0.09, 0.1)[k]])
    return np.vstack([points, at])


def _jacobian(arm: Callable[[Array], Array], q: Array, m: int) -> Array:
    h = 1e-6
    return np.column_stack([(arm(q + h * e)[-1] - arm(q - h * e)[-1])[:m] / (2 * h) for e in np.eye(len(q))])


def _moved(
    name: str, robot: str, arm: Callable[[Array], Array], q: Array, m: int, weight: Callable[[Array], Array] | None, *,
    path: str = "circle", cycles: int = 4, steps: int = 60, stopped: str | None = None, damping: float | None = None,
) -> dict[str, Any]:  # fmt: skip
    """A motion by J qdot = xdot with the weight's pseudoinverse, or with sum(q) held where there is none; Heun's steps."""
    radius, closed = 0.25 * np.ptp(arm(q)), path == "circle"
    rate = 2 * np.pi

    def wanted(t: float) -> Array:
        step = np.array([-np.sin(rate * t), np.cos(rate * t), 0.0]) if closed else np.array([-0.6 / rate, 0.2 / rate, 0.0])
        return (radius * rate * step)[:m]

    def law(q: Array, t: float) -> Array:
        J = _jacobian(arm, q, m)
        if weight is None:
            E = np.vstack([np.ones(len(q)), np.arange(len(q)) ** 2])[: len(q) - m]
            return np.linalg.lstsq(np.vstack([J, E]), np.concatenate([wanted(t), np.zeros(len(E))]), rcond=None)[0]
        inverse = np.linalg.inv(weight(q))
        return inverse @ J.T @ np.linalg.solve(J @ inverse @ J.T, wanted(t))

    T = steps * cycles + 1 if stopped is None else steps * cycles // 3
    t, h = np.arange(T) / steps, 1 / steps
    path_q = [np.asarray(q, float)]
    for instant in t[:-1]:
        first = law(path_q[-1], instant)
        second = law(path_q[-1] + h * first, instant + h)
        path_q.append(path_q[-1] + h * (first + second) / 2)
    qs = np.array(path_q)
    hand = np.array([arm(one)[-1] for one in qs])
    sigma = np.array([np.linalg.svd(_jacobian(arm, one, m), compute_uv=False)[-1] for one in qs])
    reduced = sigma**2 / 5 if stopped is None else np.linspace(0.3, -0.01, T)
    reduced[3] = np.nan
    frames = np.arange(0, T, steps if closed and stopped is None else max(1, T // 9))
    ends = qs[steps::steps] if closed and stopped is None else np.empty((0, len(q)))
    return dict(
        method=name, robot=robot, path=path, closed=closed, cycles=cycles, integrator="heun", stopped=stopped, n=len(q), m=m,
        t=t, q=qs.ravel(), qdot=np.gradient(qs, h, axis=0).ravel(), hand=hand.ravel(),
        task_error=1e-12 + np.abs(np.cumsum(np.sin(9 * t))) * 1e-10, lambda_min_reduced=reduced, sigma_min_J=sigma,
        arm=np.array([arm(qs[k]) for k in frames]).ravel(), frames=len(frames),
        drift=np.linalg.norm(ends - qs[0], axis=1) if closed else None,
        bracket=0.0 if weight is None else 0.083 if closed else None,
        singularities=json.dumps(_met(sigma, t, stopped, damping)), share=float(t[-1] / cycles), peak_rate=1.5 + (damping or 0),
        damping=damping, secondary_error=None if damping is None else 0.19 * damping,
    )  # fmt: skip


def _met(sigma: Array, t: Array, stopped: str | None, damping: float | None) -> list[dict[str, Any]]:
    """One minimum of sigma_min(J); of a motion that stopped, its end too, and of one that shows a damping that alone."""
    i = int(np.argmin(sigma))
    near = {"kind": "kinematic", "how": "minimum", "of": "sigma_min(J)", "t": float(t[i]), "value": float(sigma[i])}
    end = {"kind": "algorithmic", "how": "end", "of": "sigma_min(N'E')", "t": float(t[-1]), "value": 3.3e-8}
    return [] if damping else [near] * (damping is None) + [end] * (stopped is not None)


@cache
def motions() -> list[dict[str, Any]]:
    """Rows of records.MOTIONS: planar and spatial arms, laws that drift and one that does not, one stopped early; a damping."""
    identity = lambda q: np.eye(len(q))  # noqa: E731
    heavy = lambda q: np.diag(np.arange(len(q), 0.0, -1) ** 2)  # noqa: E731
    three, four = np.array([0.2, 1.3, -1.1]), np.array([0.1, 1.2, -0.9, 0.8])
    why = f"N'WN is not positive definite at t = 1.2 s {TAGS}"
    seven = np.array([0.3, 0.6, -0.2, 1.5, 0.1, 0.9, 0.2])
    return [
        _moved("gradient_projection", "planar_3r", _planar, three, 2, identity, cycles=6),
        _moved("gradient_projection", "panda", _spatial, seven, 3, identity),
        _moved("gradient_projection", "planar_4r", _planar, four, 2, identity, path="straight", cycles=1),
        _moved("augmented", "planar_3r", _planar, three, 2, None, cycles=6),
        _moved("inertia", "planar_3r", _planar, three, 2, heavy, cycles=6),
        _moved("inertia", "planar_4r", _planar, four, 2, heavy),
        _moved("integrable", "planar_3r", _planar, three, 2, identity, stopped=why),
        *(
            _moved(name, "planar_3r", _planar, three, 2, None, path="into", cycles=1, stopped=end, damping=damping)
            for name, damping, end in (("transpose", 0.1, None), ("augmented", 0.0, why), ("transpose", 0.01, None))
        ),
    ]
