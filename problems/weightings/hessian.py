"""W = Hess L, L = g - lam'(x(q) - x): the extended Jacobian without H."""

from __future__ import annotations

import numpy as np

from problems.weightings.extended import Extremum
from sandbox import check
from sandbox.errors import RefusalError
from sandbox.parameters import configuration, flag
from sandbox.tolerances import TORSION
from sandbox.weight import Weight

Array = np.ndarray


class PartialOrientationError(RefusalError):
    """The task fixes some of the angular velocity but not all: no symmetric matrix stands for Hess g - T."""


def hessian(condition: Extremum, *, maximum: bool = False) -> Weight:
    """W = Hess g - (T + T')/2 (..., n, n), or its negative for motion along maxima; symmetric, often indefinite.

    Rows of angular velocity make T asymmetric; N'T and N'T' agree where the task fixes all of it, or none.
    Raises PartialOrientationError, naming the configuration, where they do not. Source: methods 5.2-5.4.
    """
    maximum, T = flag(maximum, "maximum"), condition.T
    twist = np.swapaxes(condition.N, -1, -2) @ (T - np.swapaxes(T, -1, -2))
    share = np.abs(twist).max(axis=(-2, -1))
    bad = share > TORSION * np.abs(T).max(axis=(-2, -1))
    if bad.any():
        index = check.first(bad)
        value = float(share[index])
        raise PartialOrientationError(
            f"{configuration(index)} of {condition.robot.name}: N'(T - T') is {value:.3g}, its task rows "
            f"{condition.robot.rows} fix a part of the angular velocity only, so W = Hess L is not symmetric; "
            "use extended_jacobian (W = H'H)",
            index=index, asymmetry=value,
        )  # fmt: skip
    W = condition.hessian - (T + np.swapaxes(T, -1, -2)) / 2
    return Weight(-W if maximum else W)
