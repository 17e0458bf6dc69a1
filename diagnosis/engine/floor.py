"""The noise floor of each joint, from the data: what no model could predict."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import make_interp_spline

from diagnosis.engine.flexible import Features
from diagnosis.engine.observed import Observed
from diagnosis.engine.segments import rows_of
from diagnosis.engine.surrogate import predictable
from recordings.differentiate import Signals
from recordings.periods import find_period
from recordings.run import Array


def noise_floor(final: Array, made: Sequence[Features], observed: Observed) -> Array:
    """RMS (joints,), N m (N), of the noise of the filtered torque.

    final: (rows, joints), what the model leaves. What it leaves less what a surrogate can foretell of it: structure
    that nobody has named yet is no noise. Where runs repeat their motion, the scatter between repetitions, which owes
    nothing to any model; but noise is no more than what the model leaves (a disturbance may come at every other time).
    """
    floor = np.empty(final.shape[1])
    for joint, features in enumerate(made):
        left = final[:, joint] - predictable(final[:, joint], joint, features, observed)
        floor[joint] = np.sqrt(np.mean(left[rows_of(observed.used(joint), observed.rows)] ** 2))
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
