"""Random streams that are derived from names, never from the order of work or the number of workers."""

import hashlib
import json

import numpy as np

from algorithms.contract import Box
from armlab.common.arrays import Array


def named_generator(*names: str | int) -> np.random.Generator:
    """A PCG64 generator whose seed is the SHA-256 of the names; other names give an independent stream."""
    digest = hashlib.sha256(json.dumps(names).encode()).digest()
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(int.from_bytes(digest, "big"))))


def first_population(seed: int, problem: str, repetition: int, swarm_size: int, box: Box) -> Array:
    """Uniform points (swarm_size, d), the same for every algorithm, so that their results are paired.

    A larger swarm begins with the points of a smaller one.
    """
    rng = named_generator("first population", seed, problem, repetition)
    return box.lower + rng.random((swarm_size, len(box.lower))) * (box.upper - box.lower)


def own_stream(seed: int, problem: str, algorithm: str, params: str, repetition: int) -> np.random.Generator:
    """The generator of one algorithm in one repetition; params: their canonical text."""
    return named_generator("algorithm", seed, problem, algorithm, params, repetition)
