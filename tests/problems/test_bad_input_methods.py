"""Bad input to robots, measures, methods and files of one's own is refused in one line that names what, where and the way out.

First every parameter of every method is given values of all kinds: each is refused, or answered as the original answers it.
Then one row per refusal, with its words.
"""

from __future__ import annotations

import inspect
import warnings

import numpy as np
import pytest

from problems import measures, paths, robots
from problems.measures.fault_tolerance import TooManyFailuresError
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.measures.obstacle import ContactError
from problems.methods import METHODS, load
from problems.methods.gravity_torque_gradient import cast_acceleration
from problems.own_method import read_method
from problems.paths.path import Path
from problems.robots import denavit_hartenberg as dh
from problems.robots.planar import PLANAR_3R, PLANAR_4R, planar_arm
from problems.robots.robot import Robot
from problems.robots.urdf import from_urdf
from problems.weightings.augmented import NotRedundantError, OverdeterminedWarning
from problems.weightings.extended import OffManifoldError
from problems.weightings.identity import MixedUnitsError
from problems.weightings.impedance import OffEquilibriumError
from problems.weightings.stiffness import UnitMismatchError
from problems.weightings.two_task import NotControlledError
from problems.weightings.virtual_load import LoadError
from sandbox.agreement import compare, study
from sandbox.errors import (
    InputFileError,
    NonFiniteError,
    RangeError,
    RankDeficientError,
    SandboxError,
    ShapeError,
    UnknownNameError,
    WeightNotPositiveDefiniteError,
)
from sandbox.law import rates
from tests.problems.measures.chain import MIXED

B, N, M, K = 4, 3, 2, 1
LONGEST = 420
"""Letters of a refusal: what, where, the value and the way out."""

GENERIC = np.array([0.3, 1.1, -0.7])

ODD = {
    "None": None,
    "NaN": np.nan,
    "infinity": np.inf,
    "minus infinity": -np.inf,
    "-1": -1.0,
    "0": 0.0,
    "3": 3,
    "float32": np.float32(0.5),
    "word": "abc",
    "number as a word": "1.0",
    "bool": True,
    "complex": 1j,
    "dict": {"a": 1},
    "object": object(),
    "set": {1.0},
    "nothing": [],
    "[1]": [1.0],
    "huge": 1e200,
    "tiny": 1e-200,
    "beyond floats": 10**400,
    "(n,)": np.arange(1.0, N + 1),
    "(n + 1,)": np.ones(N + 1),
    "-(n,)": -np.ones(N),
    "(n,) NaN": np.full(N, np.nan),
    "(n,) infinite": np.full(N, np.inf),
    "(n,) words": ["a"] * N,
    "(n,) None": [None] * N,
    "(k,)": np.ones(K),
    "(m,)": np.ones(M),
    "(B,)": np.ones(B),
    "(B, n)": np.ones((B, N)),
    "(B, 1)": np.ones((B, 1)),
    "(B, k)": np.ones((B, K)),
    "(B + 1, n)": np.ones((B + 1, N)),
    "(2, B, n)": np.ones((2, B, N)),
    "I": np.eye(N),
    "triangular": np.triu(np.ones((N, N))),
    "-I": -np.eye(N),
    "zeros": np.zeros((N, N)),
    "stack of I": np.broadcast_to(np.eye(N), (B, N, N)),
    "too many I": np.broadcast_to(np.eye(N), (B + 1, N, N)),
    "(1, n, n)": np.eye(N)[None],
    "(m, m)": np.eye(M),
    "(k, n)": np.ones((K, N)),
    "(B, k, n)": np.sin(np.arange(B * K * N)).reshape(B, K, N),
    "(B + 1, k, n)": np.sin(np.arange((B + 1) * K * N)).reshape(B + 1, K, N),
    "(0, n)": np.zeros((0, N)),
    "(0, n, n)": np.zeros((0, N, N)),
    "masked": np.ma.masked_equal(np.arange(1.0, N + 1), 2.0),
    "objects": np.array([1] * N, dtype=object),
    "ragged": [[1.0, 2.0], [1.0]],
}
"""Values of all kinds, most of them wrong wherever they are given."""

ANOTHER = {("two_task_obstacle", "eps"), ("least_squares_rank_deficient", "rank_tolerance")}
"""Parameters that the original does not have, or decides at another place: it is the limit, or the exact rank."""

