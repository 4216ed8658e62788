"""Every claim of the paper at a reduced size: its state, its planted fault, and that its two code paths share nothing."""

from __future__ import annotations

import pickle
import re
from functools import cache
from importlib import import_module

import grimp
import pytest

from sandbox.claims.claim import Claim, Evidence, State, Trial
from sandbox.claims.ledger import noticed
from sandbox.claims.table import CLAIMS

EXPECTED = {
    State.RANGE: (
        "less_than_60_percent", "more_significant_for_general_weight", "general_cheaper_than_identity", 
        "projection_methods_comparable", "backends_in_double",
        "table_3_percentages", "table_3_augmented", "damping_reduces_task_errors", "extremum_feedback", "virtual_load_weight",
        "rank_k_weights_never_qualify",
    ),
    State.CORRECTED: (
        "footnote_1", "matrix_of_the_normal_equations", "frozen_rate",
        "stiffness_weight", "eq13_conditions",
    ),
    State.NOT_REPRODUCED: ("table_3_normal_equations",),
}  # fmt: skip
"""Every other claim is reproduced."""

NOUNS = {
    "sandbox", "sandbox.check", "sandbox.errors", "sandbox.problem", "sandbox.weight", "sandbox.solution", "sandbox.stacked",
    "sandbox.task", "sandbox.tolerances", "sandbox.method", "sandbox.parameters", "sandbox.problem_set", "problems",
}  # fmt: skip
"""What holds and checks the data that both sides are given."""

every_claim = pytest.mark.parametrize("claim", CLAIMS.values(), ids=CLAIMS)


@cache
def _evidence(claim: Claim) -> Evidence:
    return claim.evidence(Trial(full=False))


@pytest.mark.paper
@every_claim
def test_the_state_of_the_claim_is_the_expected_one(claim: Claim) -> None:
    """Computed from its checks; where it is red or limited, this is what is known of it."""
    expected = next((state for state, names in EXPECTED.items() if claim.name in names), State.REPRODUCED)
    evidence = _evidence(claim)
    assert evidence.state is expected, [check for check in evidence.checks if not check.holds]
    fallen = [check for check in evidence.checks if not check.holds]
    if expected in (State.RANGE, State.CORRECTED):
        assert all(check.range for check in fallen), "a limited claim says where it does hold"


@pytest.mark.paper
@every_claim
def test_the_planted_fault_turns_the_claim_red(claim: Claim) -> None:
    """A check that cannot fail proves nothing."""
    assert noticed(_evidence(claim), claim.evidence(Trial(full=False), faulty=True)), claim.fault.words


@pytest.mark.paper
@every_claim
def test_the_evidence_is_shown(claim: Claim) -> None:
    """At least one plot, and every text of the row says something."""
    assert any(exhibit.kind in ("plot", "heat") for exhibit in _evidence(claim).exhibits)
    assert all((claim.title, claim.place, claim.says, claim.tested, claim.accepted, claim.fault.words))
    assert claim.place.startswith(("Abstract", "Section ")) and "$" not in claim.title + claim.place


@cache
def _graph() -> grimp.ImportGraph:
    return grimp.build_graph("sandbox", "problems", include_external_packages=False)


def _knows(module: str) -> set[str]:
    """Everything of ours that a module is made of."""
    graph = _graph()
    return {module, *graph.find_upstream_modules(module)} if module in graph.modules else set()


@every_claim
def test_the_two_code_paths_share_nothing_below_numpy(claim: Claim) -> None:
    """What both import is only what holds the data: the problem, its weight, and the robot where there is one."""
    modules = [path.name.split(":")[0] for path in claim.paths]
    for path in claim.paths:
        module, function = path.name.split(":")
        value = import_module(module)
        for part in function.split("."):
            value = getattr(value, part)
    shared = _knows(modules[0]) & _knows(modules[1]) - NOUNS
    assert modules[0] != modules[1]
    assert {name for name in shared if not name.startswith("problems.robots")} == set()


@every_claim
def test_a_claim_can_be_sent_to_another_process(claim: Claim) -> None:
    """The ledger examines claims in several."""
    assert pickle.loads(pickle.dumps(claim)).name == claim.name


def test_names_tell_claims_apart() -> None:
    """Names are words of a command line; titles differ too, and every plant is a function of its own claim."""
    assert all(re.fullmatch(r"[a-z0-9_]+", name) for name in CLAIMS)
    assert len({claim.title for claim in CLAIMS.values()}) == len(CLAIMS)
