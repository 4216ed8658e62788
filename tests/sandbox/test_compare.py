"""`sandbox compare` joins two runs record by record, puts what fell first, and calls a time different only when a test does."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy import stats

from sandbox import compare as comparing
from sandbox.compare import CONFIGURATION, compare, holm, rank_test
from sandbox.errors import InputFileError
from sandbox.records import RECORDS, read_table
from sandbox.verdict import VERDICTS
from tests.reports.synthetic_run import write_run

KEY = ("problem", *CONFIGURATION)
Row = dict[str, Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of four backends and the closed forms."""
    folder = tmp_path_factory.mktemp("compare") / "run"
    write_run(folder, scale=0.08, backends=("osqp", "qpsolvers:piqp", "proxsuite:dense", "casadi:ipqp"))
    return folder


def changed(run: Path, folder: Path, change: Callable[[list[Row]], list[Row]]) -> Path:
    """A copy of a run whose records went through `change`; all of them in one part."""
    shutil.copytree(run, folder)
    rows = change(read_table(run, "records").to_pylist())
    for part in (folder / "records").iterdir():
        part.unlink()
    pq.write_table(pa.Table.from_pylist(rows, schema=RECORDS), folder / "records" / "part-9.parquet")
    return folder


def key(row: Row) -> tuple[Any, ...]:
    """What a record is joined by."""
    return tuple(row[name] for name in KEY)


def test_a_run_does_not_differ_from_itself(run: Path) -> None:
    """Every record is found again; no flip, no loss, nothing missing, no version and no time that differs."""
    found = compare(run, run)
    keys = {key(row) for row in read_table(run, "records", list(KEY)).to_pylist()}
    assert found["joined"] == len(keys) > 1000
    assert found["before"]["records"] == found["after"]["records"] == read_table(run, "records", ["problem"]).num_rows
    for name in ("flips", "fallen", "new_failures", "fixed", "worse"):
        assert found[name] == 0
    for name in ("flipped", "by_verdict", "by_backend", "lost", "missing"):
        assert found[name] == []
    assert {row["median_log10_ratio"] for row in found["accuracy"]} == {0.0}
    assert not any(row["differ"] for row in found["versions"]) and len(found["versions"]) == 4
    assert {row["says"] for row in found["time"]} <= {"noise", "too few"} and found["time"]
    json.dumps(found, allow_nan=False)


def test_flips_are_counted_and_new_failures_come_first(run: Path, tmp_path: Path) -> None:
    """Counts by verdict agree with a join in Python; verified to false success or crash stands first, fixed last."""
    rng = np.random.default_rng(3)

    def flip(rows: list[Row]) -> list[Row]:
        for row in rows:
            if rng.random() < 0.2:
                row["verdict"] = str(rng.choice(VERDICTS))
        return rows

    other = changed(run, tmp_path / "other", flip)
    before, after = ({key(r): r for r in read_table(f, "records").to_pylist()} for f in (run, other))
    found = compare(run, other)
    pairs = [(before[k]["verdict"], after[k]["verdict"]) for k in before if before[k]["verdict"] != after[k]["verdict"]]
    failed = comparing.FAILED
    assert found["flips"] == len(pairs) > 100
    assert found["fallen"] == sum(a == "verified" and b in ("crashed", "false_success") for a, b in pairs) > 0
    new = [a not in (*failed, "not_run") and b in failed for a, b in pairs]
    fixed = [a in failed and b not in (*failed, "not_run") for a, b in pairs]
    assert found["new_failures"] == sum(new) > found["fallen"] and found["fixed"] == sum(fixed) > 0
    assert {(r["before"], r["after"]): r["n"] for r in found["by_verdict"]} == {p: pairs.count(p) for p in pairs}
    assert sum(row["flips"] for row in found["by_backend"]) == len(pairs)
    listed = found["flipped"]
    assert len(listed) == min(len(pairs), comparing.LISTED)
    kinds = [
        0 if r["before"] == "verified" and r["after"] in comparing.FALLEN
        else 1 if r["before"] not in (*failed, "not_run") and r["after"] in failed
        else 3 if r["before"] in failed and r["after"] not in (*failed, "not_run") else 2
        for r in listed
    ]  # fmt: skip
    assert kinds == sorted(kinds) and kinds[0] == 0
    for row in listed:
        one, two = before[key(row)], after[key(row)]
        assert (row["before"], row["after"], row["said_before"]) == (one["verdict"], two["verdict"], one["said"])
        assert (row["set"], row["error_before"], row["error_after"]) == (one["set"], one["error"], two["error"])
    few = compare(run, other, listed=3)
    assert few["flipped"] == listed[:3] and few["flips"] == len(pairs)


