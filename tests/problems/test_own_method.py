"""A method of one's own: ten lines that run, and every mistake in them named with its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from problems import robots
from problems.own_method import read_method
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from sandbox.agreement import compare
from sandbox.errors import InputFileError, ShapeError
from sandbox.law import rates
from sandbox.tolerances import UNIT

INERTIA = "def method(robot, q):\n    return robot.inertia(q)\n"
EXPRESSION = INERTIA + "import casadi as ca\nalpha = 0.3\ndef f(robot, q):\n    return ca.sumsqr(q - 0.2) / 2\n"
PLAIN = INERTIA + (
    "import numpy as np\nalpha = 0.3\ndef f(robot, q):\n    return np.sum((np.asarray(q, dtype=float) - 0.2)**2, axis=-1) / 2\n"
    "def gradient(robot, q):\n    return q - 0.2\n"
)
TWO = "def method(robot, q):\n    return robot.inertia(q), 0.3 * (q - 0.2)\n"
IMPLICIT = (
    "import numpy as np\ndef implicit(robot, q, N):\n    Nt = np.swapaxes(N, -1, -2)\n"
    "    return Nt @ robot.inertia(q), 0.3 * (Nt @ (q - 0.2)[..., None])[..., 0]\n"
)
SAME = {"expression": EXPRESSION, "plain": PLAIN, "W and a": TWO, "implicit": IMPLICIT}


def written(tmp_path, text, name="own.py"):
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("robot", [PLANAR_3R, PLANAR_4R], ids=lambda robot: robot.name)
@pytest.mark.parametrize("text", SAME.values(), ids=SAME)
def test_every_way_of_writing_it_moves_alike(tmp_path, robot, text):
    """W with a CasADi f, with a plain f and its gradient, with a itself, and N'W with N'a: one motion."""
    own = read_method(written(tmp_path, text))
    drawn = own.draw(robot, np.random.default_rng(0), 30)
    stated = read_method(written(tmp_path, TWO, "two.py"))
    expected = rates(stated, robot, drawn.q, drawn.xdot)
    row = compare(own, robot, own.cast(robot, drawn.q, drawn.xdot), expected, {})
    assert row["agreed"] == row["held"] == 30


def test_an_original_of_ones_own_is_compared(tmp_path):
    """A file may bring its own witness, a right one agrees and a wrong one does not."""
    right = "import numpy as np\n" + (
        "def method(robot, q):\n    return np.eye(robot.n)\n"
        "def original(robot, q, xdot):\n    return np.einsum('bnm,bm->bn', np.linalg.pinv(robot.jacobian(q)), xdot)\n"
    )
    for text, agreed in ((right, 20), (right.replace("xdot)\n", "-xdot)\n"), 0)):
        own = read_method(written(tmp_path, text))
        drawn = own.draw(PLANAR_3R, np.random.default_rng(0), 20)
        problem = own.cast(PLANAR_3R, drawn.q, drawn.xdot)
        assert compare(own, PLANAR_3R, problem, own.witness(PLANAR_3R, drawn.q, drawn.xdot), {})["agreed"] == agreed


BAD = {
    "def method(robot, q)\n    pass\n": r"own.py cannot be run: SyntaxError.*line 1",
    "import no_such_module\n": r"own.py cannot be run: ModuleNotFoundError.*no_such_module.*line 1",
    "x = 1\n": r"must define one of method\(robot, q\) and implicit",
    INERTIA + "def implicit(robot, q, N):\n    pass\n": r"must define one of",
    "method = 3\n": r"method must be a function, not int",
    IMPLICIT + "def f(robot, q):\n    return 0\n": r"leave f out",
}


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_a_file_that_is_no_method_is_refused(tmp_path, text):
    """Syntax, imports, missing and contradictory functions: the file, the line and the way out."""
    with pytest.raises(InputFileError, match=BAD[text]):
        read_method(written(tmp_path, text))


CAST = {
    "def method(robot, q):\n    return 1 / 0\n": r"method failed: ZeroDivisionError.*line 2",
    "def method(robot, q):\n    return robot.inertia(q), 1, 2\n": r"method gives 3 things",
    "import numpy as np\ndef method(robot, q):\n    return np.eye(robot.n + 1)\n": r"W has shape \(4, 4\)",
    "import numpy as np\ndef method(robot, q):\n    return np.triu(np.ones((robot.n, robot.n)))\n": r"must be symmetric",
    "import numpy as np\ndef method(robot, q):\n    return np.full((robot.n, robot.n), np.nan)\n": r"is nan",
    "import numpy as np\ndef method(robot, q):\n    return np.eye(robot.n), np.ones(7)\n": r"method's a has shape \(7,\)",
    INERTIA + "def f(robot, q):\n    return q\n": r"f has shape \(3, 1\); it must be one number",
    INERTIA + "import numpy as np\ndef f(robot, q):\n    return np.sum(np.sin(np.array(q, dtype=float)))\n": r"define gradient",
    PLAIN.replace("return q - 0.2", "return q + 0.2"): r"gradient is not that of f: at q = \[.*entry 0",
    "def implicit(robot, q, N):\n    return N\n": r"implicit must give \(N'W, N'a\)",
    IMPLICIT.replace("Nt @ robot.inertia(q)", "Nt[:, :, :2]"): r"implicit's N'W has shape",
}


@pytest.mark.parametrize("text", CAST, ids=range(len(CAST)))
def test_a_method_that_fails_on_the_robot_is_refused(tmp_path, text):
    """What goes wrong when it is called is told with the file's name, and the line where it is the file's own."""
    own = read_method(written(tmp_path, text))
    drawn = own.draw(PLANAR_3R, np.random.default_rng(0), 5)
    with pytest.raises(InputFileError, match=CAST[text]) as caught:
        own.cast(PLANAR_3R, drawn.q, drawn.xdot)
    assert "own.py" in str(caught.value) and "\n" not in str(caught.value)


def test_an_asymmetric_reduced_weight_is_refused(tmp_path):
    """N'WN that is not symmetric belongs to no symmetric W."""
    text = IMPLICIT.replace("Nt @ robot.inertia(q)", "np.cumsum(Nt @ robot.inertia(q) , axis=-1) * np.arange(1, robot.n + 1)")
    own = read_method(written(tmp_path, text))
    drawn = own.draw(PLANAR_4R, np.random.default_rng(0), 5)
    with pytest.raises(InputFileError, match="N'WN is not symmetric"):
        own.cast(PLANAR_4R, drawn.q, drawn.xdot)


