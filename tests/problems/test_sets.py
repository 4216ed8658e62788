"""What each set claims of its problems, against exact truth."""

from __future__ import annotations

import hashlib
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from problems.methods import METHODS
from problems.sets import SETS, load, manufactured, methods
from problems.sets import construct as make
from sandbox.errors import UnknownNameError
from sandbox.reference import truth
from sandbox.tolerances import FORWARD, UNIT

DRAWN = [name for name in SETS if name != "textbook"]
OF_METHODS = ("methods", "trajectories")
CASES = [name for name in DRAWN if name not in OF_METHODS]

FROZEN = {
    "textbook": "c76e5397fdcf29f4",
    "manufactured": "d480ca10c1cf0141",
    "indefinite": "b76b3cf6cec01d82",
    "no_minimum": "e9f70abd45e2ed3b",
    "not_unique": "7e9d40fd44176ee9",
    "rank_deficient": "b1b305d941d37bfc",
    "near_singular": "812fba95e2e60969",
    "badly_scaled": "c1c4815b479830bf",
    "planar": "2c46321e574dca5b",
    "seven_joint": "566106f9688d48da",
    "methods": "09a2e81b4fe9069a",
    "trajectories": "8fa474db869b6cd1",
}
"""Digest of the problem ids of each set in order: a name means frozen numbers."""


@pytest.fixture(scope="module")
def truths():
    """Truth of task exact, by set, one list per group."""
    return {name: [truth(group.problem) for group in load(name).groups] for name in SETS}


def members(name, truths=None):
    """(problem, labels, truth) of every member of a set."""
    for g, group in enumerate(load(name).groups):
        for i, problem in enumerate(group.problem):
            labels = {column: values[i] for column, values in group.labels.items()}
            yield problem, labels, None if truths is None else truths[name][g][i]


def rational(array):
    """Exact fractions of an array of floats."""
    return np.vectorize(Fraction, otypes=[object])(array)


def assert_exact(*factors):
    """The float64 product of the factors is the product of their exact values; it is returned."""
    product, exact = factors[0], rational(factors[0])
    for factor in factors[1:]:
        product, exact = product @ factor, exact @ rational(factor)
    assert (rational(product) == exact).all()
    return product


# the sets together


def test_size_of_the_standard_run():
    """There are between 1,400 and 1,500 problems, at least 60 in every drawn set."""
    sizes = {name: len(load(name)) for name in SETS}
    assert 1400 <= sum(sizes.values()) <= 1500
    assert min(sizes[name] for name in DRAWN) >= 60


def test_every_class_is_expected_often(truths):
    """Each expected class occurs at least 80 times."""
    counts = Counter(t.expected for groups in truths.values() for group in groups for t in group)
    assert set(counts) == {"unique_minimum", "minimum_not_unique", "no_minimum", "infeasible"}
    assert min(counts.values()) >= 80


def test_every_redundancy_is_represented():
    """At least five (m, n) pairs; n - m = 1, 2 and >= 3 by at least 60 problems each."""
    sizes = Counter()
    for name in SETS:
        for group in load(name).groups:
            sizes[group.problem.m, group.problem.n] += len(group)
    assert len(sizes) >= 5
    for wanted in (lambda k: k == 1, lambda k: k == 2, lambda k: k >= 3):
        assert sum(count for (m, n), count in sizes.items() if wanted(n - m)) >= 60


def test_no_two_problems_are_equal():
    """Every problem of all sets, the full forms included, has its own id."""
    ids = [i for name in SETS for group in load(name, full=True).groups for i in group.ids()]
    assert len(set(ids)) == len(ids) > 7000


@pytest.mark.parametrize("name", SETS)
def test_numbers_are_frozen(name):
    """The numbers behind a name never change: changed numbers get a new name."""
    digest = hashlib.blake2b(digest_size=8)
    for group in load(name).groups:
        digest.update(repr((group.problem.J.shape, group.tasks, group.ids())).encode())
    assert digest.hexdigest() == FROZEN[name]


@pytest.mark.parametrize("name", DRAWN)
def test_standard_form_is_a_prefix_of_the_full_form(name):
    """The full form has the same groups, each beginning with the standard one, and at least six times the members."""
    standard, full = load(name), load(name, full=True)
    assert len(full) == 6 * len(standard) if name in CASES else len(full) > 6 * len(standard)
    for short, long in zip(standard.groups, full.groups, strict=True):
        assert long.ids()[: len(short)] == short.ids()
        assert long.tasks == short.tasks and long.sequence == short.sequence
        assert {c: list(v[: len(short)]) for c, v in long.labels.items()} == {c: list(v) for c, v in short.labels.items()}


