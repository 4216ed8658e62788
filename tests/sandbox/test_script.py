"""Stand-alone scripts repeat what the sandbox did, number by number."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.backends import BACKENDS
from sandbox.case import Case
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import RefusalError, UnknownNameError
from sandbox.formulation import FORMULATIONS
from sandbox.problem import VelocityProblem
from sandbox.problem_set import problem_ids
from sandbox.reference.truth import Truth, truth
from sandbox.script import TEMPLATES, script
from sandbox.solution import STATUSES, Status
from sandbox.task import TASKS
from sandbox.weight import Weight
from sandbox.worker import Workers

Array = np.ndarray

REPEATS = 1e-12
"""Relative: the posed numbers are the same, but recovery by BLAS may round differently for a stack."""

RAN = [name for name, row in BACKENDS.items() if row.expected == "runs" and row.library != "cvxpy"]
OF_CVXPY = ["cvxpy:CLARABEL", "cvxpy:OSQP", "cvxpy:PROXQP+assume_psd"]  # each start of cvxpy takes a second
THEIR_OWN = ["osqp", "proxsuite:dense", "qpsolvers:scs", "casadi:ipopt", "casadi:osqp", "scipy:slsqp"]

J = np.array([[-1.0, -1.0, 0.0, 0.5], [2.0, 1.0, 1.0, 0.0]])
CONVEX = VelocityProblem(J=J, xdot=[1.0, 0.3], W=np.diag([1.0, 2.0, 3.0, 0.7]), a=[0.1, -0.2, 0.4, 0.0])
FACTORED = VelocityProblem(
    J=J, xdot=[1.0, 0.3], W=Weight(np.diag([-0.5, 1.0, 1.0, 1.0]), [[1.0, 0.0, 1.0, 0.1]], [[3.0]]), a=[0.1, -0.2, 0.4, 0.0]
)
SADDLE = VelocityProblem(J=[[1.0, 0.0, 0.0]], xdot=[1.0], W=np.diag([1.0, 1.0, -1.0]))
REDUNDANT = VelocityProblem(
    J=[[1.0, 0.0, 2.0], [2.0, 0.0, 4.0]],
    xdot=[1.0, 0.0],
    W=np.diag([2.0, 1.0, -0.25]),
    a=[0.0, 1.0, 0.0],
    Wx=np.diag([1.0, 3.0]),
)


def case_of(problem: VelocityProblem) -> Case:
    """A case that no run recorded."""
    truths: dict[str, Truth] = {}
    for task in TASKS:
        found = truth(problem, task)
        assert isinstance(found, Truth)
        truths[task] = found
    return Case(Path("run"), problem_ids(problem)[0], "test", {}, problem, truths, [])


def repeated(text: str, folder: Path) -> dict[str, str]:
    """What a script prints, run alone: first word -> the rest of the line."""
    assert "sandbox" not in {
        name.name.split(".")[0] for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import) for name in node.names
    }
    file = folder / "repeat.py"
    file.write_text(text)
    done = subprocess.run([sys.executable, "-I", str(file)], capture_output=True, text=True, timeout=60, cwd=folder)
    assert done.returncode == 0, done.stderr
    words = (line.split(maxsplit=1) for line in done.stdout.splitlines())  # engines print, too
    return {pair[0]: pair[1] for pair in words if len(pair) == 2}


def vector(text: str) -> Array:
    """A printed list."""
    return np.array(json.loads(text.replace("nan", "NaN")), dtype=float)


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """The solver processes that the campaign uses."""
    with Workers() as running:
        yield running


def of_worker(workers: Workers, problem: VelocityProblem, backend: str, formulation: str, level: str) -> tuple[Status, Array]:
    """Status and joint rates that the sandbox itself gets."""
    stack, recipe = problem.stacked(), FORMULATIONS[formulation]
    posed = recipe.build(stack).parts[0]
    answers = workers.solve(backend, posed.qp, settings=level, time_limit=20.0)
    if answers.absent:
        pytest.skip(answers.absent)
    if recipe.then is not None:
        posed = recipe.then(stack, posed, answers.x)
        answers = workers.solve(backend, posed.qp, settings=level, time_limit=20.0)
    return STATUSES[answers.status[0]], recipe.recover(stack, posed, answers.x, answers.y)[0][0]


def compare(said: dict[str, str], status: Status, qdot: Array) -> None:
    """Same answer, and where the sandbox has none the script has none."""
    assert ("qdot" in said) == (not np.isnan(qdot).all() or status is Status.SOLVED)
    if "qdot" in said:
        np.testing.assert_allclose(vector(said["qdot"]), qdot, rtol=REPEATS, atol=REPEATS * np.abs(qdot).max())


def test_every_library_has_a_template() -> None:
    """Registering a library and forgetting its script fails here."""
    assert set(TEMPLATES) == {row.library for row in BACKENDS.values()}


@pytest.mark.parametrize("backend", RAN + OF_CVXPY)
def test_script_repeats_the_worker(backend: str, workers: Workers, tmp_path: Path) -> None:
    """At high accuracy every backend gives the same joint rates inside and outside the sandbox."""
    status, qdot = of_worker(workers, CONVEX, backend, "direct", "high_accuracy")
    compare(repeated(script(case_of(CONVEX), backend), tmp_path), status, qdot)


@pytest.mark.parametrize("backend", THEIR_OWN)
def test_default_level_is_the_engines_own(backend: str, workers: Workers, tmp_path: Path) -> None:
    """At the level `default` the script passes no tolerance either."""
    status, qdot = of_worker(workers, CONVEX, backend, "direct", "default")
    text = script(case_of(CONVEX), backend, "direct", "default")
    assert "eps_abs" not in text
    compare(repeated(text, tmp_path), status, qdot)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_script_recovers_joint_rates(formulation: str, workers: Workers, tmp_path: Path) -> None:
    """Every formulation is carried back to joint rates, and these are as near to the exact minimiser as it says."""
    problem = REDUNDANT if FORMULATIONS[formulation].task == "least_squares" else FACTORED
    case = case_of(problem)
    status, qdot = of_worker(workers, problem, "numpy:lstsq", formulation, "high_accuracy")
    said = repeated(script(case, "numpy:lstsq", formulation), tmp_path)
    compare(said, status, qdot)
    right = case.truths[FORMULATIONS[formulation].task]
    assert right.x is not None
    assert float(said["distance"].split()[0]) == np.abs(vector(said["qdot"]) - right.x).max() < 1e-13


def test_refusals_are_repeated(workers: Workers, tmp_path: Path) -> None:
    """What a library throws is printed as its status, and no answer follows."""
    status, qdot = of_worker(workers, SADDLE, "qpsolvers:quadprog", "direct", "high_accuracy")
    said = repeated(script(case_of(SADDLE), "qpsolvers:quadprog"), tmp_path)
    assert status is Status.NONCONVEX
    assert "not positive definite" in said["status"]
    compare(said, status, qdot)


def test_a_false_success_is_shown_as_such(tmp_path: Path) -> None:
    """Where there is no minimiser the script says so beside the answer that a backend gives."""
    text = script(case_of(SADDLE), "numpy:lstsq")
    assert "no_minimum: N'WN has eigenvalues of both signs" in text
    said = repeated(text, tmp_path)
    assert "distance" not in said
    assert said["there"] == "is no minimiser to compare with"


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms_are_their_equation(name: str, tmp_path: Path) -> None:
    """The script of a closed form solves its task by numpy alone, factored weights through their factors."""
    problem = REDUNDANT if CLOSED_FORMS[name].task == "least_squares" else FACTORED
    said = repeated(script(case_of(problem), f"closed_form:{name}"), tmp_path)
    assert said["status"].startswith("solved")
    assert float(said["distance"].split()[0]) < 1e-13


@pytest.mark.parametrize(("problem", "words"), [(SADDLE, "condition (7) fails"), (REDUNDANT, "J has rank 1 of 2")])
def test_closed_form_scripts_refuse(problem: VelocityProblem, words: str, tmp_path: Path) -> None:
    """Eq. (6) by script refuses a saddle and rows of deficient rank."""
    said = repeated(script(case_of(problem), "closed_form:eq6"), tmp_path)
    assert words in said["status"]
    assert "qdot" not in said


def test_what_was_not_posed_cannot_be_repeated() -> None:
    """A problem that a formulation refuses, and a QP without rows for a backend that takes none, are refused."""
    with pytest.raises(RefusalError, match=r"convexified poses no QP .* condition \(7\) fails"):
        script(case_of(SADDLE), "osqp", "convexified")
    with pytest.raises(RefusalError, match="takes no QP without rows"):
        script(case_of(FACTORED), "qpsolvers:clarabel", "null_space")


@pytest.mark.parametrize(
    "names",
    [("no_such", "direct", "default"), ("osqp", "no_such", "default"), ("osqp", "direct", "no_such"),
     ("closed_form:no_such", "direct", "default")],
)  # fmt: skip
def test_unknown_names_list_the_known(names: tuple[str, str, str]) -> None:
    """A wrong name is refused with those that there are."""
    with pytest.raises(UnknownNameError, match=r"no_such.*there are: "):
        script(case_of(CONVEX), *names)


def test_words_of_a_solver_stay_comments() -> None:
    """Whatever a solver said stands in a comment of the script and nowhere else."""
    said = 'quotes """ and\nprint("escaped")\r\x0cprint("again")\x00'
    row = {
        "backend": "osqp", "formulation": "direct", "settings": "high_accuracy", "verdict": "limit", "status": "limit",
        "said": said, "error": None, "mode": "cold", "library_version": "1", "engine_version": "1",
    }  # fmt: skip
    plain = script(case_of(CONVEX), "osqp")
    told = script(replace(case_of(CONVEX), records=[row]), "osqp")
    assert 'print("escaped")' in told
    assert ast.dump(ast.parse(told)) == ast.dump(ast.parse(plain))
