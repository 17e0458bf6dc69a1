"""Flexible regressions that stand in for physics without a name.

Features (`features.py`) fitted by ridge regression. Only what they predict on data that took no part counts.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import block_numbers, held_out_gain
from armlab.diagnosis.torque.rows.data import Observed, Segment, rows_in
from armlab.diagnosis.torque.rows.features import Features
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.diagnosis.tuning import SurrogateTuning

Thirds = tuple[tuple[Array, ...], tuple[Array, ...], NDArray[np.intp]]


def time_thirds(observed: Observed, joint: int, tuning: SurrogateTuning) -> NDArray[np.intp]:
    """Stretches of time of the identification rows, in turn; -1 elsewhere."""
    learn = rows_in(observed.of_role("identify", joint), observed.rows)
    return np.where(learn, block_numbers(observed, tuning.fold_s, tuning.min_blocks) % 3, -1)


def products_by_third(white: Array, target: Array, thirds: NDArray[np.intp], chosen: NDArray[np.bool_]) -> Thirds:
    """Products of the chosen rows, third by third."""
    parts = [white[chosen & (thirds == fold)] for fold in range(3)]
    goals = [target[chosen & (thirds == fold)] for fold in range(3)]
    grams = tuple(part.T @ part for part in parts)
    return grams, tuple(part.T @ goal for part, goal in zip(parts, goals, strict=True)), thirds


def predict_in_turn(
    values: Array,
    rows: NDArray[np.bool_],
    observed: Observed,
    ridge: float,
    grams: tuple[Array, ...],
    products: tuple[Array, ...],
    tuning: SurrogateTuning,
) -> Array:
    """Predictions of the chosen rows, each from the thirds that it does not belong to."""
    thirds = block_numbers(observed, tuning.fold_s, tuning.min_blocks)[rows] % 3
    out = np.empty(len(thirds))
    for fold in range(3):
        gram = np.sum(grams, axis=0) - grams[fold] + ridge * np.eye(values.shape[1])
        weights = np.linalg.solve(gram, np.sum(products, axis=0) - products[fold])
        out[thirds == fold] = values[rows][thirds == fold] @ weights
    return out


def errors_in_turn(
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


def best_ridge(
    grams: tuple[Array, ...], products: tuple[Array, ...], exponents: Sequence[float]
) -> tuple[float, Array]:
    """The ridge that predicts each third best from the others, and the weights with it on all.

    exponents: of ten, of the ridges that are tried, in units of the mean squared length of a feature.
    """
    count = len(products[0])
    ridges = 10.0 ** np.array(exponents) * sum(float(np.trace(gram)) for gram in grams) / max(count, 1)
    whole, towards, errors = np.sum(grams, axis=0), np.sum(products, axis=0), np.zeros(len(ridges))
    for own, product in zip(grams, products, strict=True):
        values, vectors = np.linalg.eigh(whole - own)
        turned = vectors.T @ (towards - product)
        weights = vectors @ (turned[:, None] / (np.maximum(values, 0)[:, None] + ridges))
        errors += np.sum(weights * (own @ weights), axis=0) - 2 * product @ weights
    best = float(ridges[int(np.argmin(errors))])
    return best, np.linalg.solve(whole + best * np.eye(count), towards)


@dataclass(frozen=True, eq=False)
class FoldedFeatures:
    """Features with the third of the identification rows that each row belongs to, (rows,), -1 for none.

    grams: of each third.
    """

    features: Features
    folds: NDArray[np.intp]
    grams: tuple[Array, ...]


def fold_features(made: Features, observed: Observed, joint: int, tuning: SurrogateTuning) -> FoldedFeatures:
    """Features of a joint (from 0), with their products third by third."""
    thirds = time_thirds(observed, joint, tuning)
    grams = tuple(made.values[thirds == fold].T @ made.values[thirds == fold] for fold in range(3))
    return FoldedFeatures(made, thirds, grams)


@dataclass(frozen=True, eq=False)
class Structure:
    """What a surrogate predicts of a joint's residual.

    gain: by how much the whitened held-out error falls, p_value: of chance making that (see `Gain`); the surer of
    validation rows and of identification stretches held out in turn. validation_gain: on validation rows alone. share:
    of the validation variance as it is. prediction: (rows,), N m. depends_on: variables, most important first.
    """

    joint: int
    gain: float
    p_value: float
    validation_gain: float
    share: float
    prediction: Array
    depends_on: tuple[str, ...]


def predict_structure(
    residual: Array, joint: int, made: FoldedFeatures, observed: Observed, tuning: SurrogateTuning
) -> Array:
    """What the features predict of a residual (rows,), zeros unless they do so on held-out rows, too."""
    values = made.features.values
    products = tuple(values[made.folds == fold].T @ residual[made.folds == fold] for fold in range(3))
    ridge, weights = best_ridge(made.grams, products, tuning.ridge_exponents)
    predicted = values @ weights
    rows = rows_in(observed.of_role("validate", joint), observed.rows)
    numbers, learn = block_numbers(observed, tuning.block_s, tuning.min_blocks), made.folds >= 0
    validated = held_out_gain(residual[rows], residual[rows] - predicted[rows], numbers[rows])
    turned = errors_in_turn(values[learn], residual[learn], made.folds[learn], ridge, made.grams, products)
    inside = held_out_gain(residual[learn], turned, numbers[learn])
    gains = (validated, inside)
    sure = any(each.share > tuning.min_noise_gain and each.chance < tuning.noise_level for each in gains)
    return predicted if sure else np.zeros(len(residual))


@dataclass(frozen=True, eq=False)
class Remainder:
    """What a fit leaves of the torque of a joint, (rows,), and of features that it is asked to be explained by."""

    residual: Array
    features: Features


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A surrogate fitted to what is left at a joint, and the better of the two ways in which it is held out.

    gain, p_value, validation_gain: see `Structure`. left: what it was judged on. sums: its Gram matrix and products
    there; in_turn: the same third by third where stretches were predicted in turn, None for validation runs. judged:
    whitened columns and target of the held-out rows. weights: of all that was learnt from.
    """

    joint: int
    gain: float
    p_value: float
    validation_gain: float
    left: Remainder
    ridge: float
    weights: Array
    sums: tuple[Array, Array]
    in_turn: tuple[tuple[Array, ...], tuple[Array, ...]] | None
    judged: tuple[Array, Array]

    def structure(self, observed: Observed, tuning: SurrogateTuning) -> Structure:
        """What it predicts, and of which variables: asked of the best surrogate alone."""
        if self.in_turn is None:
            prediction = self.left.features.values @ self.weights
        else:
            used = np.ones(observed.rows, dtype=bool)
            prediction = predict_in_turn(self.left.features.values, used, observed, self.ridge, *self.in_turn, tuning)
        rows = rows_in(observed.of_role("validate", self.joint), observed.rows)
        residual = self.left.residual
        power = float(np.mean(residual[rows] ** 2))
        share = 1 - float(np.mean((residual[rows] - prediction[rows]) ** 2)) / max(power, 1e-300)
        found: tuple[str, ...] = ()
        if self.gain > tuning.min_structure_gain:
            found = _important_variables(self.left.features, *self.sums, self.judged, self.ridge, tuning)
        return Structure(self.joint, self.gain, self.p_value, self.validation_gain, share, prediction, found)


