"""What there is: the tables of sets, methods, robots, backends and the rest as plain rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def _sets() -> list[dict[str, Any]]:
    from problems import sets

    loaded = [(row, sets.load(name)) for name, row in sets.SETS.items()]
    return [
        {"name": row.name, "problems": len(s), "seed": row.seed, "about": row.about,
         "tasks": " ".join(dict.fromkeys(task for g in s.groups for task in g.tasks))}
        for row, s in loaded
    ]  # fmt: skip


def _backends() -> list[dict[str, Any]]:
    from sandbox.backends import BACKENDS

    return [
        {"name": b.name, "method": b.method, "promises H": b.promise.H, "promises A": b.promise.A,
         "warm start": b.start.by if b.start else "no", "licence": b.licence,
         "expected": b.expected + (f": {b.message}" if b.message else ""), "install": b.install}
        for b in BACKENDS.values()
    ]  # fmt: skip


def _formulations() -> list[dict[str, Any]]:
    from sandbox.formulation import FORMULATIONS

    return [{"name": f.name, "task": f.task, "about": f.about} for f in FORMULATIONS.values()]


def _closed_forms() -> list[dict[str, Any]]:
    from sandbox.closed_form import CLOSED_FORMS

    return [
        {"name": f.name, "task": f.task, "domain": f.domain, "error bound": f.bound_text, "source": f.source}
        for f in CLOSED_FORMS.values()
    ]


def _robots() -> list[dict[str, Any]]:
    from problems import robots

    return [
        {"name": row.name, "robot": row.about, "needs": f"extra {row.extra}" if row.extra else "nothing more"}
        for row in robots.ROBOTS.values()
    ]


def _methods() -> list[dict[str, Any]]:
    from problems.methods import METHODS

    return [
        {"id": m.id, "name": m.name, "method": m.title, "W": m.weight, "a": m.vector, "condition (7)": m.condition,
         "reference": m.number or "none", "attribution": m.certainty}
        for m in METHODS.values()
    ]  # fmt: skip


def _measures() -> list[dict[str, Any]]:
    from problems.measures import MEASURES

    return [{"name": m.name, "f": m.about, "unit": m.unit, "defined": m.domain, "source": m.source} for m in MEASURES.values()]


def _weightings() -> list[dict[str, Any]]:
    from problems.weightings import WEIGHTINGS

    return [
        {"name": w.name, "W": w.formula, "unit": w.unit, "definite": w.definiteness, "source": w.source}
        for w in WEIGHTINGS.values()
    ]


def _paths() -> list[dict[str, Any]]:
    from problems import paths

    return [
        {"name": name, "about": curve.about, "closed": "yes" if curve.closed else "no", "seconds": curve.duration}
        for name, curve in ((name, paths.load(name)) for name in paths.PATHS)
    ]


def _claims() -> list[dict[str, Any]]:
    from reports.tex import plain
    from sandbox.claims.table import CLAIMS

    return [
        {"name": claim.name, "where": claim.place, "claim": claim.title, "planted fault": plain(claim.fault.words)}
        for claim in CLAIMS.values()
    ]


LISTS: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "sets": _sets, "methods": _methods, "measures": _measures, "weightings": _weightings, "robots": _robots,
    "paths": _paths, "backends": _backends, "formulations": _formulations, "closed_forms": _closed_forms,
    "claims": _claims,
}  # fmt: skip
"""What `sandbox list` can list: name -> rows."""
