"""Damped least squares, as eq. (6) on an arm with slack joints."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import SIX, six
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.form import ClosedForm
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.task import task_weight
from sandbox.tolerances import DAMPING
from sandbox.weight import Weight

Array = np.ndarray


@np.errstate(all="ignore")
def damped_least_squares(problem: VelocityProblem, *, damping: float = DAMPING) -> Solution:
    """Minimise |J qdot - xdot|^2_Wx + lambda^2 (qdot'W qdot + 2 a'qdot); refuse unless lambda^2 W + J'Wx J > 0.

    Eq. (6) on [J I] with weight blkdiag(lambda^2 W, Wx) and gradient (lambda^2 a, 0): full row rank at every J, and
    nothing is squared. The multiplier is y = Wx (J qdot - xdot).
    Source: methods C1; Nakamura & Hanafusa 1986, Wampler 1986.
    """
    inner = eq6(slack_problem(problem, damping))
    said = [words.replace("N'WN", "N'WN (of the arm with slack joints)") for words in inner.said]
    return Solution(x=inner.x[:, : problem.n], y=inner.y, status=inner.status, said=said, evidence=inner.evidence)


def slack_problem(problem: VelocityProblem, damping: float) -> VelocityProblem:
    """The problem with m slack joints s = xdot - J qdot (methods C1)."""
    B, m, n, share = len(problem), problem.m, problem.n, damping**2
    J = np.concatenate([problem.J, np.broadcast_to(np.eye(m), (B, m, m))], axis=-1)
    base = np.zeros((B, n + m, n + m))
    base[:, :n, :n] = share * problem.W.base
    base[:, n:, n:] = task_weight(problem)
    a = np.concatenate([share * problem.a, np.zeros((B, m))], axis=-1)
    E, gamma = problem.W.E, problem.W.gamma
    if E is not None and gamma is not None:
        E, gamma = np.concatenate([E, np.zeros((*E.shape[:-1], m))], axis=-1), share * gamma
    return VelocityProblem._of(J, problem.xdot, Weight._trusted(base, E, gamma), a, None)


@np.errstate(all="ignore")
def bound(problem: VelocityProblem, *, damping: float = DAMPING) -> Array:
    """That of eq. (6) on the arm with slack joints (B,)."""
    return six(slack_problem(problem, damping))


DAMPED_LEAST_SQUARES = ClosedForm(
    name="damped_least_squares", task="damped", domain="lambda^2 W + J'Wx J > 0", function=damped_least_squares, bound=bound,
    bound_text=SIX + ", all of the arm with slack joints", about="eq. (6) on [J I]: defined at and through singularities",
    source="methods C1; Nakamura & Hanafusa 1986, Wampler 1986",
)  # fmt: skip