def test_accuracy_is_the_median_ratio_and_losses_are_listed(run: Path, tmp_path: Path) -> None:
    """log10 of the ratio of errors that both sides call solved, median per backend; beyond ten times each is listed."""
    rng = np.random.default_rng(4)

    def lose(rows: list[Row]) -> list[Row]:
        for row in rows:
            if row["error"] is not None and row["backend"] == "osqp":
                row["error"] *= float(10.0 ** rng.normal(0.5, 0.6))
            if row["error"] is not None and row["backend"] == "closed_form:eq6":
                row["error"] = 0.0  # what is below a rounding counts as one
        return rows

    other = changed(run, tmp_path / "other", lose)
    found = compare(run, other)
    before, after = ({key(r): r for r in read_table(f, "records").to_pylist()} for f in (run, other))
    ratios: dict[str, list[float]] = {}
    unit = 2.0**-53
    for k, row in before.items():
        if row["status"] == after[k]["status"] == "solved" and row["error"] is not None:
            ratio = max(after[k]["error"], unit) / max(row["error"], unit)
            ratios.setdefault(row["backend"], []).append(ratio)
    for row in found["accuracy"]:
        own = ratios[row["backend"]]
        assert row["n"] == len(own) and row["worse"] == sum(r > 10 for r in own) and row["better"] == sum(r < 0.1 for r in own)
        assert row["median_log10_ratio"] == pytest.approx(median(np.log10(own)), abs=1e-12)
    assert found["accuracy"][0]["backend"] == "osqp" and found["worse"] == len(found["lost"]) > 10
    of = [row["error_after"] / row["error_before"] for row in found["lost"]]
    assert of == sorted(of, reverse=True) and min(of) > 10
    assert found["flips"] == 0


def test_what_one_side_lacks_is_counted(run: Path, tmp_path: Path) -> None:
    """A backend that did not run, problems left out: how many of each configuration, on which side."""

    def drop(rows: list[Row]) -> list[Row]:
        gone = {row["problem"] for row in rows[::7]}
        return [r for r in rows if r["backend"] != "casadi:ipqp" and not (r["backend"] == "osqp" and r["problem"] in gone)]

    other = changed(run, tmp_path / "other", drop)
    here, there = ({key(r) for r in read_table(f, "records").to_pylist()} for f in (run, other))
    found, back = compare(run, other), compare(other, run)
    assert sum(row["only_before"] for row in found["missing"]) == len(here - there) > 0
    assert all(row["only_after"] == 0 for row in found["missing"]) and found["joined"] == len(there)
    assert {row["backend"] for row in found["missing"]} == {"casadi:ipqp", "osqp"}
    assert [(r["only_before"], r["only_after"]) for r in back["missing"]] == [
        (r["only_after"], r["only_before"]) for r in found["missing"]
    ]
    assert {r["backend"]: r["after"] for r in found["versions"]}["casadi:ipqp"] is None


