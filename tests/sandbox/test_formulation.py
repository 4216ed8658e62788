"""Formulations are pairs: what is built, solved exactly and recovered meets the problem's own truth."""

from __future__ import annotations

import numpy as np
import pytest

from problems import sets
from sandbox.formulation import FORMULATIONS, Formulation
from sandbox.judgement import Allowance, judge
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth, truth_of_qp
from sandbox.solution import CODE, Status
from sandbox.tolerances import UNIT
from sandbox.verdict import VERDICTS
from sandbox.yardstick import Yardstick

OF_TASK = {
    "exact": ("manufactured", "indefinite", "planar", "badly_scaled"),
    "least_squares": ("rank_deficient",),
    "damped": ("planar", "rank_deficient"),
}


def solved(problem: VelocityProblem, formulation: Formulation) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict]:
    """Members posed, joint rates, multipliers by exact solution of the posed QPs, and the refusals."""
    posing = formulation.build(problem)
    index, qdot, y = [], [], []
    for posed in posing.parts:
        truths = truth_of_qp(posed.qp.H, posed.qp.g, posed.qp.A, posed.qp.b)
        good = np.flatnonzero([t.x is not None for t in truths])
        if formulation.then is not None and len(good):
            posed = posed[good]
            posed = formulation.then(problem[posed.index], posed, np.array([truths[i].x for i in good]))
            truths = truth_of_qp(posed.qp.H, posed.qp.g, posed.qp.A, posed.qp.b)
            good = np.flatnonzero([t.x is not None for t in truths])
        if not len(good):
            continue
        posed = posed[good]
        x = np.array([truths[i].x for i in good])
        mu = np.array([truths[i].y for i in good]).reshape(len(good), posed.qp.p)
        found = formulation.recover(problem[posed.index], posed, x, mu)
        index.append(posed.index), qdot.append(found[0]), y.append(found[1])
    return np.concatenate(index), np.concatenate(qdot), np.concatenate(y), posing.refused


@pytest.mark.parametrize("name", FORMULATIONS)
def test_recover_undoes_build(name: str) -> None:
    """The exact answer of the posed QP, recovered, meets the KKT conditions of the problem and is its minimiser."""
    formulation = FORMULATIONS[name]
    judged_members = 0
    for set_name in OF_TASK[formulation.task]:
        for group in sets.load(set_name).groups:
            if formulation.task not in group.tasks:
                continue
            problem = group.problem[:6]
            truths = truth(problem, formulation.task)
            yardstick = Yardstick.of(problem, formulation.task, truths)
            index, qdot, y, refused = solved(problem, formulation)
            unique = np.flatnonzero([truths[i].expected == "unique_minimum" and truths[i].margin > 1e-6 for i in index])
            index, qdot, y = index[unique], qdot[unique], y[unique]
            for i, t in enumerate(truths):
                assert not (i in refused and t.expected == "unique_minimum" and t.margin > 1e-6), (set_name, refused[i])
            status = np.full(len(index), CODE[Status.SOLVED], np.int8)
            # posing rounds H and A: allow the rounding of the worst conditioned formulation, squared in J
            eps = (64 * UNIT, 64 * UNIT * 2**10, 64 * UNIT, 64 * UNIT * 2**10)
            scale = np.abs(qdot).max(axis=-1) + np.abs(problem[index].a).max(axis=-1) + 1
            allowance = Allowance.of_solver(eps, scale, scale * yardstick.norm_W[index], "high_accuracy")
            judged = judge(yardstick[index], qdot, y, status, allowance, np.ones(len(index), bool))
            wrong = [VERDICTS[code] for code in judged.verdict if VERDICTS[code] != "verified"]
            assert not wrong, (set_name, problem.m, problem.n, wrong, judged.error, judged.tolerance, judged.multiplier_error)
            judged_members += len(index)
    assert judged_members > 20
