"""The experiment of section V: planar 3R, unit links, random q and unit velocities, every operation in float32.

A path carries it out: (q (B, 3) [rad], xdot (B, 2) [m/s]) -> (J, rates (2, B, 3), errors (2, B) evaluated in float32, and
in float64 [m/s]); of the two methods (2)-(5) comes first. Here are the samples, and what is counted over them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sandbox.claims.claim import Trial

Array = np.ndarray

Path = Callable[[Array, Array], tuple[Array, Array, Array, Array]]

SAMPLES = 10_000
"""Configurations of the paper's experiment."""

SEEDS, FEWER_SEEDS = 200, 20
"""How often it is repeated; the reduced size keeps the number of samples, for worst cases grow with it."""

SIZES = (100, 316, 1000, 3162, SAMPLES)
"""First so many samples, to see what grows with their number."""

LARGEST = 200
"""So many of the largest values of a seed are kept, for its tail."""

BINS = 10.0 ** np.arange(0, 3.01, 0.25)
"""Edges of cond(J); the last bin is open."""


def uniform(seed: int, k: int, count: int = SAMPLES) -> tuple[Array, Array]:
    """Sample k: q uniform in [-pi, pi]^3, xdot of unit norm in a uniform direction, rounded to float32."""
    rng = Trial(seed=seed).rng(f"single_precision {k}")
    q = rng.uniform(-np.pi, np.pi, (count, 3))
    return q.astype(np.float32), _direction(rng, count)


def near_singular(seed: int, count: int, decades: float = 3.3) -> tuple[Array, Array]:
    """The same at a distance 10^-decades to 1 rad from the stretched and folded arm: every decade of cond(J) alike."""
    rng = Trial(seed=seed).rng("single_precision near_singular")
    q = rng.uniform(-np.pi, np.pi, (count, 3))
    distance = 10.0 ** -rng.uniform(0, decades, count)
    q[:, 1:] = np.pi * rng.integers(0, 2, (count, 2)) + distance[:, None] * _direction(rng, count)
    return q.astype(np.float32), _direction(rng, count)


def _direction(rng: np.random.Generator, count: int) -> Array:
    angle = rng.uniform(-np.pi, np.pi, count)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1).astype(np.float32)


def condition(J: Array) -> Array:
    """cond2(J) (B,) of J (B, 2, 3), in double precision: (sigma_1^2 + sigma_2^2, sigma_1 sigma_2) from entries and minors."""
    a, b = J[:, 0].astype(np.float64), J[:, 1].astype(np.float64)
    product = np.linalg.norm(np.cross(a, b), axis=1)
    total = (a**2).sum(axis=1) + (b**2).sum(axis=1)
    largest = (total + np.sqrt(np.maximum(total**2 - 4 * product**2, 0))) / 2
    with np.errstate(divide="ignore"):
        return largest / product


@dataclass(frozen=True, eq=False)
class Summary:
    """Statistics of the errors of (2)-(5) and (6), one row a seed.

    mean, median, high, worst (S, 2) [m/s], high the 99th percentile; shares (S, 3) [%]: (2)-(5) worse, (6) worse, tied
    """

    mean: Array
    median: Array
    high: Array
    worst: Array
    shares: Array


@dataclass(frozen=True, eq=False)
class Study:
    """The experiment, once a seed (S).

    single, double : the errors evaluated in float32 and in float64
    digests : of rates and errors, equal where these agree bit for bit
    same : share of samples whose rates are the same in both methods [%]
    growing_mean, growing_worst (S, len(SIZES), 2) [m/s] : over the first so many samples, evaluated in float32 as is all below
    largest (S, 3, LARGEST) : the largest errors of (2)-(5), of (6), and values of cond(J)
    counts (S, len(BINS), 3) : samples in each bin of cond(J) where (2)-(5) is worse, (6) is worse, or neither
    lost : samples to which (2)-(5) gave no rates, J J' having no Cholesky factor: it is worse there, other statistics leave
        them out
    """

    single: Summary
    double: Summary
    digests: tuple[bytes, ...]
    same: Array
    growing_mean: Array
    growing_worst: Array
    largest: Array
    counts: Array
    lost: int

    def __len__(self) -> int:
        return len(self.digests)


def study(path: Path, trial: Trial) -> Study:
    """The experiment carried out by `path` over the seeds of a trial."""
    return _study(path, trial.seed, trial.of(SEEDS, FEWER_SEEDS))


@lru_cache(maxsize=8)
def _study(path: Path, seed: int, seeds: int) -> Study:
    rows = [_one(*path(*uniform(seed, k))) for k in range(seeds)]
    single, double = (Summary(*(np.array(part) for part in zip(*(row[i] for row in rows), strict=True))) for i in (0, 1))
    digests, *rest = zip(*(row[2:] for row in rows), strict=True)
    same, growing_mean, growing_worst, largest, counts, lost = (np.array(part) for part in rest)
    return Study(single, double, digests, same, growing_mean, growing_worst, largest, counts, int(lost.sum()))


def _one(J: Array, rates: Array, single: Array, double: Array) -> tuple:
    # zero has one sign here, and NaN one pattern
    blank = [np.where(np.isnan(part), np.nan, part + 0).astype(part.dtype).tobytes() for part in (J, rates, single, double)]
    given = np.isfinite(single).all(axis=0)
    single, double = (np.where(given, errors, np.inf).astype(np.float64) for errors in (single, double))
    first = [single[:, :size][:, given[:size]] for size in SIZES]
    cond = condition(J)
    largest = np.sort([*np.where(given, single, 0), cond], axis=1)[:, : -LARGEST - 1 : -1]
    which = np.searchsorted(BINS, cond, side="right") - 1
    counts = np.stack([np.bincount(which[won], minlength=len(BINS)) for won in _outcomes(single, given)], axis=-1)
    return (
        _summary(single, given), _summary(double, given), hashlib.sha256(b"".join(blank)).digest(),
        100 * (rates[0] == rates[1]).all(axis=-1).mean(),
        [part.mean(axis=1) for part in first], [part.max(axis=1) for part in first],
        largest, counts, (~given).sum(),
    )  # fmt: skip


def _outcomes(errors: Array, given: Array) -> tuple[Array, Array, Array]:
    return (errors[0] > errors[1]) | ~given, errors[0] < errors[1], (errors[0] == errors[1]) & given


def _summary(errors: Array, given: Array) -> tuple[Array, Array, Array, Array, Array]:
    shares = np.array([100 * won.mean() for won in _outcomes(errors, given)])
    errors = errors[:, given]
    return errors.mean(axis=1), np.median(errors, axis=1), np.quantile(errors, 0.99, axis=1), errors.max(axis=1), shares


def pooled_largest(study: Study, i: int) -> tuple[Array, Array]:
    """The largest values of all seeds, descending (half of what was kept), and the share of samples at least as large."""
    values = np.sort(study.largest[:, i].ravel())[::-1][: len(study) * LARGEST // 2]
    return values, np.arange(1, len(values) + 1) / (len(study) * SAMPLES)


def tail_index(values: Array) -> float:
    """Exponent s, where the share of values above x falls as x^-s; from the largest values, descending (Hill 1975).

    A mean is finite for s > 1 only, and the worst of N samples grows as N^(1/s).
    """
    return float(1 / np.log(values[:-1] / values[-1]).mean())
