"""Functions of the joints' motion, load and time that flexible regressions are made of, at the kept rows.

Splines and random waves (Rahimi and Recht 2007): hundreds of everything, and few of one kind of dependence each. What
jumps is made of all samples and passes the filter of the torque.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations, islice

import numpy as np

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.common.linear_filter import LinearFilter
from armlab.diagnosis.torque.columns.inverses import solve_positive
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.tuning import SurrogateTuning

ROUNDING = 1e-9  # rad, rad/s, rad/s2, s: sets values of a joint that stands apart
Part = tuple[Array, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class Grams:
    """Products of features, (features, features), of each third of the rows.

    asked_often: for many residuals, so that their axes pay: these take the time of twenty ridges.
    """

    thirds: tuple[Array, ...]
    asked_often: bool = False

    @cached_property
    def axes(self) -> tuple[tuple[Array, Array], ...]:
        """Eigenvalues and eigenvectors of what each third leaves."""
        whole = np.sum(self.thirds, axis=0)
        return tuple((values, vectors) for values, vectors in (np.linalg.eigh(whole - own) for own in self.thirds))

    def best_ridge(self, products: tuple[Array, ...], exponents: Sequence[float]) -> tuple[float, Array]:
        """The ridge that predicts each third best from the others, and the weights with it on all.

        products: of features and what is predicted, (features,), of each third. exponents: of ten, of the ridges that
        are tried, in units of the mean squared length of a feature.
        """
        count = len(products[0])
        ridges = 10.0 ** np.array(exponents) * sum(float(np.trace(gram)) for gram in self.thirds) / max(count, 1)
        towards, errors = np.sum(products, axis=0), np.zeros(len(ridges))
        for number, (own, product) in enumerate(zip(self.thirds, products, strict=True)):
            weights = self._weights_without(number, towards - product, ridges)
            errors += np.sum(weights * (own @ weights), axis=0) - 2 * product @ weights
        best = float(ridges[int(np.argmin(errors))])
        return best, solve_positive(np.sum(self.thirds, axis=0) + best * np.eye(count), towards)

    def weights_in_turn(self, products: Sequence[Array], ridge: float) -> Array:
        """The weights with a ridge on all rows but each third, (features, thirds)."""
        towards, ridges = np.sum(products, axis=0), np.array([ridge])
        parts = (self._weights_without(number, towards - each, ridges) for number, each in enumerate(products))
        return np.column_stack(list(parts))

    def _weights_without(self, third: int, towards: Array, ridges: Array) -> Array:
        """The weights with each ridge on all rows but a third, (features, ridges)."""
        if self.asked_often:
            values, vectors = self.axes[third]
            return np.asarray(vectors @ ((vectors.T @ towards)[:, None] / (np.maximum(values, 0)[:, None] + ridges)))
        gram, unit = np.sum(self.thirds, axis=0) - self.thirds[third], np.eye(len(towards))
        return np.column_stack([solve_positive(gram + ridge * unit, towards) for ridge in ridges])


@dataclass(frozen=True, eq=False)
class Features:
    """values: (rows, features). variables: per feature the names of what it depends on.

    grams: of the rows of a joint that identify, where these are asked again and again.
    """

    values: Array
    variables: tuple[frozenset[str], ...]
    grams: Grams | None = None


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
            lag = LinearFilter.first_order_lag(keep)
            out.append(np.concatenate([lag.forwards(part, lag.settled * part[0]) for part in self.split(values)]))
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
        step = tuning.swing_range ** (1 / (tuning.swings - 1))
        damping = (np.sqrt(step) - 1 / np.sqrt(step)) / 2  # each answers as far as the next one
        for frequency in np.geomspace(fastest / tuning.swing_range, fastest, tuning.swings):
            for swing in _swings(float(frequency), float(damping), rate):
                out.append(np.concatenate([swing.forwards(part - part[0]) for part in self.split(drive)]))
        return np.column_stack(out)


@lru_cache(maxsize=64)
def _swings(frequency: float, damping: float, rate: float) -> tuple[LinearFilter, LinearFilter]:
    """The deflection and the speed of a driven spring, by the bilinear transform, right at its frequency."""
    turn = 2 * rate * np.tan(np.pi * frequency / rate)
    spring = (1.0, 2 * damping * turn, turn**2)
    deflection, speed = ((0.0, 0.0, turn**2), (0.0, turn, 0.0))
    return LinearFilter.bilinear(deflection, spring, rate), LinearFilter.bilinear(speed, spring, rate)


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
    hats = tuning.hats
    parts: list[Part] = []

    def add(columns: Array, *variables: str) -> None:
        parts.append((columns, variables))

    for other in range(observed.joints):
        add(_hats(position[:, other], hats), f"position_{other + 1}")
        add(_hats(velocity[:, other], hats), f"velocity_{other + 1}")
        if other != joint:
            pair = f"position_{joint + 1}", f"position_{other + 1}"
            add(_waves(position[:, [joint, other]], rng, hats), *pair)
            add(_waves(velocity[:, [joint, other]], rng, hats), f"velocity_{joint + 1}", f"velocity_{other + 1}")
            add(
                _waves(np.column_stack([position[:, joint], velocity[:, other]]), rng, hats),
                pair[0],
                f"velocity_{other + 1}",
            )
    others = [other for other in range(observed.joints) if other != joint]
    for first, second in islice(combinations(others, 2), tuning.max_pairs):
        add(_waves(position[:, [first, second]], rng, hats), f"position_{first + 1}", f"position_{second + 1}")
    own = f"velocity_{joint + 1}"
    add(_hats(acceleration[:, joint], hats), f"acceleration_{joint + 1}")
    placed = np.column_stack([position[:, joint], velocity[:, joint]])
    driven = np.column_stack([velocity[:, joint], acceleration[:, joint]])
    add(_waves(placed, rng, 2 * hats), f"position_{joint + 1}", own)
    add(_waves(driven, rng, 2 * hats), own, f"acceleration_{joint + 1}")
    runs = whole_runs(observed)
    signs = _smooth_signs(runs.velocity[:, joint], tuning.sign_widths)
    turn = runs.filtered(signs[:, 2:3])
    add(runs.filtered(signs), own)
    patches = _hats(runs.position[:, joint], 2 * hats) * signs[:, 2:3]
    add(runs.filtered(patches), own, f"position_{joint + 1}")
    add(runs.filtered(runs.lags(signs[:, 1], tuning.memories_s)), own)
    add(runs.filtered(runs.lags(runs.velocity[:, joint], tuning.memories_s)), own)
    clock = observed.time
    add(_hats(clock, hats), "time")
    add(np.column_stack([clock, clock**2]) * turn, own, "time")
    add(np.column_stack([clock, clock**2]) * velocity[:, [joint]], own, "time")
    return _standardise(parts)


def motion_banks(observed: Observed, tuning: SurrogateTuning) -> tuple[tuple[Features, ...], ...]:
    """Of each joint few features each, of one kind of dependence on the motion.

    What depends on little drowns in the noise of what does not matter where hundreds of features are taught at once.
    Those of another joint's motion alone are the same ones for all joints.
    """
    joints = range(observed.joints)
    theirs = [_banks_of_velocity(observed, other, tuning) for other in joints]
    return tuple(_banks_of_joint(observed, joint, theirs, tuning) for joint in joints)


def _banks_of_velocity(observed: Observed, other: int, tuning: SurrogateTuning) -> tuple[Features, Features]:
    """Of how often a joint (from 0) has turned, and of its velocity now and before."""
    runs, names = whole_runs(observed), (f"velocity_{other + 1}",)
    smooth = _smooth_signs(runs.velocity[:, other], tuning.sign_widths)
    late = [runs.lags(values, tuning.memories_s) for values in (smooth[:, 2], runs.velocity[:, other])]
    moved = [_hats(observed.kept("velocity")[:, other], tuning.hats), runs.filtered(np.column_stack([smooth, *late]))]
    turned = runs.filtered(runs.turns(other, tuning.turning_ways))
    return _standardise([(turned, names)]), _standardise([(columns, names) for columns in moved])


def _banks_of_joint(
    observed: Observed, joint: int, theirs: Sequence[tuple[Features, Features]], tuning: SurrogateTuning
) -> tuple[Features, ...]:
    """theirs: `_banks_of_velocity` of each joint."""
    position = observed.kept("position")
    velocity = observed.kept("velocity")
    acceleration = observed.kept("acceleration")
    place, speed, change = (f"{name}_{joint + 1}" for name in ("position", "velocity", "acceleration"))
    runs, own, memories = whole_runs(observed), velocity[:, joint], tuning.memories_s
    signs = _smooth_signs(runs.velocity[:, joint], tuning.sign_widths)
    lagged = [runs.lags(values, memories) for values in (signs[:, 1], runs.velocity[:, joint])]
    fast = [_hats(own, 2 * tuning.hats), runs.filtered(np.column_stack([signs, *lagged]))]
    patches = signs[:, 2:3] * _hats(runs.position[:, joint], 3 * tuning.hats)
    mapped = [runs.filtered(patches), own[:, None] * _hats(position[:, joint], 2 * tuning.hats)]
    driven = _products(own, acceleration[:, joint], tuning.hats // 2)
    out = [
        _standardise([(columns, (speed,)) for columns in fast]),
        _standardise([(columns, (place, speed)) for columns in mapped]),
        _standardise([(_hats(position[:, joint], 3 * tuning.hats), (place,))]),
        _standardise([(driven, (speed, change))]),
    ]
    for other, (turned, moved) in enumerate(theirs):
        out.append(turned)
        if other != joint:
            both = _products(position[:, joint], position[:, other], tuning.hats // 2)
            out += [_standardise([(both, (place, f"position_{other + 1}"))]), moved]
    return tuple(out)


@dataclass(frozen=True, eq=False)
class Load:
    """Torque of a model at all samples of all runs, (samples, joints), N m (N). bodies: of its rigid bodies alone."""

    torque: Array
    bodies: Array


def load_banks(observed: Observed, joint: int, loads: Load, tuning: SurrogateTuning) -> tuple[Features, ...]:
    """The same of dependence on the load of a joint (from 0).

    What swings is driven by the bodies: friction acts between two neighbours, inside of what swings.
    """
    torque, speed = f"torque_{joint + 1}", f"velocity_{joint + 1}"
    runs, hats, load = whole_runs(observed), tuning.hats, loads.torque[:, joint]
    own = runs.velocity[:, joint]
    turn = _smooth_signs(own, tuning.sign_widths)[:, 2:3]
    loaded = [
        (_hats(load, hats), (torque,)),
        (load[:, None] * _hats(own, hats), (torque, speed)),
        (turn * _hats(load, hats), (torque, speed)),
    ]
    about_zero, swung = _smooth_signs(load, tuning.sign_widths), runs.swings(loads.bodies[:, joint], tuning)
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
    knots = knots[np.append(True, np.diff(knots) > ROUNDING)]  # of a joint that stands many are one
    if len(knots) < 3:
        return np.empty((len(values), 0))
    return np.column_stack([np.interp(values, knots, unit) for unit in np.eye(len(knots))])


def _products(one: Array, other: Array, hats: int) -> Array:
    """Every function of one variable times every one of the other, (rows, products)."""
    first, second = _hats(one, hats), _hats(other, hats)
    return (first[:, :, None] * second[:, None, :]).reshape(len(one), first.shape[1] * second.shape[1])


def _waves(values: Array, rng: np.random.Generator, count: int) -> Array:
    spread = values.std(axis=0)
    scaled = (values - values.mean(axis=0)) / np.where(spread > ROUNDING, spread, 1)
    frequency = rng.normal(0, 1.0, (values.shape[1], count))
    return np.asarray(np.cos(scaled @ frequency + rng.uniform(0, 2 * np.pi, count)))


def _smooth_signs(values: Array, widths: Sequence[float]) -> Array:
    """Smooth signs (rows, widths) of a signal. widths: of its largest value."""
    top = max(float(np.abs(values).max()), 1e-9)
    return np.column_stack([np.tanh(values / (width * top)) for width in widths])
