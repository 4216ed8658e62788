"""What holds for every method: framework and original agree, shifts of W change nothing, casts are fast."""

from __future__ import annotations

import inspect
import time

import numpy as np
import pytest

from problems import robots
from problems.methods import METHODS, load
from problems.methods.draw import scattered
from sandbox.agreement import SHIFTS, compare, study
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import UnknownNameError
from sandbox.tolerances import ROBOT_RANK

ROBOTS = ("planar_3r", "planar_4r", "panda")
SITUATIONS = 200
MANY = 10_000
SECONDS = 2.0
FEW = 20
SAME = 1e-9
"""Two spellings of one matrix differ by rounding through inverses of condition numbers below 1e6."""

EACH = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def test_all_rows_are_there():
    """M1 to M20 and C1 to C3, each once, found by name and by id."""
    assert [m.id for m in METHODS.values()] == [f"M{i}" for i in range(1, 21)] + [f"C{i}" for i in range(1, 4)]
    assert all(load(m.id) is load(m.name) is load(m.id.lower()) is m for m in METHODS.values())
    with pytest.raises(UnknownNameError, match="no method is called 'M21'"):
        load("M21")


@EACH
def test_a_row_says_what_it_is(method):
    """Formula, W, a, condition (7), attribution and refusals stand in the row; what is certain names its number."""
    assert all((method.formula, method.weight, method.vector, method.condition, method.works, method.refuses))
    assert method.number or method.certainty != "certain"
    assert (method.form in CLOSED_FORMS and CLOSED_FORMS[method.form].task == method.task) or method.id in ("C2", "C3")


@EACH
@pytest.mark.parametrize("robot", ROBOTS)
def test_framework_and_original_agree(method, robot):
    """Within the sum of their bounds, as cast and after J'AJ and J'B + B'J shifts, in every generic situation."""
    rows = study(method, robots.load(robot), count=SITUATIONS)
    assert {row["shift"] for row in rows} == ({None, *SHIFTS} if method.form == "eq6" else {None})
    for row in rows:
        assert row["held"] + row["refused"] == SITUATIONS
        assert row["agreed"] == row["held"]
        assert row["held"] > 0
        if row["shift"]:
            assert row["indefinite"] > 0.9 * SITUATIONS


@EACH
def test_ten_thousand_panda_configurations_are_cast_in_seconds(method):
    """J, W and a of 10,000 configurations, compiled functions being there already."""
    panda = robots.load("panda")
    drawn = method.draw(panda, np.random.default_rng(1), MANY)
    method.cast(panda, drawn.q, drawn.xdot, **drawn.parameters)
    start = time.perf_counter()
    method.cast(panda, drawn.q, drawn.xdot, **drawn.parameters)
    assert time.perf_counter() - start < SECONDS


def plain(robot, q, xdot, parameters):
    """Situations of every method without its own parameters, but springs that are at rest in balance."""
    keep = {name: parameters[name] for name in ("measure", "failures", "joints") if name in parameters}
    if "rest" in parameters:
        keep["rest"] = q - np.einsum("bmn,bm->bn", robot.jacobian(q), 0.5 * xdot)
    return keep


def agreement(method, robot, q, xdot, parameters):
    """The figures of a row: what the framework answers beside what the original says."""
    problem = method.cast(robot, q, xdot, **parameters)
    return compare(method, robot, problem, method.witness(robot, q, xdot, **parameters), parameters)


@EACH
def test_cast_and_original_take_the_same_parameters(method):
    """The same names, by keyword only, with the same values where left out; a tolerance is the cast's business alone."""
    ours, theirs = (list(inspect.signature(f).parameters.values())[3:] for f in (method.cast, method.original))
    assert [one.name for one in ours] == [one.name for one in theirs]
    assert {one.kind for one in (*ours, *theirs)} <= {inspect.Parameter.KEYWORD_ONLY}
    for one, other in zip(ours, theirs, strict=True):
        assert one.default == other.default or one.name == "tolerance", one.name


@EACH
@pytest.mark.parametrize("robot", ROBOTS)
def test_without_parameters_framework_and_original_agree(method, robot):
    """What stands where a parameter is left out is the same in both, whatever computes it from the robot."""
    robot = robots.load(robot)
    drawn = method.draw(robot, np.random.default_rng(3), FEW)
    row = agreement(method, robot, drawn.q, drawn.xdot, plain(robot, drawn.q, drawn.xdot, drawn.parameters))
    assert row["agreed"] == row["held"] > 0


