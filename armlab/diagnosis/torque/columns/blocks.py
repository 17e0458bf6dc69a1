"""Stretches of time as the units of chance: robust covariances, and errors of stretches held out in turn."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from armlab.common.arrays import Array
from armlab.common.probabilities import fisher_tail, student_tail
from armlab.diagnosis.torque.columns.columns import Columns
from armlab.diagnosis.torque.columns.inverses import pseudo_inverse_of
from armlab.diagnosis.torque.columns.solver import Fit
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.rows.noise import Noise

ROUNDING = 1e-14  # of the largest variance: rounding


@dataclass(frozen=True, eq=False)
class WhitenedRows:
    """Whitened identification rows of a fit, per joint: the design (rows, parameters) and the errors (rows,).

    blocks: the number of the stretch of time of each row, (rows,).
    """

    designs: tuple[Array, ...]
    errors: tuple[Array, ...]
    blocks: tuple[NDArray[np.intp], ...]

    def gram(self) -> Array:
        """Products of the columns over all joints, (parameters, parameters)."""
        return np.asarray(sum(design.T @ design for design in self.designs))

    def sums_over_blocks(self) -> Array:
        """Sums of design times error over each stretch, (blocks, parameters)."""
        out = np.zeros((int(max(block.max() for block in self.blocks)) + 1, self.designs[0].shape[1]))
        for design, error, block in zip(self.designs, self.errors, self.blocks, strict=True):
            out += csr_array((error, (block, np.arange(len(block)))), shape=(len(out), len(block))) @ design
        return out


@dataclass(frozen=True, eq=False)
class BlockCovariance:
    """covariance: (parameters, parameters), the larger of the model's and that of blocks; degrees: of freedom."""

    covariance: Array
    degrees: float

    def p_value(self, values: Array, place: Sequence[int], max_variance_ratio: float) -> float:
        """Chance of values at these places at least as large, were they zero (Wald's test, F distribution).

        Directions whose variance is larger than the ratio times the least one are left out.
        """
        variances, vectors = np.linalg.eigh(self.covariance[np.ix_(place, place)])
        told = (variances > 0) & (variances < max_variance_ratio * max(variances[0], ROUNDING * variances[-1]))
        wald = float(np.sum((vectors[:, told].T @ values) ** 2 / variances[told]))
        rank = max(int(np.sum(told)), 1)
        return fisher_tail(wald / rank, rank, max(self.degrees - rank, 1))


def whitened_rows(
    columns: Columns,
    extra: dict[int, Array],
    fit: Fit,
    lengths: Array,
    noise: Noise,
    observed: Observed,
) -> WhitenedRows:
    """Design and errors of a fit: links, effects in their order, then the extra columns (rows, count) by joint."""
    designs, errors, blocks = [], [], []
    for joint in range(columns.joints):
        own, left = rows_of_fit(columns, fit, lengths, joint)
        design = np.column_stack([own, *([extra[joint]] if joint in extra else [])])
        designs.append(noise.white(design, joint, observed, "identify"))
        errors.append(noise.white(left[:, None], joint, observed, "identify")[:, 0])
        blocks.append(noise.numbers(observed.stretches, joint, observed, "identify"))
    return WhitenedRows(tuple(designs), tuple(errors), tuple(blocks))


def rows_of_fit(columns: Columns, fit: Fit, lengths: Array, joint: int) -> tuple[Array, Array]:
    """Design (rows, parameters) of a fit at a joint, links and then effects in their order, and what it leaves."""
    index = columns.index[joint][:-1]
    base, rank = fit.links.shape
    loading, chosen = np.flatnonzero(index < base), np.flatnonzero(np.isin(index, fit.columns))
    rigid = columns.pick(joint, loading) / lengths[index[loading]]
    effects = columns.pick(joint, chosen) / lengths[index[chosen]]
    left = (
        columns.target_at(joint) - rigid @ fit.coefficients[index[loading]] - effects @ fit.coefficients[index[chosen]]
    )
    at = {int(column): rank + place for place, column in enumerate(fit.columns)}
    design = np.zeros((len(left), rank + len(fit.columns)))
    design[:, :rank] = rigid @ fit.links[index[loading]]
    design[:, [at[int(column)] for column in index[chosen]]] = effects
    return design, left


def block_covariance(
    rows: WhitenedRows, gram: Array, precision: Array, robust: bool, chosen: Sequence[int] | None = None
) -> BlockCovariance:
    """Covariance of the parameters, or of the `chosen` ones of a fit that has no others and leaves these errors.

    gram: of the rows. precision: of the prior; both (parameters, parameters), of all parameters.
    """
    own = np.arange(len(precision)) if chosen is None else np.asarray(chosen, dtype=np.intp)
    precision = precision[np.ix_(own, own)]
    gram = gram[np.ix_(own, own)] + precision
    inverse = pseudo_inverse_of(gram)
    count = len(np.unique(np.concatenate(rows.blocks)))
    degrees = float(max(count - 1, 1))
    variance = sum(float(error @ error) for error in rows.errors) / max(sum(map(len, rows.errors)) - len(gram), 1)
    held = inverse @ precision @ inverse  # the part of the prior, which does not grow with the errors
    model = np.asarray(held + (inverse - held) * max(variance, 1.0), dtype=np.float64)
    if not robust:
        return BlockCovariance(model, degrees)
    sums = rows.sums_over_blocks()[:, own]
    # squares are taken last: where the prior alone holds a direction, rounding of earlier ones would hide the others
    shares = sums @ inverse * np.sqrt(count / max(count - 1, 1))
    spread = np.asarray(shares.T @ shares + held, dtype=np.float64)
    ratio = np.sqrt(np.maximum(np.diag(model), 0) / np.maximum(np.diag(spread), 1e-300))
    scale = np.maximum(ratio, 1.0)
    return BlockCovariance(np.asarray(spread * np.outer(scale, scale)), degrees)


