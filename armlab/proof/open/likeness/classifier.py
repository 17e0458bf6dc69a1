"""How well a classifier tells real recordings from simulated ones, one real arm left out at a time.

The classifier was chosen before the first look: a random forest (Breiman 2001) on the rows of joints. Each arm has the
same weight, however many joints and recordings it has, and so has each side. A simulated case is an arm of its own; the
cases are left out in as many groups as there are real arms. An arm's score is the mean over its joints. The area under
the curve is the chance that a real arm has a higher score than a simulated one: 0.5 where nothing tells them apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array

TREES, MIN_LEAF = 300, 5  # of the forest
DRAWS = 2000  # of the bootstrap over arms


@dataclass(frozen=True, eq=False)
class LikenessArm:
    """Rows of one arm, (joints, features), of all its recordings."""

    name: str
    real: bool
    values: Array


@dataclass(frozen=True, eq=False)
class Separation:
    """The area with its 95 % interval over arms, and what each feature does.

    scores: of each arm, left out. importance: (features,), of the forest, mean over the folds. alone: (features,), area
    of a feature by itself, over arms; 0.5 tells nothing, and below it simulated arms have the larger values.
    """

    area: float
    low: float
    high: float
    scores: Array
    importance: Array
    alone: Array


def separate(arms: Sequence[LikenessArm], seed: int = 0) -> Separation:
    """Trains and scores with arms left out; ValueError unless there are two arms of each side."""
    from sklearn.ensemble import RandomForestClassifier  # of the extra `proof`

    real = np.array([arm.real for arm in arms])
    if min(real.sum(), (~real).sum()) < 2:
        raise ValueError(f"{real.sum()} real and {(~real).sum()} simulated arms: two of each side are needed")
    rng = np.random.default_rng(seed)
    fold = np.empty(len(arms), dtype=int)
    fold[real] = np.arange(real.sum())
    fold[~real] = rng.permutation((~real).sum()) % real.sum()
    scores, importance = np.empty(len(arms)), np.zeros(arms[0].values.shape[1])
    for number in range(int(real.sum())):
        train = [arm for arm, place in zip(arms, fold, strict=True) if place != number]
        forest = RandomForestClassifier(TREES, min_samples_leaf=MIN_LEAF, random_state=seed)
        forest.fit(np.vstack([arm.values for arm in train]), _rows(train), sample_weight=_weights(train))
        importance += forest.feature_importances_ / real.sum()
        for place in np.flatnonzero(fold == number).tolist():
            scores[place] = forest.predict_proba(arms[place].values)[:, 1].mean()
    means = np.array([arm.values.mean(axis=0) for arm in arms])
    alone = np.array([area_under_curve(column, real) for column in means.T])
    low, high = _interval(scores, real, rng)
    return Separation(area_under_curve(scores, real), low, high, scores, importance, alone)


def area_under_curve(scores: Array, positive: NDArray[np.bool_]) -> float:
    """Chance that a positive one has the higher score, ties half (Hanley and McNeil 1982)."""
    difference = scores[positive][:, None] - scores[~positive][None]
    return float(np.mean((difference > 0) + 0.5 * (difference == 0)))


def _rows(arms: Sequence[LikenessArm]) -> NDArray[np.bool_]:
    return np.concatenate([np.full(len(arm.values), arm.real) for arm in arms])


def _weights(arms: Sequence[LikenessArm]) -> Array:
    """Of each row: equal sums for each arm, and for each side."""
    number = {side: sum(arm.real == side for arm in arms) for side in (True, False)}
    return np.concatenate([np.full(len(arm.values), 1 / len(arm.values) / number[arm.real]) for arm in arms])


def _interval(scores: Array, real: NDArray[np.bool_], rng: np.random.Generator) -> tuple[float, float]:
    sides = np.flatnonzero(real), np.flatnonzero(~real)
    areas = []
    for _ in range(DRAWS):
        drawn = np.concatenate([rng.choice(side, len(side)) for side in sides])
        areas.append(area_under_curve(scores[drawn], real[drawn]))
    low, high = np.quantile(areas, (0.025, 0.975))
    return float(low), float(high)
