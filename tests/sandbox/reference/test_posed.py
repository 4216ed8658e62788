"""Posed truths: the exact answer of what was posed in floats, carried back, and its own class."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.formulation import FORMULATIONS
from sandbox.problem import VelocityProblem
from sandbox.reference.posed import posed_truth
from sandbox.reference.truth import truth


def mixed() -> VelocityProblem:
    """Solvable, infeasible and without a minimum, of ranks 2, 1 and 2, then solvable with rank 1: in one stack."""
    J = np.array([[[1.0, 0, 2], [0, 1, 1]], [[1, 1, 0], [2, 2, 0]], [[1, 0, 0], [0, 1, 0]], [[1, 1, 0], [2, 2, 0]]])
    W = np.array([np.diag([1.0, 2, 3]), np.eye(3), np.diag([1.0, 1, -1]), np.diag([2.0, 1, 4])])
    return VelocityProblem(J, [[1.0, 2], [1, 0], [1, 1], [3, 6]], W, [1.0, -1, 2])


@pytest.mark.parametrize("name", [name for name, row in FORMULATIONS.items() if row.task == "exact"])
def test_each_member_keeps_its_place(name: str) -> None:
    """Answers and classes stand at the members they belong to; nothing stands where posing was refused."""
    posed = posed_truth(mixed(), FORMULATIONS[name])
    right = truth(mixed())
    for i in (0, 3):
        np.testing.assert_allclose(posed.qdot[i], right[i].x, rtol=1e-12)
        assert posed.expected[i] == "unique_minimum"
    assert np.isnan(posed.qdot[[1, 2]]).all()
    refused = {"direct": (), "convexified": (2,), "augmented_lagrangian": (2,), "null_space": (1,)}[name]
    classes = {1: "infeasible", 2: "no_minimum"}
    assert [posed.expected[i] for i in (1, 2)] == [None if i in refused else classes[i] for i in (1, 2)]


@pytest.mark.parametrize("name", ["range_space", "normal_equations", "slack"])
def test_other_tasks_have_their_own_answers(name: str) -> None:
    """Least squares answers the infeasible member too; damping is held to its own curvature."""
    formulation = FORMULATIONS[name]
    posed, right = posed_truth(mixed(), formulation), truth(mixed(), formulation.task)
    for i, t in enumerate(right):
        assert posed.expected[i] == t.expected
        if t.x is None:
            assert np.isnan(posed.qdot[i]).all()
        else:
            np.testing.assert_allclose(posed.qdot[i], t.x, rtol=1e-9)
    assert sum(t.x is not None for t in right) >= 3


def test_hierarchical_goes_through_both_stages() -> None:
    """The second stage answers where the first did; a first stage without a minimum gives the class, and no answer."""
    J = np.array([[[1.0, 0], [1, 0]], [[1, 0], [0, 0]], [[0, 1], [0, 1]], [[2, 0], [0, 0]]])
    Wx = np.array([np.eye(2), np.diag([-1.0, 1]), np.eye(2), np.diag([-2.0, 1])])
    W = np.array([np.diag([1.0, 2]), np.eye(2), np.diag([-1.0, 2]), np.eye(2)])
    problem = VelocityProblem(J, [[1.0, 3], [1, 1], [2, 4], [1, 1]], W, [1.0, 4], Wx)
    posed = posed_truth(problem, FORMULATIONS["hierarchical"])
    assert posed.expected == ["unique_minimum", "no_minimum", "no_minimum", "no_minimum"]
    np.testing.assert_allclose(posed.qdot[0], [2, -2], rtol=1e-14)
    assert np.isnan(posed.qdot[1:]).all()
    alone = posed_truth(problem[1:2], FORMULATIONS["hierarchical"])
    assert alone.expected == ["no_minimum"] and np.isnan(alone.qdot).all()


def test_a_freedom_is_filled_by_the_least_norm() -> None:
    """Where the posed minimum is not unique, its answer of least norm is carried back."""
    problem = VelocityProblem([[1.0, 0, 0]], [2.0], np.diag([1.0, 0, 1]), [0, 0, 1]).stacked()
    posed = posed_truth(problem, FORMULATIONS["direct"])
    assert posed.expected == ["minimum_not_unique"]
    np.testing.assert_array_equal(posed.qdot, [[2, 0, -1]])
