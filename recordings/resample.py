"""Even samples from uneven ones: filters and differences need a constant step."""

import numpy as np
from scipy.interpolate import make_interp_spline

from recordings.run import Array, Run

TOO_CLOSE = 0.2  # of a step: a spline through two noisy samples this close would swing out


def evened(run: Run) -> Run:
    """The run at even stamps, by cubic splines through its samples; the same run if they are even already.

    Lost samples (the reader has cut the run at long gaps) are bridged by the same splines.
    """
    if run.even:
        return run
    steps = np.diff(run.time)
    usual = float(np.median(steps))
    run = run.rows(np.append(True, steps >= TOO_CLOSE * usual))
    intervals = round((run.time[-1] - run.time[0]) / usual)
    time = np.linspace(run.time[0], run.time[-1], intervals + 1)
    return sampled_at(run, time)


def sampled_at(run: Run, time: Array) -> Run:
    """The run at other stamps within its own, by cubic splines."""
    return run.with_signals(time, {name: _at(time, run.time, signal) for name, signal in run.signals.items()})


def _at(time: Array, known: Array, signal: Array) -> Array:
    measured = ~np.isnan(signal).any(axis=0)
    values = np.full((len(time), signal.shape[1]), np.nan)
    if measured.any():
        values[:, measured] = make_interp_spline(known, signal[:, measured], k=3)(time)
    return values