def variance_inflation(shape: Array, errors: Array) -> float:
    """By how much correlated errors (rows,) widen the variance of the size of a known shape (rows,); at least one.

    The sum of c_s(k) c_e(k) over lags k, c_s and c_e the autocorrelations of shape and errors, one at lag zero.
    """
    powers = [np.abs(np.fft.rfft(each, 2 * len(each))) ** 2 for each in (shape, errors)]
    of_shape, of_errors = (np.fft.irfft(each) for each in powers)
    return max(float(of_shape @ of_errors) / max(float(of_shape[0] * of_errors[0]), 1e-300), 1.0)


@dataclass(frozen=True, eq=False)
class Folds:
    """Whitened rows of a wide fit, cut into folds of whole stretches of time. precision: of the parameters' prior.

    parts: of each joint, fold by fold, the numbers of its rows and their design.
    """

    rows: WhitenedRows
    targets: tuple[Array, ...]
    precision: Array
    parts: tuple[tuple[tuple[NDArray[np.intp], Array], ...], ...]
    grams: tuple[Array, ...]
    products: tuple[Array, ...]

    @cached_property
    def whole(self) -> Array:
        """Products of the columns over all folds, (parameters, parameters)."""
        return np.asarray(np.sum(self.grams, axis=0))

    def errors(self, chosen: Sequence[int]) -> list[Array]:
        """Held-out errors of a fit with the chosen parameters only, (rows,) for each joint."""
        return self.errors_of(self.solutions(chosen))

    def solutions(self, chosen: Sequence[int]) -> Array:
        """Parameters fitted without each fold, (parameters, folds); zeros where they are not chosen."""
        count = len(self.grams)
        place, values = np.ix_(chosen, chosen), np.zeros((len(self.precision), count))
        towards = np.sum(self.products, axis=0)
        for fold in range(count):
            gram = (self.whole - self.grams[fold] + self.precision)[place]
            inverse = pseudo_inverse_of(gram)
            values[chosen, fold] = inverse @ (towards - self.products[fold])[chosen]
        return values

    def errors_of(self, values: Array) -> list[Array]:
        """Errors (rows,) for each joint, where each fold is predicted by its own parameters (parameters, folds)."""
        return [self.errors_at(joint, values) for joint in range(len(self.targets))]

    def errors_at(self, joint: int, values: Array) -> Array:
        """The same at one joint (from 0)."""
        out = self.targets[joint].copy()
        for (own, design), solution in zip(self.parts[joint], values.T, strict=True):
            out[own] -= design @ solution
        return out


def split_folds(rows: WhitenedRows, values: Array, precision: Array, count: int) -> Folds:
    """Some folds of a fit's rows; values: its parameters, to give the errors back what they explain."""
    targets = tuple(error + design @ values for error, design in zip(rows.errors, rows.designs, strict=True))
    parts = tuple(
        tuple((own, design[own]) for own in (np.flatnonzero(block % count == fold) for fold in range(count)))
        for design, block in zip(rows.designs, rows.blocks, strict=True)
    )
    grams, products = [], []
    for fold in range(count):
        own = [each[fold] for each in parts]
        grams.append(np.sum([design.T @ design for _, design in own], axis=0))
        products.append(
            np.sum([design.T @ target[at] for target, (at, design) in zip(targets, own, strict=True)], axis=0)
        )
    return Folds(rows, targets, precision, parts, tuple(grams), tuple(products))


@dataclass(frozen=True)
class HeldOutGain:
    """By how much squared held-out errors fall, a share of what is left of them, and one-sided p-values of that.

    p_value asks whether stretches of time profit alike: what a few of them hold may be a fault of theirs. chance asks
    whether noise would make it. growth_p asks as p_value does whether the errors grow.
    """

    share: float
    p_value: float
    chance: float
    growth_p: float


def held_out_gain(without: Array, with_it: Array, blocks: NDArray[np.intp]) -> HeldOutGain:
    """The gain from errors (rows,) without and with something.

    What is left times what is predicted is how far chance carries the gain, stretch by stretch; as many stretches
    count as share the prediction's power.
    """
    predicted, places = without - with_it, np.flatnonzero(np.bincount(blocks))
    better = np.bincount(blocks, without**2 - with_it**2)[places]
    power = np.bincount(blocks, predicted**2)[places]
    carried = np.bincount(blocks, with_it * predicted)[places]
    gain = float(np.sum(better))
    spread = float(np.std(better, ddof=1)) * np.sqrt(len(better)) if len(better) > 2 else 0.0
    p_value, growth_p = (student_tail(each / spread, len(better) - 1) if spread > 0 else 1.0 for each in (gain, -gain))
    noise = 2 * float(np.sqrt(carried @ carried))
    count = float(np.sum(power)) ** 2 / max(float(power @ power), 1e-300)
    chance = student_tail(gain / noise, count) if noise > 0 else 1.0
    return HeldOutGain(gain / max(float(with_it @ with_it), 1e-300), p_value, chance, growth_p)
