"""What a sample of points says of a landscape: feasible share, correlation of fitness and distance, and ruggedness.

Points are in coordinates from -1 to 1 over the box. Fitness is log10 of what a search minimises, penalties included:
that is the landscape which an algorithm without derivatives sees. Own code, since the package for it, pflacco 1.2.2,
wants numpy below 1.25 and scipy below 1.11; a test compares the information content with its values.
"""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from problem.excitation import ExcitationProblem

_BATCH = 500  # points that are in memory at a time


@dataclass(frozen=True)
class SamplingSettings:
    """points: of the feasible share. distances: of the correlation of fitness and distance. walks, steps: of the walks.

    step: standard deviation of a step of a walk in each coordinate, in halves of the box.
    """

    points: int = 20_000
    distances: int = 2_000
    walks: int = 8
    steps: int = 200
    step: float = 0.05


def in_box(problem: ExcitationProblem, shares: Array) -> Array:
    """Points (n, dimension) of the box from coordinates from -1 to 1."""
    return np.asarray(problem.lower + (shares + 1) / 2 * (problem.upper - problem.lower))


def in_shares(problem: ExcitationProblem, points: Array) -> Array:
    """Coordinates from -1 to 1 of points (..., dimension) of the box."""
    return np.asarray(2 * (points - problem.lower) / (problem.upper - problem.lower) - 1)


def feasible_share(problem: ExcitationProblem, points: int, rng: np.random.Generator) -> float:
    """Share of uniform points of the box that keep every limit at the samples."""
    kept = 0
    for first in range(0, points, _BATCH):
        shares = rng.uniform(-1, 1, (min(_BATCH, points - first), len(problem.lower)))
        motions = problem.trajectory.motions(in_box(problem, shares), problem.times)
        kept += int((problem.constraints.violation(motions) == 0).sum())
    return kept / points


def log_fitness(problem: ExcitationProblem, shares: Array) -> Array:
    """log10 of the fitness (n,) of points (n, dimension)."""
    parts = [
        problem.evaluate(in_box(problem, part)).fitness for part in np.array_split(shares, len(shares) // _BATCH + 1)
    ]
    return np.log10(np.concatenate(parts))


def distance_correlation(fitness: Array, shares: Array, best: Array) -> float:
    """Pearson's correlation of fitness (n,) with the distance to the best point (Jones and Forrest 1995).

    1: a straight slope to the best; 0: distance says nothing; below 0: the slope leads away. NaN where all are equal.
    """
    distances = np.linalg.norm(shares - best, axis=1)
    if np.ptp(fitness) == 0 or np.ptp(distances) == 0:
        return float("nan")
    return float(np.corrcoef(fitness, distances)[0, 1])


def random_walk(dimension: int, steps: int, step: float, rng: np.random.Generator) -> Array:
    """A walk (steps + 1, dimension) of normal steps from a uniform point, reflected at the walls of the box."""
    free = rng.uniform(-1, 1, dimension) + np.vstack(
        [np.zeros(dimension), rng.normal(scale=step, size=(steps, dimension)).cumsum(axis=0)]
    )
    return np.asarray(1 - np.abs((free + 1) % 4 - 2))


def walk_correlation(fitness: Array) -> float:
    """Correlation of neighbours on walks (walks, steps + 1) (Weinberger 1990): near 1 smooth, near 0 rugged.

    Mean and variance are those of all walks. NaN where all values are equal.
    """
    centred = fitness - fitness.mean()
    variance = float((centred**2).mean())
    return float((centred[:, 1:] * centred[:, :-1]).mean() / variance) if variance > 0 else float("nan")


def information_content(fitness: Array, distances: Array) -> float:
    """The largest entropy of changes of slope on a walk (Munoz, Kirley and Halgamuge 2015, eq. 5).

    fitness: (n + 1,); distances: (n,), the lengths of the steps. A slope counts as 0 below a threshold e; H(e) is the
    entropy, to the base 6, of neighbouring signs that differ. 0: no change; 1: every change is as frequent.
    """
    slopes = np.diff(fitness) / distances
    return float(max(_entropy(slopes, each) for each in (0.0, *np.unique(np.abs(slopes)))))


def _entropy(slopes: Array, threshold: float) -> float:
    signs = np.where(np.abs(slopes) <= threshold, 0, np.sign(slopes)).astype(int)
    pairs = 3 * (signs[:-1] + 1) + signs[1:] + 1
    shares = np.bincount(pairs, minlength=9) / len(pairs)
    shares = shares[[1, 2, 3, 5, 6, 7]]  # the pairs that differ
    shares = shares[shares > 0]
    return float(-(shares * np.log(shares)).sum() / np.log(6))


@dataclass(frozen=True)
class Ruggedness:
    """walk_correlation: of all walks. information: mean information content of a walk."""

    walk_correlation: float
    information: float


def measure_ruggedness(problem: ExcitationProblem, settings: SamplingSettings, rng: np.random.Generator) -> Ruggedness:
    """Walks through the box from random points."""
    dimension = len(problem.lower)
    walks = [random_walk(dimension, settings.steps, settings.step, rng) for _ in range(settings.walks)]
    fitness = np.array([log_fitness(problem, walk) for walk in walks])
    lengths = [np.linalg.norm(np.diff(walk, axis=0), axis=1) for walk in walks]
    contents = [information_content(values, each) for values, each in zip(fitness, lengths, strict=True)]
    return Ruggedness(walk_correlation(fitness), float(np.mean(contents)))
