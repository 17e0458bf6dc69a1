"""Probabilities of the names of a finding: a conditional logit model (McFadden 1974) of what each name has for it.

A finding leaves some names open, and that none of them is right. With x the numbers that speak for one of them and w
the weights that all findings share,

    P(name) = (1 - lapse) exp(w . x) / sum over names of exp(w . x)  +  lapse / names

In a share of findings, the lapse, the numbers mislead: there each name is as likely as another. So no name is more
certain than names were right on recordings that the weights do not know.

The weights are found on recordings whose truth is known: they maximise the log likelihood less half their squared
distance from stated ones, in standard deviations. A finding that more than one name describes rightly counts with the
sum of their probabilities.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.special import logsumexp

from armlab.common.arrays import Array

Numbers = Mapping[str, float]  # of one name, by what they say
MAX_LAPSE = 0.3


@dataclass(frozen=True)
class Example:
    """A finding whose truth is known. names: numbers of each name; right: which of them describe it rightly."""

    names: tuple[Numbers, ...]
    right: tuple[bool, ...]


@dataclass(frozen=True)
class Weights:
    """What probabilities of names are computed from. numbers: the weight of each; lapse: a share of findings."""

    numbers: Numbers
    lapse: float = 0.0


def probabilities(names: Sequence[Numbers], weights: Weights) -> Array:
    """The probability of each name, (names,); numbers without a weight do not count."""
    known = weights.numbers
    utilities = np.array([sum(known.get(key, 0.0) * value for key, value in each.items()) for each in names])
    return with_lapse(np.exp(utilities - logsumexp(utilities)), weights.lapse)


def with_lapse(chances: Array, lapse: float) -> Array:
    """Probabilities (names,) where each name is as likely as another in a share of findings."""
    return np.asarray((1 - lapse) * chances + lapse / len(chances))


def fit_lapse(chances: Sequence[Array], rights: Sequence[Sequence[bool]]) -> float:
    """The likeliest lapse for probabilities of findings that their weights do not know.

    chances, rights: of each finding, (names,). Findings in which no name is right do not count; 0 without any other.
    """
    used = [(each, np.array(right)) for each, right in zip(chances, rights, strict=True) if any(right)]
    own = np.array([each[right].sum() for each, right in used])
    even = np.array([right.mean() for _, right in used])
    if not len(used):
        return 0.0

    def loss(lapse: float) -> float:
        return -float(np.sum(np.log((1 - lapse) * own + lapse * even)))

    return float(minimize_scalar(loss, bounds=(0.0, MAX_LAPSE), method="bounded").x)


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
