"""Which backends, formulations and settings a run has, from the names a user gives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from sandbox.backends import BACKENDS
from sandbox.campaign import Plan
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import EmptyPlanError, UnknownNameError
from sandbox.formulation import FORMULATIONS
from sandbox.problem_set import ProblemSet
from sandbox.records import CLOSED_FORM
from sandbox.tolerances import VERIFIED_RELATIVE

RUNNABLE = [name for name, row in BACKENDS.items() if row.expected == "runs"]
"""Backends that a run takes unless told otherwise: a row that is known to fail is named, not run."""


def known(kind: str, names: Iterable[str] | None, registered: Iterable[str]) -> list[str]:
    """`names` as a list, all `registered` ones where None; a name may be the first part of several ("qpsolvers").

    Raises UnknownNameError for a name that is not registered.
    """
    registered = list(registered)
    if names is None:
        return registered
    found: list[str] = []
    for name in names:
        fitting = [one for one in registered if one == name or one.startswith(f"{name}:")]
        if not fitting:
            raise UnknownNameError.of(kind, name, registered)
        found += [one for one in fitting if one not in found]
    return found


def chosen(
    sets: Sequence[ProblemSet], backends: Sequence[str] | None, formulations: Sequence[str] | None,
    settings: Sequence[str] = ("high_accuracy",), *, jobs: int = 1, time_limit: float = 2.0, sample_every: int = 1,
    warm: bool = True,
) -> Plan:  # fmt: skip
    """A plan that runs the same formulations at every settings level; closed forms are named "closed_form:eq6".

    warm : solve sequences a second time, each member started from the answer to the one before (campaign.WARM)

    Raises UnknownNameError where a name is not registered, EmptyPlanError where nothing would be run.
    """
    forms = [f"{CLOSED_FORM}{name}" for name in CLOSED_FORMS]
    levels = known("settings level", settings, VERIFIED_RELATIVE)
    posed = known("formulation", formulations, FORMULATIONS)
    tasks = {task for one in sets for group in one.groups for task in group.tasks}
    if formulations and not any(FORMULATIONS[name].task in tasks for name in posed):
        needed = ", ".join(sorted({FORMULATIONS[name].task for name in posed}))
        raise EmptyPlanError(
            f"{', '.join(posed)} poses task {needed}, but the problems are posed for {', '.join(sorted(tasks))}"
        )
    if not 0 < time_limit < math.inf:  # NaN compares as wrong
        raise EmptyPlanError(f"time_limit is {time_limit:g} s; it must be positive and finite")
    wanted = known("backend", backends, [*(BACKENDS if backends else RUNNABLE), *forms])
    return Plan(
        sets=sets,
        backends=[name for name in wanted if not name.startswith(CLOSED_FORM)],
        levels=dict.fromkeys(levels, posed),
        closed_forms=[name.removeprefix(CLOSED_FORM) for name in wanted if name.startswith(CLOSED_FORM)],
        jobs=jobs, time_limit=time_limit, sample_every=sample_every, warm=warm,
    )  # fmt: skip


def standard(
    sets: Sequence[ProblemSet], *, jobs: int, time_limit: float = 2.0, sample_every: int = 10, warm: bool = True
) -> Plan:
    """What `sandbox verify` runs: every formulation at high accuracy, the engines' own settings on `direct` alone.

    warm : solve sequences a second time, each member started from the answer to the one before (campaign.WARM)
    """
    return Plan(
        sets=sets, backends=RUNNABLE, levels={"high_accuracy": list(FORMULATIONS), "default": ["direct"]},
        closed_forms=list(CLOSED_FORMS), jobs=jobs, time_limit=time_limit, sample_every=sample_every, warm=warm,
    )  # fmt: skip
