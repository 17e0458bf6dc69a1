"""Choice of the cut-off of an identification by what it predicts: blocks of the runs that identify, left out in turn.

A spectrum of the positions alone tells where noise begins, not what a model of the torque makes of it: with encoders of
little noise it keeps everything, vibrations included. Here plain least squares, behind each cut-off, predicts the
torque of blocks that took no part, each with an equal share of the travel. Too low a cut-off loses torque that the
motion explains, too high a one fits noise and vibrations. Of cut-offs that one standard error does not tell apart, the
highest keeps most of what was recorded (Breiman, Friedman, Olshen and Stone 1984). Runs that validate take no part.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.cutoff import MAX_CUTOFF_SHARE, MIN_CUTOFF_PERIODS, ROWS_PER_CUTOFF, travel_bandwidth
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.plain_least_squares import PlainLayout, TrimmedButterworth, smooth_motion, weighted_solution
from armlab.recordings.recording import Run
from problem.arm import Arm

BLOCKS = 6  # of all runs together, as for the model that predicts
MIN_SAMPLES = 20  # of a run whose spectrum tells a cut-off
MAX_ROWS = 1000  # of all runs, that a fit uses
HARMONICS_JUDGED = 50  # of the travel: above them the torque is vibration and noise
STEP = 2.0  # from one candidate to the next


@dataclass(frozen=True, eq=False)
class CutoffTrial:
    """candidates_hz: descending; scores: (candidates, blocks), mean logarithm of the joints' errors, less is better."""

    candidates_hz: tuple[float, ...]
    scores: Array

    @property
    def best_hz(self) -> float:
        """The highest candidate that is no worse than the best one by more than one standard error over blocks."""
        beyond = self.scores - self.scores[np.argmin(self.scores.mean(axis=1))]
        error = np.std(beyond, axis=1, ddof=1) / np.sqrt(beyond.shape[1])
        return self.candidates_hz[int(np.argmax(beyond.mean(axis=1) <= error))]


@dataclass(frozen=True, eq=False)
class _Candidate:
    """Runs behind one cut-off. matrix, torque, block: of the rows that fit; judged_*: of those that judge, behind the
    low-pass of the judge.
    """

    matrix: Array
    torque: Array
    block: NDArray[np.intp]
    judged_matrix: Array
    judged_torque: Array
    judged_block: NDArray[np.intp]

    def scores(self) -> Array:
        """Of each block when the others are fitted, (blocks,); ValueError where fewer than two hold rows."""
        numbers = np.intersect1d(self.block, self.judged_block)
        if len(numbers) < 2:
            raise DataError("the runs move too little to try cut-offs: record more motion")
        out = []
        for number in numbers:
            own, judged = self.block == number, self.judged_block == number
            values, _ = weighted_solution(self.matrix[~own], self.torque[~own])
            left = np.mean((self.judged_torque[judged] - self.judged_matrix[judged] @ values) ** 2, axis=0)
            out.append(float(np.mean(0.5 * np.log(np.maximum(left, 1e-300)))))
        return np.array(out)


def choose_cutoff_hz(arm: Arm, runs: Sequence[Run]) -> float:
    """The cut-off, Hz, that predicts best among those that the rate carries. Raises ValueError without rows."""
    return try_cutoffs(arm, [run for run in runs if run.samples >= MIN_SAMPLES]).best_hz


def try_cutoffs(arm: Arm, runs: Sequence[Run]) -> CutoffTrial:
    """Compares cut-offs from the highest that can matter down to ten periods of the longest run.

    Raises ValueError without rows.
    """
    even = [resample_evenly(run) for run in runs]
    if not even:
        raise DataError("no run identifies")
    judged = HARMONICS_JUDGED * max(travel_bandwidth(run.position, run.rate_hz) for run in even)
    highest = min(judged, MAX_CUTOFF_SHARE * min(run.rate_hz for run in even))
    lowest = min(MIN_CUTOFF_PERIODS * min(run.rate_hz / run.samples for run in even), highest)
    candidates = tuple(float(highest / STEP**number) for number in range(int(np.log2(highest / lowest)) + 1))
    blocks = _blocks_of_equal_travel(even, lowest)
    return CutoffTrial(
        candidates, np.array([_behind(arm, even, blocks, each, lowest, judged).scores() for each in candidates])
    )


def _blocks_of_equal_travel(runs: Sequence[Run], lowest_hz: float) -> list[NDArray[np.intp]]:
    """The block of each sample of each run: a joint counts by its travel as a share of its range."""
    span = np.ptp(np.concatenate([run.position for run in runs]), axis=0)
    shares = []
    for run in runs:
        way = np.zeros(run.position.shape)
        rows = _rows(run, lowest_hz, 1)
        way[rows] = np.abs(np.diff(run.position[rows], axis=0, prepend=run.position[rows][:1]))
        shares.append(np.sum(way / np.where(span > 0, span, 1.0), axis=1))
    sums = np.cumsum(np.concatenate(shares))
    number = np.minimum(sums * BLOCKS // max(sums[-1], 1e-300), BLOCKS - 1).astype(np.intp)
    return np.split(number, np.cumsum([run.samples for run in runs])[:-1])


def _behind(
    arm: Arm,
    runs: Sequence[Run],
    blocks: Sequence[NDArray[np.intp]],
    cutoff_hz: float,
    lowest_hz: float,
    judged_hz: float,
) -> _Candidate:
    filters = [TrimmedButterworth.possible(run, cutoff_hz) for run in runs]
    motions = [smooth_motion(run, low_pass) for run, low_pass in zip(runs, filters, strict=True)]
    top_speed = np.max([np.abs(motion.velocity).max(axis=0) for motion in motions], axis=0)
    layout = PlainLayout(arm, tuple(range(len(arm))), top_speed)
    samples = sum(run.samples for run in runs)
    parts = list[tuple[Array, Array, NDArray[np.intp], Array, Array, NDArray[np.intp]]]()
    for run, block, low_pass, motion in zip(runs, blocks, filters, motions, strict=True):
        fitted = _rows(run, lowest_hz, min(int(run.rate_hz / (ROWS_PER_CUTOFF * cutoff_hz)), samples // MAX_ROWS))
        judge = TrimmedButterworth.possible(run, judged_hz)
        judged = _rows(run, lowest_hz, int(run.rate_hz / (ROWS_PER_CUTOFF * judged_hz)))
        matrix = layout.matrix(motion)
        parts.append(
            (
                matrix[fitted],
                low_pass.smooth(run.torque)[fitted],
                block[fitted],
                judge.smooth(matrix)[judged],
                judge.smooth(run.torque)[judged],
                block[judged],
            )
        )
    return _Candidate(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _rows(run: Run, lowest_hz: float, step: int) -> slice:
    """Every step-th row without the ends that the lowest cut-off disturbs, a tenth at most."""
    margin = min(int(2 * run.rate_hz / lowest_hz), run.samples // 10)
    return slice(margin, run.samples - margin, max(step, 1))
