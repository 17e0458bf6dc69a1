"""A flexible stand-in for physics without a name: does anything predictable remain, and on what does it depend?

Ridge regression on flexible features, none of them from the library. Only what it predicts on data that took no part
counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.engine.flexible import Features
from diagnosis.engine.folds import Gain, gain_of
from diagnosis.engine.noise import Noise
from diagnosis.engine.observed import Observed
from diagnosis.engine.ridge import FOLD_S, best_ridge, by_thirds, in_turn, predicted_in_turn
from diagnosis.engine.robust import block_numbers
from diagnosis.engine.segments import Segment, rows_of
from recordings.run import Array

BLOCK_S = 1.0  # s: stretches of time that are compared on held-out data
LEAST = 0.02  # of the held-out error, for the noise
SMALL = 0.03  # of the held-out error: less may be what known effects are known too little of
STRUCTURED = 0.05  # p-value below which a prediction counts as no noise: else whitening would hide what is slow


@dataclass(frozen=True, eq=False)
class Structure:
    """What a surrogate predicts of a joint's residual.

    gain: share by which the whitened held-out error falls, p_value: of chance making that (see `Gain`); the surer of
    validation rows and of identification stretches held out in turn. validated: on validation rows alone. share: of
    the validation variance as it is. prediction: (rows,), N m. depends_on: variables, most important first.
    """

    joint: int
    gain: float
    p_value: float
    validated: float
    share: float
    prediction: Array
    depends_on: tuple[str, ...]


def predictable(residual: Array, joint: int, made: Features, observed: Observed) -> Array:
    """What the features predict of a residual (rows,), zeros unless they do so on held-out rows, too."""
    products = tuple(made.values[made.folds == fold].T @ residual[made.folds == fold] for fold in range(3))
    ridge, weights = best_ridge(made.grams, products)
    predicted = made.values @ weights
    rows = rows_of(observed.of_role("validate", joint), observed.rows)
    numbers, learn = block_numbers(observed, BLOCK_S), made.folds >= 0
    validated = gain_of(residual[rows], residual[rows] - predicted[rows], numbers[rows])
    turned = in_turn(made.values[learn], residual[learn], made.folds[learn], ridge, made.grams, products)
    inside = gain_of(residual[learn], turned, numbers[learn])
    sure = any(each.share > LEAST and each.chance < STRUCTURED for each in (validated, inside))
    return predicted if sure else np.zeros(len(residual))


def structure(residual: Array, joint: int, made: Features, noise: Noise, observed: Observed) -> Structure:
    """What the features predict of a residual (rows,) of a joint: whitened, or as it is.

    A slow structure that no surrogate foretold has passed for coloured noise, and whitening would hide it. As slow
    noise would pass for structure, it counts only if validation runs have it, too.
    """
    plain = Noise(tuple(np.ones(1) for _ in noise.taps), tuple(1.0 for _ in noise.taps), noise.resting)
    whitened, raw = (_structure(residual, joint, made, each, observed) for each in (noise, plain))
    ways = [whitened, raw] if raw.validated > SMALL else [whitened]
    return min(ways, key=lambda each: (each.gain <= SMALL, each.p_value))


def _unsure(gain: Gain) -> tuple[bool, float]:
    return gain.share <= SMALL, gain.chance


def _structure(residual: Array, joint: int, made: Features, noise: Noise, observed: Observed) -> Structure:
    learn, judge = observed.of_role("identify", joint), observed.of_role("validate", joint)
    both = (*learn, *judge)
    white, target = noise.whitened(made.values, joint, both), noise.whitened(residual[:, None], joint, both)[:, 0]
    lost = noise.lost(joint)
    known = np.arange(len(target)) < sum(each.stop - each.start - lost for each in learn)
    grams, products, thirds = by_thirds(white, target, _folds(both, lost, observed, FOLD_S) % 3, known)
    ridge, weights = best_ridge(grams, products)
    blocks = _folds(both, lost, observed, BLOCK_S)
    validated = gain_of(target[~known], target[~known] - white[~known] @ weights, blocks[~known])
    all_grams, all_products, folds = by_thirds(white, target, thirds, np.ones(len(target), dtype=bool))
    turned = in_turn(white, target, folds, ridge, all_grams, all_products)
    inside = gain_of(target, turned, blocks)
    best = min((validated, inside), key=_unsure)
    rows = rows_of(judge, observed.rows)
    prediction = made.values @ weights
    if best is inside:
        prediction[rows] = predicted_in_turn(made.values, rows, observed, ridge, all_grams, all_products)
    power = float(np.mean(residual[rows] ** 2))
    share = 1 - float(np.mean((residual[rows] - prediction[rows]) ** 2)) / max(power, 1e-300)
    pair = (white[~known], target[~known]) if best is validated else (white, target)
    worth = best.share > SMALL
    found = _depends_on(made, np.sum(grams, axis=0), np.sum(products, axis=0), pair, ridge) if worth else ()
    return Structure(joint, best.share, best.chance, validated.share, share, prediction, found)


def _depends_on(
    made: Features, gram: Array, products: Array, judged: tuple[Array, Array], ridge: float
) -> tuple[str, ...]:
    """Variables without which the gain falls by a tenth or more, most important first."""
    columns, target = judged
    power = float(target @ target)

    def gain(kept: NDArray[np.bool_]) -> float:
        own = gram[np.ix_(kept, kept)] + ridge * np.eye(int(kept.sum()))
        weights = np.linalg.solve(own, products[kept])
        return 1 - float(np.sum((target - columns[:, kept] @ weights) ** 2)) / power

    whole, lost = gain(np.ones(len(products), dtype=bool)), {}
    for variable in sorted(frozenset().union(*made.variables)):
        lost[variable] = whole - gain(np.array([variable not in each for each in made.variables]))
    important = [name for name in sorted(lost, key=lambda each: -lost[each]) if lost[name] > 0.1 * whole]
    return tuple(important[:4]) or tuple(sorted(lost, key=lambda each: -lost[each])[:1])


def _folds(segments: Sequence[Segment], lost: int, observed: Observed, length_s: float) -> NDArray[np.intp]:
    """Number of the stretch of time of each whitened row."""
    numbers = block_numbers(observed, length_s)
    return np.concatenate([numbers[each.start + lost : each.stop] for each in segments])