PARAMETERS = [(method, name) for method in METHODS.values() for name in list(inspect.signature(method.cast).parameters)[3:]]


def refused_well(error: SandboxError) -> bool:
    """Whether a refusal is one line of readable length."""
    listed = isinstance(error, UnknownNameError)  # of all names there are
    return "\n" not in str(error) and bool(str(error)) and (listed or len(str(error)) <= LONGEST)


@pytest.mark.parametrize("method, name", PARAMETERS, ids=lambda value: value if isinstance(value, str) else value.id)
def test_any_parameter_is_refused_or_answered(method, name):
    """Whatever a parameter is given: a refusal in one line, or finite rates, those of the original; nothing else is raised."""
    drawn = method.draw(PLANAR_3R, np.random.default_rng(0), B)
    answered = 0
    for kind, value in ODD.items():
        given = {**drawn.parameters, name: value}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OverdeterminedWarning)
            try:
                qdot = rates(method, PLANAR_3R, drawn.q, drawn.xdot, **given)
            except SandboxError as error:
                assert refused_well(error), (kind, error)
                continue
            answered += 1
            assert qdot.shape == (B, N) and np.isfinite(qdot).all(), kind
            if (method.name, name) in ANOTHER:
                continue
            original = method.original(PLANAR_3R, drawn.q, drawn.xdot, **given)
            problem = method.cast(PLANAR_3R, drawn.q, drawn.xdot, **given)
            assert compare(method, PLANAR_3R, problem, original, given)["agreed"] == B, kind
    assert answered < len(ODD) / 2


def placed(shape: tuple[int, ...], q: np.ndarray) -> dict[str, object]:
    """What may be given in the place of q (B, w), by kind."""
    w = shape[-1]
    nan, infinite = q.copy(), q.copy()
    nan[2, 1], infinite[3, 0] = np.nan, np.inf
    return {
        "None": None,
        "word": "abc",
        "number": 1.0,
        "nothing": [],
        "(0, w)": np.zeros((0, w)),
        "(B, w + 1)": np.ones((B, w + 1)),
        "(B, w - 1)": np.ones((B, w - 1)),
        "NaN": nan,
        "infinite": infinite,
        "(B + 1, w)": np.concatenate([q, q[:1]]),
        "masked": np.ma.masked_where(q > 0, q),
        "words": np.full(shape, "1"),
        "bools": np.ones(shape, dtype=bool),
        "huge": 1e200 * q,
    }


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_any_configuration_and_velocity_is_refused_or_answered(method):
    """What is no stack of configurations or task velocities is refused; lists, tuples, objects and any memory order are one."""
    drawn = method.draw(PLANAR_3R, np.random.default_rng(0), B)
    expected = rates(method, PLANAR_3R, *drawn[:2], **drawn.parameters)
    for place in (0, 1):
        good = drawn[place]
        for kind, value in placed(good.shape, good).items():
            both = [drawn.q, drawn.xdot]
            both[place] = value
            with pytest.raises(SandboxError) as caught:
                rates(method, PLANAR_3R, *both, **drawn.parameters)
            assert refused_well(caught.value), (kind, caught.value)
        still = good.copy()
        still.setflags(write=False)
        for same in (good.tolist(), tuple(map(tuple, good)), good.astype(object), np.asfortranarray(good), still):
            both = [drawn.q, drawn.xdot]
            both[place] = same
            np.testing.assert_array_equal(rates(method, PLANAR_3R, *both, **drawn.parameters), expected)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_robots_that_a_method_is_not_for(method):
    """As many rows as joints, more rows than joints, a row that no joint moves, one joint: refused, or solved as asked."""
    for robot in (PLANAR_3R.task("planar pose"), PLANAR_3R.task("pose"), PLANAR_3R.task((2,)), planar_arm([1.0])):
        q, xdot = np.array([[0.3, 0.7, 1.1], [0.5, 0.6, 0.9]])[:, : robot.n], np.ones((2, robot.m))
        try:
            qdot = rates(method, robot, q, xdot)
        except SandboxError as error:
            assert refused_well(error)
        else:
            assert np.isfinite(qdot).all()
            if method.task == "exact":
                np.testing.assert_allclose(np.einsum("bmn,bn->bm", robot.jacobian(q), qdot), xdot)
        try:
            method.draw(robot, np.random.default_rng(0), 2)
        except SandboxError as error:
            assert refused_well(error)


