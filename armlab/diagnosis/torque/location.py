"""Where the error is: the noise floor of each joint, and the joints, variables and times that hold the excess."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.diagnosis.result import Located
from armlab.diagnosis.torque.rows.data import Observed, rows_in
from armlab.diagnosis.torque.search.surrogate import FoldedFeatures, predict_structure
from armlab.diagnosis.tuning import Tuning
from armlab.recordings.differentiate import Signals
from armlab.recordings.periods import find_period


def noise_floor(final: Array, made: Sequence[FoldedFeatures], observed: Observed, tuning: Tuning) -> Array:
    """RMS (joints,), N m (N), of the noise of the filtered torque.

    final: (rows, joints), what the model leaves. What it leaves less what a surrogate can foretell of it: structure
    that nobody has named yet is no noise. Where runs repeat their motion, the scatter between repetitions, which owes
    nothing to any model; but noise is no more than what the model leaves (a disturbance may come at every other time).
    """
    floor = np.empty(final.shape[1])
    for joint, features in enumerate(made):
        left = final[:, joint] - predict_structure(final[:, joint], joint, features, observed, tuning.surrogate)
        floor[joint] = np.sqrt(np.mean(left[rows_in(observed.used(joint), observed.rows)] ** 2))
    scatter = [each for each in map(period_scatter, observed.signals) if each is not None]
    return np.minimum(floor, np.sqrt(np.mean(np.square(scatter), axis=0))) if scatter else floor


def period_scatter(signals: Signals) -> Array | None:
    """RMS (joints,) of the filtered torque's noise, from a motion that repeats itself; None where it does not."""
    period = find_period(signals.run)
    if period is None:
        return None
    time, torque = signals.run.time[signals.filter.rows], signals.filter.smooth(signals.run.torque)
    early = time[time + period <= time[-1]]
    curve = make_interp_spline(signals.run.time, torque, k=3)
    return np.asarray(np.sqrt(np.mean((curve(early + period) - curve(early)) ** 2, axis=0) / 2))


def locate_excess(residual: Array, floor: Array, observed: Observed, tuning: Tuning) -> tuple[Located, ...]:
    """Joints whose error exceeds the noise. residual: (rows, joints); floor: (joints,), N m, of the noise."""
    power = residual**2 - floor**2
    joints = range(residual.shape[1])
    excess = np.array([_significant_excess(power[:, joint], observed, tuning) for joint in joints])
    total = float(excess.sum())
    if total <= 0:
        return ()
    order = [int(joint) for joint in np.argsort(-excess) if excess[joint] > 0]
    return tuple(_locate_in_joint(joint, excess[joint] / total, power[:, joint], observed, tuning) for joint in order)


def _significant_excess(power: Array, observed: Observed, tuning: Tuning) -> float:
    """Mean excess power, zero where it may be chance: tested between stretches of time, errors being tied."""
    _, numbers, counts = np.unique(observed.long_stretches, return_inverse=True, return_counts=True)
    means = np.bincount(numbers, power) / counts
    error = float(np.std(means, ddof=1) / np.sqrt(len(means)))
    mean = float(power.mean())
    return mean if mean > tuning.location.min_significance * error * np.sqrt(np.log(len(means) + 1)) else 0.0


def _locate_in_joint(joint: int, share: float, power: Array, observed: Observed, tuning: Tuning) -> Located:
    variables = _joint_variables(joint, observed)
    scored = {name: _best_regime(power, values, tuning) for name, values in variables.items()}
    best = max(scored, key=lambda name: scored[name][0])
    runs, peak = _affected_runs(power, observed, tuning), _peak_stretch(power, observed, tuning)
    return Located(joint + 1, float(share), best, f"{best} {scored[best][1]}", runs, peak)


def _joint_variables(joint: int, observed: Observed) -> dict[str, Array]:
    own = joint + 1
    velocity = observed.kept("velocity")[:, joint]
    return {
        f"position_{own}": observed.kept("position")[:, joint],
        f"velocity_{own}": velocity,
        f"acceleration_{own}": observed.kept("acceleration")[:, joint],
        f"speed_{own}": np.abs(velocity),
    }


def _best_regime(power: Array, values: Array, tuning: Tuning) -> tuple[float, str]:
    """Share of the excess error's scatter that a variable orders, and the regime with more than half of its peak."""
    count = tuning.location.bins
    edges = np.quantile(values, np.linspace(0, 1, count + 1))
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, count - 1)
    counts = np.bincount(bins, minlength=count)
    means = np.bincount(bins, power, count) / np.maximum(counts, 1)
    ordered = float(np.average((means - power.mean()) ** 2, weights=counts)) / max(float(np.var(power)), 1e-300)
    high = np.flatnonzero(means > means.max() / 2)
    if len(high) >= count - 1:
        return ordered, "over its whole range"
    spans = np.split(high, np.flatnonzero(np.diff(high) > 1) + 1)
    text = " and ".join(f"from {edges[each[0]]:.3g} to {edges[each[-1] + 1]:.3g}" for each in spans)
    return ordered, text


def _affected_runs(power: Array, observed: Observed, tuning: Tuning) -> tuple[str, ...]:
    """Runs with more than half of the excess of the worst one."""
    means: dict[str, float] = {}
    for index, name in enumerate(observed.names):
        parts = [power[each.start : each.stop] for each in observed.segments if each.run == index]
        means[name] = float(np.mean(np.concatenate(parts)))
    worst = max(means.values())
    return tuple(name for name, mean in means.items() if mean > worst / 2)


def _peak_stretch(power: Array, observed: Observed, tuning: Tuning) -> tuple[float, float] | None:
    """The short stretch of a run that holds most of all excess error; None where there is none."""
    total = float(np.sum(np.maximum(power, 0)))
    for each in observed.segments:
        part = np.maximum(power[each.start : each.stop], 0)
        width = max(len(part) // tuning.location.bins, 1)
        sums = np.convolve(part, np.ones(width), mode="valid")
        if total > 0 and sums.max() > total / 2:
            start = observed.time[each.start + int(np.argmax(sums))]
            return float(start), float(start + width / observed.rate_hz)
    return None