def test_the_example_of_the_readme_runs():
    """examples/my_method.py moves the Panda: W = M, a = alpha grad f of its CasADi expression."""
    own = read_method(Path(__file__).parents[2] / "examples" / "my_method.py")
    panda = robots.load("panda")
    drawn = own.draw(panda, np.random.default_rng(0), 10)
    problem = own.cast(panda, drawn.q, drawn.xdot)
    np.testing.assert_array_equal(problem.W.base, panda.inertia(drawn.q))
    np.testing.assert_allclose(problem.a, 0.5 * (drawn.q - 0.2), atol=4 * UNIT)
    assert np.isfinite(rates(own, panda, drawn.q, drawn.xdot)).all()


def test_a_missing_file_is_named(tmp_path):
    """No file, no method."""
    with pytest.raises(InputFileError, match=r"absent\.py: no such file"):
        read_method(tmp_path / "absent.py")


HALF = {
    INERTIA + "alpha = 0.3\n": "alpha is given, but no f",
    INERTIA + "def gradient(robot, q):\n    return q\n": "gradient is given, but no f",
    IMPLICIT + "alpha = 0.3\n": "leave alpha out",
    EXPRESSION.replace("alpha = 0.3", "alpha = 'much'"): "own.py: alpha",
    EXPRESSION.replace("alpha = 0.3", "alpha = float('nan')"): "own.py: alpha",
}


@pytest.mark.parametrize("text", HALF, ids=range(len(HALF)))
def test_parts_that_belong_together_are_asked_for(tmp_path, text):
    """Only with f are alpha and a gradient of use, and alpha is a finite number: refused when the file is read."""
    with pytest.raises(InputFileError, match=HALF[text]):
        read_method(written(tmp_path, text))


def test_a_foreign_symbol_is_refused(tmp_path):
    """An f that depends on a symbol that is none of q has no value."""
    own = read_method(written(tmp_path, EXPRESSION.replace("ca.sumsqr(q - 0.2)", "ca.sumsqr(q - ca.SX.sym('home'))")))
    with pytest.raises(InputFileError, match="f depends on home, which is none of the symbols q"):
        own.cast(PLANAR_3R, np.ones((2, 3)), np.ones((2, 2)))


def test_one_configuration_is_no_stack(tmp_path):
    """The file's functions are written for stacks (B, n): a single q is refused by its shape."""
    own = read_method(written(tmp_path, TWO))
    with pytest.raises(ShapeError, match=r"q has shape \(3,\).*stacks \(B, 3\)"):
        own.cast(PLANAR_3R, np.ones(3), np.ones(2))


def test_numbers_that_are_none_are_told_with_the_file(tmp_path):
    """What a function gives must be finite numbers: the file, and which of them is not."""
    for bad, words in (("q * float('nan')", "method's a"), ("[['x'] * 3] * len(q)", "method's a")):
        own = read_method(written(tmp_path, TWO.replace("0.3 * (q - 0.2)", bad)))
        with pytest.raises(InputFileError, match=f"own.py: {words}"):
            own.cast(PLANAR_3R, np.ones((2, 3)), np.ones((2, 2)))


@pytest.mark.parametrize("where", ["file", "f", "method"])
def test_an_interrupt_is_not_swallowed(tmp_path, where):
    """Ctrl-C while the user's own lines run ends the run and is no mistake in the file."""
    text = {
        "file": "raise KeyboardInterrupt\n",
        "f": INERTIA + "def f(robot, q):\n    raise KeyboardInterrupt\n",
        "method": "def method(robot, q):\n    raise KeyboardInterrupt\n",
    }[where]
    with pytest.raises(KeyboardInterrupt):
        read_method(written(tmp_path, text)).cast(PLANAR_3R, np.ones((2, 3)), np.ones((2, 2)))