@pytest.mark.parametrize("name", CASES)
def test_seeds(name):
    """Member i of a set is drawn from its own seed, the set's plus i."""
    seeds = [labels["seed"] for _, labels, _ in members(name)]
    assert sorted(seeds) == list(range(SETS[name].seed, SETS[name].seed + len(load(name))))


def test_every_method_and_built_in_robot_is_posed():
    """The set of methods holds every method that minimises something, on every built-in robot it is exact for."""
    posed = {(labels["method"], labels["robot"]) for _, labels, _ in members("methods")}
    wanted = {(m.name, r) for m in METHODS.values() for r in methods.ROBOTS if m.task is not None}
    missing = wanted - posed
    assert missing == {("least_squares_rank_deficient", "seven_joint"), ("least_squares_rank_deficient", "panda")}
    assert posed <= wanted


def test_lost_rank_is_lost_exactly():
    """Where the set of methods poses eq. (13), J has lost a row to the last bit."""
    for group in load("methods", full=True).groups:
        if group.tasks == ("least_squares",):
            assert (np.abs(group.problem.J).sum(axis=-1) == 0).any(axis=-1).all()


def test_trajectories_are_followed_step_by_step():
    """Members of one trajectory stand in the order of their steps, near one another, and start the next one at 0."""
    for group in load("trajectories").groups:
        assert group.sequence
        seeds, steps, q = (group.labels[name] for name in ("seed", "step", "q"))
        for i in range(1, len(group)):
            if seeds[i] == seeds[i - 1]:
                assert steps[i] == steps[i - 1] + 1
                assert 0 < np.abs(np.subtract(q[i], q[i - 1])).max() < 1
            else:
                assert steps[i] == 0


def test_unknown_set():
    """A name that is no set's is refused, and the message lists those there are."""
    with pytest.raises(UnknownNameError, match="near_singular"):
        load("near_singluar")


def test_factored_weights():
    """Some problems of textbook and planar keep their weight in factors, planar with and without a base."""
    for name in ("textbook", "planar"):
        assert any(group.problem.W.factored for group in load(name).groups)
    bases = {bool(p.W.base.any()) for p, _, _ in members("planar") if p.W.factored}
    assert bases == {True, False}


# manufactured


def cases():
    """Each manufactured problem with its case and the chosen parts, drawn again from its seed."""
    by_text = {(case.m, case.n, case.text): case for case in manufactured.CASES}
    for problem, labels, _ in members("manufactured"):
        case = by_text[problem.m, problem.n, labels["case"]]
        yield problem, case, manufactured.manufacture(case, np.random.default_rng(labels["seed"]))


def test_manufactured_is_generic():
    """C != 0 and a generic S_T in at least half, n - m >= 2 in a third, n up to 12, every inertia of N'WN."""
    chosen = list(cases())
    generic = [bool(parts.C.any()) and len(parts.S_T) > 0 and case.S_T == "generic" for _, case, parts in chosen]
    assert np.mean(generic) >= 1 / 2
    assert np.mean([problem.n - problem.m >= 2 for problem, _, _ in chosen]) >= 1 / 3
    assert max(problem.n for problem, _, _ in chosen) == 12
    inertias = {case.S_N for _, case, _ in chosen}
    assert {"positive", "negative", "indefinite", "singular", "indefinite and singular"} <= inertias


def test_manufactured_classes(truths):
    """The chosen inertia decides the class."""
    expected = {
        "positive": "condition_7",
        "negative": "maximum",
        "indefinite": "saddle",
        "singular": "singular",
        "singular, descending": "descending",
        "indefinite and singular": "indefinite_singular",
    }
    flat = [t for group in truths["manufactured"] for t in group]
    for (_, case, _), found in zip(cases(), flat, strict=True):
        assert found.reason == expected[case.S_N]


