"""The memory that a trial needs, estimated before any trial starts."""

import os

from armlab.common.errors import InputError
from problem.contract import Problem
from problem.registry import ProblemSettings

MAX_COUNT = 1_000_000  # of a problem's whole-number settings: samples, harmonics, dimensions
BYTES_PER_NUMBER = 8
COPIES_OF_POPULATION = 8  # position, velocity, acceleration and their intermediate results
COPIES_OF_HISTORY = 4  # points of all batches, and the same in one array


def check_counts(settings: ProblemSettings, where: str) -> None:
    """Raises InputError for a whole number in a problem's settings that no machine has memory for."""
    for key, value in settings:
        if isinstance(value, int) and not key.endswith("seed") and value > MAX_COUNT:
            raise InputError(f"'{key}' in {where}: should be at most {MAX_COUNT}, not {_shorten(value)}")


def check_memory(problem: Problem, swarm_size: int, evaluations: int, where: str) -> None:
    """Raises InputError where a trial would need more memory than the machine has.

    Counted are the population with its motions, if the problem has any, and the history of all evaluated points.
    """
    dimension = len(problem.lower)
    inner = getattr(problem, "problem", problem)
    motion = getattr(inner, "samples", 0) * len(getattr(inner, "arm", ()))
    numbers = COPIES_OF_POPULATION * swarm_size * (dimension + motion) + COPIES_OF_HISTORY * evaluations * dimension
    needed, present = BYTES_PER_NUMBER * numbers, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > present:
        raise InputError(
            f"{where}: a trial with swarm_size {_shorten(swarm_size)} and {_shorten(evaluations)} evaluations needs "
            f"{_shorten(needed // 10**9)} GB of memory, this machine has {present / 1e9:.0f} GB"
        )


def _shorten(value: int) -> str:
    """A whole number, as a power of ten where it has too many digits to read."""
    return str(value) if value < 10**12 else f"about 10^{len(str(value)) - 1}"
