"""Every tolerance of the project, each with its reason."""

from __future__ import annotations

UNIT = 2.0**-53
"""Unit roundoff u of float64."""

SYMMETRY = 64 * 2 * UNIT
"""|W - W'| up to this share of max|W| is rounding; above it the matrix is asymmetric (methods section 1)."""

LARGEST_ENTRY = 1e150
SMALLEST_ENTRY = 1e-150
"""Products of two entries beyond these leave the range of float64."""

RANK_GAP = 1e3
"""sigma_r / sigma_(r+1) below this leaves the numerical rank ambiguous (methods section 1, general refusals)."""

FORWARD = 50.0
"""Factor c of the forward bound c n u cond: largest ratio observed is 1.9 (methods section 7)."""

CONDITION_SEVEN = 1.0
"""lambda_min(N'WN) <= c k n eps |W|_2 is an algorithmic singularity (methods section 1, acceptance test)."""

RANK = 16.0
"""Singular values below c max(m, n) u sigma_1 count as zero where no rank tolerance is given."""

DAMPING = 0.125
"""Default lambda of damped least squares; a power of two, so that lambda^2 is exact."""

UNDECIDABLE_CLOSED_FORM = 1e3
"""A margin below c (n + m) u is within what rounding of the data can turn over."""

UNDECIDABLE_SOLVER = 10.0
"""A margin below c eps is within what a solver asked for eps may overlook."""

SOLVER_SLACK = 2.0
"""Factor on a solver's own tolerance: engines stop on scaled residuals, ours are unscaled."""

FALSE_FACTOR = 1000.0
FALSE_RELATIVE = 1e-3
"""An answer this many times beyond its tolerance, and this wrong relatively, is a false success."""

FALSE_RESIDUAL_RELATIVE = 1e-2
"""With its own optimality conditions missed, an answer this wrong relatively is a false success."""

VERIFIED_RELATIVE = {"default": 2e-2, "low_accuracy": 2e-2, "mid_accuracy": 1e-3, "high_accuracy": 1e-3}
"""However generous its tolerance, a verified answer is not further off than this."""

ASKED = {"low_accuracy": 1e-3, "mid_accuracy": 1e-6, "high_accuracy": 1e-9}
"""Absolute primal and dual tolerance asked of every engine that has one, by settings level; relative 0."""

CONVEXITY_SHARE = 2.0**-10
"""Added curvature beyond the exact threshold, as a share of |W|_2: H then has a condition number near 1e3 at worst."""

CONSISTENCY = 50.0
"""|J q_p - xdot| above c n u (|J||q_p| + |xdot|) says that xdot is outside range J: c as for the residual in methods 7."""

POSITIVE_PIVOT = 4.0
"""A Cholesky pivot below c n u of its diagonal entry is rounding: the factorisation cannot tell it from zero."""

HEALTHY_PIVOT = 1e-6
"""Cholesky pivots above this share of their diagonal entries keep the error bound of eqs. (2)-(5) far below one."""

PIVOT = 4.0
"""A pivot of eq. (6) within c n u of its own rounding bound is no evidence of rank or curvature: errors reach 0.5 n u of it."""

CONFORMANCE_SLACK = 10.0
"""A backend's x and y may be off by c |K^-1| eps: engines stop on residuals scaled by themselves, c covers their scaling."""

CONFORMANCE_FLOOR = 1e-6
"""And by this: HiGHS adds 1e-7 I to H, whatever tolerance it is asked for."""

CONFORMANCE_ROUNDING = 1e-12
"""The same problem solved twice may differ by this: vectorised loops round by where an array lies in memory."""
