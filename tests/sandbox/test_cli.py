"""The command line: quick to start, and its help says what stands in the code."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.main import get_command

from sandbox import cli
from sandbox.listing import LISTS

HEAVY = ("casadi", "pinocchio", "numba", "scipy", "osqp", "pyarrow", "typer", "problems", "reports")


@pytest.mark.parametrize("module, allowed", [("sandbox", ()), ("sandbox.cli", ("typer",))])
def test_importing_it_loads_no_library(module: str, allowed: tuple[str, ...]) -> None:
    """`import sandbox` and the command line load neither solvers nor robots: what is heavy comes with its first use."""
    code = f"import sys, {module}; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(list(allowed))


@pytest.mark.parametrize("name", sorted(get_command(cli.app).commands))  # type: ignore[attr-defined]
def test_help_shows_every_word(name: str) -> None:
    """The help of a command holds every option's help in full, what stands in brackets too."""
    command = get_command(cli.app).commands[name]  # type: ignore[attr-defined]
    done = subprocess.run([sys.executable, "-m", "sandbox.cli", name, "--help"], capture_output=True, text=True, check=True)
    words = "".join(done.stdout.split())
    told = [parameter.help for parameter in command.params if getattr(parameter, "help", None)]
    assert told or name == "--help"
    for text in told:
        assert "".join(text.split()) in words


@pytest.mark.parametrize("what", [name for name in LISTS if name not in ("sets", "backends", "formulations", "closed_forms")])
def test_a_list_has_rows_that_say_everything(what: str) -> None:
    """Methods, measures, weightings, robots and paths: a name of its own in each row, and no empty cell."""
    rows = LISTS[what]()
    assert len({row["name"] for row in rows}) == len(rows) > 3
    assert all(str(cell) for row in rows for cell in row.values())
