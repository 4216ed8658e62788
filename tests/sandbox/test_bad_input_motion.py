"""Bad input to motions, brackets, singularities and implicit forms: refused in one line, or the motion ends and says why."""

from __future__ import annotations

import re
import signal
import sys

import numpy as np
import pytest

from problems import paths, robots
from problems.methods import METHODS
from problems.robots.planar import PLANAR_3R
from problems.weightings.extended import OffManifoldError
from sandbox import cli
from sandbox.algorithmic_singularity import cure, locate, secondary_rate
from sandbox.closed_form.eq6_implicit import NullBasisError, eq6_implicit
from sandbox.errors import (
    NonFiniteError,
    RangeError,
    RankDeficientError,
    RefusalError,
    SandboxError,
    ShapeError,
    UnknownNameError,
)
from sandbox.method_study import followed
from sandbox.motion import Motion, follow
from sandbox.repeatability import drift, lie_brackets, limit_cycle
from sandbox.solution import Status

START = (0.2, 1.3, -0.9)
SQUARE = paths.load("square", 0.1)
PANDA = robots.load("panda")
LONGEST = 420
"""Letters of a refusal."""

J = PLANAR_3R.jacobian(START)
BASIS = np.linalg.svd(J)[2][2:].T


def pinv(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
    """Planar 3R's pseudoinverse, as a plain law."""
    return np.linalg.pinv(PLANAR_3R.jacobian(q)) @ xdot


def moved(law=METHODS["gradient_projection"], robot=PLANAR_3R, path=SQUARE, q0=START, **given) -> Motion:
    """A motion of a few steps."""
    return follow(law, robot, path, q0, **{"integrator": "steps", "steps": 4, **given})


def brackets(q=START, law=METHODS["inertia_weighted"], robot=PLANAR_3R, **given):
    """Lie brackets of a law."""
    return lie_brackets(law, robot, q, **given)


def cured(**given):
    """What damping costs on a short motion."""
    pair = (METHODS["augmented_jacobian"], METHODS["damped_secondary"])
    return cure(*pair, PLANAR_3R, SQUARE, START, following={"integrator": "steps", "steps": 4}, **given)


def implicit(**given):
    """Eq. (6) by N'W and N'a of W = I."""
    return eq6_implicit(**{"J": J, "xdot": [1.0, 1.0], "N": BASIS, "NtW": BASIS.T, "Nta": [0.0], **given})


NUMBERS = {"None": None, "word": "0.1", "list": [1.0, 2.0], "NaN": np.nan, "infinity": np.inf, "bool": True, "complex": 1j}
"""What is no finite number."""

ASKED = {
    "feedback": lambda value: moved(feedback=value),
    "rtol": lambda value: moved(integrator="solve_ivp", rtol=value),
    "cycles": lambda value: moved(cycles=value),
    "steps": lambda value: moved(steps=value),
    "samples": lambda value: moved(samples=value),
    "integrator": lambda value: moved(integrator=value),
    "q0": lambda value: moved(q0=value),
    "rates": lambda value: moved(lambda q, xdot: value),
    "step": lambda value: brackets(step=value),
    "q": lambda value: brackets(value),
    "below": lambda value: locate(moved(), METHODS["gradient_projection"], PLANAR_3R, below=value),
    "damping": lambda value: cured(dampings=[value]),
    "duration": lambda value: paths.load("circle", 0.1, duration=value),
    "radius": lambda value: paths.load("circle", "x" if value is None else value),  # None: its own
    "plane": lambda value: paths.load("circle", 0.1, plane=value),
    "direction": lambda value: paths.load("straight", 0.1, direction=value),
    "xdot": lambda value: implicit(xdot=value),
    "N": lambda value: implicit(N=value),
    "NtW": lambda value: implicit(NtW=value),
    "Nta": lambda value: implicit(Nta=value),
    "size": lambda value: implicit(size="x" if value is None else [value]),  # None: that of N'W
}


@pytest.mark.parametrize("value", NUMBERS.values(), ids=NUMBERS)
@pytest.mark.parametrize("name", ASKED)
def test_what_is_no_number_is_refused(name, value):
    """Words, lists, NaN, infinity, None, True and complex numbers in the place of a number: one line, no traceback."""
    if (name, value) == ("size", [1.0, 2.0]):
        value = [[1.0, 2.0], [1.0]]
    if (name, value) == ("xdot", [1.0, 2.0]):
        value = [1.0, 2.0, 3.0]
    with pytest.raises(SandboxError) as caught:
        ASKED[name](value)
    assert "\n" not in str(caught.value) and 0 < len(str(caught.value)) <= LONGEST


def failing(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
    """A law with a mistake."""
    raise KeyError("gain")


REFUSALS = {
    "negative feedback": (lambda: moved(feedback=-1.0), RangeError, "feedback is -1"),
    "steps beyond memory": (lambda: moved(steps=10**9), RangeError, "steps over all cycles are 1000000000; at most"),
    "an open path twice": (lambda: moved(path=paths.load("straight"), cycles=2), RangeError, "straight is open"),
    "out of the arm's plane": (lambda: moved(path=paths.load("circle", 0.1, plane="yz")), RangeError, "moves along z"),
    "another robot's start": (lambda: moved(robot=PANDA), ShapeError, r"q0 has shape \(3,\)"),
    "two starts": (lambda: moved(q0=[START, START]), RangeError, "starts at one configuration"),
    "no law": (lambda: moved(3), UnknownNameError, r"a function \(q, xdot\) -> qdot"),
    "a parameter of a plain law": (lambda: moved(pinv, alpha=1.0), UnknownNameError, "plain law is called 'alpha'"),
    "no such parameter": (lambda: moved(beta=1.0), UnknownNameError, "there are: alpha, gradient"),
    "a law that fails": (lambda: moved(failing), RefusalError, "the law failed: KeyError: 'gain'"),
    "rates of a stack": (lambda: moved(lambda q, xdot: np.zeros((1, 3))), RangeError, r"rates of shape \(1, 3\)"),
    "rates of another arm": (lambda: moved(lambda q, xdot: np.zeros(7)), ShapeError, r"qdot of the law has shape \(7,\)"),
    "rates in words": (lambda: moved(lambda q, xdot: ["0", "0", "0"]), ShapeError, "qdot of the law must hold real numbers"),
    "a parameter of many": (lambda: moved(gradient=np.ones((5, 3))), ShapeError, "grad f has the leading axes"),
    "a weight of many": (
        lambda: moved(METHODS["weighted_pseudoinverse"], weight=np.array([np.eye(3)] * 5)),
        ShapeError,
        "weight",
    ),
    "measures that are none": (lambda: moved(measures=["w"]), ShapeError, "measures must be a mapping"),
    "off the manifold": (lambda: moved(METHODS["extended_jacobian"]), OffManifoldError, "feed h back"),
    "at rest off the manifold": (
        lambda: followed(METHODS["extended_jacobian"], PLANAR_3R, SQUARE, cycles=1, q=np.array(START)),
        OffManifoldError,
        "feed h back",
    ),
    "at rest off balance": (
        lambda: followed(METHODS["mussa_ivaldi_hogan"], PLANAR_3R, SQUARE, cycles=1, q=np.array(START)),
        RefusalError,
        "for any force F on the hand",
    ),
    "beyond the barrier": (
        lambda: moved(METHODS["joint_limit_gradient"], q0=(0.2, 2.8, -0.9), measure="joint_limits_barrier"),
        RangeError,
        "joint 2 .*not between its limits",
    ),
    "no cycle": (
        lambda: drift(moved(lambda q, xdot: np.full(3, np.nan) if q[0] != START[0] else pinv(q, xdot))),
        RangeError,
        "no cycle",
    ),
    "a cycle is no limit": (lambda: limit_cycle(moved()), RangeError, "1 cycles cannot tell"),
    "brackets of a stack": (lambda: brackets([START, START]), ShapeError, "brackets are taken at one configuration"),
    "brackets of no law": (lambda: brackets(law=3), UnknownNameError, "a function"),
    "brackets where J lost rank": (
        lambda: brackets((0, 0, 0), METHODS["damped_least_squares"]),
        RankDeficientError,
        "no brackets to take",
    ),
    "brackets of more rows than joints": (
        lambda: brackets(law=METHODS["damped_least_squares"], robot=PLANAR_3R.task("pose")),
        RankDeficientError,
        "no brackets to take",
    ),
    "brackets of a short law": (lambda: brackets(law=lambda q, xdot: np.zeros(2)), ShapeError, "the law's rates"),
    "brackets of a self-motion": (lambda: brackets(law=METHODS["gradient_projection"]), RefusalError, "while the hand rests"),
    "brackets, no such parameter": (lambda: brackets(beta=1), UnknownNameError, "there are: none"),
    "singularities of another robot": (
        lambda: locate(moved(), METHODS["gradient_projection"], PANDA),
        ShapeError,
        "q has shape",
    ),
    "singularities, no such parameter": (
        lambda: locate(moved(), METHODS["gradient_projection"], PLANAR_3R, beta=1),
        UnknownNameError,
        "there are: alpha",
    ),
    "no such knob": (lambda: cured(knob="size"), UnknownNameError, "no parameter of damped_secondary is called 'size'"),
    "no damping": (lambda: cured(dampings=[0.0]), RangeError, "a damping is 0; it must be positive"),
    "no secondary functions": (
        lambda: secondary_rate(moved(), METHODS["gradient_projection"], PLANAR_3R),
        RefusalError,
        "its weight is no E'Gamma E",
    ),
    "N is no null basis": (lambda: implicit(N=np.ones((3, 1))), NullBasisError, "row 0 of J times column 0 of N"),
    "N of zeros": (lambda: implicit(N=np.zeros((3, 1))), NullBasisError, "do not span null J"),
    "N upright": (lambda: implicit(N=BASIS.T), ShapeError, r"N has shape \(1, 3\)"),
    "N'a of another redundancy": (lambda: implicit(Nta=[0.0, 0.0]), ShapeError, "Nta has shape"),
    "stacks that differ": (lambda: implicit(J=[J, J], N=[BASIS] * 3), ShapeError, "the stacks do not agree"),
    "an empty stack": (lambda: implicit(J=np.zeros((0, 2, 3))), ShapeError, "an empty stack"),
    "negative size": (lambda: implicit(size=-1.0), RangeError, "must not be negative"),
    "NaN in xdot": (lambda: implicit(xdot=[1.0, np.nan]), NonFiniteError, r"xdot\[1\] is nan"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_names_what_where_and_the_way_out(name):
    """Each has its own kind of error and its words, in one line."""
    refuse, kind, words = REFUSALS[name]
    with pytest.raises(kind, match=words) as caught:
        refuse()
    assert "\n" not in str(caught.value) and len(str(caught.value)) <= LONGEST


def until(reason: object):
    """A law that goes wrong once joint 1 has left its start."""

    def law(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        if q[0] == START[0]:
            return pinv(q, xdot)
        if isinstance(reason, BaseException):
            raise reason
        return np.full(3, reason)

    return law


@pytest.mark.parametrize("integrator", ["steps", "solve_ivp"])
@pytest.mark.parametrize(
    "reason, words",
    [
        (np.nan, "not finite|must be finite"),
        (IndexError("no"), "the law failed: IndexError: no"),
        (ZeroDivisionError("0"), "0"),
    ],
    ids=["NaN", "IndexError", "ZeroDivisionError"],
)
def test_a_law_that_goes_wrong_on_the_way_ends_the_motion(integrator, reason, words):
    """Whatever goes wrong in a law after the start: the motion ends there, with the reason, and every posture is finite."""
    motion = moved(until(reason), integrator=integrator)
    assert re.search(words, motion.stopped)
    assert np.isfinite(motion.q).all() and not len(motion.cycle_ends)


def test_the_barrier_met_on_the_way_ends_the_motion():
    """A joint driven into its limit ends the motion with joint and value, not with an answer beyond the barrier."""
    motion = moved(
        METHODS["joint_limit_gradient"], path=paths.load("straight", 1.5), q0=(0.0, 2.6, 0.3), steps=200,
        measure="joint_limits_barrier", alpha=-5.0,
    )  # fmt: skip
    assert "not between its limits -2.75 and 2.75" in motion.stopped and len(motion.t) < 200


def test_feedback_of_an_angle_there_is_not_ends_the_motion():
    """With some rows of rotation alone the hand has no angle to feed back once it turns about another axis: it says so."""
    motion = moved(
        METHODS["weighted_pseudoinverse"], PANDA.task((0, 1, 2, 5)), paths.load("circle", 0.1),
        (0.0, 0.3, 0.0, -1.5, 0.0, 1.5, 0.0), steps=20, feedback=5.0,
    )  # fmt: skip
    assert "its angle about the others is none to feed back" in motion.stopped


@pytest.mark.parametrize("integrator", ["steps", "solve_ivp"])
def test_a_law_may_change_what_it_is_given(integrator):
    """What a law does to its arguments changes neither the motion nor what is kept of it."""

    def careless(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        rates = pinv(q, xdot)
        q += 1
        xdot *= 0
        return rates

    whole, clean = moved(careless, integrator=integrator), moved(pinv, integrator=integrator)
    for name in ("q", "qdot", "xdot"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(clean, name))


@pytest.mark.parametrize("change", [{"NtW": -BASIS.T}, {"NtW": 0 * BASIS.T}, {"J": 0 * J}], ids=["negative", "zero", "J = 0"])
def test_an_implicit_form_that_is_refused_has_no_answer(change):
    """Where (7) or the rank of J fails the status says so, and the rates are NaN."""
    answer = implicit(**change)
    assert answer.status in (Status.CONDITION_SEVEN, Status.RANK_DEFICIENT) and answer.said
    assert np.isnan(answer.x).all()


F1 = "0,1.5707963267948966,-1.5707963267948966"
WORDS = {
    "twice": (["M1", "--parameter", "M1.alpha=1", "--parameter", "M1.alpha=2"], "--parameter M1.alpha is given twice"),
    "nested without end": (["M1", "--parameter", "M1.alpha=" + 9999 * "["], "is no JSON"),
    "an option of follow": (["M1", "--parameter", "M1.feedback=5"], "no parameter of gradient_projection is called 'feedback'"),
    "the robot itself": (["M1", "--parameter", "M1.robot=1"], "called 'robot'"),
    "beyond floats": (["M1", "--parameter", "M1.alpha=1e400"], "alpha is inf"),
    "a new line": (["M1", "--parameter", "M1.alpha=1\n2"], r"'1\n2' is no JSON"),
    "a start in brackets": (["M1", "--start", "(0,1,2)"], "give 3 numbers, q_1,...,q_n"),
    "a start beyond floats": (["M1", "--start", "0,1e400,0"], "[1] is inf"),
    "off the manifold": (["M12", "--start", "0.2,1.3,-0.9"], "is no extremum of g on its self-motion"),
    "off balance": (["M18", "--start", "0.2,1.3,-0.9"], "for any force F on the hand"),
    "contact": (["M7", "--start", F1, "--parameter", "M7.obstacle=[1,0,0]"], "touches the obstacle"),
    "on a limit": (["M4", "--start", "0,2.75,0"], "joint 2"),
    "a path of another arm": (["M16", "--robot", "planar_4r", "--path", "through_kinematic_singularity"], "give --start"),
    "steps beyond memory": (["M16", "--steps", "1000000000"], "at most 10000000"),
    "no self-motion": (["M11", "--robot", "planar_2r"], "there is no self-motion for a secondary task"),
    "one joint": (["M1", "--robot", "planar_1r"], "planar_1r"),
}


@pytest.fixture
def polite():
    """Gives the signal back that the command line takes for itself."""
    kept = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, kept)


@pytest.mark.usefixtures("polite")
@pytest.mark.parametrize("name", WORDS)
def test_the_command_refuses(name, tmp_path, monkeypatch, capsys):
    """`sandbox follow` with odd words: status 2, one line, no folder."""
    arguments, words = WORDS[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["sandbox", "follow", *arguments, "--out", "new"])
    with pytest.raises(SystemExit) as done:
        cli.main()
    said = capsys.readouterr().err
    assert done.value.code == 2 and words in said and said.startswith("error: ") and said.count("\n") == 1
    assert not (tmp_path / "new").exists()


@pytest.mark.usefixtures("polite")
def test_a_path_with_a_start_begins_there(tmp_path, monkeypatch, capsys):
    """Without --start a path that does what its name says from one posture alone is followed from there."""
    monkeypatch.chdir(tmp_path)
    words = ["follow", "M16", "--path", "through_kinematic_singularity", "--steps", "50", "--out", "new", "--json"]
    monkeypatch.setattr(sys, "argv", ["sandbox", *words])
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert done.value.code == 0 and "kinematic" in capsys.readouterr().out
