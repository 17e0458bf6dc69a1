"""Flexible regressions that stand in for physics without a name.

Splines and random waves (Rahimi and Recht 2007) of the joints' motion and of time, fitted by ridge regression. Only
what they predict on data that took no part counts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

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
    """values: (rows, features). variables: per feature the names of what it depends on.

    folds: (rows,), which third of the identification rows each belongs to, -1 for none. grams: of each third.
    """

    values: Array
    variables: tuple[frozenset[str], ...]
    folds: NDArray[np.intp]
    grams: tuple[Array, ...]


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
    signs = _smooth_signs(velocity[:, joint], tuning.sign_widths)
    add(signs, own)
    add(_hats(position[:, joint], tuning.fine_hats) * signs[:, 2:3], own, f"position_{joint + 1}")
    add(_lags(observed, signs[:, 1], tuning.memories_s), own)
    add(_lags(observed, velocity[:, joint], tuning.memories_s), own)
    clock = observed.time
    add(_hats(clock, hats), "time")
    add(np.column_stack([clock, clock**2]) * signs[:, 2:3], own, "time")
    add(np.column_stack([clock, clock**2]) * velocity[:, [joint]], own, "time")
    return _standardise(parts, time_thirds(observed, joint, tuning))


def feature_banks(observed: Observed, joint: int, load: Array, tuning: SurrogateTuning) -> Iterator[Features]:
    """Few features each, of one kind of dependence. load: torque of the model at the joint, (rows,), N m.

    What depends on little drowns in the noise of what does not matter where hundreds of features are taught at once.
    """
    position = observed.kept("position")
    velocity = observed.kept("velocity")
    acceleration = observed.kept("acceleration")
    signals = ("torque", "position", "velocity", "acceleration")
    torque, place, speed, change = (f"{name}_{joint + 1}" for name in signals)
    own, signs = velocity[:, joint], _smooth_signs(velocity[:, joint], tuning.sign_widths)
    turn, hats, memories = signs[:, 2:3], tuning.hats, tuning.memories_s
    thirds = time_thirds(observed, joint, tuning)
    loaded = [
        (_hats(load, hats), (torque,)),
        (load[:, None] * _hats(own, hats), (torque, speed)),
        (turn * _hats(load, hats), (torque, speed)),
    ]
    lagged = [_lags(observed, values, memories) for values in (signs[:, 1], own)]
    fast = [_hats(own, tuning.fine_hats), signs, *lagged]
    mapped = [
        turn * _hats(position[:, joint], tuning.fine_position_hats),
        own[:, None] * _hats(position[:, joint], tuning.position_hats),
    ]
    yield _standardise(loaded, thirds)
    yield _standardise([(_smooth_signs(load, tuning.sign_widths), (torque,))], thirds)
    yield _standardise([(columns, (speed,)) for columns in fast], thirds)
    yield _standardise([(columns, (place, speed)) for columns in mapped], thirds)
    yield _standardise([(_hats(position[:, joint], tuning.fine_position_hats), (place,))], thirds)
    driven = _products(own, acceleration[:, joint], tuning.product_speeds)
    yield _standardise([(driven, (speed, change))], thirds)
    for other in range(observed.joints):
        theirs = f"velocity_{other + 1}"
        yield _standardise([(_turns(observed, other, tuning.turning_ways), (theirs,))], thirds)
        if other != joint:
            both = _products(position[:, joint], position[:, other], tuning.product_positions)
            smooth = _smooth_signs(velocity[:, other], tuning.sign_widths)
            moved = [_hats(velocity[:, other], hats), smooth, _lags(observed, smooth[:, 2], memories)]
            moved.append(_lags(observed, velocity[:, other], memories))
            yield _standardise([(both, (place, f"position_{other + 1}"))], thirds)
            yield _standardise([(columns, (theirs,)) for columns in moved], thirds)


def _standardise(parts: Sequence[Part], thirds: NDArray[np.intp]) -> Features:
    """Features of columns (rows, count) with the variables that they depend on; constant ones left out."""
    matrix = np.column_stack([columns for columns, _ in parts])
    names = [frozenset(variables) for columns, variables in parts for _ in range(columns.shape[1])]
    matrix = matrix - matrix.mean(axis=0)
    spread = matrix.std(axis=0)
    kept = spread > 1e-9
    chosen = tuple(name for name, wanted in zip(names, kept, strict=True) if wanted)
    scaled = matrix[:, kept] / spread[kept]
    grams = tuple(scaled[thirds == fold].T @ scaled[thirds == fold] for fold in range(3))
    return Features(scaled, chosen, thirds, grams)


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


def _turns(observed: Observed, joint: int, ways: Sequence[float]) -> Array:
    """Signs of a joint's motion that turn over some way after a reversal (Dahl 1968), run by run, (rows, ways).

    ways: of its travel. It is what hysteresis makes of the motion, however fast that is.
    """
    positions = [each.motion.position[:, joint] for each in observed.signals]
    travel = max(max(float(np.ptp(each)) for each in positions), 1e-9)
    parts = [
        np.column_stack([dahl_state(position, way * travel) for way in ways])[each.filter.rows]
        for position, each in zip(positions, observed.signals, strict=True)
    ]
    return np.concatenate(parts)


def _lags(observed: Observed, values: Array, memories: Sequence[float]) -> Array:
    """First-order lags of a signal, run by run. memories: time constants, s."""
    lengths = np.cumsum([len(each.torque) for each in observed.signals])[:-1]
    out = []
    for memory in memories:
        keep = float(np.exp(-1 / (memory * observed.rate_hz)))
        parts = [lfilter([1 - keep], [1, -keep], part, zi=[keep * part[0]])[0] for part in np.split(values, lengths)]
        out.append(np.concatenate(parts))
    return np.column_stack(out)


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
    residual: Array, joint: int, made: Features, observed: Observed, tuning: SurrogateTuning
) -> Array:
    """What the features predict of a residual (rows,), zeros unless they do so on held-out rows, too."""
    products = tuple(made.values[made.folds == fold].T @ residual[made.folds == fold] for fold in range(3))
    ridge, weights = best_ridge(made.grams, products, tuning.ridge_exponents)
    predicted = made.values @ weights
    rows = rows_in(observed.of_role("validate", joint), observed.rows)
    numbers, learn = block_numbers(observed, tuning.block_s, tuning.min_blocks), made.folds >= 0
    validated = held_out_gain(residual[rows], residual[rows] - predicted[rows], numbers[rows])
    turned = errors_in_turn(made.values[learn], residual[learn], made.folds[learn], ridge, made.grams, products)
    inside = held_out_gain(residual[learn], turned, numbers[learn])
    gains = (validated, inside)
    sure = any(each.share > tuning.min_noise_gain and each.chance < tuning.noise_level for each in gains)
    return predicted if sure else np.zeros(len(residual))


def find_structure(
    residual: Array, joint: int, made: Features, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Structure:
    """What the features predict of a residual (rows,) of a joint: whitened, or as it is.

    A slow structure that no surrogate foretold has passed for coloured noise, and whitening would hide it. As slow
    noise would pass for structure, it counts only if validation runs have it, too.
    """
    plain = replace(noise, taps=tuple(np.ones(1) for _ in noise.taps), scales=tuple(1.0 for _ in noise.taps))
    whitened = _find_structure(residual, joint, made, noise, observed, tuning)
    raw = _find_structure(residual, joint, made, plain, observed, tuning)
    least = tuning.min_structure_gain
    ways = [whitened, raw] if raw.validation_gain > least else [whitened]
    return min(ways, key=lambda each: (each.gain <= least, each.p_value))


def _find_structure(
    residual: Array, joint: int, made: Features, noise: Noise, observed: Observed, tuning: SurrogateTuning
) -> Structure:
    learn, judge = observed.of_role("identify", joint), observed.of_role("validate", joint)
    both = (*learn, *judge)
    white, target = noise.whitened(made.values, joint, both), noise.whitened(residual[:, None], joint, both)[:, 0]
    lost = noise.lost(joint)
    known = np.arange(len(target)) < sum(each.stop - each.start - lost for each in learn)
    numbers = _stretch_numbers(both, lost, block_numbers(observed, tuning.fold_s, tuning.min_blocks))
    grams, products, thirds = products_by_third(white, target, numbers % 3, known)
    ridge, weights = best_ridge(grams, products, tuning.ridge_exponents)
    blocks = _stretch_numbers(both, lost, block_numbers(observed, tuning.block_s, tuning.min_blocks))
    validated = held_out_gain(target[~known], target[~known] - white[~known] @ weights, blocks[~known])
    all_grams, all_products, folds = products_by_third(white, target, thirds, np.ones(len(target), dtype=bool))
    turned = errors_in_turn(white, target, folds, ridge, all_grams, all_products)
    inside = held_out_gain(target, turned, blocks)
    least = tuning.min_structure_gain
    best = min((validated, inside), key=lambda gain: (gain.share <= least, gain.chance))
    rows = rows_in(judge, observed.rows)
    prediction = made.values @ weights
    if best is inside:
        prediction[rows] = predict_in_turn(made.values, rows, observed, ridge, all_grams, all_products, tuning)
    power = float(np.mean(residual[rows] ** 2))
    share = 1 - float(np.mean((residual[rows] - prediction[rows]) ** 2)) / max(power, 1e-300)
    pair = (white[~known], target[~known]) if best is validated else (white, target)
    found: tuple[str, ...] = ()
    if best.share > least:
        found = _important_variables(made, np.sum(grams, axis=0), np.sum(products, axis=0), pair, ridge, tuning)
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
