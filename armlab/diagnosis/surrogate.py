"""Flexible regressions that stand in for physics without a name.

Splines and random waves (Rahimi and Recht 2007) of the joints' motion and of time, fitted by ridge regression. Only
what they predict on data that took no part counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from armlab.common.arrays import Array
from armlab.diagnosis.blocks import block_numbers, held_out_gain
from armlab.diagnosis.data import Observed, Segment, rows_in
from armlab.diagnosis.noise import Noise
from armlab.diagnosis.tuning import SurrogateTuning
from armlab.effects.memory import dahl_state

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


Part = tuple[Array, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class Features:
    """values: (rows, features). variables: per feature the names of what it depends on."""

    values: Array
    variables: tuple[frozenset[str], ...]


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
class WholeRuns:
    """All samples of all runs, stacked, (samples, joints): what jumps is made of them and then filtered as torque is.

    A low-pass rounds every jump. A feature that is made of what was filtered and thinned before jumps elsewhere.
    """

    observed: Observed
    position: Array
    velocity: Array

    def filtered(self, columns: Array) -> Array:
        """Columns (samples, count) through the filter of the torque, (rows, count)."""
        pairs = zip(self.observed.signals, self.split(columns), strict=True)
        return np.concatenate([each.filter(part) for each, part in pairs])

    def split(self, values: Array) -> list[Array]:
        """Values of all samples, run by run."""
        return np.split(values, np.cumsum([each.run.samples for each in self.observed.signals])[:-1])

    def lags(self, values: Array, memories: Sequence[float]) -> Array:
        """First-order lags (samples, memories) of a signal (samples,), run by run. memories: time constants, s."""
        rate, out = self.observed.signals[0].run.rate_hz, []
        for memory in memories:
            keep = float(np.exp(-1 / (memory * rate)))
            parts = [lfilter([1 - keep], [1, -keep], part, zi=[keep * part[0]])[0] for part in self.split(values)]
            out.append(np.concatenate(parts))
        return np.column_stack(out)

    def turns(self, joint: int, ways: Sequence[float]) -> Array:
        """Signs of a joint's motion that turn over some way after a reversal (Dahl 1968), (samples, ways).

        ways: of its travel. It is what hysteresis makes of the motion, however fast that is.
        """
        positions = self.split(self.position[:, joint])
        travel = max(max(float(np.ptp(each)) for each in positions), 1e-9)
        parts = [np.column_stack([dahl_state(each, way * travel) for way in ways]) for each in positions]
        return np.concatenate(parts)

    def swings(self, drive: Array, tuning: SurrogateTuning) -> Array:
        """Deflection and speed of damped springs that a signal (samples,) drives, (samples, features), run by run.

        It is what anything that swings makes of the motion: a liquid, a hose, a base that gives way.
        """
        rate, out = self.observed.signals[0].run.rate_hz, []
        fastest = min(tuning.fastest_swing_hz, tuning.max_swing_share * rate)
        for frequency in np.geomspace(fastest / tuning.swing_range, fastest, tuning.swings):
            turn = 2 * rate * np.tan(np.pi * frequency / rate)  # the bilinear transform moves it to the frequency
            spring = [1, 2 * tuning.swing_damping * turn, turn**2]
            for driven in ([turn**2], [turn, 0]):
                taps = bilinear(driven, spring, rate)
                out.append(np.concatenate([lfilter(*taps, part - part[0]) for part in self.split(drive)]))
        return np.column_stack(out)


def whole_runs(observed: Observed) -> WholeRuns:
    """The samples of all runs."""
    motions = [each.motion for each in observed.signals]
    position, velocity = (
        np.concatenate([getattr(each, name) for each in motions]) for name in ("position", "velocity")
    )
    return WholeRuns(observed, position, velocity)


def flexible_features(observed: Observed, joint: int, rng: np.random.Generator, tuning: SurrogateTuning) -> Features:
    """Features for one joint at the kept rows."""
    position = observed.kept("position")
    velocity = observed.kept("velocity")
    acceleration = observed.kept("acceleration")
    hats, waves = tuning.hats, tuning.waves if observed.joints <= tuning.few_joints else tuning.waves // 2
    parts: list[Part] = []

    def add(columns: Array, *variables: str) -> None:
        parts.append((columns, variables))

    for other in range(observed.joints):
        add(_hats(position[:, other], hats), f"position_{other + 1}")
        add(_hats(velocity[:, other], hats), f"velocity_{other + 1}")
        if other != joint:
            pair = f"position_{joint + 1}", f"position_{other + 1}"
            add(_waves(position[:, [joint, other]], rng, waves), *pair)
            add(_waves(velocity[:, [joint, other]], rng, waves), f"velocity_{joint + 1}", f"velocity_{other + 1}")
            add(
                _waves(np.column_stack([position[:, joint], velocity[:, other]]), rng, waves),
                pair[0],
                f"velocity_{other + 1}",
            )
    others = [other for other in range(observed.joints) if other != joint]
    for first, second in islice(combinations(others, 2), tuning.max_pairs):
        add(_waves(position[:, [first, second]], rng, waves), f"position_{first + 1}", f"position_{second + 1}")
    own = f"velocity_{joint + 1}"
    add(_hats(acceleration[:, joint], hats), f"acceleration_{joint + 1}")
    placed = np.column_stack([position[:, joint], velocity[:, joint]])
    driven = np.column_stack([velocity[:, joint], acceleration[:, joint]])
    add(_waves(placed, rng, tuning.waves), f"position_{joint + 1}", own)
    add(_waves(driven, rng, tuning.waves), own, f"acceleration_{joint + 1}")
    runs = whole_runs(observed)
    signs = _smooth_signs(runs.velocity[:, joint], tuning.sign_widths)
    turn = runs.filtered(signs[:, 2:3])
    add(runs.filtered(signs), own)
    patches = _hats(runs.position[:, joint], tuning.fine_hats) * signs[:, 2:3]
    add(runs.filtered(patches), own, f"position_{joint + 1}")
    add(runs.filtered(runs.lags(signs[:, 1], tuning.memories_s)), own)
    add(runs.filtered(runs.lags(runs.velocity[:, joint], tuning.memories_s)), own)
    clock = observed.time
    add(_hats(clock, hats), "time")
    add(np.column_stack([clock, clock**2]) * turn, own, "time")
    add(np.column_stack([clock, clock**2]) * velocity[:, [joint]], own, "time")
    return _standardise(parts)


def motion_banks(observed: Observed, joint: int, tuning: SurrogateTuning) -> tuple[Features, ...]:
    """Few features each, of one kind of dependence on the motion.

    What depends on little drowns in the noise of what does not matter where hundreds of features are taught at once.
    """
    position = observed.kept("position")
    velocity = observed.kept("velocity")
    acceleration = observed.kept("acceleration")
    place, speed, change = (f"{name}_{joint + 1}" for name in ("position", "velocity", "acceleration"))
    runs, own, hats, memories = whole_runs(observed), velocity[:, joint], tuning.hats, tuning.memories_s
    signs = _smooth_signs(runs.velocity[:, joint], tuning.sign_widths)
    lagged = [runs.lags(values, memories) for values in (signs[:, 1], runs.velocity[:, joint])]
    fast = [_hats(own, tuning.fine_hats), runs.filtered(np.column_stack([signs, *lagged]))]
    patches = signs[:, 2:3] * _hats(runs.position[:, joint], tuning.fine_position_hats)
    mapped = [runs.filtered(patches), own[:, None] * _hats(position[:, joint], tuning.position_hats)]
    driven = _products(own, acceleration[:, joint], tuning.product_speeds)
    out = [
        _standardise([(columns, (speed,)) for columns in fast]),
        _standardise([(columns, (place, speed)) for columns in mapped]),
        _standardise([(_hats(position[:, joint], tuning.fine_position_hats), (place,))]),
        _standardise([(driven, (speed, change))]),
    ]
    for other in range(observed.joints):
        theirs = f"velocity_{other + 1}"
        turned = runs.filtered(runs.turns(other, tuning.turning_ways))
        out.append(_standardise([(turned, (theirs,))]))
        if other != joint:
            both = _products(position[:, joint], position[:, other], tuning.product_positions)
            smooth = _smooth_signs(runs.velocity[:, other], tuning.sign_widths)
            late = [runs.lags(values, memories) for values in (smooth[:, 2], runs.velocity[:, other])]
            moved = [_hats(velocity[:, other], hats), runs.filtered(np.column_stack([smooth, *late]))]
            out.append(_standardise([(both, (place, f"position_{other + 1}"))]))
            out.append(_standardise([(columns, (theirs,)) for columns in moved]))
    return tuple(out)


def load_banks(observed: Observed, joint: int, load: Array, tuning: SurrogateTuning) -> tuple[Features, ...]:
    """The same of dependence on the load. load: torque of the model at the joint, (samples,) of all runs, N m."""
    torque, speed = f"torque_{joint + 1}", f"velocity_{joint + 1}"
    runs, hats = whole_runs(observed), tuning.hats
    own = runs.velocity[:, joint]
    turn = _smooth_signs(own, tuning.sign_widths)[:, 2:3]
    loaded = [
        (_hats(load, hats), (torque,)),
        (load[:, None] * _hats(own, hats), (torque, speed)),
        (turn * _hats(load, hats), (torque, speed)),
    ]
    about_zero, swung = _smooth_signs(load, tuning.sign_widths), runs.swings(load, tuning)
    banks = (loaded, [(about_zero, (torque,))], [(swung, (torque,))])
    return tuple(_standardise([(runs.filtered(columns), names) for columns, names in bank]) for bank in banks)


def _standardise(parts: Sequence[Part]) -> Features:
    """Features of columns (rows, count) with the variables that they depend on; constant ones left out."""
    matrix = np.column_stack([columns for columns, _ in parts])
    names = [frozenset(variables) for columns, variables in parts for _ in range(columns.shape[1])]
    matrix = matrix - matrix.mean(axis=0)
    spread = matrix.std(axis=0)
    kept = spread > 1e-9
    chosen = tuple(name for name, wanted in zip(names, kept, strict=True) if wanted)
    return Features(matrix[:, kept] / spread[kept], chosen)


def _hats(values: Array, hats: int) -> Array:
    """Piecewise linear functions between quantiles of the values, (rows, hats)."""
    knots = np.unique(np.quantile(values, np.linspace(0, 1, hats)))
    if len(knots) < 3:
        return np.empty((len(values), 0))
    return np.column_stack([np.interp(values, knots, unit) for unit in np.eye(len(knots))])


def _products(one: Array, other: Array, hats: int) -> Array:
    """Every function of one variable times every one of the other, (rows, products)."""
    first, second = _hats(one, hats), _hats(other, hats)
    return (first[:, :, None] * second[:, None, :]).reshape(len(one), first.shape[1] * second.shape[1])


def _waves(values: Array, rng: np.random.Generator, count: int) -> Array:
    spread = values.std(axis=0)
    scaled = (values - values.mean(axis=0)) / np.where(spread > 0, spread, 1)
    frequency = rng.normal(0, 1.0, (values.shape[1], count))
    return np.asarray(np.cos(scaled @ frequency + rng.uniform(0, 2 * np.pi, count)))


def _smooth_signs(values: Array, widths: Sequence[float]) -> Array:
    """Smooth signs (rows, widths) of a signal. widths: of its largest value."""
    top = max(float(np.abs(values).max()), 1e-9)
    return np.column_stack([np.tanh(values / (width * top)) for width in widths])


@dataclass(frozen=True, eq=False)
class Structure:
    """What a surrogate predicts of a joint's residual.

    gain: share by which the whitened held-out error falls, p_value: of chance making that (see `Gain`); the surer of
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


