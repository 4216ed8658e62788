"""Near a singularity the joint rates of every exact method are beyond all limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from problems import robots
from sandbox.claims import equations
from sandbox.claims.arms import ARMS
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import fitted
from sandbox.claims.printed import each
from sandbox.claims.singularities.approach import CLOSE, NAMES, SIX, SPEED, Approach, approach, norms, singular_values
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import EXPONENT, FORWARD, UNIT

Array = np.ndarray

DEEPEST = 1e-10
"""Share of the largest singular value down to which a line is followed: below, J is lost in rounding."""


def not_realizable_near_singularity(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """(6), (2)-(5) and (13) on lines into singular configurations of three arms, against what any exact method must do."""
    rng = trial.rng("not_realizable_near_singularity")
    reach = np.geomspace(1.5, 1e-9, trial.of(56, 20))
    checks: list[Check] = []
    rows: list[tuple[str | float | int | None, ...]] = []
    slopes: dict[str, list[float]] = {"(6)": [], "(2)–(5)": [], "(13)": []}
    growth: list[Series] = []
    shares, ratios, least, far, also = [], [], [], [], []
    for name in NAMES if trial.full else ("planar_3r", "panda"):
        robot = robots.load(name)
        for line in range(trial.of(5, 1)):
            one = approach(robot, rng)
            u, sigma, _ = singular_values(one.problem(reach).J)
            deep = sigma[:, -1] > DEEPEST * sigma[:, 0]
            t, u, sigma = reach[deep], u[deep], sigma[deep]
            problem = one.problem(t)
            lowest, x = sigma[:, -1], six(problem).x
            other = each(printed, problem)
            ratios.append(np.abs(x - other).max(axis=1) / np.abs(other).max(axis=1) / (2 * CLOSED_FORMS["eq6"].bound(problem)))
            # u'xdot = sigma v'qdot whatever the method: |qdot| >= |u'xdot| / sigma
            floor = np.abs(u @ one.xdot) / lowest
            rounding = FORWARD * robot.n * UNIT * sigma[:, 0] / lowest
            least.append((floor / norms(x) - 1) / (rounding + CLOSED_FORMS["eq6"].bound(problem)))
            by_method = {"(6)": norms(x), "(2)–(5)": norms(eq2_5(problem).x), "(13)": norms(eq13(problem).x)}
            for method, size in by_method.items():
                near = (t <= CLOSE) & np.isfinite(size)
                if method == "(2)–(5)":  # they say nothing where their own error bound is no longer small
                    near &= CLOSED_FORMS["eq2_5"].bound(problem) < CLOSE
                slopes[method].append(fitted(lowest[near], size[near]))
            if name == "panda" and not line:
                ends, limit = [lowest[-1], lowest[0]], [robot.rate_limits.min()] * 2
                growth = [Series("(6)", lowest, by_method["(6)"], "line"), Series("(13)", lowest, by_method["(13)"])]
                growth.append(Series("(2)–(5)", lowest, by_method["(2)–(5)"]))
                growth += [
                    Series(r"least of any exact method, $|u^T\dot x|/\sigma_{\min}$", lowest, floor, "line", "bound"),
                    Series("rate limit of the slowest joint", ends, limit, "line", "bound"),
                ]
            share = unrealizable(one, t, rng, six, trial.of(200, 60))
            far.append(share[t <= CLOSE**2])
            told = (t <= CLOSE**2) & (CLOSED_FORMS["eq2_5"].bound(problem) < CLOSE)
            if told.any():
                also.append(unrealizable(one, t[told], rng, eq2_5, trial.of(200, 60)))
            half = float(lowest[share >= 0.5].max(initial=0.0)) or None
            translation = float(one.lost[:3] @ one.lost[:3]) if robot.m == 6 else None
            power, end = slopes["(6)"][-1], float(norms(x)[-1])
            rows.append((f"{ARMS[name]}, {line + 1}", translation, round(power, 3), half, float(share[-1]), end))
            if not line:
                shares.append(Series(ARMS[name], lowest, share, "line"))
    for method, found in slopes.items():
        words = rf"joint rates of {method} grow as $1/\sigma_{{\min}}$: size of exponent + 1"
        checks.append(at_most(words, np.abs(np.array(found) + 1), EXPONENT))
    checks += [
        at_least("share of random task directions whose rates by (6) exceed a rate limit, within 0.1 mrad of a singularity",
                 np.concatenate(far), 0.5),
        at_least("the same by (2)–(5), where their error bound is below 1 %", np.concatenate(also), 0.5),
        at_most("(6) of the sandbox and as printed: difference / sum of bounds", np.concatenate(ratios), 1.0),
        at_most(r"$|\dot q| \ge |u^T \dot x| / \sigma_{\min}$, $u$ the direction that is lost: what is short of it / bound",
                np.concatenate(least), 1.0, role=Role.OURS),
    ]  # fmt: skip
    plots = (
        Plot(
            "Joint rates on a straight line into a singularity of the Panda, hand speed 0.25 (m/s, rad/s); (2)–(5) ends where "
            "forming $J J^T$ has lost the smallest singular value",
            Axis("smallest singular value of $J$", log=True), Axis(r"$|\dot q|$ [rad/s]", log=True), tuple(growth),
        ),
        Plot(
            "Share of random task directions, hand speed 0.25 (m/s, rad/s), whose rates by (6) exceed a rate limit",
            Axis("smallest singular value of $J$", log=True), Axis("share of directions", low=0, high=1), tuple(shares),
        ),
    )  # fmt: skip
    columns = (
        "arm, line", "share of translation in the lost direction", "exponent of (6)",
        r"$\sigma_{\min}$ where half of the directions exceed a limit", "share at the end", r"$|\dot q|$ at the end [rad/s]",
    )  # fmt: skip
    return Evidence(
        tuple(checks), (*plots, Table("Straight lines into singular configurations, $W = I$", columns, tuple(rows)))
    )


def unrealizable(one: Approach, t: Array, rng: np.random.Generator, six: Answer, count: int) -> Array:
    """Share (T,) of `count` random task directions for which the rates of (6) exceed a limit."""
    xdot = rng.standard_normal((count, one.robot.m))
    xdot *= SPEED / norms(xdot)[:, None]
    # linear in xdot: m columns say it all
    columns = [six(one.problem(t, xdot=row)).x for row in np.eye(one.robot.m)]
    x = np.einsum("kbn,ck->bcn", np.stack(columns), xdot)
    return np.asarray((np.abs(x) > one.robot.rate_limits).any(axis=2).mean(axis=1))


def truncated(six: Answer) -> Answer:
    """The pseudoinverse with singular values below a hundredth of the largest dropped, in the place of (6)."""

    def planted(problem: VelocityProblem) -> Solution:
        x = (np.linalg.pinv(problem.J, rcond=CLOSE) @ problem.xdot[:, :, None])[:, :, 0]
        return replace(six(problem), x=x)

    return planted


CLAIM = Claim(
    name="not_realizable_near_singularity",
    title="Near a singularity the rates of (6) and of (2)–(5) are not realizable",
    place="Section VI, last paragraph",
    says="(6) will typically not give physically realizable joint rates near a kinematic singularity, nor will (2)–(5).",
    formula=r"|\dot q| \ge \frac{|u_m^T \dot x|}{\sigma_m} \quad \text{for every } \dot q \text{ with } J \dot q = \dot x",
    tested="Straight lines into singular configurations of the planar 3R, the 7R and the Panda, to a billionth of a "
    "radian, hand speed 0.25 (m/s, rad/s), $W = I$; random task directions against the arms' rate limits.",
    accepted=r"Rates grow as $1/\sigma_{\min}$ by (6), (2)–(5) and (13). “Typically” is taken as: close to the singularity the "
    "rates of more than half of the task directions exceed a rate limit.",
    paths=(SIX, CodePath("eq. (6) as printed, in numpy", equations.augmented)),
    examine=not_realizable_near_singularity,
    fault=Fault("small singular values dropped on the quiet", truncated),
)