FORMS = {
    "joint_stiffness": ("stiffness", "compliance", "compliance_as_printed"),
    "weighted_pseudoinverse": ("weight",),
    "gravity_torque_gradient": ("Q",),
    "two_task_obstacle": ("Qd",),
    "extended_jacobian": ("stiffness",),
    "extended_jacobian_hessian": ("stiffness",),
    "extremum_feedback": ("stiffness",),
    "mussa_ivaldi_hogan": ("compliance",),
    "damped_secondary": ("base", "stiffness"),
    "least_squares_rank_deficient": ("weight", "task_weight"),
    "damped_least_squares": ("weight", "task_weight"),
    "jacobian_transpose": ("gain",),
}
"""Parameters that are matrices."""

NO_NUMBER = ("joint_stiffness", "weighted_pseudoinverse", "gravity_torque_gradient", "two_task_obstacle")
"""Methods that do not take a number for one of them."""

MATRICES = pytest.mark.parametrize("name, field", [(name, field) for name, fields in FORMS.items() for field in fields])


def size_of(robot, field):
    """Rows of the matrix."""
    return {"gain": robot.m, "task_weight": robot.m, "Qd": robot.k + 1}.get(field, robot.n)


def posed(name, field, matrix, robot, seed=4, count=FEW):
    """Situations of a method with this matrix: (q, xdot, parameters)."""
    rng = np.random.default_rng(seed)
    q, xdot, _ = METHODS[name].draw(robot, rng, count)
    parameters = {field: matrix}
    if field in ("stiffness", "compliance") and name != "joint_stiffness":  # rest = q - K^-1 J'F: springs in balance
        full = matrix * np.eye(robot.n) if np.ndim(matrix) < 2 else np.asarray(matrix)
        inverse = full if field == "compliance" else np.linalg.inv(full)
        parameters["rest"] = q - np.einsum("bmn,bm->bn", robot.jacobian(q), 0.5 * xdot) @ inverse
    if name == "damped_secondary" and field == "stiffness":
        parameters["secondary"] = "extended"
    if field == "Qd":  # one row more than self-motion can meet, or Qd would not matter
        first = robot.m // 2 + 1
        parameters["points"] = [(joint, (0.0, 0.0, 0.0)) for joint in range(first, first + robot.k + 1)]
    if name == "least_squares_rank_deficient":
        parameters["rank_tolerance"] = ROBOT_RANK
    return q, xdot, parameters


@MATRICES
@pytest.mark.parametrize("robot", ["planar_4r", "panda"])
def test_a_full_matrix_is_used_as_it_stands(name, field, robot):
    """With a full positive definite matrix framework and original agree, and not with its diagonal alone."""
    robot, method = robots.load(robot), METHODS[name]
    A = scattered(np.random.default_rng(5), size_of(robot, field))
    q, xdot, parameters = posed(name, field, A, robot)
    row = agreement(method, robot, q, xdot, parameters)
    assert row["agreed"] == row["held"] > 0
    diagonal = method.witness(robot, q, xdot, **{**parameters, field: np.diag(A)})
    assert compare(method, robot, method.cast(robot, q, xdot, **parameters), diagonal, parameters)["agreed"] == 0


@MATRICES
def test_numbers_diagonals_and_lists_are_matrices(name, field):
    """A diagonal (n,), as an array or a list, and a number are the matrices they stand for, in cast and original."""
    robot, method = robots.load("planar_4r"), METHODS[name]
    size = size_of(robot, field)
    for given in (np.arange(1, size + 1), np.arange(1, size + 1).tolist(), *([] if name in NO_NUMBER else [2, 2.0])):
        full = np.eye(size) * given
        q, xdot, parameters = posed(name, field, full, robot)
        if "tolerance" in inspect.signature(method.cast).parameters:
            parameters["tolerance"] = np.inf
        before, after = (method.cast(robot, q, xdot, **{**parameters, field: A}) for A in (full, given))
        for one, other in ((before.W.dense(), after.W.dense()), (before.a, after.a), (before.xdot, after.xdot)):
            np.testing.assert_allclose(one, other, rtol=SAME, atol=SAME)
        one, other = (method.witness(robot, q, xdot, **{**parameters, field: A}) for A in (full, given))
        np.testing.assert_allclose(one, other, rtol=SAME, atol=SAME)


def same(one, other):
    """Whether two values of a parameter are the same numbers."""
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return np.array_equal(one, other)


