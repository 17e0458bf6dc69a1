"""Periodic runs: periods are averaged, derivatives are exact, and the scatter between periods shows the noise.

Swevers et al. 1997 (Optimal robot excitation and identification): averaging removes noise without the bias of a
filter, and the differences between periods give its covariance.
"""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.differentiate import Signals, resample_at, resample_evenly
from armlab.recordings.filters import Filter
from armlab.recordings.recording import Run
from problem.motion import Motion

MAX_PERIOD_MISMATCH = 0.02  # of the motion's variance: a lag with a smaller mean-square difference is a period
MIN_PERIODS = 2


@dataclass(frozen=True)
class Harmonics(Filter):
    """Keeps the mean and the first `harmonics` multiples of the frequency of one period; (samples, ...)."""

    harmonics: int

    @property
    def rows(self) -> slice:
        """All rows: a period has no ends."""
        return slice(None)

    def smooth(self, signal: Array) -> Array:
        """The truncated Fourier series at the samples."""
        series = np.fft.rfft(signal, axis=0)
        series[self.harmonics + 1 :] = 0
        return np.asarray(np.fft.irfft(series, n=len(signal), axis=0))


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


def average_periods(run: Run, period_s: float | None = None, harmonics: int | None = None) -> Signals:
    """The average period of a run with its exact derivatives, and the covariance of the averaged torque.

    period_s: found in the data if left out. harmonics: how many are kept; chosen from the scatter if left out.
    The last whole periods are used, because a run starts with a transient. Raises ValueError for a run that is not
    periodic or shorter than two periods.
    """
    period = period_s or find_period(run)
    if period is None:
        raise ValueError(f"{run.name} does not repeat itself within half its length: no periods to average")
    periods = _stack_periods(resample_evenly(run), period)
    mean = {name: np.mean(signal, axis=0) for name, signal in periods.items()}
    count = harmonics or choose_harmonics(periods["position"])
    smooth = Harmonics(count)
    time = np.arange(len(mean["position"])) * period / len(mean["position"])
    averaged = run.with_signals(time, mean)
    residuals = np.array([smooth(torque - mean["torque"]) for torque in periods["torque"]])
    covariance = _covariance_of_mean(residuals)
    motion = _series_motion(mean["position"], period, count)
    return Signals(averaged, motion, smooth(mean["torque"]), smooth, torque_covariance=covariance)


def _stack_periods(run: Run, period: float) -> dict[str, Array]:
    """Each signal as (periods, samples, channels), resampled to a whole number of samples in a period."""
    samples = round(period * run.rate_hz)
    count = int((run.time[-1] - run.time[0] + 1 / run.rate_hz) / period + 1e-6)
    if count < MIN_PERIODS:
        raise ValueError(f"{run.name} holds {count} whole period(s) of {period:g} s; {MIN_PERIODS} are needed")
    step = period / samples
    time = run.time[-1] - step * np.arange(samples * count)[::-1]
    if abs(step * run.rate_hz - 1) * samples * count < 1e-3:
        chosen = run.rows(slice(run.samples - samples * count, None))
    else:
        chosen = resample_at(run, np.maximum(time, run.time[0]))
    return {name: signal.reshape(count, samples, -1) for name, signal in chosen.signals.items()}


def choose_harmonics(positions: Array) -> int:
    """The number of harmonics with the least estimated error of the averaged acceleration.

    positions: (periods, samples, joints). The noise of each harmonic is its scatter over the periods, so
    noise of any colour is known; an omitted harmonic costs its signal, a kept one its noise (Mallows 1973).
    """
    series = np.fft.rfft(positions, axis=1)
    mean = np.abs(series.mean(axis=0)) ** 2
    noise = np.var(series, axis=0, ddof=1) / len(series)
    weight = np.arange(series.shape[1])[:, None] ** 4.0
    gain = np.cumsum(weight * (2 * noise - mean), axis=0)
    power = np.sum(weight * mean, axis=0)
    moving = power > 0
    risk = np.sum(gain[:, moving] / power[moving], axis=1)
    return max(int(np.argmin(risk)), 1)


def _series_motion(position: Array, period: float, harmonics: int) -> Motion:
    series = np.fft.rfft(position, axis=0)
    series[harmonics + 1 :] = 0
    omega = 2j * np.pi * np.arange(len(series))[:, None] / period
    samples = len(position)
    velocity = np.fft.irfft(series * omega, n=samples, axis=0)
    acceleration = np.fft.irfft(series * omega**2, n=samples, axis=0)
    return Motion(np.fft.irfft(series, n=samples, axis=0), velocity, acceleration)


def _covariance_of_mean(residuals: Array) -> Array:
    """Covariance (joints, joints) of one row of the average, from residuals (periods, samples, joints)."""
    periods, samples, joints = residuals.shape
    rows = residuals.reshape(-1, joints)
    return np.asarray(rows.T @ rows / (samples * (periods - 1) * periods))
