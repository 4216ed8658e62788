"""One problem or stack through closed forms and backends, as a table of records in memory."""

from __future__ import annotations

from collections.abc import Sequence

import pyarrow as pa

from sandbox.campaign import Campaign
from sandbox.plan import chosen, known
from sandbox.problem import VelocityProblem, given
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import RECORDS
from sandbox.task import TASKS


def cross_validate(
    problem: VelocityProblem,
    backends: Sequence[str] | None = None,
    formulations: Sequence[str] | None = None,
    settings: str = "high_accuracy",
    *,
    tasks: Sequence[str] = ("exact",),
    time_limit: float = 2.0,
    sequence: bool = False,
) -> pa.Table:
    """Records (records.RECORDS) of `problem`, one per backend and formulation and one per closed form.

    backends, formulations : names, all where None ("closed_form:eq6" names a closed form, "qpsolvers" all its engines)
    settings : default, low_accuracy, mid_accuracy or high_accuracy
    tasks : of exact, least_squares, damped
    time_limit : seconds for one problem
    sequence : the stack follows one trajectory: backends that can be started from an earlier answer solve it warm, too

    Raises
    ------
    UnknownNameError
        where a name is not registered; it lists those that are.
    EmptyPlanError
        where a formulation is asked for whose task is not.
    """
    stack = given(problem).stacked()
    group = Group(stack, {"step": list(range(len(stack)))}, tuple(known("task", _listed(tasks), TASKS)), sequence)
    sets = [ProblemSet("given", (group,))]
    plan = chosen(sets, _listed(backends), _listed(formulations), [settings], time_limit=time_limit)
    kept = [RECORDS.empty_table()]
    Campaign(plan, lambda kind, _, table: kept.append(table) if kind == "records" else None).carry_out()
    return pa.concat_tables(kept).unify_dictionaries().combine_chunks()


def _listed(names: Sequence[str] | str | None) -> Sequence[str] | None:
    """One name may come without its list."""
    return [names] if isinstance(names, str) else names