@EACH
@pytest.mark.parametrize("robot", ROBOTS)
def test_situations_are_those_of_their_seed(method, robot):
    """The same seed draws the same numbers and another one others; joints keep to their limits, xdot fills [-1, 1)."""
    robot = robots.load(robot)
    one, again, other = (method.draw(robot, np.random.default_rng(seed), 60) for seed in (8, 8, 9))
    assert same(one.q, again.q) and same(one.xdot, again.xdot) and not same(one.q, other.q)
    assert one.parameters.keys() == again.parameters.keys() <= set(inspect.signature(method.cast).parameters)
    assert all(same(value, again.parameters[name]) for name, value in one.parameters.items())
    assert one.q.shape == (60, robot.n) and one.xdot.shape == (60, robot.m)
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    assert ((one.q > robot.lower) & (one.q < robot.upper))[:, bounded].all()
    assert -1 <= one.xdot.min() < -0.9 and 0.9 < one.xdot.max() < 1


SINGULAR = ("damped_least_squares", "least_squares_rank_deficient")
"""Methods that are drawn at singular configurations, and near them."""


@EACH
def test_situations_are_away_from_kinematic_singularities(method):
    """No J is drawn below a twentieth of its size, but where the method is made for it."""
    robot = robots.load("panda")
    sigma = np.linalg.svd(robot.jacobian(method.draw(robot, np.random.default_rng(8), 60).q), compute_uv=False)
    share = sigma[:, -1] / sigma[:, 0]
    assert (share > 0.05).all() if method.name not in SINGULAR else (share < 1e-13).any()


def test_damping_is_drawn_at_near_and_off_singularities():
    """A third each: rank lost to rounding, nearly so over eight decades, and well kept."""
    robot = robots.load("panda")
    sigma = np.linalg.svd(robot.jacobian(METHODS["damped_least_squares"].draw(robot, np.random.default_rng(8), 60).q))[1]
    share = sigma[:, -1] / sigma[:, 0]
    assert (share[:20] < 1e-13).all() and (share[40:] > 0.05).all()
    assert share[20:40].min() < 1e-6 and share[20:40].max() > 1e-3


def test_limits_bind_in_many_drawn_situations():
    """Of time scaling: J^+ xdot alone exceeds a limit in some situations and in others it does not."""
    robot, method = robots.load("planar_4r"), METHODS["time_scaling"]
    drawn = method.draw(robot, np.random.default_rng(8), 200)
    fastest = np.abs(np.einsum("bnm,bm->bn", np.linalg.pinv(robot.jacobian(drawn.q)), drawn.xdot))
    bound = (fastest / drawn.parameters["rate_limits"]).max(axis=1) > 1
    assert 0.2 < bound.mean() < 0.9


def test_singular_values_and_failures_are_drawn_off_ties():
    """Where a least one of several is followed, it is least by a share of 1e-3: its gradient is that of one alone."""
    robot = robots.load("panda")
    draw = METHODS["manipulability_gradient"].draw
    q = draw(robot, np.random.default_rng(8), 60, measure="smallest_singular_value").q
    sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
    assert (sigma[:, -2] - sigma[:, -1] > 1e-3 * sigma[:, 0]).all()
    for measure in ("kfm", "least_relative_manipulability"):
        drawn = METHODS["fault_tolerance"].draw(robot, np.random.default_rng(8), 60, measure=measure)
        J, joints = robot.jacobian(drawn.q), np.array(drawn.parameters["joints"]) - 1
        reduced = np.stack([np.delete(J, joint, axis=2) for joint in joints], axis=1)
        sigma, whole = np.linalg.svd(reduced, compute_uv=False), np.linalg.svd(J, compute_uv=False)
        rho = sigma.prod(axis=-1) / whole.prod(axis=-1)[:, None]
        members = np.sort(sigma[..., -1] if measure == "kfm" else rho, axis=1)
        assert (members[:, 1] - members[:, 0] > 1e-3 * members[:, 0]).all()
        assert (rho > 0.05).all()


def test_second_tasks_are_drawn_clear_and_in_reach():
    """Of the two-task law: no critical point near the obstacle, and every distance is one that self-motion changes."""
    method = METHODS["two_task_obstacle"]
    for name in ROBOTS:
        robot = robots.load(name)
        drawn = method.draw(robot, np.random.default_rng(8), 60)
        E = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters).W.E
        N = np.swapaxes(np.linalg.svd(robot.jacobian(drawn.q))[2][:, robot.m :, :], 1, 2)
        assert (np.linalg.svd(E @ N, compute_uv=False)[:, -1] > 0.05 * np.linalg.norm(E, axis=(1, 2))).all()
        assert (drawn.parameters["escape"] >= 0).all()
