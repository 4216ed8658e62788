"""A method of the user's own, read from a Python file of about ten lines.

The file defines one of

    def method(robot, q): ...          # W, or (W, a): W (n, n) or (B, n, n), a (n,) or (B, n), at q (B, n)
    def implicit(robot, q, N): ...     # (N'W, N'a): (B, k, n), (B, k), for the orthonormal N (B, n, k) of null J

and, where it wishes,

    alpha = 0.5                        # a = alpha grad f is added to what `method` gives; 1 if left out
    def f(robot, q): ...               # a CasADi expression of the symbols q; or numbers (B,) at q (B, n), and then also
    def gradient(robot, q): ...        # its gradient (B, n), which is checked against f
    def original(robot, q, xdot): ...  # the same joint rates (B, n) on another path, compared with the framework's
"""

from __future__ import annotations

import runpy
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from problems.measures.measure import symbolic
from problems.methods.draw import generic
from problems.robots.robot import Robot
from problems.robots.twin import twin
from sandbox import check
from sandbox.errors import InputFileError, SandboxError, ShapeError
from sandbox.method import Draw, Method
from sandbox.parameters import number, vectors, within
from sandbox.problem import VelocityProblem
from sandbox.tolerances import GRADIENT_CHECK, GRADIENT_STEP
from sandbox.weight import Weight

Array = np.ndarray
Gradient = Callable[[Robot, Array], Array]

NAMES = ("method", "implicit", "alpha", "f", "gradient", "original")
CHECKED_AT = 5
"""Seeded configurations at which a gradient is checked."""


def read_method(path: Path) -> Method:
    """The method that the Python file `path` defines.

    Raises InputFileError where the file cannot be read or run, or defines no method; and, when the method is cast,
    where one of its functions fails or gives the wrong shape, and where its gradient is not that of f.
    """
    path = Path(path)
    if not path.is_file():
        raise InputFileError(f"{check.named(path)}: {'a folder, not a Python file' if path.is_dir() else 'no such file'}")
    try:
        found = runpy.run_path(str(path), run_name="own_method")
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit among them
        raise InputFileError(f"{check.named(path)} cannot be run: {_where(error, path)}") from error
    given = {name: found[name] for name in NAMES if name in found}
    if ("method" in given) == ("implicit" in given):
        raise InputFileError(f"{check.named(path)} must define one of method(robot, q) and implicit(robot, q, N)")
    for name in ("f", "gradient", "alpha"):
        if "implicit" in given and name in given:
            raise InputFileError(f"{check.named(path)}: implicit(robot, q, N) gives N'a itself; leave {name} out")
        if name in given and "f" not in given:
            raise InputFileError(f"{check.named(path)}: {name} is given, but no f(robot, q) that it belongs to")
    if "alpha" in given:
        try:
            given["alpha"] = number(given["alpha"], "alpha")
        except SandboxError as error:
            raise InputFileError(f"{check.named(path)}: {check.line(error)}") from error
    for name in ("method", "implicit", "f", "gradient", "original"):
        if name in given and not callable(given[name]):
            raise InputFileError(f"{check.named(path)}: {name} must be a function, not {type(given[name]).__name__}")
    own = _Own(path, given)
    return Method(
        id="own", name=path.stem, title=f"read from {path.name}", formula="", weight="own", vector="own", condition="unknown",
        number="", certainty="not identified", works=(), cast=own.cast, original=own.original if "original" in given else None,
        draw=lambda robot, rng, count: Draw(*generic(robot, rng, count)[:2]),
    )  # fmt: skip