def cast(name: str, robot: Robot = PLANAR_3R, q: object = (0.3, 1.1, -0.7), **given: object) -> object:
    """The cast of a method at one configuration."""
    return load(name).cast(robot, np.array([q]), np.ones((1, robot.m)), **given)


FAR = (0.5, 0.5, 0.5)
LIMITS = {"measure": "joint_limits_barrier"}
REFUSALS = {
    "M1 mixed joints": (lambda: cast("M1", MIXED, (0.1, 0.2, 0.3, 0.4)), MixedUnitsError, r"joint 2 slides.*give scales"),
    "M1 long gradient": (lambda: cast("M1", gradient=np.ones(4)), ShapeError, r"grad f has shape \(4,\)"),
    "M1 alpha per joint": (lambda: cast("M1", alpha=[1, 2, 3]), ShapeError, r"alpha has shape \(3,\); it must be one number"),
    "M1 gradient of others": (lambda: cast("M1", gradient=np.ones((4, 3))), ShapeError, "grad f has the leading axes"),
    "M1 posture and gradient": (lambda: cast("M1", gradient=FAR, posture=FAR), RangeError, "give one"),
    "M1 posture of one number": (lambda: cast("M1", posture=1.0), ShapeError, "one angle per joint"),
    "M1 scales in words": (lambda: cast("M1", scales="abc"), ShapeError, "scales must hold real numbers"),
    "M2 indefinite": (lambda: cast("M2", weight=np.diag([-1.0, 1, 1])), WeightNotPositiveDefiniteError, r"eq\. \(6\)"),
    "M3 limits crossed": (lambda: cast("M3", lower=[1, 1, 1], upper=[2, 0, 2]), RangeError, "joint 2 .* 1 and 0"),
    "M3 outside the barrier": (
        lambda: cast("M3", q=(0, 3.0, 0), **LIMITS),
        OutsideDomainError,
        "joint 2 of configuration 0 is at 3",
    ),
    "M3 on the barrier": (lambda: cast("M3", q=(0, 2.75, 0), **LIMITS), OutsideDomainError, "is at 2.75, not between"),
    "M3 infinite with a weight": (
        lambda: cast("M3", upper=[1, np.inf, 1], weights=[1, 1, 1]),
        RangeError,
        "no two finite limits",
    ),
    "M3 p of another measure": (
        lambda: cast("M3", p=4),
        RangeError,
        "p is given, but joint_limits_quadratic has no use for it",
    ),
    "M3 masked limit": (
        lambda: cast("M3", lower=np.ma.masked_equal([-1.0, -2, -3], -2)),
        NonFiniteError,
        r"lower\[1\] is masked",
    ),
    "M3 limits in words": (lambda: cast("M3", upper=["1", "1", "1"]), ShapeError, "upper must hold real numbers"),
    "M3 f without a gradient": (
        lambda: cast("M3", q=(0, 0, 0), measure="joint_limits_p_norm"),
        NotDifferentiableError,
        "use the quadratic measure",
    ),
    "M6 a link without mass": (lambda: planar_arm([1, 1, 1], [1, 0, 1]), RangeError, "mass of link 2 is 0"),
    "M15 stiffnesses of others": (
        lambda: cast("M15", stiffness=np.array([np.eye(3)] * 4)),
        ShapeError,
        "K has the leading axes",
    ),
    "M4 at a limit": (lambda: cast("M4", q=(0, 2.75, 0)), OutsideDomainError, "joint 2"),
    "M4 mixed joints": (lambda: cast("M4", MIXED, (0.1, 0.2, 0.3, 0.4)), MixedUnitsError, "weigh its joints yourself"),
    "M5 singular": (lambda: cast("M5", q=(0, 0, 0)), RankDeficientError, r"\(3\.74, 0\)"),
    "M5 no such measure": (lambda: cast("M5", measure=["manipulability"]), UnknownNameError, "there are: log_manipulability"),
    "M6 Q negative": (lambda: cast("M6", Q=-np.eye(3)), RangeError, "Q has the eigenvalue -1"),
    "M6 Q of each configuration": (lambda: cast("M6", Q=np.eye(3)[None]), ShapeError, "one for all configurations"),
    "M6 massless": (lambda: cast("M6", massless()), SandboxError, "mass of 0 kg"),
    "M6 accelerations, M singular": (
        lambda: cast_acceleration(massless(), GENERIC, np.ones(2)),
        WeightNotPositiveDefiniteError,
        "mass matrix",
    ),
    "M7 contact": (lambda: cast("M7", q=(0, 1, 1), obstacle=(1, 0, 0)), ContactError, r"link 1 .*configuration 0 \(distance"),
    "M7 d0": (lambda: cast("M7", reach=0.0), RangeError, "reach is 0; it must be positive"),
    "M7 d0 of each": (lambda: cast("M7", reach=np.ones(3)), ShapeError, "it must be one number"),
    "M7 stray point": (lambda: cast("M7", points=[(4, (0, 0, 0))]), RangeError, r"not on the arm.*1\.\.3"),
    "M7 point in words": (lambda: cast("M7", points="ab"), ShapeError, "points is 'ab'"),
    "M8 contact": (lambda: cast("M8", q=(0, 1, 1), obstacle=(1, 0, 0), points=[(2, (0, 0, 0))]), ContactError, "touches"),
    "M8 not controlled": (lambda: cast("M8", points=[(1, (0, 0, 0))], obstacle=(2, 2, 0)), NotControlledError, "give eps > 0"),
    "M8 eps": (lambda: cast("M8", eps=-1.0), RangeError, "eps is -1; it must be at least 0"),
    "M8 eps of each": (lambda: cast("M8", eps=[1.0]), ShapeError, "eps has shape"),
    "M8 escape of others": (lambda: cast("M8", escape=np.ones((4, 1))), ShapeError, "escape has the leading axes"),
    "M8 no self-motion": (lambda: cast("M8", planar_arm([1, 1]), (0.3, 0.4)), NotRedundantError, "no self-motion"),
    "M8 eps I of mixed joints": (
        lambda: cast("M8", MIXED, (0.1, 0.2, 0.3, 0.4), eps=1.0),
        MixedUnitsError,
        "so that eps = 0 will do",
    ),
    "M9 too many failures": (lambda: cast("M9", failures=2), TooManyFailuresError, "1 degrees of redundancy"),
    "M9 half a joint": (lambda: cast("M9", joints=[1.7]), RangeError, r"joints\[0\] of planar_3r is 1\.7"),
    "M9 joints in words": (lambda: cast("M9", joints="123"), ShapeError, "give the numbers of those that may fail"),
    "M9 half a failure": (lambda: cast("M9", failures=0.5), RangeError, "failures of 3 joints is 0.5"),
    "M9 rho = 0": (lambda: cast("M9", q=(0, np.pi / 2, 0)), OutsideDomainError, "joint 1 .*locked there"),
    "M9 singular": (lambda: cast("M9", q=(0, 0, 0)), RankDeficientError, "relative manipulability"),
    "M10 upright": (lambda: cast("M10", q=(0, np.pi / 2, 0), measure="swing_angle"), NotDifferentiableError, "upright"),
    "M10 weights of each": (lambda: cast("M10", weights=np.ones((1, 3))), ShapeError, r"weights has shape \(1, 3\)"),
    "M11 too few": (lambda: cast("M11", PLANAR_4R, (0.1, 0.2, 0.3, 0.4), E=np.ones((1, 4))), SandboxError, "give 2"),
    "M11 gamma": (lambda: cast("M11", gamma=[0.0]), RangeError, "must be 1 positive numbers"),
    "M11 rows of others": (lambda: cast("M11", E=np.ones((4, 1, 3))), ShapeError, "E has the leading axes"),
    "M11 singular N'E'": (lambda: cast("M11", q=(0, 0, 1)), SandboxError, "algorithmic singularity"),
    "M12 off the manifold": (lambda: cast("M12", q=GENERIC), OffManifoldError, "feed h back"),
    "M12 tolerance NaN": (lambda: cast("M12", q=GENERIC, tolerance=np.nan), RangeError, "tolerance is nan"),
    "M12 tolerance negative": (lambda: cast("M12", tolerance=-1.0), RangeError, "tolerance is -1"),
    "M12 springs of each": (lambda: cast("M12", stiffness=np.eye(3)[None]), ShapeError, "one for all configurations"),
    "M13 neither true nor false": (lambda: cast("M13", maximum="no", tolerance=np.inf), ShapeError, "maximum is 'no'"),
    "M14 gain in words": (lambda: cast("M14", kappa="fast"), ShapeError, "kappa must hold real numbers"),
    "M15 wrong unit": (lambda: cast("M15", stiffness=np.ones(3), unit="rad/Nm"), UnitMismatchError, "Nm/rad"),
    "M15 unit of nothing": (lambda: cast("M15", unit="Nm/rad"), RangeError, "unit is given, but"),
    "M15 two kinds": (lambda: cast("M15", stiffness=np.ones(3), compliance=np.ones(3)), RangeError, "give one of"),
    "M15 singular K": (lambda: cast("M15", stiffness=[1, 0, 1]), WeightNotPositiveDefiniteError, "K is not positive definite"),
    "M16 massless": (lambda: cast("M16", massless()), WeightNotPositiveDefiniteError, "mass matrix M of massless"),
    "M17 negative mass": (lambda: cast("M17", bodies=[(1, -1.0)]), LoadError, "mass of -1 kg"),
    "M17 masses": (lambda: cast("M17", bodies=[(1, [1.0, 2.0])]), ShapeError, "mass of a virtual body has shape"),
    "M17 half a joint": (lambda: cast("M17", bodies=[(1.5, 1.0)]), RangeError, r"joint 1\.5 of a virtual body"),
    "M17 no bodies": (lambda: cast("M17", bodies="ball"), ShapeError, "bodies is 'ball'"),
    "M17 stacked centre": (lambda: cast("M17", bodies=[(1, 1.0, np.ones((2, 3)))]), ShapeError, "centre of a virtual body"),
    "M18 off equilibrium": (lambda: cast("M18", q=GENERIC), OffEquilibriumError, "for any force F on the hand"),
    "M18 C not definite": (lambda: cast("M18", compliance=[1, -1, 1]), WeightNotPositiveDefiniteError, "compliance"),
    "M19 base": (lambda: cast("M19", base=0.0), WeightNotPositiveDefiniteError, "base"),
    "M19 no such task": (lambda: cast("M19", secondary=np.ones(3)), UnknownNameError, "there are: augmented, extended"),
    "M19 springs of the other": (lambda: cast("M19", stiffness=1.0), RangeError, "the augmented Jacobian has no use for it"),
    "M19 rows of the other": (lambda: cast("M19", secondary="extended", gbar=[1.0]), RangeError, "gbar is given"),
    "M20 I of mixed joints": (lambda: cast("M20", MIXED, (0.1, 0.2, 0.3, 0.4)), MixedUnitsError, "give weight"),
    "M20 negative tolerance": (lambda: cast("M20", rank_tolerance=-1.0), RangeError, "rank_tolerance is -1"),
    "C1 no damping": (lambda: cast("C1", damping=0.0), RangeError, "lambda must be positive"),
    "C1 damping of each": (lambda: cast("C1", damping=[1.0]), ShapeError, "damping has shape"),
    "C1 I of mixed joints": (lambda: cast("C1", MIXED, (0.1, 0.2, 0.3, 0.4)), MixedUnitsError, "give weight"),
    "C2 error of one row": (lambda: load("C2").cast(PLANAR_3R, GENERIC, [1.0]), ShapeError, r"xdot has shape \(1,\)"),
    "C3 limit": (lambda: cast("C3", rate_limits=[1, 0, 1]), RangeError, "rate limit of joint 2 is 0"),
    "C3 limits of each": (lambda: cast("C3", rate_limits=np.ones((1, 3))), ShapeError, "rate_limits has shape"),
    "C3 mixed joints": (lambda: cast("C3", MIXED, (0.1, 0.2, 0.3, 0.4)), MixedUnitsError, "gradient_projection with scales"),
    "no such parameter": (
        lambda: rates(load("M1"), PLANAR_3R, GENERIC, [1, 1], beta=1),
        UnknownNameError,
        "there are: alpha, ",
    ),
    "parameter of a cast that has none": (
        lambda: rates(load("M16"), PLANAR_3R, GENERIC, [1, 1], alpha=1),
        UnknownNameError,
        "there are: none",
    ),
    "no method": (lambda: load("M21"), UnknownNameError, "no method is called 'M21'"),
    "a list for a method": (lambda: load(["M1"]), UnknownNameError, r"no method is called .*\['M1'\]"),
    "no situations": (lambda: study(load("M1"), PLANAR_3R, count=0), RangeError, "count is 0; it must be a whole number"),
    "negative seed": (lambda: study(load("M1"), PLANAR_3R, count=2, seed=-1), RangeError, "seed is -1"),
    "measure: no such": (lambda: measures.load("speed", PLANAR_3R), UnknownNameError, "no measure is called 'speed'"),
    "measure: no such parameter": (lambda: measures.load("posture", PLANAR_3R, goal=1), UnknownNameError, "there are: target"),
    "measure: another arm's posture": (
        lambda: measures.load("posture", PLANAR_3R, target=[1, 2]).value(PLANAR_3R, GENERIC),
        ShapeError,
        "posture",
    ),
    "measure: obstacle of others": (
        lambda: measures.load("obstacle_potential", PLANAR_3R, obstacle=np.full((2, 3), 5.0), reach=1.0).value(
            PLANAR_3R, [GENERIC]
        ),
        ShapeError,
        "leading axes",
    ),
    "path: no such": (lambda: paths.load(["square"]), UnknownNameError, "there are: circle"),
    "path: no such option": (lambda: paths.load("circle", turns=2), UnknownNameError, "there are: duration, plane"),
    "path: size": (lambda: paths.load("circle", np.nan), NonFiniteError, "radius is nan"),
    "path: duration in words": (lambda: curve(duration="1"), ShapeError, "duration must hold real numbers"),
    "path: wrong velocity": (
        lambda: curve(speed=2.0),
        RangeError,
        "velocity of line is not the derivative of its displacement",
    ),
    "robot: no such": (lambda: robots.load("planar_0r"), UnknownNameError, "planar_Nr for any N of 1..99"),
    "robot: a number": (lambda: robots.load(3), UnknownNameError, "no robot is called '3'"),
    "robot: Arabic digits": (lambda: robots.load("planar_\u0663r"), UnknownNameError, "no robot is called"),
    "robot: task of one number": (lambda: PLANAR_3R.task(3), RangeError, "task rows 3 must be different numbers"),
    "robot: task row True": (lambda: PLANAR_3R.task([True]), RangeError, "different numbers"),
    "robot: task rows nested": (lambda: PLANAR_3R.task([[0, 1]]), RangeError, "different numbers"),
    "robot: point on joint True": (lambda: PLANAR_3R.point(GENERIC, True), RangeError, r"joint True is not one of 1\.\.3"),
    "robot: point on joint 1.0": (lambda: PLANAR_3R.point(GENERIC, 1.0), RangeError, r"joint 1\.0"),
    "robot: frame of no name": (lambda: PLANAR_3R.frame(None), UnknownNameError, "there are: tip"),
    "robot: hand of no name": (lambda: Robot("arm", PLANAR_3R.model, None), UnknownNameError, "there are: tip"),
    "robot: no name": (lambda: Robot(3, PLANAR_3R.model, "tip"), ShapeError, "the name of a robot is 3"),
    "robot: lengths": (lambda: planar_arm("111"), ShapeError, "link length"),
    "robot: rods in words": (lambda: planar_arm([1, 1], rods="no"), ShapeError, "rods is 'no'"),
    "robot: rows of a table": (lambda: dh.arm("arm", [(1, 2, 3, 4)]), ShapeError, "row 1 .*give a Link"),
    "robot: a file of no name": (lambda: from_urdf(None, "hand"), InputFileError, "None names no file"),
    "robot: a folder": (lambda: from_urdf("/", "hand"), InputFileError, "cannot read /"),
}


