"""NOTATION.md names what the code has, and everything that it has."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

from problems.measures.measure import Measure
from problems.robots.robot import Robot
from sandbox import tolerances
from sandbox.method import Method
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.records import METHODS, MOTIONS, RECORDS
from sandbox.weight import Weight

PAGE = (Path(__file__).parents[1] / "NOTATION.md").read_text()


def test_every_column_and_field_is_explained() -> None:
    """Each record column and each field of the nouns stands in a table of the page."""
    named = set(re.findall(r"`(\w+)`", PAGE))
    fields = {field.name for noun in (VelocityProblem, Weight, QP) for field in dataclasses.fields(noun)}
    assert not (set(RECORDS.names) | set(METHODS.names) | set(MOTIONS.names) | fields) - named


def test_every_code_name_exists() -> None:
    """Each code name in the second column of a table is a field, a column or a constant."""
    second = re.findall(r"^\|[^|]*\| ((?:`\w+`(?:, )?)+) \|", PAGE, re.MULTILINE)
    names = {name for cell in second for name in re.findall(r"`(\w+)`", cell)}
    fields = {field.name for noun in (VelocityProblem, Weight, QP) for field in dataclasses.fields(noun)}
    members = {name for noun in (Robot, Measure, Method) for name in dir(noun)}
    members |= {field.name for noun in (Robot, Measure, Method) for field in dataclasses.fields(noun)}
    members |= {"alpha", "gbar", "hessian"}  # parameters of methods
    known = fields | members | set(RECORDS.names) | set(vars(tolerances)) | {"n", "m", "N", "q", "damping"}
    assert names and not names - known
