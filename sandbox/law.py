"""The joint rates of a method as the framework finds them: its cast, answered by a closed form."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from sandbox.closed_form.jacobian_transpose import jacobian_transpose
from sandbox.closed_form.solve import solve
from sandbox.closed_form.time_scaling import time_scaling
from sandbox.errors import UnknownNameError
from sandbox.method import Method
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status

Array = np.ndarray

OPTIONS = ("damping", "rank_tolerance")
"""Parameters of a method that its closed form takes too."""


def rates(method: Method, robot: Any, q: Any, xdot: Any, **parameters: Any) -> Array:
    """Joint rates (..., n) [rad/s, m/s] of `method` on `robot` at q (..., n) for xdot (..., m).

    Raises UnknownNameError for a parameter that the method does not have, and what its cast and its closed form raise.
    """
    taken(method, parameters)
    return answer(method, robot, method.cast(robot, q, xdot, **parameters), parameters).x


def taken(method: Method, parameters: Iterable[str]) -> None:
    """Refuse (UnknownNameError) a parameter that the method's cast does not take; it lists those that it does."""
    known = inspect.signature(method.cast).parameters.values()
    names = [one.name for one in known if one.kind is one.KEYWORD_ONLY]
    for name in parameters:
        if name not in names:
            raise UnknownNameError.of(f"parameter of {method.name}", name, names or ("none",))


def answer(
    method: Method, robot: Any, problem: VelocityProblem, parameters: Mapping[str, Any], *, on_refusal: str = "raise"
) -> Solution:
    """The framework's answer to a problem that `method` has cast for `robot` with these parameters; refusals as in `solve`."""
    if method.form == "jacobian_transpose":
        return _solved(problem, jacobian_transpose(problem.stacked()))
    if method.form == "time_scaling":
        both = solve(problem, on_refusal=on_refusal)
        task = solve(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W), on_refusal=on_refusal).x
        own = solve(VelocityProblem(J=problem.J, xdot=0 * problem.xdot, W=problem.W, a=problem.a), on_refusal=on_refusal).x
        given = parameters.get("rate_limits")
        scaled, _ = time_scaling(task, robot.rate_limits if given is None else given, own)
        return Solution(x=scaled, y=both.y, status=both.status, said=both.said, evidence=both.evidence)
    options = {name: parameters[name] for name in OPTIONS if name in parameters}
    return solve(problem, method.form, on_refusal=on_refusal, **options)


def _solved(problem: VelocityProblem, x: Array) -> Solution:
    """Rates that minimise nothing, so that nothing can refuse them."""
    lead = problem.lead
    status = np.full(lead, Status.SOLVED, dtype=object) if lead else Status.SOLVED
    said = np.full(lead, "", dtype=object) if lead else ""
    y = np.full((*lead, problem.m), np.nan)
    return Solution(x=x.reshape((*lead, -1)), y=y, status=status, said=said, evidence={})