class _Own:
    """The functions of one file, called with its name on every error."""

    def __init__(self, path: Path, given: dict[str, Any]) -> None:
        self.path, self.given = path, given
        self._gradients: dict[Robot, Gradient] = {}

    def cast(self, robot: Robot, q: Array, xdot: Array) -> VelocityProblem:
        """W and a at q (B, n) as the file says."""
        q = vectors(q, "q", robot.n)
        if q.ndim != 2:
            raise ShapeError(f"q has shape {q.shape}; a method of your own is asked of stacks (B, {robot.n})", shape=q.shape)
        J = robot.jacobian(q)
        if "implicit" in self.given:
            W, a = self._implicit(robot, q, J)
        else:
            W, a = self._explicit(robot, q)
        try:
            weight = W if isinstance(W, Weight) else Weight(W)
            within(q.shape[:1], weight.lead, "W")
        except Exception as error:
            raise InputFileError(f"{check.named(self.path)}: {check.line(error)}") from error
        if weight.n != robot.n:
            raise InputFileError(
                f"{check.named(self.path)}: W has shape {weight.base.shape}; it must be ({robot.n}, {robot.n}), or one "
                "for each q"
            )
        return VelocityProblem(J=J, xdot=xdot, W=weight, a=self._shaped("a", a, q.shape))

    def original(self, robot: Robot, q: Array, xdot: Array) -> Array:
        """The rates of the file's own original."""
        q, xdot = check.real(q, "q"), check.real(xdot, "xdot")
        return self._shaped("original", self._call("original", robot, q, xdot), (len(q), robot.n))

    def _explicit(self, robot: Robot, q: Array) -> tuple[Any, Array]:
        answer = self._call("method", robot, q)
        W, a = answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, None)
        if isinstance(answer, tuple) and len(answer) != 2:
            raise InputFileError(f"{check.named(self.path)}: method gives {len(answer)} things; give W, or (W, a)")
        a = np.zeros(q.shape) if a is None else self._shaped("method's a", a, q.shape, one_for_all=True)
        if "f" in self.given:
            a = a + self.given.get("alpha", 1.0) * self._gradient(robot)(robot, q)
        return W, a

    def _implicit(self, robot: Robot, q: Array, J: Array) -> tuple[Array, Array]:
        """W and a from N'W and N'a: of all weights with this N'W the one that is zero on range J'.

        With N orthonormal, W = N(N'W) + (N'W)'N' - N(N'WN)N' has the given N'W; its block on range J' is irrelevant.
        """
        N = np.swapaxes(np.linalg.svd(J)[2], -1, -2)[..., robot.m :]
        answer = self._call("implicit", robot, q, N)
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise InputFileError(f"{check.named(self.path)}: implicit must give (N'W, N'a)")
        k = N.shape[-1]
        NtW = self._shaped("implicit's N'W", answer[0], (len(q), k, robot.n))
        Nta = self._shaped("implicit's N'a", answer[1], (len(q), k))
        S = NtW @ N
        off = np.abs(S - np.swapaxes(S, -1, -2)).max(axis=(-1, -2), initial=0.0)
        wrong = ~(off <= GRADIENT_CHECK * np.abs(S).max(axis=(-1, -2), initial=0.0))
        if wrong.any():
            i = int(np.flatnonzero(wrong)[0])
            raise InputFileError(
                f"{check.named(self.path)}: N'WN is not symmetric (by {off[i]:.3g}) at configuration {i}: N'W is of no "
                "symmetric W"
            )
        NNtW = N @ NtW
        W = NNtW + np.swapaxes(NNtW, -1, -2) - N @ S @ np.swapaxes(N, -1, -2)
        return (W + np.swapaxes(W, -1, -2)) / 2, (N @ Nta[..., None])[..., 0]

    def _gradient(self, robot: Robot) -> Gradient:
        """Gradient of f on `robot`: by CasADi from an expression, or the file's own, checked once."""
        if robot not in self._gradients:
            symbols = twin(robot)
            try:
                expression = self.given["f"](robot, symbols.q)
            except KeyboardInterrupt:
                raise
            except BaseException:  # a plain function does not know what to do with symbols
                expression = None
            if isinstance(expression, ca.SX):
                self._gradients[robot] = self._symbolic(robot, expression)
            else:
                self._check(robot)
                self._gradients[robot] = lambda robot, q: self._shaped("gradient", self._call("gradient", robot, q), q.shape)
        return self._gradients[robot]

    def _symbolic(self, robot: Robot, expression: Any) -> Gradient:
        if expression.shape != (1, 1):
            raise InputFileError(f"{check.named(self.path)}: f has shape {expression.shape}; it must be one number")
        strange = [str(symbol) for symbol in ca.symvar(expression) if not ca.depends_on(ca.vertcat(twin(robot).q), symbol)]
        if strange:
            raise InputFileError(f"{check.named(self.path)}: f depends on {strange[0]}, which is none of the symbols q")
        f = symbolic(self.path.stem, "", f"f of {self.path.name}", "", lambda _: expression)

        def found(robot: Robot, q: Array) -> Array:
            self._shaped("f", f.value(robot, q), (len(q),))  # where f is undefined its derivative may still be a number
            return f.gradient(robot, q)

        if "gradient" in self.given:
            q = generic(robot, np.random.default_rng(0), CHECKED_AT).q
            stated = self._shaped("gradient", self._call("gradient", robot, q), q.shape)
            self._compare(q, stated, found(robot, q), "CasADi gives")
        return found

    def _compare(self, q: Array, stated: Array, measured: Array, words: str) -> None:
        """Refuse the file's gradient (B, n) where it is not that of f."""
        allowed = GRADIENT_CHECK * max(1.0, float(np.abs(stated).max()))
        wrong = ~(np.abs(measured - stated) <= allowed)
        if wrong.any():
            i, joint = (int(index) for index in np.argwhere(wrong)[0])
            raise InputFileError(
                f"{check.named(self.path)}: gradient is not that of f: at q = {q[i].tolist()} its entry {joint} is "
                f"{stated[i, joint]:.9g}, {words} {measured[i, joint]:.9g}"
            )

    def _check(self, robot: Robot) -> None:
        """Refuse a plain f whose `gradient` is not that of f: fourth-order central differences at a few configurations."""
        if "gradient" not in self.given:
            raise InputFileError(
                f"{check.named(self.path)}: f is no CasADi expression; define gradient(robot, q) too, (B, n) at q (B, n)"
            )
        q = generic(robot, np.random.default_rng(0), CHECKED_AT).q
        stated, measured = self._shaped("gradient", self._call("gradient", robot, q), q.shape), np.empty(q.shape)
        for joint in range(robot.n):
            step = GRADIENT_STEP * np.eye(robot.n)[joint]
            near, far = (
                self._shaped("f", self._call("f", robot, q + h * step), (len(q),))
                - self._shaped("f", self._call("f", robot, q - h * step), (len(q),))
                for h in (1, 2)
            )
            measured[:, joint] = (8 * near - far) / (12 * GRADIENT_STEP)
        self._compare(q, stated, measured, "differences of f give")

    def _call(self, name: str, *arguments: Any) -> Any:
        """What the file's function makes of copies of the arrays: it may change its own."""
        try:
            return self.given[name](*(a.copy() if isinstance(a, np.ndarray) else a for a in arguments))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit among them: a file must not end the run
            raise InputFileError(f"{check.named(self.path)}: {name} failed: {_where(error, self.path)}") from error

    def _shaped(self, what: str, values: Any, shape: tuple[int, ...], *, one_for_all: bool = False) -> Array:
        """Numbers of that shape; with `one_for_all` those of one configuration will do for all."""
        try:
            found = check.real(values, what)
        except Exception as error:
            raise InputFileError(f"{check.named(self.path)}: {check.line(error)}") from error
        if found.shape != shape and not (one_for_all and found.shape == shape[1:]):
            raise InputFileError(f"{check.named(self.path)}: {what} has shape {found.shape}; it must be {shape}")
        return np.broadcast_to(found, shape)


def _where(error: BaseException, path: Path) -> str:
    """The error and the last line of the user's file that it passed through."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    if isinstance(error, SyntaxError) and error.lineno:
        lines.append(error.lineno)
    place = f", line {lines[-1]}" if lines else ""
    try:
        words = check.line(error)
    except Exception:  # an error of the user's own whose words fail
        words = ""
    return f"{type(error).__name__}: {words}{place}"