def surest(surrogates: Iterable[Surrogate], tuning: SurrogateTuning) -> Surrogate:
    """The surrogate that is least by chance among those that explain enough."""
    return min(surrogates, key=lambda each: (each.gain <= tuning.min_structure_gain, each.p_value))


def fit_surrogate(
    learnt: Remainder, whole: Remainder, joint: int, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Surrogate:
    """The surrogate of what is left at a joint: whitened, or as it is.

    learnt: by a fit of the identification rows, beside which validation runs are predicted. whole: by one of all rows,
    beside which stretches are predicted in turn; where a fit of some rows is bad elsewhere, that is no structure.
    A slow structure that no surrogate foretold has passed for coloured noise, and whitening would hide it. As slow
    noise would pass for structure, it counts only if validation runs have it, too.
    """
    plain = replace(noise, taps=tuple(np.ones(1) for _ in noise.taps), scales=tuple(1.0 for _ in noise.taps))
    whitened = _fit_surrogate(learnt, whole, joint, noise, observed, tuning)
    raw = _fit_surrogate(learnt, whole, joint, plain, observed, tuning)
    return surest([whitened, raw] if raw.validation_gain > tuning.min_structure_gain else [whitened], tuning)


def _fit_surrogate(
    learnt: Remainder, whole: Remainder, joint: int, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Surrogate:
    learn, judge = observed.of_role("identify", joint), observed.of_role("validate", joint)
    both = (*learn, *judge)
    lost = noise.lost(joint)
    numbers = _stretch_numbers(both, lost, block_numbers(observed, tuning.fold_s, tuning.min_blocks))
    blocks = _stretch_numbers(both, lost, block_numbers(observed, tuning.block_s, tuning.min_blocks))
    known = np.arange(len(blocks)) < sum(each.stop - each.start - lost for each in learn)

    def white(left: Remainder) -> tuple[Array, Array]:
        target = noise.whitened(left.residual[:, None], joint, both)[:, 0]
        return noise.whitened(left.features.values, joint, both), target

    columns, target = white(learnt)
    grams, products, _ = products_by_third(columns, target, numbers % 3, known)
    ridge, weights = best_ridge(grams, products, tuning.ridge_exponents)
    validated = held_out_gain(target[~known], target[~known] - columns[~known] @ weights, blocks[~known])
    all_columns, all_target = white(whole)
    everything = np.ones(len(known), dtype=bool)
    thirds = products_by_third(all_columns, all_target, numbers % 3, everything)
    turned = errors_in_turn(all_columns, all_target, thirds[2], ridge, *thirds[:2])
    inside = held_out_gain(all_target, turned, blocks)
    least = tuning.min_structure_gain
    if (inside.share <= least, inside.chance) < (validated.share <= least, validated.chance):
        best, left, in_turn, judged = inside, whole, thirds[:2], (all_columns, all_target)
    else:
        best, left, in_turn, judged = validated, learnt, None, (columns[~known], target[~known])
    gram, towards = (np.asarray(np.sum(parts, axis=0)) for parts in in_turn or (grams, products))
    return Surrogate(
        joint, best.share, best.chance, validated.share, left, ridge, weights, (gram, towards), in_turn, judged
    )


def _important_variables(
    made: Features,
    gram: Array,
    products: Array,
    judged: tuple[Array, Array],
    ridge: float,
    tuning: SurrogateTuning,
) -> tuple[str, ...]:
    """Variables without which a part of the gain is lost that matters, most important first."""
    columns, target = judged
    power = float(target @ target)

    def gain(kept: NDArray[np.bool_]) -> float:
        own = gram[np.ix_(kept, kept)] + ridge * np.eye(int(kept.sum()))
        weights = np.linalg.solve(own, products[kept])
        return 1 - float(np.sum((target - columns[:, kept] @ weights) ** 2)) / power

    whole, lost = gain(np.ones(len(products), dtype=bool)), {}
    for variable in sorted(frozenset().union(*made.variables)):
        lost[variable] = whole - gain(np.array([variable not in each for each in made.variables]))
    ordered = sorted(lost, key=lambda each: -lost[each])
    important = [name for name in ordered if lost[name] > tuning.min_variable_share * whole]
    return tuple(important[: tuning.max_variables]) or tuple(ordered[:1])


def _stretch_numbers(segments: Sequence[Segment], lost: int, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Number of the stretch of time of each whitened row. numbers: of all rows, (rows,)."""
    return np.concatenate([numbers[each.start + lost : each.stop] for each in segments])