def find_structure(
    learnt: Remainder, whole: Remainder, joint: int, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Structure:
    """What features predict of what is left at a joint: whitened, or as it is.

    learnt: by a fit of the identification rows, beside which validation runs are predicted. whole: by one of all rows,
    beside which stretches are predicted in turn; where a fit of some rows is bad elsewhere, that is no structure.
    A slow structure that no surrogate foretold has passed for coloured noise, and whitening would hide it. As slow
    noise would pass for structure, it counts only if validation runs have it, too.
    """
    plain = replace(noise, taps=tuple(np.ones(1) for _ in noise.taps), scales=tuple(1.0 for _ in noise.taps))
    whitened = _find_structure(learnt, whole, joint, noise, observed, tuning)
    raw = _find_structure(learnt, whole, joint, plain, observed, tuning)
    least = tuning.min_structure_gain
    ways = [whitened, raw] if raw.validation_gain > least else [whitened]
    return min(ways, key=lambda each: (each.gain <= least, each.p_value))


def _find_structure(
    learnt: Remainder, whole: Remainder, joint: int, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Structure:
    learn, judge = observed.of_role("identify", joint), observed.of_role("validate", joint)
    both = (*learn, *judge)
    lost, rows = noise.lost(joint), rows_in(judge, observed.rows)
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
    all_grams, all_products, folds = products_by_third(all_columns, all_target, numbers % 3, everything)
    turned = errors_in_turn(all_columns, all_target, folds, ridge, all_grams, all_products)
    inside = held_out_gain(all_target, turned, blocks)
    least = tuning.min_structure_gain
    if (inside.share <= least, inside.chance) < (validated.share <= least, validated.chance):
        best, left, pair, sums = inside, whole, (all_columns, all_target), (all_grams, all_products)
        used = np.ones(observed.rows, dtype=bool)
        prediction = predict_in_turn(whole.features.values, used, observed, ridge, all_grams, all_products, tuning)
    else:
        best, left, pair, sums = validated, learnt, (columns[~known], target[~known]), (grams, products)
        prediction = learnt.features.values @ weights
    power = float(np.mean(left.residual[rows] ** 2))
    share = 1 - float(np.mean((left.residual[rows] - prediction[rows]) ** 2)) / max(power, 1e-300)
    found: tuple[str, ...] = ()
    if best.share > least:
        gram, towards = (np.sum(parts, axis=0) for parts in sums)
        found = _important_variables(left.features, gram, towards, pair, ridge, tuning)
    return Structure(joint, best.share, best.chance, validated.share, share, prediction, found)


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
