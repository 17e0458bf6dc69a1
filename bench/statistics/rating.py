"""Ratings of algorithms from paired runs, with intervals, for a fixed budget or a fixed target.

Each repetition of each problem is a game between every two algorithms: the smaller loss wins, a tie counts half. The
strengths p are those of Bradley and Terry 1952,

    chance that i wins against j = p_i / (p_i + p_j),   rating = 1500 + 400 log10 p

found by the minorisation of Hunter 2004. IOHanalyzer rates by Glicko-2, whose numbers depend on the order in which
games are drawn, and whose deviation shrinks with the number of games that are drawn from the same runs. Here all games
count at once, and the interval is that of the runs: a percentile bootstrap over the repetitions of each problem.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.streams import named_generator

MEAN_RATING = 1500.0  # as Glicko's
POINTS_PER_DECADE = 400.0  # of strength, as Elo's
DRAWN_GAMES = 1.0  # added to each pair, so that one that always wins has a finite rating
RESAMPLES = 1000
_ROUNDS = 300  # of the minorisation


@dataclass(frozen=True)
class Rating:
    """A rating and its 95 % interval."""

    value: float
    low: float
    high: float


def rate_algorithms(losses: Sequence[pd.DataFrame]) -> dict[str, Rating]:
    """Ratings over problems, each of the same weight; best first.

    losses: of each problem, a row a repetition and a column an algorithm; infinite where nothing was found. A
    repetition that an algorithm lacks (NaN) is left out.
    """
    names = [str(name) for name in losses[0].columns]
    games = [_paired_wins(each.dropna().to_numpy(dtype=np.float64)) for each in losses]
    games = [each for each in games if len(each)]
    if not games:
        return {}
    found = _ratings(_shares(games, [np.full((1, len(each)), 1 / len(each)) for each in games]))[0]
    rng = named_generator("rating")
    weights = [rng.multinomial(len(each), np.full(len(each), 1 / len(each)), RESAMPLES) / len(each) for each in games]
    low, high = np.percentile(_ratings(_shares(games, weights)), [2.5, 97.5], axis=0)
    order = np.argsort(-found, kind="stable")
    return {names[k]: Rating(float(found[k]), float(low[k]), float(high[k])) for k in order.tolist()}


def _paired_wins(losses: Array) -> Array:
    """1 where the first algorithm of a pair wins a repetition, 1/2 where it ties, (repetitions, algorithms ** 2)."""
    one, other = losses[:, :, None], losses[:, None, :]
    return np.asarray((one < other) + (one == other) / 2, dtype=np.float64).reshape(len(losses), -1)


def _shares(games: Sequence[Array], weights: Sequence[Array]) -> Array:
    """Shares of wins (draws, algorithms, algorithms) for weights (draws, repetitions) of each problem's games."""
    total = sum(map(len, games))
    mean = np.mean([weight @ each for weight, each in zip(weights, games, strict=True)], axis=0)
    count = round(np.sqrt(mean.shape[1]))
    return np.asarray((total * mean + DRAWN_GAMES / 2) / (total + DRAWN_GAMES)).reshape(-1, count, count)


def _ratings(shares: Array) -> Array:
    """Ratings (draws, algorithms) of shares of wins (draws, algorithms, algorithms)."""
    count = shares.shape[1]
    others = 1.0 - np.eye(count)
    wins, strengths = (shares * others).sum(axis=2), np.ones(shares.shape[:2])
    for _ in range(_ROUNDS):
        met = (others / (strengths[:, :, None] + strengths[:, None, :])).sum(axis=2)
        strengths = wins / np.maximum(met, np.finfo(float).tiny)
        strengths /= np.exp(np.log(strengths).mean(axis=1, keepdims=True))
    return np.asarray(MEAN_RATING + POINTS_PER_DECADE * np.log10(strengths))
