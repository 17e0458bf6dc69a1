"""The period of a motion that repeats itself."""

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.recording import Run

MAX_PERIOD_MISMATCH = 0.02  # of the motion's variance: a lag with a smaller mean-square difference is a period
MIN_PERIODS = 2


def find_period(run: Run) -> float | None:
    """The shortest time, s, after which the motion repeats itself; None if that is more than half the run."""
    run = resample_evenly(run)
    mismatch = _lag_mismatch(run.position)
    inner = mismatch[1:-1]
    valleys = np.flatnonzero((inner < mismatch[:-2]) & (inner <= mismatch[2:]) & (inner < MAX_PERIOD_MISMATCH)) + 1
    if not len(valleys):
        return None
    best = mismatch[valleys].min()
    lag = int(valleys[mismatch[valleys] <= 4 * best + 1e-12][0])
    return float((lag + _parabola_vertex(mismatch[lag - 1 : lag + 2])) / run.rate_hz)


def _lag_mismatch(position: Array) -> Array:
    """Mean-square difference of the motion to itself, over twice its variance, at each lag up to half the run."""
    centred = position - position.mean(axis=0)
    scale = np.sqrt(np.mean(centred**2, axis=0))
    centred = centred / np.where(scale > 0, scale, 1)
    samples, lags = len(centred), len(centred) // MIN_PERIODS + 1
    spectrum = np.fft.rfft(centred, n=2 * samples, axis=0)
    products = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[:lags].sum(axis=1)
    energy = np.append(0, np.cumsum(np.sum(centred**2, axis=1)))
    lag = np.arange(lags)
    both = energy[samples - lag] + energy[-1] - energy[lag]
    moving = max(int(np.sum(scale > 0)), 1)
    return np.asarray((both - 2 * products) / (2 * moving * (samples - lag)))


def _parabola_vertex(values: Array) -> float:
    """Where the parabola through three even points has its lowest point, from the middle one."""
    before, middle, after = values
    bend = before - 2 * middle + after
    return float((before - after) / (2 * bend)) if bend > 0 else 0.0
