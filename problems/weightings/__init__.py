"""Weights W(q) of the joint rates, each a function that gives a stack of `Weight`."""

from __future__ import annotations

from problems.weightings import (
    augmented,
    damped,
    extended,
    hessian,
    identity,
    impedance,
    inertia,
    least_norm,
    stiffness,
    torque,
    two_task,
    virtual_load,
    whitney,
)
from problems.weightings.weighting import Weighting

POSITIVE = "positive definite"
SEMIDEFINITE = "positive semidefinite, rank at most"

WEIGHTINGS: dict[str, Weighting] = {
    row.name: row
    for row in (
        Weighting(
            name="identity", formula="I, or diag(1/s_i^2) with joint scales s", unit="rad^2/s^2", definiteness=POSITIVE,
            source="A. Liegeois, 1977", function=identity.identity,
        ),
        Weighting(
            name="whitney", formula="any symmetric positive definite W", unit="any", definiteness=POSITIVE,
            source="D. E. Whitney, 1969; eq. (5)", function=whitney.whitney,
        ),
        Weighting(
            name="least_norm", formula="diag(1 + |dH/dq_i|), or 1 where |dH/dq_i| is falling", unit="rad^2/s^2",
            definiteness=POSITIVE, source="T. F. Chan, R. V. Dubey, 1995", function=least_norm.least_norm,
        ),
        Weighting(
            name="stiffness", formula="K, or C^-1; C itself only by the name ComplianceAsPrinted", unit="J/s^2",
            definiteness=POSITIVE, source="J. K. Salisbury, 1980 (a guess)", function=stiffness.stiffness,
        ),
        Weighting(
            name="inertia", formula="M(q)", unit="J", definiteness=POSITIVE, source="O. Khatib, 1987", function=inertia.inertia,
        ),
        Weighting(
            name="virtual_load", formula="K_p = sum_b J_b' M_b J_b", unit="J",
            definiteness="positive semidefinite; definite if the stacked M_b^1/2 J_b have full column rank",
            source="methods M17; not identified", function=virtual_load.virtual_load,
        ),
        Weighting(
            name="two_task", formula="Jd' Qd Jd + eps I", unit="m^2/s^2",
            definiteness=f"{SEMIDEFINITE} p for eps = 0; {POSITIVE} for eps > 0",
            source="A. A. Maciejewski, C. A. Klein, 1985", function=two_task.two_task,
        ),
        Weighting(
            name="torque", formula="M' Q M, of joint accelerations", unit="that of Q (Nm)^2",
            definiteness="positive semidefinite; definite if Q is", source="J. M. Hollerbach, K. C. Suh, 1987",
            function=torque.torque,
        ),
        Weighting(
            name="augmented", formula="E' Gamma E, rows of E the gradients g_i'", unit="any", definiteness=f"{SEMIDEFINITE} k",
            source="eqs. (8) and (10)", function=augmented.augmented,
        ),
        Weighting(
            name="extended", formula="H' H, H = d(N' grad g)/dq", unit="any", definiteness=f"{SEMIDEFINITE} n - m",
            source="J. Baillieul, 1985; eqs. (11) and (12)", function=extended.extended,
        ),
        Weighting(
            name="hessian", formula="Hess g - T, T_ij = sum_k lambda_k dJ_ki/dq_j", unit="any", definiteness="often indefinite",
            source="methods 5.2, 5.3", function=hessian.hessian,
        ),
        Weighting(
            name="impedance", formula="C^-1 - Gamma, Gamma_ij = sum_k F_k dJ_ki/dq_j", unit="J/s^2",
            definiteness="often indefinite", source="F. A. Mussa-Ivaldi, N. Hogan, 1991", function=impedance.impedance,
        ),
        Weighting(
            name="damped", formula="W~ + W, W~ positive definite", unit="that of W",
            definiteness=f"{POSITIVE} for W positive semidefinite", source="methods M19; [27]", function=damped.damped,
        ),
    )
}  # fmt: skip
"""Every weighting, by name."""
