"""Ridge regression whose ridge is what predicts each third of the time best from the others."""

import numpy as np
from numpy.typing import NDArray

from diagnosis.engine.observed import Observed
from diagnosis.engine.robust import block_numbers
from diagnosis.engine.segments import rows_of
from recordings.run import Array

RIDGES = tuple(10.0 ** np.arange(-6.0, 2.0))  # of the mean squared length of a feature
FOLD_S = 2.0  # s: stretches that choose the ridge in turn

Thirds = tuple[tuple[Array, ...], tuple[Array, ...], NDArray[np.intp]]


def thirds_of(observed: Observed, joint: int) -> NDArray[np.intp]:
    """Stretches of time of the identification rows, in turn; -1 elsewhere."""
    learn = rows_of(observed.of_role("identify", joint), observed.rows)
    return np.where(learn, block_numbers(observed, FOLD_S) % 3, -1)


def by_thirds(white: Array, target: Array, thirds: NDArray[np.intp], chosen: NDArray[np.bool_]) -> Thirds:
    """Products of the chosen rows, third by third."""
    parts = [white[chosen & (thirds == fold)] for fold in range(3)]
    goals = [target[chosen & (thirds == fold)] for fold in range(3)]
    grams = tuple(part.T @ part for part in parts)
    return grams, tuple(part.T @ goal for part, goal in zip(parts, goals, strict=True)), thirds


def predicted_in_turn(
    values: Array,
    rows: NDArray[np.bool_],
    observed: Observed,
    ridge: float,
    grams: tuple[Array, ...],
    products: tuple[Array, ...],
) -> Array:
    """Predictions of the chosen rows, each from the thirds that it does not belong to."""
    thirds = block_numbers(observed, FOLD_S)[rows] % 3
    out = np.empty(len(thirds))
    for fold in range(3):
        gram = np.sum(grams, axis=0) - grams[fold] + ridge * np.eye(values.shape[1])
        weights = np.linalg.solve(gram, np.sum(products, axis=0) - products[fold])
        out[thirds == fold] = values[rows][thirds == fold] @ weights
    return out


def in_turn(
    white: Array,
    target: Array,
    thirds: NDArray[np.intp],
    ridge: float,
    grams: tuple[Array, ...],
    products: tuple[Array, ...],
) -> Array:
    """Errors of each third where the others have been learnt from, (rows,)."""
    out, whole, towards = target.copy(), np.sum(grams, axis=0), np.sum(products, axis=0)
    for fold in range(3):
        weights = np.linalg.solve(whole - grams[fold] + ridge * np.eye(len(whole)), towards - products[fold])
        out[thirds == fold] -= white[thirds == fold] @ weights
    return out


def best_ridge(grams: tuple[Array, ...], products: tuple[Array, ...]) -> tuple[float, Array]:
    """The ridge that predicts each third best from the others, and the weights with it on all."""
    count = len(products[0])
    ridges = np.array(RIDGES) * sum(float(np.trace(gram)) for gram in grams) / max(count, 1)
    errors = np.zeros(len(ridges))
    whole, towards = np.sum(grams, axis=0), np.sum(products, axis=0)
    for own, product in zip(grams, products, strict=True):
        values, vectors = np.linalg.eigh(whole - own)
        turned = vectors.T @ (towards - product)
        for number, ridge in enumerate(ridges):
            weights = vectors @ (turned / (np.maximum(values, 0) + ridge))
            errors[number] += weights @ own @ weights - 2 * weights @ product
    best = float(ridges[int(np.argmin(errors))])
    return best, np.linalg.solve(whole + best * np.eye(count), towards)