def massless() -> Robot:
    """Planar 3R whose links have no mass."""
    model = PLANAR_3R.model.copy()
    for body in model.inertias:
        body.mass = 0.0
    return Robot("massless", model, "tip", PLANAR_3R.rows)


def curve(duration: object = 1.0, speed: float = 1.0) -> Path:
    """A line along x, at 1 m/s."""
    x = np.array([1.0, 0.0, 0.0])
    return Path(
        name="line", duration=duration, closed=False, displacement=lambda t: np.asarray(t)[..., None] * x,
        velocity=lambda t: np.ones(np.shape(t))[..., None] * speed * x,
    )  # fmt: skip


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_names_what_where_and_the_way_out(name):
    """Each has its own kind of error and its words, in one line."""
    refuse, kind, words = REFUSALS[name]
    with pytest.raises(kind, match=words) as caught:
        refuse()
    assert refused_well(caught.value)


def test_a_single_joint_is_a_robot():
    """One joint, one row: numbers keep their axes, and the rate is xdot over the length."""
    arm = planar_arm([2.0]).task((1,))
    q = np.zeros((3, 1))
    assert arm.jacobian(q).shape == (3, 1, 1) and arm.inertia(q).shape == (3, 1, 1) and arm.gravity_torque(q).shape == (3, 1)
    assert arm.jacobian_derivative(q).shape == (3, 1, 1, 1) and arm.geometric(q).shape == (3, 6, 1)
    for name in ("M1", "M2", "M3", "M4", "M5", "M6", "M10", "M15", "M16", "M17", "C3"):
        np.testing.assert_allclose(rates(load(name), arm, q, np.ones((3, 1))), 0.5)


