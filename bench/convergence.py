"""Average convergence of each algorithm: the best so far, and the algorithm's own present best."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from algorithms.contract import Array
from bench.outcome import Curves
from bench.plan import Entry
from bench.statistics import is_feasible
from bench.store import RunStore


def convergence_table(entries: Sequence[Entry], store: RunStore) -> pd.DataFrame:
    """One row an algorithm and iteration; iteration 0 is the first population.

    best_so_far, present_best: averages over the repetitions whose point is feasible at that time, NaN without
    any; the two shares say how many those are.
    """
    labels = dict.fromkeys(entry.algorithm for entry in entries)
    return pd.concat(
        [
            _average(label, [store.get(entry.key).curves for entry in entries if entry.algorithm == label])
            for label in labels
        ],
        ignore_index=True,
    )


def _average(label: str, curves: Sequence[Curves]) -> pd.DataFrame:
    moments = np.unique(np.concatenate([curve.evaluations for curve in curves]))
    best, best_share = _feasible_mean(
        _at(moments, curves, [curve.best_value for curve in curves]),
        _at(moments, curves, [curve.best_violation for curve in curves]),
    )
    present, present_share = _feasible_mean(
        _at(moments, curves, [curve.present_value for curve in curves]),
        _at(moments, curves, [curve.present_violation for curve in curves]),
    )
    return pd.DataFrame(
        {
            "algorithm": label,
            "iteration": np.arange(len(moments)),
            "evaluations": moments,
            "best_so_far": best,
            "best_so_far_feasible_share": best_share,
            "present_best": present,
            "present_best_feasible_share": present_share,
        }
    )


def _at(moments: Array, curves: Sequence[Curves], rows: Sequence[Array]) -> Array:
    """Rows below each other at common numbers of evaluations (n, moments): populations need not be of one size.

    Before its first population a run has the figure of that; after its end it stays where it ended.
    """
    places = [np.searchsorted(curve.evaluations, moments, side="right") - 1 for curve in curves]
    return np.stack([row[np.maximum(place, 0)] for row, place in zip(rows, places, strict=True)])


def _feasible_mean(values: Array, violations: Array) -> tuple[Array, Array]:
    """Averages over the feasible entries of each column (n, k) and the shares of those."""
    feasible = is_feasible(values, violations)
    count = feasible.sum(axis=0)
    total = np.where(feasible, values, 0.0).sum(axis=0)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return mean, count / len(values)