def test_versions_that_differ_are_told(run: Path, tmp_path: Path) -> None:
    """Library and engine of each backend, on both sides."""
    newer = changed(
        run, tmp_path / "o", lambda rows: [r | {"engine_version": "1.0"} if r["backend"] == "osqp" else r for r in rows]
    )
    rows = {row["backend"]: row for row in compare(run, newer)["versions"]}
    assert rows["osqp"] == {
        "backend": "osqp", "before": ["1.2.3, engine 0.9"], "after": ["1.2.3, engine 1.0"], "differ": True
    }  # fmt: skip
    assert not rows["qpsolvers:piqp"]["differ"]


def test_the_worst_of_several_records_counts(run: Path, tmp_path: Path) -> None:
    """A problem in two sets, or repeated, has several records of one key: the worst verdict and the largest error."""

    def repeat(rows: list[Row]) -> list[Row]:
        verified = [row for row in rows if row["verdict"] == "verified" and row["backend"] == "osqp"]
        return (
            rows
            + [r | {"repeat": 1, "verdict": "crashed", "status": "crashed", "error": None} for r in verified[:5]]
            + verified
        )

    other = changed(run, tmp_path / "other", repeat)
    found = compare(run, other)
    assert found["flips"] == found["fallen"] == 5 and found["missing"] == []
    assert [(row["n"], row["before"], row["after"]) for row in found["by_verdict"]] == [(5, "verified", "crashed")]
    assert found["worse"] == 0


# ---- time -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sizes", [(30, 40), (200, 200), (21, 1000)])
@pytest.mark.parametrize("factor", [1.0, 1.02, 1.3, 0.5])
def test_the_rank_test_is_scipys(sizes: tuple[int, int], factor: float) -> None:
    """Mann-Whitney U with ties, two-sided: the same p-value."""
    rng = np.random.default_rng(sizes)
    a, b = rng.integers(1, 50, sizes[0]), np.round(factor * rng.integers(1, 50, sizes[1]))
    right = stats.mannwhitneyu(b, a, method="asymptotic")
    _, ties = np.unique(np.concatenate([a, b]), return_counts=True)
    u = float(np.sum(b[:, None] > a) + 0.5 * np.sum(b[:, None] == a))
    assert u == right.statistic
    assert rank_test(u, len(a), len(b), float(np.sum(ties.astype(float) ** 3 - ties))) == pytest.approx(right.pvalue, rel=1e-9)


def test_times_that_are_all_equal_do_not_differ() -> None:
    """No variance, no difference."""
    assert rank_test(50.0, 10, 10, 20.0**3 - 20) == 1.0


def test_holm_is_scipys_up_to_its_name() -> None:
    """Sorted p-values times the number left, never falling, never above 1."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0] and holm([]) == []


def test_times_are_grouped_ranked_and_corrected(run: Path, tmp_path: Path) -> None:
    """Per configuration the p-value is scipy's on the times of what both sides solved, in steps of 0.14 %."""
    rng = np.random.default_rng(5)
    factors = {"osqp": 1.5, "qpsolvers:piqp": 0.5, "proxsuite:dense": 1.03, "casadi:ipqp": 1.0}

    def slow(rows: list[Row]) -> list[Row]:
        for row in rows:
            scale = factors.get(row["backend"], 3.0) * float(np.exp(rng.normal(0, 0.1)))
            row["solve_time"], row["build_time"] = row["solve_time"] * scale, row["build_time"] * scale
        return rows

    other = changed(run, tmp_path / "other", slow)
    found = compare(run, other)["time"]
    assert {row["backend"] for row in found} == set(factors)  # a closed form is timed by the stack: no test
    before, after = ({key(r): r for r in read_table(f, "records").to_pylist()} for f in (run, other))
    p = []
    for row in found:
        own = [
            (before[k], after[k]) for k in before
            if before[k]["status"] == after[k]["status"] == "solved"
            and all(before[k][name] == row[name] for name in ("backend", "formulation", "settings", "mode"))
        ]  # fmt: skip
        steps = [np.round(np.log2([r["build_time"] + r["solve_time"] for r in side]) * 512) for side in zip(*own, strict=True)]
        assert (row["n_before"], row["n_after"]) == (len(own), len(own))
        assert row["ratio"] == pytest.approx(2 ** ((lower(steps[1]) - lower(steps[0])) / 512), rel=1e-9)
        right = stats.mannwhitneyu(steps[1], steps[0], method="asymptotic").pvalue
        assert (row["p"] is None) == (len(own) < comparing.FEWEST)
        if row["p"] is not None:
            assert row["p"] == pytest.approx(right, rel=1e-6)
            p.append((row["p"], row["p_adjusted"]))
    assert [adjusted for _, adjusted in p] == pytest.approx(holm([raw for raw, _ in p]))
    said = {name: {row["says"] for row in found if row["backend"] == name and row["p"] is not None} for name in factors}
    assert said["osqp"] == {"slower"} and said["qpsolvers:piqp"] == {"faster"}
    assert said["proxsuite:dense"] == said["casadi:ipqp"] == {"noise"}


