"""Section V in single precision, written out for two rows and three joints: every variable holds all samples."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


@np.errstate(all="ignore")
def by_elements(q: Array, xdot: Array) -> tuple[Array, Array, Array, Array]:
    """Both methods on the planar 3R arm, unit links, W = I, alpha = 0, q (B, 3) [rad], xdot (B, 2) [m/s], all in float32.

    Returns J (B, 2, 3), the rates (2, B, 3) of (2)-(5) and of (6), and |xdot - J qdot| (2, B) evaluated in float32
    and in float64. numpy rounds after every operation, and fuses none. Source: sections IV and V.
    """
    J, target = jacobian(*np.ascontiguousarray(q.T)), np.ascontiguousarray(xdot.T)
    rates = np.stack([normal_equations(J, target), augmented(J, target)])
    errors = [np.stack([error(J.astype(kind), target.astype(kind), x.astype(kind)) for x in rates]) for kind in "fd"]
    return J.transpose(2, 0, 1), rates.transpose(0, 2, 1), errors[0], errors[1]


def jacobian(q1: Array, q2: Array, q3: Array) -> Array:
    """J (2, 3, B): sums of the links' sines and cosines from the tip to the base."""
    a, b = q1, q1 + q2
    c = b + q3
    (s1, c1), (s2, c2), (s3, c3) = (_sine_cosine(angle) for angle in (a, b, c))
    return np.array([[-((s3 + s2) + s1), -(s3 + s2), -s3], [(c3 + c2) + c1, c3 + c2, c3]])


def _sine_cosine(angle: Array) -> tuple[Array, Array]:
    wide = angle.astype(np.float64)
    return np.sin(wide).astype(np.float32), np.cos(wide).astype(np.float32)


def normal_equations(J: Array, xdot: Array) -> Array:
    """(2)-(5), W = I: J J' = L L', L L' y = xdot, qdot = J'y; rates (3, B)."""
    (a, b, c), (d, e, f) = J
    m11 = a * a + b * b + c * c
    m21 = d * a + e * b + f * c
    m22 = d * d + e * e + f * f
    l11 = np.sqrt(m11)
    l21 = m21 / l11
    rest = m22 - l21 * l21
    l22 = np.sqrt(np.where(rest > 0, rest, np.float32(np.nan)))
    y1 = xdot[0] / l11
    y2 = (xdot[1] - l21 * y1) / l22 / l22
    y1 = (y1 - l21 * y2) / l11
    return np.array([a * y1 + d * y2, b * y1 + e * y2, c * y1 + f * y2])


def augmented(J: Array, xdot: Array) -> Array:
    """(6), W = I: J Q = L U with column pivoting, N_J by back-substitution, the LU extended by N_J'; rates (3, B)."""
    member = np.arange(J.shape[2])
    order = np.tile(np.arange(3), (len(member), 1))
    first = np.abs(J[0]).argmax(axis=0)
    order[member, 0], order[member, first] = first, 0
    u11, u12, u13 = (J[0][order[:, j], member] for j in range(3))
    below, left, right = (J[1][order[:, j], member] for j in range(3))
    l21 = below / u11
    left, right = left - l21 * u12, right - l21 * u13
    swap = np.abs(right) > np.abs(left)
    u12, u13 = np.where(swap, u13, u12), np.where(swap, u12, u13)
    u22, u23 = np.where(swap, right, left), np.where(swap, left, right)
    order[swap] = order[swap][:, [0, 2, 1]]
    n2 = -u23 / u22  # N_J = (n1, n2, 1)
    n1 = -(u12 * n2 + u13) / u11
    l31 = n1 / u11
    l32 = (n2 - l31 * u12) / u22
    u33 = (np.float32(1) - l31 * u13) - l32 * u23
    b2 = xdot[1] - l21 * xdot[0]
    b3 = -(l31 * xdot[0]) - l32 * b2
    x3 = b3 / u33
    x2 = (b2 - u23 * x3) / u22
    x1 = (xdot[0] - u12 * x2 - u13 * x3) / u11
    rates = np.empty_like(J[0])
    for j, x in enumerate((x1, x2, x3)):
        rates[order[:, j], member] = x
    return rates


def error(J: Array, xdot: Array, rates: Array) -> Array:
    """|xdot - J qdot| (B,) in the precision of its arguments."""
    e1 = xdot[0] - (J[0, 0] * rates[0] + J[0, 1] * rates[1] + J[0, 2] * rates[2])
    e2 = xdot[1] - (J[1, 0] * rates[0] + J[1, 1] * rates[1] + J[1, 2] * rates[2])
    return np.sqrt(e1 * e1 + e2 * e2)
