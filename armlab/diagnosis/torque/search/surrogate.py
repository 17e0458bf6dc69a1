"""Flexible regressions that stand in for physics without a name.

Features (`features.py`) fitted by ridge regression. Only what they predict on data that took no part counts.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import HeldOutGain, held_out_gain
from armlab.diagnosis.torque.columns.inverses import solve_positive
from armlab.diagnosis.torque.rows.data import Observed, Segment, rows_in
from armlab.diagnosis.torque.rows.features import Features, Grams
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.diagnosis.tuning import SurrogateTuning

Sums = tuple[tuple[Array, ...], tuple[Array, ...]]  # Gram matrices and products with the target, of each third


def time_thirds(observed: Observed, joint: int) -> NDArray[np.intp]:
    """Stretches of time of the identification rows, in turn; -1 elsewhere."""
    learn = rows_in(observed.of_role("identify", joint), observed.rows)
    return np.where(learn, observed.long_stretches % 3, -1)


def _grams(white: Array, thirds: Sequence[NDArray[np.bool_]]) -> tuple[Array, ...]:
    return tuple(part.T @ part for part in (white[own] for own in thirds))


def predict_in_turn(
    values: Array,
    rows: NDArray[np.bool_],
    observed: Observed,
    ridge: float,
    grams: tuple[Array, ...],
    products: tuple[Array, ...],
) -> Array:
    """Predictions of the chosen rows, each from the thirds that it does not belong to."""
    thirds = observed.long_stretches[rows] % 3
    out = np.empty(len(thirds))
    for fold in range(3):
        gram = np.sum(grams, axis=0) - grams[fold] + ridge * np.eye(values.shape[1])
        weights = solve_positive(gram, np.sum(products, axis=0) - products[fold])
        out[thirds == fold] = values[rows][thirds == fold] @ weights
    return out


def errors_in_turn(
    white: Array,
    target: Array,
    thirds: Sequence[NDArray[np.bool_]],
    ridge: float,
    grams: tuple[Array, ...],
    products: tuple[Array, ...],
) -> Array:
    """Errors of each third where the others have been learnt from, (rows,)."""
    out, whole, towards = target.copy(), np.sum(grams, axis=0), np.sum(products, axis=0)
    for own, gram, product in zip(thirds, grams, products, strict=True):
        out[own] -= white[own] @ solve_positive(whole - gram + ridge * np.eye(len(whole)), towards - product)
    return out


@dataclass(frozen=True, eq=False)
class FoldedFeatures:
    """Features with the third of the identification rows that each row belongs to, (rows,), -1 for none."""

    features: Features
    folds: NDArray[np.intp]
    grams: Grams


def fold_features(made: Features, observed: Observed, joint: int) -> FoldedFeatures:
    """Features of a joint (from 0), with their products third by third."""
    thirds = time_thirds(observed, joint)
    parts = (made.values[thirds == fold] for fold in range(3))
    grams = Grams(tuple(part.T @ part for part in parts), asked_often=True)
    return FoldedFeatures(replace(made, grams=grams), thirds, grams)


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
    values, folds = made.features.values, made.folds
    products = tuple((values.T @ np.where(folds[:, None] == range(3), residual[:, None], 0.0)).T)
    ridge, weights = made.grams.best_ridge(products, tuning.ridge_exponents)
    predicted, *in_turn = (values @ np.column_stack([weights, made.grams.weights_in_turn(products, ridge)])).T
    rows = rows_in(observed.of_role("validate", joint), observed.rows)
    numbers, learn = observed.held_out_stretches, folds >= 0
    validated = held_out_gain(residual[rows], residual[rows] - predicted[rows], numbers[rows])
    turned = residual[learn] - np.choose(folds[learn], [each[learn] for each in in_turn])
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
    in_turn: Sums | None
    judged: tuple[Array, Array]

    def structure(self, observed: Observed, tuning: SurrogateTuning) -> Structure:
        """What it predicts, and of which variables: asked of the best surrogate alone."""
        if self.in_turn is None:
            prediction = self.left.features.values @ self.weights
        else:
            used = np.ones(observed.rows, dtype=bool)
            prediction = predict_in_turn(self.left.features.values, used, observed, self.ridge, *self.in_turn)
        rows = rows_in(observed.of_role("validate", self.joint), observed.rows)
        residual = self.left.residual
        power = float(np.mean(residual[rows] ** 2))
        share = 1 - float(np.mean((residual[rows] - prediction[rows]) ** 2)) / max(power, 1e-300)
        found: tuple[str, ...] = ()
        if self.gain > tuning.least_gain:
            found = _important_variables(self.left.features, *self.sums, self.judged, self.ridge, tuning)
        return Structure(self.joint, self.gain, self.p_value, self.validation_gain, share, prediction, found)


def surest(surrogates: Iterable[Surrogate], tuning: SurrogateTuning) -> Surrogate:
    """The surrogate that is least by chance among those that explain enough."""
    return min(surrogates, key=lambda each: (each.gain <= tuning.least_gain, each.p_value))


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
    whitened = _Regression.of(learnt, joint, noise, observed, tuning)
    raw = _Regression.of(learnt, joint, plain, observed, tuning, learnt.features.grams)
    counted = [whitened, raw] if raw.validated.share > tuning.least_gain else [whitened]
    return surest([each.surrogate(whole, tuning) for each in counted], tuning)


@dataclass(frozen=True, eq=False)
class _Regression:
    """A surrogate learnt from the identification rows of a joint under some noise, and judged on validation runs.

    segments: of the whitened rows. numbers, blocks: of the stretches to which they belong, (rows,). known: which of
    them identify. sums: Grams and products of these. judged: whitened columns and target of the others.
    """

    left: Remainder
    joint: int
    noise: Noise
    segments: tuple[Segment, ...]
    numbers: NDArray[np.intp]
    blocks: NDArray[np.intp]
    sums: Sums
    judged: tuple[Array, Array]
    ridge: float
    weights: Array
    validated: HeldOutGain

    @classmethod
    def of(
        cls,
        left: Remainder,
        joint: int,
        noise: Noise,
        observed: Observed,
        tuning: SurrogateTuning,
        grams: Grams | None = None,
    ) -> "_Regression":
        """grams: of the identification rows under this noise, where they are known."""
        learn, judge = observed.of_role("identify", joint), observed.of_role("validate", joint)
        both = (*learn, *judge)
        lost = noise.lost(joint)
        numbers = _stretch_numbers(both, lost, observed.long_stretches)
        blocks = _stretch_numbers(both, lost, observed.held_out_stretches)
        known = np.arange(len(blocks)) < sum(each.stop - each.start - lost for each in learn)
        columns, target = _white(left, joint, noise, both)
        thirds = [known & (numbers % 3 == fold) for fold in range(3)]
        products = tuple(columns[own].T @ target[own] for own in thirds)
        grams = grams or Grams(_grams(columns, thirds))
        ridge, weights = grams.best_ridge(products, tuning.ridge_exponents)
        judged = columns[~known], target[~known]
        validated = held_out_gain(judged[1], judged[1] - judged[0] @ weights, blocks[~known])
        sums = grams.thirds, products
        return cls(left, joint, noise, both, numbers, blocks, sums, judged, ridge, weights, validated)

    def surrogate(self, whole: Remainder, tuning: SurrogateTuning) -> Surrogate:
        """The better of the two ways in which it is held out. whole: what a fit of all rows leaves."""
        columns, target = _white(whole, self.joint, self.noise, self.segments)
        thirds = [self.numbers % 3 == fold for fold in range(3)]
        sums = _grams(columns, thirds), tuple(columns[own].T @ target[own] for own in thirds)
        turned = errors_in_turn(columns, target, thirds, self.ridge, *sums)
        inside, validated = held_out_gain(target, turned, self.blocks), self.validated
        least, in_turn = tuning.least_gain, None
        if (inside.share <= least, inside.chance) < (validated.share <= least, validated.chance):
            best, left, judged, in_turn = inside, whole, (columns, target), sums
        else:
            best, left, judged, sums = validated, self.left, self.judged, self.sums
        gram, towards = (np.asarray(np.sum(parts, axis=0)) for parts in sums)
        return Surrogate(
            self.joint,
            best.share,
            best.chance,
            validated.share,
            left,
            self.ridge,
            self.weights,
            (gram, towards),
            in_turn,
            judged,
        )


def _white(left: Remainder, joint: int, noise: Noise, segments: tuple[Segment, ...]) -> tuple[Array, Array]:
    """Features (rows, features) and residual (rows,) of a joint, whitened."""
    target = noise.whitened(left.residual[:, None], joint, segments)[:, 0]
    return noise.whitened(left.features.values, joint, segments), target


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
        weights = solve_positive(own, products[kept])
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