def lower(values: np.ndarray) -> float:
    """The lower median."""
    return float(np.sort(values)[(len(values) - 1) // 2])


def test_a_sure_difference_within_five_per_cent_is_noise() -> None:
    """A small p-value alone is no difference, nor is a large ratio without one."""
    says = comparing._says
    assert says(1e-30, 1.04) == says(1e-30, 0.96) == says(0.02, 3.0) == says(0.01, 3.0) == "noise"
    assert says(0.009, 1.06) == "slower" and says(0.009, 0.9) == "faster" and says(None, 9.0) == "too few"


# ---- the command ------------------------------------------------------------------------------------------------------------


def command(*words: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "sandbox.cli", "compare", *map(str, words)], capture_output=True, text=True, timeout=120
    )


def fall(rows: list[Row]) -> list[Row]:
    """One verified answer crashes."""
    one = next(row for row in rows if row["verdict"] == "verified")
    return [row | {"verdict": "crashed", "status": "crashed"} if row is one else row for row in rows]


def miss(rows: list[Row]) -> list[Row]:
    """One verified answer runs out of time: a new failure, no fall."""
    one = next(row for row in rows if row["verdict"] == "verified")
    return [row | {"verdict": "timed_out", "status": "timed_out"} if row is one else row for row in rows]


@pytest.mark.parametrize(("change", "status", "said"), [(fall, 1, "1 fell from verified"), (miss, 0, "1 are new failures")])
def test_the_exit_status_is_1_when_something_fell(
    run: Path, tmp_path: Path, change: Callable[[list[Row]], list[Row]], status: int, said: str
) -> None:
    """1 for verified to false success or crash, 0 for anything else; the table says what, JSON says the same."""
    other = changed(run, tmp_path / "other", change)
    done = command(run, other)
    assert (done.returncode, done.stderr) == (status, "") and said in done.stdout
    told = command(run, other, "--json")
    found = json.loads(told.stdout)
    assert told.returncode == status and found["flips"] == 1 and found["fallen"] == status
    assert command(other, run).returncode == 0


def test_what_is_no_run_is_refused(run: Path, tmp_path: Path) -> None:
    """A folder without run.json, a verdict that nobody knows: exit status 2 or an error that names the folders."""
    done = command(run, tmp_path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "is no run folder" in done.stderr
    strange = changed(run, tmp_path / "strange", lambda rows: [rows[0] | {"verdict": "splendid"}, *rows[1:]])
    with pytest.raises(InputFileError, match=r"strange cannot be compared: .*splendid"):
        compare(run, strange)


def test_runs_without_records_compare(run: Path, tmp_path: Path) -> None:
    """A run stopped before its first record lacks everything, and nothing fell."""
    (tmp_path / "empty").mkdir()
    shutil.copy(run / "run.json", tmp_path / "empty")
    found = compare(run, tmp_path / "empty")
    assert found["joined"] == found["fallen"] == 0 and found["after"]["records"] == 0
    assert sum(row["only_before"] for row in found["missing"]) > 1000
    assert compare(tmp_path / "empty", tmp_path / "empty")["time"] == []
