"""A run by which models are judged: one low-pass and the same rows for all of them."""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.identification.regression import MAX_CUTOFF_SHARE, suggested_cutoff
from armlab.identification.torque_model import TorqueModel
from armlab.identification.validation import relative_percent
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.filters import Butterworth
from armlab.recordings.recording import Recording, Run


@dataclass(frozen=True)
class Percent:
    """||tau - tau_hat|| / ||tau|| over all joints in percent: of the torque as recorded, and of the filtered torque."""

    recorded: float
    filtered: float


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """run: even in time. low_pass: of torque and prediction, whatever model predicts; its rows are compared."""

    run: Run
    low_pass: Butterworth

    def percent(self, model: TorqueModel) -> Percent:
        """The error of a model, which smooths the positions in its own way to predict every sample."""
        torque, error = self.run.torque, self.run.torque - model.predict(self.run)
        rows = self.low_pass.rows
        filtered = relative_percent(self.low_pass(error), self.low_pass(torque))
        recorded = relative_percent(error[rows], torque[rows])
        if filtered is None or recorded is None:
            raise DataError(f"{self.run.name} has no torque that an error could be a share of")
        return Percent(recorded, filtered)

    def filtered_error(self, model: TorqueModel) -> Array:
        """The error of a model behind the low-pass, (kept, joints), N m (N)."""
        return self.low_pass(self.run.torque - model.predict(self.run))


def common_cutoff(recording: Recording) -> float:
    """The cut-off that the positions of the runs that identify suggest, Hz."""
    return max(suggested_cutoff(run) for run in recording.with_role("identify"))


def judged_run(run: Run, cutoff_hz: float) -> JudgedRun:
    """A run with its low-pass."""
    even = resample_evenly(run)
    return JudgedRun(even, Butterworth(even.rate_hz, min(cutoff_hz, MAX_CUTOFF_SHARE * even.rate_hz), even.samples))


def joint_rms(judged: tuple[JudgedRun, ...], model: TorqueModel) -> Array:
    """RMS of the filtered error of each joint over all runs, (joints,), N m (N)."""
    return np.asarray(np.sqrt(np.mean(np.concatenate([each.filtered_error(model) for each in judged]) ** 2, axis=0)))
