"""Measured properties of an algorithm: its path on a problem that is moved or scaled, its ends on pure noise.

All runs have 50 points, 30 iterations (1,550 evaluations) and default parameters.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from algorithms.contract import AnyAlgorithm, Box, uniform_points
from algorithms.driver import iterate, minimise, planned_iterations
from armlab.common.arrays import Array

SWARM_SIZE, DIMENSIONS, EVALUATIONS = 50, 15, 1550
REFERENCE_BOX = Box(np.full(DIMENSIONS, -1.0), np.full(DIMENSIONS, 3.0))  # the origin inside, not in the centre
UNIT_BOX = Box(np.zeros(DIMENSIONS), np.ones(DIMENSIONS))


@dataclass(frozen=True)
class Properties:
    """translation, scale: largest deviation of a coordinate on the path, in fractions of the box width.

    noise_p_value: of the Kolmogorov-Smirnov test that best points on pure noise are uniform in the box.
    noise_share_on_bounds: share of the coordinates of these points that lie on a bound.
    """

    translation: float
    scale: float
    noise_p_value: float
    noise_share_on_bounds: float


def measure_properties(
    algorithm: AnyAlgorithm, repetitions: int = 40, seed: int = 0, bounds: str = "clip"
) -> Properties:
    """All properties of an algorithm, from two runs a path and so many repetitions on noise."""
    best = best_points_on_noise(algorithm, repetitions, seed, bounds)
    return Properties(
        translation=path_deviation(algorithm, offset=5.0, factor=1.0, seed=seed, bounds=bounds),
        scale=path_deviation(algorithm, offset=0.0, factor=16.0, seed=seed, bounds=bounds),
        noise_p_value=float(stats.kstest(best.ravel(), "uniform").pvalue),
        noise_share_on_bounds=float(np.mean((best == 0.0) | (best == 1.0))),
    )


def path_deviation(algorithm: AnyAlgorithm, offset: float, factor: float, seed: int, bounds: str) -> float:
    """Largest deviation of the path after x -> factor * x + offset of box, population and objective."""
    here = evaluated_points(algorithm, 1.0, 0.0, seed, bounds)
    there = evaluated_points(algorithm, factor, offset, seed, bounds)
    width = REFERENCE_BOX.upper - REFERENCE_BOX.lower
    return float(np.abs(((there - offset) / factor - here) / width).max())


def evaluated_points(algorithm: AnyAlgorithm, factor: float, offset: float, seed: int, bounds: str) -> Array:
    """All evaluated points (1550, d) on a bowl that lies at 0.7 of the reference coordinates."""
    box = Box(*(factor * bound + offset for bound in REFERENCE_BOX))
    weights = np.arange(1.0, DIMENSIONS + 1.0)

    def bowl(X: Array) -> Array:
        fitness: Array = (weights * np.square((X - offset) / factor - 0.7)).sum(axis=1)
        return fitness

    population = factor * uniform_points(SWARM_SIZE, REFERENCE_BOX, np.random.default_rng(seed)) + offset
    horizon = planned_iterations(EVALUATIONS, SWARM_SIZE)
    state = algorithm.init(algorithm.Params(), population, box, horizon, np.random.default_rng(seed + 1))
    batches = iterate(algorithm, state, bowl, box, EVALUATIONS, bounds)
    return np.concatenate([batch.X for batch in batches])


def best_points_on_noise(algorithm: AnyAlgorithm, repetitions: int, seed: int, bounds: str) -> Array:
    """The best point of each run on an objective of pure noise in [0, 1]^d, (repetitions, d)."""
    runs = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(repetitions))
    return np.array([_best_point_on_noise(algorithm, rng, bounds) for rng in runs])


def _best_point_on_noise(algorithm: AnyAlgorithm, rng: np.random.Generator, bounds: str) -> Array:
    noise, own = rng.spawn(2)
    population = uniform_points(SWARM_SIZE, UNIT_BOX, rng)

    def objective(X: Array) -> Array:
        return noise.random(len(X))

    params = algorithm.Params()
    return minimise(algorithm, params, objective, UNIT_BOX, population, EVALUATIONS, own, bounds).best_x
