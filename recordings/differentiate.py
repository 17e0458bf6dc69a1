"""From a run to the motion that a regressor needs, and the torque that passed the filter of its columns."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from problem.motion import Motion
from recordings.cutoff import CutoffChoice, choose_cutoff
from recordings.filters import Butterworth, Filter, LowPass
from recordings.resample import evened
from recordings.run import Array, Run


@dataclass(frozen=True, eq=False)
class Signals:
    """A run made ready for identification.

    run: even in time, unfiltered. motion: (samples, joints), all rows. torque: (kept, joints), filtered.
    torque_covariance: (joints, joints) of the noise of one row of torque, where repetitions have shown it.
    cutoff: how the cut-off was chosen, None where it was given. position_cutoff_hz: of the positions, None where
    they passed no low-pass.
    """

    run: Run
    motion: Motion
    torque: Array
    filter: Filter
    cutoff: CutoffChoice | None = None
    torque_covariance: Array | None = None
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


def differentiate(
    run: Run,
    low_pass: type[LowPass] = Butterworth,
    cutoff_hz: float | None = None,
    torque_cutoff_hz: float | None = None,
    step: int = 1,
) -> Signals:
    """Smoothed positions, their derivatives, and the filtered torque of a run.

    cutoff_hz: of the positions; chosen from the data if left out. torque_cutoff_hz: of the filter that torque
    and columns share; that of the positions if left out. step: keeps each so-manyth row of those.
    Raises ValueError for a cut-off above half the sampling rate.
    """
    run = evened(run)
    choice = None if cutoff_hz else choose_cutoff(run.position, run.rate_hz, low_pass)
    cutoff = cutoff_hz or (choice.cutoff_hz if choice else 0.0)
    smooth = low_pass(run.rate_hz, cutoff, run.samples).smooth(run.position)
    both = low_pass(run.rate_hz, torque_cutoff_hz or cutoff, run.samples, step)
    return Signals(run, _motion(run.time, smooth), both(run.torque), both, choice, None, cutoff)


def _motion(time: Array, position: Array) -> Motion:
    """Derivatives of the quintic spline through the positions: fourth order in the step and better."""
    spline = make_interp_spline(time, position, k=5)
    return Motion(position, np.asarray(spline(time, 1)), np.asarray(spline(time, 2)))
