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

ORIGINAL = 50.0
"""An original formulation rounds its data by up to c n u of their norms: the c of `FORWARD`, for as many operations."""

ROBOT_RANK = 1e-8
"""Singular values of a robot's Jacobian below this share of the largest come from rounding of its sines, or nearly so."""

GRADIENT_STEP = 1e-3
"""Step of fourth-order central differences [rad, m]: h^4 truncated, u/h rounded, both near 1e-12."""

GRADIENT_CHECK = 1e-6
"""A user's gradient may differ by this from differences of f: a wrong term shows, f's own rounding does not."""

EXTREMAL = 1e-6
"""|N'grad g| / |grad g| up to this is an extremum of g on its self-motion, an equilibrium (methods M18)."""

TORSION = 1e-9
"""|N'(T - T')| above this share of |T| is no rounding: T is known to u cond(J) |T| (methods 5.4)."""

SHRUNK = 1 - 2.0**-20
"""A self-motion faster than the rate limits is shrunk to this share of them: rounding must not put it back above."""

PATH_CLOSURE = 1e-12
"""A path is closed where it ends within this share of its size: sine and cosine of 2 pi are off by u."""

ORTHONORMAL = 1e-9
"""Directions typed with ten digits count as orthonormal."""

INTEGRATION = 1e-12
"""Relative and absolute [rad, m] tolerance of a motion: its error stays below what drift is told from."""

SMALLEST_STEP = 1e-10
"""A law that refuses however short the step, down to this share of a piece of the path, has stopped the motion."""

NEAR_SINGULAR = 1e-2
"""A smallest singular value or eigenvalue below this share of the largest is worth a line in the report."""

SINGULAR_TIME = 1e-12
"""A singularity is located to this share of the motion's duration: a few roundings of t."""

NULL_BASIS = 1e3
"""|J_i N_c| above c eps |J_i||N_c| says that N_c is not in null J: c as in methods 1, general refusals."""

REDUCED_ASYMMETRY = 1e3
"""|N'WN - its transpose| above c eps |N'W||N| says that N'W is wrong: inverse dynamics is off by 0.1 eps at 30 joints."""

SIMPLE = 1e-8
"""Singular values closer than this share of sigma_1 are not told apart: neither has a gradient (methods M5)."""

TIE = 1e-8
"""Members of a minimum this close to it, as a share of its scale, tie with it: the gradient is one of several (methods M9)."""

KINK = 64.0
"""Within c n u of a kink, relative to what the quantity is made of, rounding decides the side: no gradient is given."""

BRACKET_STEP = 2.0**-5
"""Step of eighth-order differences of a law [rad, m]: h^8 truncated, 10 u/h rounded, both near 1e-13."""

BRACKET_ROUNDING = 10.0
"""Rounding of a difference quotient of G is up to c n u cond(J) |G| / h."""

LINEARITY = 1e-9
"""A law whose rates add up to this share of the largest is linear in the task velocity."""

CLOSED_CYCLE = 1e-10
"""Drift per cycle [rad, m] that is the integration's own error: a hundred times its tolerance."""

DIFFERENCE = 1e-6
"""A derivative and a central difference of step u^(1/3) agree to 2e-11 and the third derivative: this tells abs apart."""

QUARTER_TURN = 1e-15
"""Sine and cosine of pi/2 are off by 6e-17: a constant this close to a whole number is one."""

LIMIT_KNOWN = 0.01
"""A limit posture is in sight when what is left to it is this share of the way covered."""

EXTREMUM_STEP = 4e-3
"""Step of fourth-order differences of an extremum [m]: what is truncated is measured by halving it."""

EXTREMUM_ROUNDING = 1e3
"""Root finding ends within c u of the size of the conditions: largest observed is 40."""

TASK_MISSED = 1e6
"""A task error this many times beyond rounding is the method's own: damping of 1/8 leaves 1e9 times and more."""

TIKHONOV = 1e-2
"""An error c eps + O(eps^2) falls tenfold per decade to this share once eps is below 1e-7: the second term is up to 1e5 eps."""

EXPONENT = 0.25
"""A power fitted to seeded draws over a few decades: whole powers are told apart."""

COMPARABLE = 2.0
"""Operation counts within this factor are comparable: (6) and the projection method stay within it for any n and m."""

RANK_CORRELATION = 0.5
"""A gauge orders what it gauges this well at least (Spearman); counts order times by 0.8 and more, on a busy machine too."""

IMPERFECT = 1.25
"""Ratios of times and of counts further apart than this factor are no noise: the least of repeats is stable to a tenth."""

PERCENTAGE = 3.0
"""Percentage points between a share of the paper's one sample of section V and the median of ours: sampling moves it by 0.4."""

MEAN_ERROR = 0.25
"""Relative difference of a mean error of section V: the order of operations, which the paper leaves open, moves it as much."""

TIES_IN_DOUBLE = 2.0
"""Percent of samples of section V whose errors may agree in float64: rates agree by chance for 1 %, float32 sums for 11 %."""

LINEAR_PROGRAM = 1e-6
"""HiGHS meets rows to 1e-7, and the rows of a task velocity are of size 0.1 and more."""

MOTION_END = 1e-6
"""A motion that an algorithmic singularity ends stops within this of it [m]: rates grow as the root of what is left falls."""

LINEARISED = 0.1
"""Of ln |h| beside its linear rate, for |h| up to 0.02 Nm on arms of metres: what is left out is of the order of |h|."""

LINEAR_SIZE = 0.02
"""|h| [Nm] up to which its rate counts as linear."""

OTHER_MOTION = 1e-2
"""Joint rates further apart than this, relatively, are another motion, not the same one less exactly."""

SAME_MOTION = 1e-9
"""Joint rates of well conditioned systems closer than this, relatively, are the same motion: rounding is below 1e-12."""

LIMIT_MOTION = 1e-4
"""Joint rates for a joint's unit of 1e-3 or 1e3 rad differ from their limit by the square of it, times what J has."""

CURVATURE_DIFFERENCED = 1e-5
"""A second derivative [Nm/rad^2] by differences of step `EXTREMUM_STEP`: rounded by u/h^2, 1e-11, truncated by h^4, 1e-9."""

THROUGH = 1e-8
"""Tolerance of a motion to or through an algorithmic singularity: what is asked of it is checked instant by instant."""

REDUCED_ERROR = 0.5
"""A task error that damping reduces is at most this share of the undamped one: no chance of a controller's phase does that."""
