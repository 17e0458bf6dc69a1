"""Makes a run ready for a regressor: even samples, smoothed positions, their derivatives, and filtered torque."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.recordings.cutoff import CutoffChoice, choose_cutoff
from armlab.recordings.filters import Butterworth
from armlab.recordings.recording import Run
from problem.motion import Motion

MIN_STEP_SHARE = 0.2  # of a step: a spline through two noisy samples this close would swing out


def resample_evenly(run: Run) -> Run:
    """The run at even stamps, by cubic splines through its samples; the same run if they are even already.

    Lost samples (the reader splits a run at long gaps) are bridged by the same splines.
    """
    if run.even:
        return run
    steps = np.diff(run.time)
    usual = float(np.median(steps))
    run = run.rows(np.append(True, steps >= MIN_STEP_SHARE * usual))
    intervals = round((run.time[-1] - run.time[0]) / usual)
    time = np.linspace(run.time[0], run.time[-1], intervals + 1)
    return resample_at(run, time)


def resample_at(run: Run, time: Array) -> Run:
    """The run at other stamps within its own, by cubic splines."""
    return run.with_signals(time, {name: _interpolate(time, run.time, signal) for name, signal in run.signals.items()})


def _interpolate(time: Array, known: Array, signal: Array) -> Array:
    measured = ~np.isnan(signal).any(axis=0)
    values = np.full((len(time), signal.shape[1]), np.nan)
    if measured.any():
        values[:, measured] = make_interp_spline(known, signal[:, measured], k=3)(time)
    return values


@dataclass(frozen=True, eq=False)
class Signals:
    """A run made ready for identification.

    run: even in time, unfiltered. motion: (samples, joints), all rows. torque: (kept, joints), filtered.
    cutoff: how the cut-off was chosen, None where it was given. position_cutoff_hz: of the positions, None where
    they passed no low-pass.
    """

    run: Run
    motion: Motion
    torque: Array
    filter: Butterworth
    cutoff: CutoffChoice | None = None
    position_cutoff_hz: float | None = None

    @property
    def time(self) -> Array:
        """Stamps of the kept rows, (kept,), s."""
        return self.run.time[self.filter.rows]

    def columns(self, matrix: Array) -> Array:
        """Columns of an observation matrix that passed the filter of the torque.

        matrix: (samples * joints, columns), the joints of a sample in consecutive rows, at every sample of
        `motion`. Returns (kept * joints, columns), row by row as `torque.ravel()`.
        """
        joints = self.motion.joints
        filtered = self.filter(matrix.reshape(-1, joints, matrix.shape[-1]))
        return filtered.reshape(-1, matrix.shape[-1])


NO_SPEED = 1e-9  # rad/s (m/s): what rounding makes of a joint that stands


def differentiate(
    run: Run,
    cutoff_hz: float | None = None,
    torque_cutoff_hz: float | None = None,
    step: int = 1,
) -> Signals:
    """Smoothed positions, their derivatives, and the filtered torque of a run.

    cutoff_hz: of the positions; chosen from the data if left out. torque_cutoff_hz: of the filter that torque
    and columns share; that of the positions if left out. step: every step-th row of torque and columns is kept.
    Raises ValueError for a cut-off above half the sampling rate.
    """
    run = resample_evenly(run)
    choice = None if cutoff_hz else choose_cutoff(run.position, run.rate_hz)
    cutoff = cutoff_hz or (choice.cutoff_hz if choice else 0.0)
    smooth = Butterworth(run.rate_hz, cutoff, run.samples).smooth(run.position)
    both = Butterworth(run.rate_hz, torque_cutoff_hz or cutoff, run.samples, step)
    return Signals(run, _spline_motion(run.time, smooth), both(run.torque), both, choice, cutoff)


def _spline_motion(time: Array, position: Array) -> Motion:
    """Derivatives of the quintic spline through the positions: fourth order in the step and better.

    What stands has no velocity: rounding would give it a direction, and friction with it.
    """
    spline = make_interp_spline(time, position, k=5)
    velocity = np.asarray(spline(time, 1))
    velocity[np.abs(velocity) < NO_SPEED] = 0.0
    return Motion(position, velocity, np.asarray(spline(time, 2)))