def test_one_row_of_accelerations():
    """A task of one row keeps its axis: least torque by accelerations, for a stack and for one."""
    arm = PLANAR_3R.task((0,))
    q = np.array([GENERIC, GENERIC / 2])
    problem = cast_acceleration(arm, q, np.ones((2, 1)), qdot=[0.1, 0.2, 0.3])
    assert problem.xdot.shape == (2, 1)
    np.testing.assert_allclose(problem.xdot[1], cast_acceleration(arm, q[1], [1.0], qdot=[0.1, 0.2, 0.3]).xdot)


def test_a_weight_of_each_configuration():
    """Where one W or Wx per configuration is taken, the original takes it too, and they agree."""
    rng = np.random.default_rng(5)
    for name, field, size in (("C1", "weight", N), ("C1", "task_weight", M), ("M20", "weight", N), ("M19", "base", N)):
        method = load(name)
        drawn = method.draw(PLANAR_3R, rng, B)
        A = rng.standard_normal((B, size, size))
        given = {**drawn.parameters, field: A @ np.swapaxes(A, 1, 2) + np.eye(size)}
        problem = method.cast(PLANAR_3R, drawn.q, drawn.xdot, **given)
        original = method.original(PLANAR_3R, drawn.q, drawn.xdot, **given)
        assert compare(method, PLANAR_3R, problem, original, given)["agreed"] == B, (name, field)


