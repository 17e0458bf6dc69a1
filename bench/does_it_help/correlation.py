"""Rank correlations between what a criterion promises and what identification gives."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import rankdata

from bench.does_it_help.identification import KINDS
from bench.does_it_help.judgement import CRITERIA, ERRORS, HALVES
from bench.seeds import named_generator
from problem.transforms import Array

RESAMPLES = 1000
LEVEL = 0.95
SUBSETS = MappingProxyType({"all": "all trajectories", "better_half": "the better half of the trajectories"})


def correlations(frame: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Spearman's correlation of each criterion with each error, with a bootstrap interval of 95 %.

    frame: one row a trajectory, as `judged` makes it. Whole groups are drawn again, since the trajectories of
    one search are alike. Returns columns subset, noise, error, criterion, correlation, low, high, trajectories.
    """
    return pd.concat([_of_subset(name, rows, seed) for name, rows in subsets(frame).items()], ignore_index=True)


def subsets(frame: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """All trajectories, and the half of them with the smaller condition numbers."""
    return dict(zip(SUBSETS, (frame, frame[frame["cond"] <= frame["cond"].median()]), strict=True))


def ceiling_of(frame: pd.DataFrame, kind: str, error: str) -> float:
    """About the correlation with an error that a perfect criterion would have, given the error's own noise.

    From the correlation r of two halves of the repetitions: 2 r / (1 + r) for all of them (Spearman and Brown
    1910), and its root for the attenuation by one noisy side. 0 where the halves do not agree at all.
    """
    halves = (frame[[f"{kind}_{error}_{half}"]].to_numpy() for half in HALVES)
    agreement = max(float(spearman(*halves)[0, 0]), 0.0)
    return float(np.sqrt(2 * agreement / (1 + agreement)))


def spearman(criteria: Array, errors: Array) -> Array:
    """Spearman's correlations (c, e) between columns of criteria (n, c) and of errors (n, e)."""
    one, other = (_standard_ranks(values) for values in (criteria, errors))
    return np.asarray(one.T @ other)


def group_resample(groups: Sequence[str], rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices of the members of groups that are drawn with replacement."""
    names = np.asarray(groups)
    members = [np.flatnonzero(names == name) for name in dict.fromkeys(groups)]
    return np.concatenate([members[index] for index in rng.integers(len(members), size=len(members))])


def _of_subset(subset: str, frame: pd.DataFrame, seed: int) -> pd.DataFrame:
    pairs = [(kind, error) for kind in KINDS for error in ERRORS]
    promised = frame[list(CRITERIA)].to_numpy()
    given = frame[[f"{kind}_{error}" for kind, error in pairs]].to_numpy()
    rng = named_generator("does it help", "bootstrap", seed, subset)
    groups = frame["group"].tolist()
    picks = [group_resample(groups, rng) for _ in range(RESAMPLES)]
    low, high = np.quantile(
        [spearman(promised[pick], given[pick]) for pick in picks], [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0
    )
    found = spearman(promised, given)
    rows = [
        (subset, *pair, criterion, found[c, e], low[c, e], high[c, e], len(frame))
        for e, pair in enumerate(pairs)
        for c, criterion in enumerate(CRITERIA)
    ]
    names = ["subset", "noise", "error", "criterion", "correlation", "low", "high", "trajectories"]
    return pd.DataFrame(rows, columns=names)


def _standard_ranks(values: Array) -> Array:
    """Ranks of each column (n, k), centred and of unit length."""
    ranks = rankdata(values, axis=0)
    centred = ranks - ranks.mean(axis=0)
    return np.asarray(centred / np.linalg.norm(centred, axis=0))
