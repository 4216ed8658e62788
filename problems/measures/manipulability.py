"""Manipulability w = sqrt(det JJ') and ln w (Yoshikawa 1985; methods M5)."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.measures.jacobian import require_full_rank
from problems.measures.measure import Card, Measure, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin

Array = np.ndarray

VOLUME = Card(
    "manipulability", "product of the task units per rad", "volume of the ellipsoid of task velocities",
    "Yoshikawa 1985; methods M5", "everywhere; no gradient where J has no full row rank",
)  # fmt: skip
LOG_VOLUME = Card(
    "log_manipulability", "1", "logarithm of the manipulability: other task units only add to it",
    "Yoshikawa 1985; methods M5", "where J has full row rank",
)  # fmt: skip


def volume() -> Measure:
    """Measure w = sqrt(det JJ'), the product of the singular values; its unit is that of the task rows' product.

    The gradient refuses a Jacobian without full row rank (RankDeficientError). Scaling a task row scales w.
    """
    return symbolic(*VOLUME[:4], _volume, domain=VOLUME.domain, smooth=_regular, value=_product)


def log_volume() -> Measure:
    """Measure ln w; refuses a Jacobian without full row rank (RankDeficientError)."""
    return symbolic(*LOG_VOLUME[:4], _log_volume, domain=LOG_VOLUME.domain, guard=_regular)


def _product(robot: Robot, q: Array) -> Array:
    """Product (...,) of the singular values of J."""
    return np.prod(np.linalg.svd(robot.jacobian(q), compute_uv=False), axis=-1)


def _regular(robot: Robot, q: Array) -> None:
    J = robot.jacobian(q)
    require_full_rank(robot, J, np.linalg.svd(J, compute_uv=False), "manipulability has no gradient there: keep away")


def _triangular(twin: Twin) -> Symbol:
    """Diagonal of the triangular factor of J': its product is w, without the squares of JJ'."""
    return ca.diag(ca.qr(twin.jacobian.T)[1])


def _volume(twin: Twin) -> Symbol:
    diagonal, product = _triangular(twin), ca.SX(1)
    for i in range(diagonal.numel()):
        product = product * diagonal[i]
    return product


def _log_volume(twin: Twin) -> Symbol:
    return ca.sum1(ca.log(_triangular(twin)))
