"""The first population and the random stream of a trial."""

import numpy as np

from algorithms.contract import Box
from armlab.common.arrays import Array
from armlab.common.streams import named_generator


def first_population(seed: int, problem: str, repetition: int, swarm_size: int, box: Box) -> Array:
    """Uniform points (swarm_size, d), the same for every algorithm, so that their results are paired.

    A larger swarm begins with the points of a smaller one.
    """
    rng = named_generator("first population", seed, problem, repetition)
    return box.lower + rng.random((swarm_size, len(box.lower))) * (box.upper - box.lower)


def own_stream(seed: int, problem: str, algorithm: str, params: str, repetition: int) -> np.random.Generator:
    """The generator of one algorithm in one repetition; params: their canonical text."""
    return named_generator("algorithm", seed, problem, algorithm, params, repetition)
