"""How long until a target is reached: running times, expected running time, and their distribution (COCO).

Hansen, Auger, Brockhoff, Tušar, Tušar 2016, arXiv 1605.03560. Runs are known population by population: a running time
is that of the first population whose best point reaches the target, so it is late by less than one population.
"""

from dataclasses import dataclass

import numpy as np

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


def share_reached(times: Array, evaluations: Array) -> Array:
    """The share of all times, of whatever runs, problems and targets, within each number of evaluations (k,)."""
    ordered = np.sort(times, axis=None)
    return np.asarray(np.searchsorted(ordered, evaluations, side="right") / ordered.size)
