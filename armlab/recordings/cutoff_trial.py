"""Choice of the cut-off of an identification by what it predicts: blocks of the runs that identify, left out in turn.

A spectrum of the positions alone tells where noise begins, not what a model of the torque makes of it: with encoders of
little noise it keeps everything, vibrations included. Here plain least squares, behind each cut-off, predicts the
torque as recorded on blocks of time that took no part. Too low a cut-off loses torque that the motion explains, too
high a one fits noise and vibrations; both predict worse. Runs that validate take no part.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.cutoff import MIN_CUTOFF_PERIODS
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.plain_least_squares import (
    PlainLayout,
    TrimmedButterworth,
    smooth_motion,
    suggested_cutoff_hz,
    weighted_solution,
)
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion

BLOCKS = 6  # of time, of all runs together, as for the model that predicts
MIN_SAMPLES = 20  # of a run whose spectrum tells a cut-off
MAX_ROWS = 1000  # of all runs, at which the torque is predicted
STEP = 2.0  # from one candidate to the next


@dataclass(frozen=True, eq=False)
class CutoffTrial:
    """candidates_hz: descending; scores: (candidates, blocks), mean logarithm of the joints' errors, less is better."""

    candidates_hz: tuple[float, ...]
    scores: Array

    @property
    def best_hz(self) -> float:
        """The candidate that predicts best in the mean of the blocks."""
        return self.candidates_hz[int(np.argmin(self.scores.mean(axis=1)))]


def choose_cutoff_hz(arm: Arm, runs: Sequence[Run]) -> float:
    """The best cut-off, Hz, of those up to what the positions suggest. Raises ValueError without rows."""
    long = [run for run in runs if run.samples >= MIN_SAMPLES]
    return try_cutoffs(arm, long, suggested_cutoff_hz(long)).best_hz


def try_cutoffs(arm: Arm, runs: Sequence[Run], highest_hz: float) -> CutoffTrial:
    """Compares cut-offs from the highest down to ten periods of the longest run. Raises ValueError without rows."""
    even = [resample_evenly(run) for run in runs]
    duration = max((run.samples / run.rate_hz for run in even), default=0.0)
    if duration <= 0:
        raise DataError("no run identifies")
    lowest = min(MIN_CUTOFF_PERIODS / duration, highest_hz)
    count = int(np.log(highest_hz / lowest) / np.log(STEP)) + 1
    candidates = tuple(float(highest_hz / STEP**number) for number in range(count))
    kept = [_kept_rows(run, lowest, sum(each.samples for each in even)) for run in even]
    sizes = [len(rows) for rows in kept]
    block = np.arange(sum(sizes)) * BLOCKS // max(sum(sizes), 1)
    recorded = np.concatenate([run.torque[rows] for run, rows in zip(even, kept, strict=True)])
    scores = [_scores(arm, _rows_behind(even, kept, each), recorded, block) for each in candidates]
    return CutoffTrial(candidates, np.array(scores))


def _kept_rows(run: Run, lowest_hz: float, samples: int) -> NDArray[np.intp]:
    """Rows at which the torque is predicted, without the ends that the lowest cut-off disturbs, a tenth at most."""
    margin = min(int(2 * run.rate_hz / lowest_hz), run.samples // 10)
    return np.arange(margin, run.samples - margin, max(samples // MAX_ROWS, 1), dtype=np.intp)


def _rows_behind(runs: Sequence[Run], kept: Sequence[NDArray[np.intp]], cutoff_hz: float) -> list[tuple[Motion, Array]]:
    """Motion and torque of each run behind a low-pass, at the rows that are kept."""
    out = []
    for run, rows in zip(runs, kept, strict=True):
        low_pass = TrimmedButterworth.possible(run, cutoff_hz)
        whole = smooth_motion(run, low_pass)
        motion = Motion(whole.position[rows], whole.velocity[rows], whole.acceleration[rows])
        out.append((motion, low_pass.smooth(run.torque)[rows]))
    return out


def _scores(arm: Arm, rows: Sequence[tuple[Motion, Array]], recorded: Array, block: NDArray[np.intp]) -> Array:
    """Of one cut-off, (blocks,). recorded: (rows, joints), unfiltered; block: (rows,)."""
    top_speed = np.max([np.abs(motion.velocity).max(axis=0) for motion, _ in rows], axis=0)
    layout = PlainLayout(arm, tuple(range(len(arm))), top_speed)
    matrix = np.concatenate([layout.matrix(motion) for motion, _ in rows])
    torque = np.concatenate([each for _, each in rows])
    out = []
    for number in range(BLOCKS):
        own = block == number
        values, _ = weighted_solution(matrix[~own], torque[~own])
        left = np.mean((recorded[own] - matrix[own] @ values) ** 2, axis=0)
        out.append(float(np.mean(0.5 * np.log(np.maximum(left, 1e-300)))))
    return np.array(out)