def test_a_fast_task_does_not_hide_the_self_motion():
    """However fast the task, the self-motion is not lost in it: time scaling answers, at the limits."""
    drawn = load("C3").draw(PLANAR_3R, np.random.default_rng(0), B)
    qdot = rates(load("C3"), PLANAR_3R, drawn.q, 1e12 * drawn.xdot, **drawn.parameters)
    limits = drawn.parameters["rate_limits"]
    np.testing.assert_allclose((np.abs(qdot) / limits).max(axis=-1), 1.0)


def test_time_scaling_by_the_robots_own_limits():
    """rate_limits=None is the same as leaving it out."""
    same = [rates(load("C3"), PLANAR_3R, [GENERIC], [[9, 9]], **given) for given in ({}, {"rate_limits": None})]
    np.testing.assert_array_equal(*same)


OWN = "def method(robot, q):\n    return robot.inertia(q)\n"
FILES = {
    "leaves": ("import sys\nsys.exit(0)\n", "cannot be run: SystemExit: 0, line 2"),
    "leaves when called": ("import sys\ndef method(robot, q):\n    sys.exit(0)\n", "method failed: SystemExit: 0, line 3"),
    "an error of its own": (
        "class E(BaseException): pass\ndef method(robot, q):\n    raise E('x')\n",
        "method failed: E: x, line 3",
    ),
    "an error without words": (
        "class E(Exception):\n    def __str__(self): raise ValueError\ndef method(robot, q):\n    raise E\n",
        "method failed: E: , line 4",
    ),
    "endless recursion": ("def method(robot, q):\n    return method(robot, q)\n", "method failed: RecursionError"),
    "gives nothing": ("def method(robot, q):\n    pass\n", "W must hold real numbers, but W is None"),
    "gives words": ("def method(robot, q):\n    return 'W'\n", "W must hold real numbers"),
    "gives complex numbers": ("def method(robot, q):\n    return robot.inertia(q) * 1j\n", "not complex128"),
    "gives too many": ("def method(robot, q):\n    return robot.inertia([q, q])\n", "W has the leading axes"),
    "W of another arm": (
        "import numpy as np\ndef method(robot, q):\n    return np.eye(2)\n",
        r"W has shape \(2, 2\); it must be \(3, 3\)",
    ),
    "alpha in words": (OWN + "alpha = 'x'\ndef f(robot, q):\n    return q[0]\n", "alpha must hold real numbers"),
    "alpha NaN": (OWN + "alpha = float('nan')\ndef f(robot, q):\n    return q[0]\n", "alpha is nan"),
    "alpha per joint": (OWN + "alpha = [1, 2]\ndef f(robot, q):\n    return q[0]\n", r"alpha has shape \(2,\)"),
    "alpha of nothing": (OWN + "alpha = 3\n", "alpha is given, but no f"),
    "gradient of nothing": (OWN + "def gradient(robot, q):\n    return q\n", "gradient is given, but no f"),
    "alpha beside implicit": ("alpha = 1\ndef implicit(robot, q, N):\n    pass\n", "leave alpha out"),
    "f a whole number": (
        OWN + "def f(robot, q):\n    return 0\ndef gradient(robot, q):\n    return 0 * q\n",
        r"f has shape \(\); it must be \(5,\)",
    ),
    "gradient of one": (
        OWN + "import numpy as np\ndef f(robot, q):\n    return np.array(q)[:, 0]\ndef gradient(robot, q):\n    return q[0]\n",
        r"gradient has shape \(3,\); it must be \(5, 3\)",
    ),
    "f of a stray symbol": (
        OWN + "import casadi as ca\ndef f(robot, q):\n    return q[0] * ca.SX.sym('z')\n",
        "f depends on z",
    ),
    "expression with a wrong gradient": (
        OWN + "def f(robot, q):\n    return q[0] * q[0]\ndef gradient(robot, q):\n    return 0 * q\n",
        "gradient is not that of f.*CasADi gives",
    ),
    "expression beyond its domain": (
        OWN + "import casadi as ca\ndef f(robot, q):\n    return ca.log(q[0] - 9)\n",
        r"f\[0\] is nan",
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_ones_own_cannot_harm(tmp_path, name):
    """Whatever a file does, leaving the process among it, is a refusal that names the file, and the line where it has one."""
    text, words = FILES[name]
    path = tmp_path / "own file's.py"
    path.write_text(text)
    with pytest.raises(InputFileError, match=words) as caught:
        read_method(path).cast(PLANAR_3R, GENERIC[None], np.ones((1, 2)))
    assert "own file's.py" in str(caught.value) and refused_well(caught.value)


def test_a_file_may_give_lists_whole_numbers_and_objects(tmp_path):
    """W as a list, of whole numbers or of objects is W; what the file does to the arrays it is given stays its own."""
    path = tmp_path / "own.py"
    start = np.array([GENERIC, GENERIC])
    for body in (
        "[[1 if i == j else 0 for j in range(3)] for i in range(3)]",
        "np.eye(3, dtype=object)",
        "np.eye(3, dtype=int)",
    ):
        path.write_text(f"import numpy as np\ndef method(robot, q):\n    q += 1\n    return {body}\n")
        q = start.copy()
        problem = read_method(path).cast(PLANAR_3R, q, np.ones((2, 2)))
        np.testing.assert_array_equal(problem.W.base, np.broadcast_to(np.eye(3), (2, 3, 3)))
        np.testing.assert_array_equal(q, start)


def test_an_original_of_one_configuration_is_not_that_of_all(tmp_path):
    """Rates (n,) where (B, n) are due are refused, not copied to every configuration."""
    path = tmp_path / "own.py"
    path.write_text(OWN + "import numpy as np\ndef original(robot, q, xdot):\n    return np.ones(3)\n")
    with pytest.raises(InputFileError, match=r"original has shape \(3,\); it must be \(2, 3\)"):
        read_method(path).original(PLANAR_3R, np.ones((2, 3)), np.ones((2, 2)))


def test_the_interrupt_of_a_looping_file_is_no_refusal(tmp_path):
    """Ctrl-C in a file that loops stops the run, as it does anywhere else."""
    path = tmp_path / "own.py"
    for text in ("raise KeyboardInterrupt\n", "def method(robot, q):\n    raise KeyboardInterrupt\n"):
        path.write_text(text)
        with pytest.raises(KeyboardInterrupt):
            read_method(path).cast(PLANAR_3R, GENERIC[None], np.ones((1, 2)))


@pytest.mark.parametrize(
    "name, words", [("folder.py", "a folder, not a Python file"), ("bytes.py", "cannot be run: SyntaxError")]
)
def test_what_is_no_python_file(tmp_path, name, words):
    """A folder, and bytes that are no text."""
    path = tmp_path / name
    if name.startswith("folder"):
        path.mkdir()
    else:
        path.write_bytes(bytes(range(256)))
    with pytest.raises(InputFileError, match=words):
        read_method(path)
