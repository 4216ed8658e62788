"""A figure of a run as one SVG file: several methods after some cycles of the same closed path, with their drift."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from reports import drawing, page
from reports.methods import cycles, methods
from reports.run_data import RunData
from sandbox.errors import EmptyPlanError, UnknownNameError


def write_drift_figure(run: Path, out: Path, *, names: Sequence[str] = (), robot: str = "", path: str = "") -> Path:
    """Draw the motions of the methods `names` on `robot` along `path` of the run folder `run`, and return `out`.

    Without names: every method that got round once; one that is named is drawn as far as it got. Without robot or path:
    those of the first motion that is left.

    Raises
    ------
    InputFileError
        where `run` is no run folder, or a file of it is not what it should be.
    UnknownNameError
        where the run has no method of a name.
    EmptyPlanError
        where no motion is left to draw.
    """
    data = RunData(Path(run))
    try:
        sections = {section["name"]: section for section in methods(data, room=0)}
    finally:
        data.close()
    for name in names:
        if name not in sections:
            raise UnknownNameError.of("method", name, list(sections))
    closed = [
        (sections[name]["title"], motion)
        for name in names or sections
        for motion in sections[name]["motions"]
        if motion["closed"]
        and (names or motion["first"] is not None)
        and robot in ("", motion["robot"])
        and path in ("", motion["path"])
    ]
    if closed:  # one arm, one path: drifts of others cannot be compared
        first = closed[0][1]
        closed = [pair for pair in closed if (pair[1]["robot"], pair[1]["path"]) == (first["robot"], first["path"])]
    panels = [cycles(motion, title) for title, motion in {id(pair[0]): pair for pair in closed}.values()]
    if not panels:
        raise EmptyPlanError("no motion of the run goes round a closed path with this method, robot and path")
    page.write(drawing.standalone(drawing.drift_figure(panels)), Path(out))
    return Path(out)