def test_manufactured_answers(truths):
    """Where N'WN > 0, qdot = Y xdot + N y and lam = -(S_T xdot + C y + mu), y = -S_N^-1 (nu + C'xdot)."""
    flat = [t for group in truths["manufactured"] for t in group]
    compared = 0
    for (problem, case, parts), found in zip(cases(), flat, strict=True):
        if case.S_N != "positive":
            continue
        y = -np.linalg.solve(parts.S_N, parts.nu + parts.C.T @ parts.xdot)
        qdot = parts.basis.Y @ parts.xdot + parts.basis.N @ y
        lam = -(parts.S_T @ parts.xdot + parts.C @ y + parts.mu)
        A = np.vstack([problem.J, parts.basis.N.T @ problem.W.dense()])
        A = A / np.linalg.norm(A, axis=1, keepdims=True)
        bound = FORWARD * problem.n * UNIT * np.linalg.cond(A)
        assert np.abs(qdot - found.x).max() <= bound * np.abs(found.x).max()
        size = np.abs(lam).max() + np.abs(problem.W.dense()).max() * np.abs(found.x).max()
        assert np.abs(lam - found.y).max() <= bound * size
        compared += 1
    assert compared == 108


def test_manufactured_integer_answers_are_exact(truths):
    """With integer data the stated answer satisfies the optimality conditions without any rounding."""
    for problem, case, parts in cases():
        if case.data == "real":
            continue
        J, N, W = problem.J, parts.basis.N, problem.W.dense()
        assert not assert_exact(J, N).any()
        np.testing.assert_array_equal(assert_exact(N.T, W, N), parts.S_N)
        np.testing.assert_array_equal(assert_exact(J, parts.basis.Y), np.eye(problem.m))
        np.testing.assert_array_equal(assert_exact(N.T, problem.a), parts.nu)


# the other sets


def test_indefinite_claims(truths):
    """lambda_min(W) is the knob, W has the number of negative eigenvalues labelled, and condition (7) holds."""
    levels, negatives = Counter(), Counter()
    for problem, labels, found in members("indefinite", truths):
        assert (found.expected, found.reason) == ("unique_minimum", "condition_7")
        W = problem.W.dense()
        eigenvalues = np.linalg.eigvalsh(W)
        assert abs(eigenvalues[0] - labels["value"]) <= FORWARD * problem.n * UNIT * np.abs(eigenvalues).max()
        assert int(labels["case"].split()[0]) == np.sum(eigenvalues < 0) <= problem.m
        Y = np.linalg.pinv(problem.J)
        coupling = Y.T @ W @ np.linalg.svd(problem.J)[2][problem.m :].T
        assert np.abs(coupling).max() > 1e-3 * min(1.0, np.abs(eigenvalues).max())
        levels[labels["value"]] += 1
        negatives[int(labels["case"].split()[0]), problem.m] += 1
    assert sorted(levels) == sorted(-float(f"1e{p}") for p in range(-9, 5))
    assert {p for p, m in negatives if p == m} >= {2, 3}  # all m of them negative, too


def test_no_minimum_claims(truths):
    """Nothing has a minimum, for the reason labelled; saddles and maxima by margins far above rounding."""
    reasons = Counter()
    for problem, labels, found in members("no_minimum", truths):
        assert (found.expected, found.reason) == ("no_minimum", labels["case"])
        if found.reason in ("saddle", "maximum"):
            assert found.margin >= 0.1 * abs(labels["value"])
        if found.reason == "maximum":
            assert found.inertia == (0, problem.n - problem.m, 0)
        reasons[found.reason] += 1
    assert min(reasons[r] for r in ("saddle", "maximum", "indefinite_singular", "descending")) >= 20


def test_not_unique_claims(truths):
    """Every minimum leaves the freedom labelled, with W semidefinite, generic and indefinite."""
    for problem, labels, found in members("not_unique", truths):
        kind, freedom = labels["case"].split(", freedom ")
        assert found.expected == "minimum_not_unique"
        assert found.freedom.shape[1] == found.inertia[2] == int(freedom)
        eigenvalues = np.linalg.eigvalsh(problem.W.dense())
        zero = FORWARD * problem.n * UNIT * np.abs(eigenvalues).max()
        if kind == "W semidefinite":
            assert eigenvalues[0] >= -zero
        elif kind == "W indefinite":
            assert eigenvalues[0] < -1.0


