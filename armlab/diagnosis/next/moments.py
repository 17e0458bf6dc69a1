"""Sufficient statistics of a fit: Gram matrices of whitened columns that add from run to run, least squares from
them, and draws from the posterior of the coefficients.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate

RELATIVE_RIDGE = 1e-9  # of a column's squared length, so that dependent columns do not stop a fit
ROUNDING_SHARE = 1e-6  # of a column's squared length: a smaller remainder is rounding
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class DesignMoments:
    """gram: (columns, columns), of whitened rows. vector: (columns,), with the whitened torque."""

    gram: Array
    vector: Array

    def select(self, kept: Index) -> "DesignMoments":
        """The moments of the `kept` columns alone."""
        return DesignMoments(self.gram[np.ix_(kept, kept)], self.vector[kept])

    def __add__(self, other: "DesignMoments") -> "DesignMoments":
        """Moments of both sets of rows, for one set of coefficients."""
        return DesignMoments(self.gram + other.gram, self.vector + other.vector)


def empty_moments(columns: int) -> DesignMoments:
    """Moments of no rows."""
    return DesignMoments(np.zeros((columns, columns)), np.zeros(columns))


def solve_least_squares(gram: Array, chosen: Index, right: Array) -> Array:
    """Coefficients of the chosen columns for right-hand sides (columns, ...): least squares, slightly damped.

    A column of zeros, of a law that the motion never excites, has the coefficient zero.
    """
    part = gram[np.ix_(chosen, chosen)]
    lengths = np.sqrt(np.where(np.diag(part) > 0, np.diag(part), np.inf))
    scaled = part / np.outer(lengths, lengths) + RELATIVE_RIDGE * np.eye(len(chosen))
    turned = right[chosen] / (lengths if right.ndim == 1 else lengths[:, None])
    values = np.linalg.solve(scaled, turned)
    return np.asarray(values / (lengths if right.ndim == 1 else lengths[:, None]))


def unexplained_power(gram: Array, own: Index, values: Array, fitted: Index) -> float:
    """Squared length of own columns times values that the fitted columns cannot explain, in standard errors squared."""
    if not len(fitted):
        return float(values @ gram[np.ix_(own, own)] @ values)
    signal = gram[:, own] @ values
    best = solve_least_squares(gram, fitted, signal)
    return max(float(values @ signal[own] - best @ signal[fitted]), 0.0)


def count_independent(gram: Array, own: Index, fitted: Index) -> int:
    """Number of own columns that are independent of the fitted ones and of each other."""
    lengths = np.sqrt(np.maximum(np.diag(gram)[own], 1e-300))
    part = gram[np.ix_(own, own)]
    if len(fitted):
        part = part - gram[np.ix_(own, fitted)] @ solve_least_squares(gram, fitted, gram[:, own])
    return int(np.sum(np.linalg.eigvalsh(part / np.outer(lengths, lengths)) > ROUNDING_SHARE))


MIN_RELATIVE_EIGENVALUE = 1e-6  # of the largest eigenvalue: directions that are known less well are left as they are
DRAWS_PER_SAMPLE = 20  # draws for each one that is wanted


def draw_coefficients(
    seen: DesignMoments, free: Index, own: Index, candidate: Candidate, count: int, rng: np.random.Generator
) -> tuple[Index, Array]:
    """Indices of the free columns and a law's own, and draws from the posterior of their coefficients.

    seen: moments of the recording, with the prior. own: the columns of `candidate`. Returns (indices,) and
    (indices, draws) with at most `count` draws. A draw that physics refuses is left out, so there may be none.
    """
    chosen = np.append(free, own)
    gram = seen.gram.copy()
    gram[own, own] += 1 / candidate.prior_scale(None) ** 2
    mean = solve_least_squares(gram, chosen, seen.vector)
    part = gram[np.ix_(chosen, chosen)]
    lengths = np.sqrt(np.maximum(np.diag(part), 1e-300))
    values, axes = np.linalg.eigh(part / np.outer(lengths, lengths))
    spread = np.where(values > MIN_RELATIVE_EIGENVALUE * values[-1], 1 / np.sqrt(np.maximum(values, 1e-300)), 0.0)
    drawn = (
        mean[:, None] + (axes * spread) @ rng.normal(size=(len(chosen), DRAWS_PER_SAMPLE * count)) / lengths[:, None]
    )
    allowed = [each for each in drawn.T if _is_possible(candidate, each[len(free) :])][:count]
    return chosen, np.array(allowed).T if allowed else np.empty((len(chosen), 0))


def _is_possible(candidate: Candidate, values: Array) -> bool:
    return candidate.objection(values) is None and candidate.absurdity(values) is None
