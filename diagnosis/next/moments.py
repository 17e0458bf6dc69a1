"""What runs say about everything that is fitted: products of whitened columns, which add from run to run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings.run import Array

RIDGE = 1e-9  # of a column's squared length: columns that hold each other do not stop a fit
ROUNDING = 1e-6  # of a squared length: what less of it is left is not seen
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Moments:
    """gram: (columns, columns), of whitened rows. vector: (columns,), with the whitened torque."""

    gram: Array
    vector: Array

    def __add__(self, other: "Moments") -> "Moments":
        """Both, with one set of coefficients."""
        return Moments(self.gram + other.gram, self.vector + other.vector)


def no_run(columns: int) -> Moments:
    """Nothing recorded."""
    return Moments(np.zeros((columns, columns)), np.zeros(columns))


def solved(gram: Array, chosen: Index, right: Array) -> Array:
    """Coefficients of the chosen columns for right-hand sides (columns, ...): least squares, slightly damped.

    What a motion never shows, torque below zero say, has none: its column is zero.
    """
    part = gram[np.ix_(chosen, chosen)]
    lengths = np.sqrt(np.where(np.diag(part) > 0, np.diag(part), np.inf))
    scaled = part / np.outer(lengths, lengths) + RIDGE * np.eye(len(chosen))
    turned = right[chosen] / (lengths if right.ndim == 1 else lengths[:, None])
    values = np.linalg.solve(scaled, turned)
    return np.asarray(values / (lengths if right.ndim == 1 else lengths[:, None]))


def left_over(gram: Array, own: Index, values: Array, fitted: Index) -> float:
    """Squared length of own columns times values that the fitted columns cannot explain, in standard errors squared."""
    if not len(fitted):
        return float(values @ gram[np.ix_(own, own)] @ values)
    signal = gram[:, own] @ values
    best = solved(gram, fitted, signal)
    return max(float(values @ signal[own] - best @ signal[fitted]), 0.0)


def independent(gram: Array, own: Index, fitted: Index) -> int:
    """How many of the own columns add something that the fitted ones do not hold."""
    lengths = np.sqrt(np.maximum(np.diag(gram)[own], 1e-300))
    part = gram[np.ix_(own, own)]
    if len(fitted):
        part = part - gram[np.ix_(own, fitted)] @ solved(gram, fitted, gram[:, own])
    return int(np.sum(np.linalg.eigvalsh(part / np.outer(lengths, lengths)) > ROUNDING))
