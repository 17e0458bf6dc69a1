"""The linear regression that runs leave: rows in time, joints side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.identification.structure import Structure
from armlab.recordings.cutoff import ROWS_PER_CUTOFF, choose_cutoff
from armlab.recordings.differentiate import Signals, differentiate, resample_evenly
from armlab.recordings.recording import Run
from problem.drive_torque import torque_beside_columns

MAX_CUTOFF_SHARE = 0.45  # of the sampling rate: cut-offs


@dataclass(frozen=True, eq=False)
class Regression:
    """torque = matrix @ parameters + error.

    matrix: (samples * joints, columns). torque: (samples * joints,), N m. lengths: samples of each run, in
    their order. rate_hz: of the rows. correlation_s: the time over which the filter ties errors together.
    """

    matrix: Array
    torque: Array
    joints: int
    lengths: tuple[int, ...]
    rate_hz: float
    correlation_s: float

    @property
    def samples(self) -> int:
        """Number of instants."""
        return len(self.torque) // self.joints

    @property
    def torques(self) -> Array:
        """The torque as (samples, joints)."""
        return self.torque.reshape(-1, self.joints)

    def residuals(self, parameters: Array) -> Array:
        """What the parameters leave of the torque, (samples, joints)."""
        return (self.torque - self.matrix @ parameters).reshape(-1, self.joints)

    def rows(self, chosen: NDArray[np.bool_]) -> "Regression":
        """Only the chosen samples (samples,), each with all joints."""
        wanted = np.repeat(chosen, self.joints)
        ends = np.cumsum(self.lengths)
        lengths = tuple(int(np.sum(part)) for part in np.split(chosen, ends[:-1]))
        return replace(self, matrix=self.matrix[wanted], torque=self.torque[wanted], lengths=lengths)

    def columns(self, chosen: NDArray[np.intp] | slice) -> "Regression":
        """Only the chosen columns."""
        return replace(self, matrix=self.matrix[:, chosen])

    def weighted(self, weights: Array) -> "Regression":
        """Rows times weights: (joints,) or (samples * joints,)."""
        every = np.tile(weights, self.samples) if len(weights) == self.joints else weights
        return replace(self, matrix=self.matrix * every[:, None], torque=self.torque * every)


def signals_of(run: Run, cutoff_hz: float | None = None, position_factor: float = 1.0) -> Signals:
    """The run ready for identification.

    cutoff_hz: of the filter that torque and columns share; chosen from the positions if left out.
    position_factor: the cut-off of the positions over it. Columns pass both filters, the torque only one: with a
    factor of 1 they lose more than the torque near the cut-off, with a larger one they carry more encoder noise.
    """
    chosen = cutoff_hz or suggested_cutoff(run)
    step = max(int(run.rate_hz / (ROWS_PER_CUTOFF * chosen)), 1)
    most = MAX_CUTOFF_SHARE * run.rate_hz
    positions = min(position_factor * chosen, most)
    return differentiate(run, cutoff_hz=positions, torque_cutoff_hz=min(chosen, most), step=step)


def refilter(signals: Signals, run: Run) -> Signals:
    """Another version of the run of these signals through the same filters."""
    shared = signals.filter
    return differentiate(run, signals.position_cutoff_hz, shared.cutoff_hz, shared.step)


def suggested_cutoff(run: Run) -> float:
    """The cut-off that the positions of a run suggest, Hz."""
    even = resample_evenly(run)
    return choose_cutoff(even.position, even.rate_hz).cutoff_hz


def _target(structure: Structure, signals: Signals) -> Array:
    return np.asarray(signals.torque - signals.filter(torque_beside_columns(structure.arm, signals.motion)))


def require_rows(data: Regression) -> None:
    """Raises DataError for fewer independent rows than unknowns: such a fit explains everything and says nothing.

    A filter leaves two independent samples a period of its cut-off.
    """
    independent = data.joints * sum(
        max(int(2 * samples / (data.rate_hz * data.correlation_s)), 1) for samples in data.lengths
    )
    if independent <= data.matrix.shape[1]:
        raise DataError(
            f"the runs hold {independent} independent rows below {1 / data.correlation_s:.3g} Hz for "
            f"{data.matrix.shape[1]} unknown numbers: record longer motion, or give a higher --cutoff-hz"
        )


def regression(structure: Structure, signals: Sequence[Signals]) -> Regression:
    """The regression of one or more runs; ValueError for runs of another arm or without any rows.

    The weight that the simulator of the arm holds itself, which no column has, is added to the torque of the drives.
    """
    joints = len(structure.arm)
    wrong = [each.run.name for each in signals if each.motion.joints != joints]
    if wrong or not signals:
        raise DataError(f"{wrong[0]} does not have the {joints} joints of {structure.arm.name}" if wrong else "no run")
    matrix = np.vstack([structure.filtered(each) for each in signals])
    torque = np.concatenate([_target(structure, each).ravel() for each in signals])
    first = signals[0]
    rate = 1 / float(np.median(np.diff(first.time)))
    return Regression(
        matrix, torque, joints, tuple(len(each.torque) for each in signals), rate, 1 / first.filter.cutoff_hz
    )
