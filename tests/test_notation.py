"""NOTATION.md names what the code has, and everything that it has."""

from __future__ import annotations

import dataclasses
import re
from inspect import signature
from pathlib import Path

from problems.measures.measure import Measure
from problems.methods import METHODS as rows
from problems.robots.robot import Robot
from problems.weightings.extended import Extremum
from problems.weightings.two_task import two_task
from sandbox import tolerances
from sandbox.closed_form.eq6_implicit import eq6_implicit
from sandbox.method import Method
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.records import CHECKS, CLAIMS, EXHIBITS, METHODS, MOTIONS, RECORDS
from sandbox.weight import Weight

PAGE = (Path(__file__).parents[1] / "NOTATION.md").read_text()
COLUMNS = {name for schema in (RECORDS, METHODS, MOTIONS, CLAIMS, CHECKS, EXHIBITS) for name in schema.names}
GIVEN = {"robot", "q", "xdot"}
PARAMETERS = {name for method in rows.values() for name in signature(method.cast).parameters} - GIVEN


def test_every_column_and_field_is_explained() -> None:
    """Each record column and each field of the nouns stands in a table of the page."""
    named = set(re.findall(r"`(\w+)`", PAGE))
    fields = {field.name for noun in (VelocityProblem, Weight, QP) for field in dataclasses.fields(noun)}
    assert not (COLUMNS | fields) - named


def test_every_code_name_exists() -> None:
    """Each code name in the first or second column of a table is a field, a column, a parameter or a constant."""
    cells = re.findall(r"^\|([^|]*)\|([^|]*)\|", PAGE, re.MULTILINE)
    names = {name for pair in cells for cell in pair for name in re.findall(r"`(\w+)`", cell)}
    nouns = (VelocityProblem, Weight, QP, Robot, Measure, Method, Extremum)
    known = {field.name for noun in nouns for field in dataclasses.fields(noun)} | {
        name for noun in nouns for name in dir(noun)
    }
    known |= PARAMETERS | set(signature(eq6_implicit).parameters) | set(signature(two_task).parameters)
    known |= {*COLUMNS, *vars(tolerances)} | {"n", "m", "N", "q"}
    assert len(names) > 100 and not names - known


def test_every_parameter_of_a_method_is_explained() -> None:
    """Each parameter stands in the table of parameters in rows that name all methods that take it, and no other."""
    table = PAGE[PAGE.index("## Parameters of methods") : PAGE.index("## Columns of a record")]
    said: dict[str, set[str]] = {}
    for parameters, ids in re.findall(r"^\| (`[^|]+) \| ([^|]+) \|", table, re.MULTILINE):
        names, groups = re.findall(r"`(\w+)`", parameters), ids.split(";")
        for i, name in enumerate(names):
            said.setdefault(name, set()).update(members(groups[i] if len(groups) == len(names) else ids))
    taken = {name: {method.id for method in rows.values() if name in signature(method.cast).parameters} for name in PARAMETERS}
    assert said == taken


def members(ids: str) -> set[str]:
    """{"M1", "M5", "M6", "M7"} of "M1, M5-M7"."""
    found = set()
    for letter, first, _, last in re.findall(r"([MC])(\d+)(-[MC](\d+))?", ids):
        found |= {f"{letter}{i}" for i in range(int(first), int(last or first) + 1)}
    return found
