"""Each stretch of the identification runs held out in turn: what a fit to the others leaves of it.

A validation run may not excite what the identification runs show. So a gain counts on either: on the runs that took no
part at all, or on stretches of time that took no part in their turn.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from diagnosis.engine.robust import Rows
from recordings.run import Array

FOLDS = 5


@dataclass(frozen=True, eq=False)
class Folds:
    """Whitened rows of a wide fit, cut into folds of whole stretches of time. precision: of the parameters' prior."""

    rows: Rows
    targets: tuple[Array, ...]
    precision: Array
    grams: tuple[Array, ...]
    products: tuple[Array, ...]

    def errors(self, chosen: Sequence[int]) -> list[Array]:
        """Held-out errors of a fit with the chosen parameters only, (rows,) for each joint."""
        place, values = np.ix_(chosen, chosen), np.zeros((len(self.precision), FOLDS))
        whole, towards = np.sum(self.grams, axis=0), np.sum(self.products, axis=0)
        for fold in range(FOLDS):
            gram = (whole - self.grams[fold] + self.precision)[place]
            inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
            values[chosen, fold] = inverse @ (towards - self.products[fold])[chosen]
        return [
            target - (design @ values)[np.arange(len(block)), block % FOLDS]
            for target, design, block in zip(self.targets, self.rows.designs, self.rows.blocks, strict=True)
        ]


def folds_of(rows: Rows, values: Array, precision: Array) -> Folds:
    """The folds of a fit's rows; values: its parameters, to give the errors back what they explain."""
    targets = tuple(error + design @ values for error, design in zip(rows.errors, rows.designs, strict=True))
    grams, products = [], []
    for fold in range(FOLDS):
        gram, product = np.zeros(precision.shape), np.zeros(len(values))
        for target, design, block in zip(targets, rows.designs, rows.blocks, strict=True):
            own = block % FOLDS == fold
            gram += design[own].T @ design[own]
            product += design[own].T @ target[own]
        grams.append(gram)
        products.append(product)
    return Folds(rows, targets, precision, tuple(grams), tuple(products))


@dataclass(frozen=True)
class Gain:
    """Share by which held-out errors fall, and one-sided p-values of that.

    p_value asks whether stretches of time profit alike: what a few of them hold may be a fault of theirs. chance asks
    whether noise would make it. change: mean square of what the prediction changes by: how much the data excite it.
    """

    share: float
    p_value: float
    chance: float
    change: float


def gain_of(without: Array, with_it: Array, blocks: NDArray[np.intp]) -> Gain:
    """The gain from errors (rows,) without and with something.

    What is left times what is predicted is how far chance carries the gain, stretch by stretch; as many stretches
    count as share the prediction's power.
    """
    predicted, places = without - with_it, np.unique(blocks)
    better, power, carried = (
        np.bincount(blocks, each)[places] for each in (without**2 - with_it**2, predicted**2, with_it * predicted)
    )
    gain = float(np.sum(better))
    spread = float(np.std(better, ddof=1)) * np.sqrt(len(better)) if len(better) > 2 else 0.0
    p_value = float(student.sf(gain / spread, len(better) - 1)) if spread > 0 else 1.0
    noise = 2 * float(np.sqrt(carried @ carried))
    count = float(np.sum(power)) ** 2 / max(float(power @ power), 1e-300)
    chance = float(student.sf(gain / noise, count)) if noise > 0 else 1.0
    return Gain(gain / max(float(with_it @ with_it), 1e-300), p_value, chance, float(np.mean(predicted**2)))
