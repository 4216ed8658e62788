"""What the words on a page mean: verdicts, expected classes, tasks, each with its sentence."""

from __future__ import annotations

from sandbox import verdict

VERDICTS: dict[str, tuple[str, str, str]] = {
    "verified": ("verified", "good", "said solved, a minimum exists, and the error is within the tolerance"),
    "right_refusal": ("right refusal", "good", "refused, and there was nothing to solve"),
    "inaccurate": ("inaccurate", "fair", "said solved, neither verified nor grossly wrong"),
    "limit": ("limit", "fair", "ran out of iterations, or stopped short of its tolerance"),
    "out_of_scope": ("out of scope", "none", "refused a solvable problem that its documentation does not promise to solve"),
    "undecidable": ("undecidable", "none", "the class changes within rounding of the data: either answer is allowed"),
    "not_run": ("not run", "none", "was not run, for the reason given"),
    "false_success": (
        "false success",
        "bad",
        "said solved, and the answer is not finite, has no right to exist or is grossly wrong",
    ),
    "wrong_refusal": ("wrong refusal", "bad", "refused a solvable problem that its documentation promises to solve"),
    "crashed": ("crashed", "bad", "died with its process"),
    "timed_out": ("timed out", "bad", "overran the time limit"),
}
"""Verdict -> (words, kind, sentence); in the order in which bars and lists show them."""

PRECEDENCE: tuple[tuple[str, str], ...] = tuple(
    (row[0], row[1])
    for row in (
        [cell.strip() for cell in line.strip("|").split("|")] for line in (verdict.__doc__ or "").splitlines() if "|" in line
    )
    if row[0] not in ("verdict", "---")
)
"""The verdict table as the code that applies it states it: the first row that applies decides."""

EXPECTED: dict[str, tuple[str, str]] = {
    "unique_minimum": ("unique minimum", "exactly one minimiser exists: it is to be found"),
    "minimum_not_unique": ("minimum, not unique", "minimisers form a flat: any of them is right"),
    "no_minimum": ("no minimum", "saddle, maximum or unbounded descent: to be refused"),
    "infeasible": ("infeasible", "xdot is not in the range of J: to be refused"),
}
"""Expected class -> (words, sentence)."""

TASKS: dict[str, tuple[str, str]] = {
    "exact": ("J q̇ = ẋ exactly", "minimise ½ q̇ᵀW q̇ + aᵀq̇ subject to J q̇ = ẋ"),
    "least_squares": ("least squares, eq. (13)", "the same objective over the minimisers of (J q̇ − ẋ)ᵀWx(J q̇ − ẋ)"),
    "damped": ("damped least squares", "J q̇ = ẋ traded against |q̇| by the damping λ"),
}
"""Task -> (words, sentence)."""

FORMULATIONS: tuple[str, ...] = (
    "direct", "convexified", "augmented_lagrangian", "null_space", "range_space", "normal_equations", "hierarchical", "slack",
)  # fmt: skip
"""Order in which formulations stand side by side."""
