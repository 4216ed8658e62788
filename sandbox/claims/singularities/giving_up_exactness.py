"""Near a singularity rates within the limits miss the task: the least load of exact rates, beside four methods."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from problems import robots
from sandbox.claims.arms import ARMS
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesKind, Table
from sandbox.claims.singularities.approach import SIX, Approach, approach, norms, singular_values, stretching
from sandbox.closed_form.damped_least_squares import damped_least_squares
from sandbox.closed_form.eq13 import eq13
from sandbox.closed_form.time_scaling import time_scaling
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import FORWARD, LINEAR_PROGRAM, UNIT

Array = np.ndarray

CHOSEN = 0.1


class Passage(NamedTuple):
    """What each method does on a way through a singularity; rates (B, n) [rad/s], t (B,) [rad]."""

    name: str
    one: Approach
    t: Array
    problem: VelocityProblem
    sigma: Array
    by: dict[str, Array]
    least: Array  # of max |rate| / limit, over all rates with J qdot = xdot
    floor: Array  # that such rates cannot go below

    @property
    def limits(self) -> Array:
        """Rate limits (n,)."""
        return self.one.robot.rate_limits

    def load(self, method: str) -> Array:
        """Largest |rate| / limit (B,)."""
        return np.asarray((np.abs(self.by[method]) / self.limits).max(axis=1))

    def missed(self, method: str) -> Array:
        """|J qdot - xdot| / |xdot| (B,)."""
        return np.asarray(norms(self.achieved(method) - self.problem.xdot) / norms(self.problem.xdot))

    def aside(self, method: str) -> Array:
        """Part of J qdot across xdot / |xdot| (B,): what leaves the path."""
        size, achieved = norms(self.problem.xdot)[:, None], self.achieved(method)
        unit = self.problem.xdot / size
        return np.asarray(norms(achieved - unit * (achieved * unit).sum(axis=1, keepdims=True)) / size[:, 0])

    def achieved(self, method: str) -> Array:
        """J qdot (B, m)."""
        return np.asarray((self.problem.J @ self.by[method][:, :, None])[:, :, 0])


def least_load(programme: Answer, J: Array, xdot: Array, limits: Array) -> float:
    """Least max |qdot_i| / limit_i of all qdot with J qdot = xdot, by linear programming; inf where there is none."""
    m, n = J.shape
    # unknowns (p, load), qdot = limits p: minimise load subject to J limits p = xdot, -load <= p <= load
    rows = np.block([[np.eye(n), -np.ones((n, 1))], [-np.eye(n), -np.ones((n, 1))]])
    found = programme(
        np.eye(1, n + 1, n)[0], A_ub=rows, b_ub=np.zeros(2 * n), A_eq=np.hstack([J * limits, np.zeros((m, 1))]), b_eq=xdot,
        bounds=(None, None), method="highs",
    )  # fmt: skip
    return float(found.fun) if found.status == 0 else np.inf


def passages(trial: Trial, six: Answer, programme: Answer, rng: np.random.Generator) -> list[Passage]:
    """The planar 3R straight out to its full stretch and back, and a line through a singularity of the Panda and the 7R."""
    found = []
    t = np.geomspace(0.8, 1e-4, trial.of(60, 16))
    t = np.concatenate([-t, t[::-1]])
    lines = [("planar 3R, out and back", stretching())]
    lines += [(f"{ARMS[name]}, across", approach(robots.load(name), rng)) for name in ("panda", "seven_joint")]
    for name, one in lines if trial.full else lines[:2]:
        limits = one.robot.rate_limits
        planar = one.robot.m == 2
        xdot = np.where(t[:, None] < 0, -one.xdot, one.xdot) if planar else one.xdot  # out, then back
        # W measures rates by their limits, so that (6) comes as near to the least load as a 2-norm does
        problem = one.problem(t, np.diag(limits**-2.0), xdot)
        u, sigma, v = singular_values(problem.J)
        x = six(problem).x
        plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(one.robot.n))
        by = {
            "(6)": x, "(13)": eq13(problem).x, "damped": damped_least_squares(plain, damping=CHOSEN).x,
            "scaled": time_scaling(x, limits)[0],
        }  # fmt: skip
        least = np.array([least_load(programme, problem.J[i], problem.xdot[i], limits) for i in range(len(t))])
        floor = np.abs((u * problem.xdot).sum(axis=1)) / (sigma[:, -1] * (np.abs(v) @ limits))
        found.append(Passage(name, one, t, problem, sigma, by, least, floor))
    return found


NAMES = {
    "(6)": "(6), exact",
    "(13)": "(13)",
    "damped": rf"damped least squares, $\lambda = {CHOSEN:g}$",
    "scaled": "time scaling",
}

LINES = ("(6)", "damped", "scaled")
"""Drawn as lines; (13), which is (6) there, as points upon its line."""


def drawn_as(method: str, *lines: str) -> SeriesKind:
    """A line for the methods named, points for the others."""
    return "line" if method in lines else "points"


def must_give_up_exactness(trial: Trial, six: Answer, programme: Answer) -> Evidence:
    """The least load of all exact rates along a way through a singularity, beside (6), (13), damping and time scaling."""
    rng = trial.rng("must_give_up_exactness")
    beyond, within, order, exact, gap, floor = [], [], [], [], [], []
    rows: list[tuple[str | float | int | None, ...]] = []
    ways = passages(trial, six, programme, rng)
    for way in ways:
        over, n = way.floor > 1, way.one.robot.n
        beyond.append(way.least[over])
        within += [way.load("damped"), way.load("scaled")]
        load = way.load("(6)")
        order += [way.least / load, load / (np.sqrt(n) * way.least)]
        rounding = FORWARD * n * UNIT * way.sigma[:, 0] * norms(way.by["(6)"]) / norms(way.problem.xdot)
        exact.append(way.missed("(6)") / rounding)
        floor.append(way.floor / way.least)
        # rates within the limits miss at least |u'xdot| (1 - 1/floor)
        u = singular_values(way.problem.J)[0]
        must = np.abs((u * way.problem.xdot).sum(axis=1)) * (1 - 1 / way.floor) / norms(way.problem.xdot)
        gap += [(must - way.missed(method))[over] for method in ("damped", "scaled")]
        near = way.t[way.least > 1]
        rows.append((way.name, "least of all exact rates", float(way.least.max()), 0.0, 0.0, float(np.abs(near).max())))
        for method, label in NAMES.items():
            loaded = way.t[way.load(method) > 1 + LINEAR_PROGRAM]
            rows.append((way.name, label, float(way.load(method).max()), float(way.missed(method).max()),
                         float(way.aside(method).max()), float(np.abs(loaded).max()) if len(loaded) else None))  # fmt: skip
    stretched = stretching().problem(np.zeros(1))
    nothing = least_load(programme, stretched.J[0], stretched.xdot[0], stretching().robot.rate_limits)
    checks = (
        at_least("close to the singularity even the least load of all exact rates exceeds the limits: largest rate / limit",
                 np.concatenate(beyond), 1.0),
        every("at the full stretch no rates are exact: the linear programme has no feasible point", [nothing == np.inf]),
        at_most("damped least squares and time scaling: largest rate / limit, all the way", np.concatenate(within),
                1 + FORWARD * UNIT),
        at_most("close to the singularity both miss the task as rates within the limits must: what is short of it",
                np.concatenate(gap), LINEAR_PROGRAM),
        at_most("(6) is one of the exact rates: task error / rounding", np.concatenate(exact), 1.0, role=Role.OURS),
        at_most(r"least load ≤ load of (6) ≤ $\sqrt n$ least load, $W = \mathrm{diag}(1/\ell^2)$: both ratios",
                np.concatenate(order), 1 + LINEAR_PROGRAM, role=Role.OURS),
        at_most(r"least load ≥ $|u^T\dot x| / (\sigma_{\min} \sum_i |v_i| \ell_i)$: ratio", np.concatenate(floor),
                1 + LINEAR_PROGRAM, role=Role.OURS),
    )  # fmt: skip
    way = ways[0]
    loads = [Series("least of all exact rates, by linear programming", way.t, way.least, "line", "other")]
    loads += [Series(label, way.t, way.load(method), drawn_as(method, *LINES)) for method, label in NAMES.items()]
    loads.append(Series("limit", [way.t[0], way.t[-1]], [1.0, 1.0], "line", "bound"))
    missed = [Series(label, way.t, way.missed(method), drawn_as(method, *LINES)) for method, label in NAMES.items()]
    missed.append(Series("least that rates within the limits miss", way.t, np.maximum(1 - 1 / way.floor, 0.0), "line", "bound"))
    axis = Axis("$t$, from the full stretch [rad]")
    plots = (
        Plot("Planar 3R straight out to its full stretch and back, hand speed 0.25 m/s: joint rates", axis,
             Axis("largest joint rate / limit", log=True), tuple(loads)),
        Plot("The same: what each method misses of the task velocity", axis,
             Axis(r"$|J\dot q - \dot x| \,/\, |\dot x|$", low=0, high=1), tuple(missed)),
    )  # fmt: skip
    columns = (
        "way",
        "method",
        "largest rate / limit",
        "largest task error / speed",
        "of it, off the path",
        "over the limits within [rad] of it",
    )
    return Evidence(
        checks, (*plots, Table("All exact rates, and four methods, through three singularities", columns, tuple(rows)))
    )


def transposed(six: Answer) -> Answer:
    """J'xdot, scaled to the task along its gradient, passed off as an exact solution."""

    def planted(problem: VelocityProblem) -> Solution:
        x = np.einsum("bmn,bm->bn", problem.J, problem.xdot)
        back = np.einsum("bmn,bn->bm", problem.J, x)
        gain = (problem.xdot * back).sum(axis=1) / np.maximum((back * back).sum(axis=1), UNIT)
        return replace(six(problem), x=gain[:, None] * x)

    return planted


CLAIM = Claim(
    name="must_give_up_exactness",
    title="Near a singularity the desired task velocity must be given up",
    place="Section VI, last sentence",
    says=r"To address the issue of singularities, a method must be used that does not give the desired $\dot x$, such as time "
    "scaling or damped least squares.",
    formula=r"\min_{J \dot q = \dot x} \max_i \frac{|\dot q_i|}{\ell_i} \ge \frac{|u_m^T \dot x|}{\sigma_m "
    r"\sum_i |v_{m,i}| \, \ell_i}",
    tested="The planar 3R straight out to its full stretch and back, and lines through singularities of the Panda and "
    "the 7R: the least load of all exact rates, by linear programming, beside (6), (13), damped least squares and time "
    "scaling.",
    accepted=r"Close to the singularity no exact rates are within the limits $\ell_i$ of the joints; those of damped least "
    r"squares and "
    "time scaling are, and miss the task.",
    paths=(
        SIX,
        CodePath("the least load of all exact rates, by linear programming (HiGHS)", linprog, "scipy.optimize:linprog"),
    ),
    examine=must_give_up_exactness,
    fault=Fault("the Jacobian's transpose taken for its inverse", transposed),
)
