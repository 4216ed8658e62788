"""What the README shows runs as written."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_python_blocks_run(block):
    """Each block of Python runs; the file of one's own method is the one in examples/."""
    if "def method" in block:
        assert block in (ROOT / "examples" / "my_method.py").read_text()
    exec(compile(block, "README.md", "exec"), {})


def test_the_figure_is_made_by_its_command(tmp_path):
    """The command below the figure draws it: the same panels as the committed file, to the pixel they are rounded to."""
    command = re.search(r"```sh\n(sandbox follow .*?)```", README, re.DOTALL)
    assert command is not None
    words = shlex.split(command[1].replace("\\\n", " "))
    places = {"--out": str(tmp_path / "run"), "--svg": str(tmp_path / "drift.svg")}
    words = [places.get(before, word) for before, word in zip(["", *words], words, strict=False)]
    made = subprocess.run([sys.executable, "-m", "sandbox.cli", *words[1:]], cwd=ROOT, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    drawn, kept = ((path / "drift.svg").read_text() for path in (tmp_path, ROOT / "docs"))
    assert re.sub(r"[-\d.,−e]+", "#", drawn) == re.sub(r"[-\d.,−e]+", "#", kept)