@pytest.mark.parametrize("name", ["rank_deficient", "not_unique", "no_minimum"])
def test_exact_claims_have_exact_data(name):
    """J N = 0, and J, J'WxJ, J'Wx xdot, N'WN, N'a and J q0 suffer no rounding in float64."""
    checked = 0
    for problem, labels, _ in members(name):
        if name == "no_minimum" and labels["case"] in ("saddle", "maximum"):
            continue  # their curvature is far from zero: nothing exact is claimed
        r = int(labels["case"].split(";")[0].removeprefix("rank ")) if name == "rank_deficient" else problem.m
        basis = make.integer_basis(np.random.default_rng(labels["seed"]), r, problem.n)
        J, W = problem.J, problem.W.dense()
        Wx = np.eye(problem.m) if problem.Wx is None else problem.Wx
        assert not assert_exact(J, basis.N).any()
        assert_exact(J.T, Wx, J)
        assert_exact(J.T, Wx, problem.xdot)
        assert_exact(basis.N.T, W, basis.N)
        assert_exact(basis.N.T, problem.a)
        if "unachievable" not in labels["case"]:
            q0 = basis.Y @ np.linalg.lstsq(J @ basis.Y, problem.xdot, rcond=None)[0].round(2)
            np.testing.assert_array_equal(assert_exact(J, q0), problem.xdot)
        checked += 1
    assert checked >= 40


def test_rank_deficient_claims(truths):
    """The rank is the one labelled, achievable is as labelled, and each kind of Wx does what it says to the target."""
    reasons, ranks = Counter(), set()
    for problem, labels, found in members("rank_deficient", truths):
        rank, xdot, Wx, W = labels["case"].split("; ")
        assert found.rank == int(rank.removeprefix("rank "))
        assert found.rank < problem.m
        assert (found.expected == "infeasible") == (xdot == "xdot unachievable")
        target = truth(problem, "least_squares")
        unbounded = Wx in ("Wx P indefinite", "Wx P singular, target unbounded")
        assert (target.reason == "target_unbounded") == unbounded
        if W == "W positive definite" and not unbounded:
            assert target.expected == "unique_minimum"
        if W in ("W positive definite", "W indefinite") and not unbounded and found.rank < problem.n:
            assert target.reason == "condition_7"
        eigenvalues = np.linalg.eigvalsh(problem.W.dense())
        if W == "W indefinite":
            assert eigenvalues[0] < -1.0
        if Wx == "Wx indefinite off range J":
            assert np.linalg.eigvalsh(problem.Wx)[0] < 0
        reasons[target.reason] += 1
        ranks.add((problem.m, problem.n, found.rank))
    assert len(ranks) >= 8
    assert {"condition_7", "singular", "descending", "target_unbounded", "no_freedom"} <= set(reasons)


def test_near_singular_claims(truths):
    """sigma_min(J) is the knob, over twelve decades, half with an answer of order 1."""
    levels, kinds, achievable = Counter(), Counter(), 0
    for problem, labels, found in members("near_singular", truths):
        assert found.expected == "unique_minimum"
        sigma = np.linalg.svd(problem.J, compute_uv=False)[-1]
        assert abs(sigma - labels["value"]) <= FORWARD * problem.n * UNIT
        xdot, W = labels["case"].split(", ")
        if xdot == "xdot = J q0":
            achievable += 1
            assert np.abs(found.x).max() <= 100
        levels[labels["value"]] += 1
        kinds[labels["value"], W] += 1
    assert achievable == len(load("near_singular")) / 2
    assert sorted(levels) == sorted(float(f"1e-{p}") for p in range(1, 13))
    assert len(kinds) == 3 * len(levels)  # every kind of weight at every level


def test_badly_scaled_claims(truths):
    """Every member has its minimum, four things are scaled, each from below 1e-3 to above 1e3."""
    knobs = {}
    for _, labels, found in members("badly_scaled", truths):
        assert found.expected == "unique_minimum"
        knobs.setdefault(labels["knob"], set()).add(labels["value"])
    assert set(knobs) == {"row of J", "unit of joints", "W against J", "a"}
    assert all(min(v) <= 1e-3 and max(v) >= 1e3 for v in knobs.values())
    assert (min(knobs["W against J"]), max(knobs["W against J"])) == (1e-8, 1e8)


@pytest.mark.parametrize("name", ["planar", "seven_joint"])
def test_robots_claims(truths, name):
    """Every member has its minimum, its robot and its configuration; some of seven_joint's weights are indefinite."""
    sizes, indefinite = set(), 0
    for problem, labels, found in members(name, truths):
        assert found.expected == "unique_minimum"
        assert labels["robot"] in ("planar_3r", "planar_4r", "seven_joint")
        assert len(labels["q"]) == problem.n
        indefinite += bool(np.linalg.eigvalsh(problem.W.dense())[0] < -1e-6)
        sizes.add((problem.m, problem.n))
    assert sizes == ({(2, 3), (2, 4), (3, 4)} if name == "planar" else {(3, 7), (6, 7)})
    assert indefinite == (0 if name == "planar" else 20)
