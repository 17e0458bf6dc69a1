"""How long until a target is reached: running times, expected running time, and their distribution (COCO).

Hansen, Auger, Brockhoff, Tušar, Tušar 2016, arXiv 1605.03560. Runs are known population by population: a running time
is that of the first population whose best point reaches the target, so it is late by less than one population.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import Array


@dataclass(frozen=True, eq=False)
class Run:
    """Best value so far (k,), infinite while nothing feasible is found, after so many evaluations (k,)."""

    evaluations: Array
    best: Array


def targets_between(easy: float, hard: float, count: int = 51) -> Array:
    """Targets (count,) from easy to hard, evenly spaced in the logarithm; both positive."""
    return np.asarray(np.geomspace(easy, hard, count))


def running_times(run: Run, targets: Array) -> Array:
    """Evaluations until each target is reached (targets,), infinite for those that never are."""
    reached = run.best[:, None] <= targets[None, :]
    first = reached.argmax(axis=0)
    return np.where(reached.any(axis=0), run.evaluations[first], np.inf)


def expected_running_time(times: Array, spent: Array) -> Array:
    """Evaluations until a target is reached if a failed run is followed by another, (targets,).

    times: (runs, targets), infinite for failures. spent: evaluations of each run (runs,). Infinite without a success.
    """
    success = np.isfinite(times)
    used = np.where(success, times, spent[:, None]).sum(axis=0)
    count = success.sum(axis=0)
    return np.asarray(np.divide(used, count, out=np.full(len(count), np.inf), where=count > 0))


@dataclass(frozen=True, eq=False)
class Hits:
    """Running times of many runs and targets, condensed: as short for a thousand runs as for ten.

    times: the finite ones in ascending order, each once (k,); counts: how many are no later (k,); of: all of them.
    """

    times: Array
    counts: NDArray[np.intp]
    of: int


def hits(times: Array) -> Hits:
    """Condensed running times, of any shape."""
    once, counts = np.unique(times[np.isfinite(times)], return_counts=True)
    return Hits(once, counts.cumsum(), times.size)


def share_reached(found: Sequence[Hits], evaluations: Array) -> Array:
    """The share of all times, of whatever runs, problems and targets, within each number of evaluations (k,)."""
    reached = [np.append(0, one.counts)[np.searchsorted(one.times, evaluations, side="right")] for one in found]
    return np.asarray(np.sum(reached, axis=0) / sum(one.of for one in found))
