"""Raw answers of one backend to one posed group, carried back to joint rates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sandbox.backends.backend import Engine
from sandbox.formulation import Formulation, Posed
from sandbox.judgement import Allowance
from sandbox.problem import VelocityProblem
from sandbox.solution import CODE, Status
from sandbox.worker import Answers

Array = np.ndarray


@dataclass(eq=False)
class Batch:
    """One backend, level, formulation and mode on a group of B problems; only `members` were asked.

    mode : cold, or warm: each member started from the answer to the one before it on its trajectory; the first of a
        trajectory, and one after a failure, from nothing
    qdot (B, n), y (B, m), status (B,) codes, times (B,) [s]; primal_scale and dual_scale (B,) are what relative
    tolerances multiply.
    """

    backend: str
    level: str
    formulation: str
    members: Array
    qdot: Array
    y: Array
    status: Array
    said: list[str]
    iterations: list[int | None]
    build_time: Array
    solve_time: Array
    runtime: Array
    primal_scale: Array
    dual_scale: Array
    engine: Engine | None = None
    mode: Literal["cold", "warm"] = "cold"

    @classmethod
    def empty(
        cls, backend: str, level: str, formulation: str, problem: VelocityProblem, members: Array,
        mode: Literal["cold", "warm"] = "cold",
    ) -> Batch:  # fmt: skip
        """Nothing answered yet."""
        B = len(problem)
        status = np.full(B, CODE[Status.NOT_RUN], np.int8)
        qdot, y = np.full((B, problem.n), np.nan), np.full((B, problem.m), np.nan)
        nothing = cls(backend, level, formulation, members, qdot, y, status, [""] * B, [None] * B, *np.full((5, B), np.nan))
        nothing.mode = mode
        return nothing

    def refuse(self, refused: dict[int, tuple[Status, str]]) -> None:
        """Members that the formulation did not pose."""
        for i, (status, words) in refused.items():
            self.status[i], self.said[i] = CODE[status], words

    def scale(self, posed: Posed, answers: Answers) -> None:
        """Sizes max(|Ax|, |b|) and max(|Hx|, |A'y|, |g|) of the QP as posed, at the answer where there is one."""
        qp = posed.qp
        # the last iterate of a refusal may be the far end of a ray: it says nothing about the problem's size
        solved = (answers.status == CODE[Status.SOLVED])[:, None]
        x, y = np.where(solved, answers.x, np.nan), np.where(solved, answers.y, np.nan)
        with np.errstate(all="ignore"):
            Ax, Hx = qp.A @ x[..., None], qp.H @ x[..., None]
            Ay = np.swapaxes(qp.A, -1, -2) @ y[..., None]
            sizes = [np.abs(v.reshape(len(qp), -1)).max(axis=-1, initial=0.0) for v in (Ax, qp.b, Hx, Ay, qp.g)]
        self.primal_scale[posed.index] = np.fmax(sizes[0], sizes[1])
        self.dual_scale[posed.index] = np.fmax(np.fmax(sizes[2], sizes[3]), sizes[4])

    def take(self, posed: Posed, answers: Answers, problem: VelocityProblem, recipe: Formulation) -> None:
        """Carry the answers to `posed` back to the problem."""
        index = posed.index
        with np.errstate(all="ignore"):  # answers may be NaN or overflow
            self.qdot[index], self.y[index] = recipe.recover(problem[index], posed, answers.x, answers.y)
        self.note(index, answers)

    def note(self, index: Array, answers: Answers) -> None:
        """Statuses, words and times of an answered stack whose members are `index` of the group."""
        self.status[index] = answers.status
        for i, said, iterations in zip(index, answers.said, answers.iterations, strict=True):
            self.said[i], self.iterations[i] = said, iterations
        for name in ("build_time", "solve_time", "runtime"):
            getattr(self, name)[index] = getattr(answers, name)

    def allowance(self) -> Allowance:
        """What the engine's effective tolerances allow each member to miss."""
        eps = (0.0, 0.0, 0.0, 0.0) if self.engine is None else self.engine.eps
        return Allowance.of_solver(eps, self.primal_scale, self.dual_scale, self.level)
