"""Probabilities of the names of a finding: a conditional logit model (McFadden 1974) of what each name has for it.

A finding leaves some names open, and that none of them is right. With x the numbers that speak for one of them and w
the weights that all findings share,

    P(name) = exp(w . x) / sum over names of exp(w . x)

The weights are found on recordings whose truth is known, by the most likely ones less half their squared distance from
stated ones. A finding that more than one name describes rightly counts with the sum of their probabilities.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

from armlab.common.arrays import Array

Numbers = Mapping[str, float]  # of one name, by what they say


@dataclass(frozen=True)
class Example:
    """A finding whose truth is known. names: numbers of each name; right: which of them describe it rightly."""

    names: tuple[Numbers, ...]
    right: tuple[bool, ...]


def probabilities(names: Sequence[Numbers], weights: Numbers) -> Array:
    """The probability of each name, (names,); numbers without a weight do not count."""
    utilities = np.array([sum(weights.get(key, 0.0) * value for key, value in each.items()) for each in names])
    return np.asarray(np.exp(utilities - logsumexp(utilities)))


def fit_weights(examples: Sequence[Example], stated: Numbers, spread: Numbers) -> dict[str, float]:
    """The weights that make what is right likely, near the stated ones.

    spread: how far each may be from it, a standard deviation. Examples in which no name is right do not count.
    """
    keys = tuple(stated)
    centre, scale = (np.array([numbers[key] for key in keys]) for numbers in (stated, spread))
    used = [each for each in examples if any(each.right)]
    table = np.array([[own.get(key, 0.0) for key in keys] for each in used for own in each.names])
    right = np.array([own for each in used for own in each.right])
    counts = np.array([len(each.names) for each in used])
    starts = np.cumsum(counts) - counts

    def shares(utilities: Array) -> tuple[Array, Array]:
        """Probability of each name in its finding, and the logarithm of the sum behind it."""
        largest = np.repeat(np.maximum.reduceat(utilities, starts), counts)
        weights = np.exp(utilities - largest)
        sums = np.add.reduceat(weights, starts)
        return weights / np.repeat(sums, counts), np.log(sums) + largest[starts]

    def loss(moved: Array) -> tuple[float, Array]:
        utilities = table @ (centre + scale * moved)
        chances, whole = shares(utilities)
        right_chances, true = shares(np.where(right, utilities, -np.inf))
        slope = (chances - right_chances) @ table
        return 0.5 * float(moved @ moved) + float(np.sum(whole - true)), moved + scale * slope

    found = minimize(loss, np.zeros(len(keys)), jac=True, method="L-BFGS-B")
    return {key: float(value) for key, value in zip(keys, centre + scale * found.x, strict=True)}
