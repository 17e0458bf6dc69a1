"""Choice of the cut-off of an identification by what it predicts: blocks of the runs that identify, left out in turn.

A spectrum of the positions alone tells where noise begins, not what a model of the torque makes of it: with encoders of
little noise it keeps everything, vibrations included. Here plain least squares, behind each cut-off, predicts the
torque of blocks that took no part, each with an equal share of the travel. Too low a cut-off loses torque that the
motion explains, too high a one fits noise and vibrations. What is left is judged behind each of the cut-offs in turn:
behind one low-pass alone, vibrations that no model explains hide what models differ in, or a low-pass cuts it away.
Runs that validate take no part.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.cutoff import MAX_CUTOFF_SHARE, MIN_CUTOFF_PERIODS, ROWS_PER_CUTOFF, travel_bandwidth
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.plain_least_squares import (
    NormalEquations,
    PlainLayout,
    TrimmedButterworth,
    smooth_motion,
    sum_equations,
)
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion

BLOCKS = 6  # of all runs together, as for the model that predicts
MIN_SAMPLES = 20  # of a run whose spectrum tells a cut-off
MAX_ROWS = 1000  # of all runs, that a fit uses
HARMONICS_JUDGED = 50  # of the travel, at first: above them the torque of most motions is vibration and noise
STEP = 2.0  # from one low-pass to the next
Predict = Callable[[int, int, slice], Array]


@dataclass(frozen=True, eq=False)
class HeldOutBlocks:
    """Runs that identify, in blocks that are left out in turn, and the low-passes behind which predictions are judged.

    runs: even in time. blocks: the block of each sample of each run, rising. low_passes_hz: descending.
    """

    runs: tuple[Run, ...]
    blocks: tuple[NDArray[np.intp], ...]
    low_passes_hz: tuple[float, ...]

    @classmethod
    def of(cls, runs: Sequence[Run]) -> "HeldOutBlocks":
        """Low-passes from the highest that can matter down to ten periods of the longest run.

        Raises ValueError for runs that are too short or move too little.
        """
        even = tuple(resample_evenly(run) for run in runs if run.samples >= MIN_SAMPLES)
        if not even:
            raise DataError("no run identifies")
        judged = HARMONICS_JUDGED * max(travel_bandwidth(run.position, run.rate_hz) for run in even)
        highest = min(judged, MAX_CUTOFF_SHARE * min(run.rate_hz for run in even))
        lowest = min(MIN_CUTOFF_PERIODS * min(run.rate_hz / run.samples for run in even), highest)
        low_passes = tuple(float(highest / STEP**number) for number in range(int(np.log2(highest / lowest)) + 1))
        blocks = tuple(_blocks_of_equal_travel(even, low_passes[-1]))
        rows = [block[_inner_rows(run, low_passes[-1])] for run, block in zip(even, blocks, strict=True)]
        if len(np.unique(np.concatenate(rows))) < 2:
            raise DataError("the runs move too little to try cut-offs: record more motion")
        return cls(even, blocks, low_passes)

    def up_to(self, highest_hz: float) -> "HeldOutBlocks":
        """With low-passes up to a frequency, as far as the rate carries them; the same where it has them already."""
        most = min(highest_hz, MAX_CUTOFF_SHARE * min(run.rate_hz for run in self.runs))
        higher = self
        while STEP * higher.low_passes_hz[0] <= most:
            higher = replace(higher, low_passes_hz=(STEP * higher.low_passes_hz[0], *higher.low_passes_hz))
        return higher

    @property
    def numbers(self) -> list[int]:
        """The blocks that hold rows to judge."""
        return [int(number) for number in np.unique(np.concatenate([block[rows] for block, rows in self._judged()]))]

    def scores(self, predict: Predict) -> Array:
        """Mean logarithm of what is left of each joint's torque behind each low-pass, (blocks,); less is better.

        predict: torque (samples, joints) of the model that was fitted without a block, of a run and a stretch of it.
        """
        numbers, joints = self.numbers, self.runs[0].torque.shape[1]
        squares, counts = np.zeros((len(numbers), len(self.low_passes_hz), joints)), np.zeros(len(numbers))
        for place, (run, (block, rows)) in enumerate(zip(self.runs, self._judged(), strict=True)):
            left = run.torque.copy()
            for number in numbers:
                part = slice(*np.searchsorted(block, (number, number + 1)))
                if part.stop > part.start:
                    left[part] -= predict(number, place, part)
            chosen = block[rows] == np.array(numbers)[:, None]
            counts += chosen.sum(axis=1)
            for at, cutoff in enumerate(self.low_passes_hz):
                squares[:, at] += chosen @ TrimmedButterworth.possible(run, cutoff).smooth(left)[rows] ** 2
        return np.asarray(0.5 * np.log(np.maximum(squares / counts[:, None, None], 1e-300)).mean(axis=(1, 2)))

    def _judged(self) -> Iterator[tuple[NDArray[np.intp], slice]]:
        """The blocks of each run, and its rows that judge."""
        for run, block in zip(self.runs, self.blocks, strict=True):
            yield block, _inner_rows(run, self.low_passes_hz[-1])


def choose_cutoff_hz(arm: Arm, runs: Sequence[Run]) -> float:
    """The low-pass, Hz, behind which plain least squares predicts best; while that is the highest, its double is tried.

    Raises ValueError for too little motion.
    """
    held_out, fits = HeldOutBlocks.of(runs), dict[float, Predict]()
    while True:
        fits |= {each: _fit_plain(arm, held_out, each) for each in held_out.low_passes_hz if each not in fits}
        scores = [np.mean(held_out.scores(fits[each])) for each in held_out.low_passes_hz]
        best = held_out.low_passes_hz[int(np.argmin(scores))]
        higher = held_out.up_to(STEP * best)
        if higher is held_out:
            return best
        held_out = higher


def _fit_plain(arm: Arm, held_out: HeldOutBlocks, cutoff_hz: float) -> Predict:
    """Plain least squares behind a cut-off, without each block."""
    filters = [TrimmedButterworth.possible(run, cutoff_hz) for run in held_out.runs]
    motions = [smooth_motion(run, low_pass) for run, low_pass in zip(held_out.runs, filters, strict=True)]
    top_speed = np.max([np.abs(motion.velocity).max(axis=0) for motion in motions], axis=0)
    layout = PlainLayout(arm, tuple(range(len(arm))), top_speed)
    most = sum(run.samples for run in held_out.runs) // MAX_ROWS
    rows = [
        _inner_rows(run, held_out.low_passes_hz[-1], min(int(run.rate_hz / (ROWS_PER_CUTOFF * cutoff_hz)), most))
        for run in held_out.runs
    ]
    together = list(zip(held_out.runs, held_out.blocks, filters, motions, rows, strict=True))
    matrix = np.concatenate([layout.matrix(_part(motion, part)) for *_, motion, part in together])
    torque = np.concatenate([low_pass.smooth(run.torque)[part] for run, _, low_pass, _, part in together])
    block = np.concatenate([block[part] for _, block, *_, part in together])
    sums = {number: NormalEquations.of(matrix[block == number], torque[block == number]) for number in np.unique(block)}
    fitted = {
        left_out: sum_equations([each for number, each in sums.items() if number != left_out]).solve()[0]
        for left_out in held_out.numbers
    }
    return lambda number, place, part: layout.matrix(_part(motions[place], part)) @ fitted[number]


def _part(motion: Motion, part: slice) -> Motion:
    return Motion(motion.position[part], motion.velocity[part], motion.acceleration[part])


def _blocks_of_equal_travel(runs: Sequence[Run], lowest_hz: float) -> list[NDArray[np.intp]]:
    """The block of each sample of each run: a joint counts by its travel as a share of its range."""
    span = np.ptp(np.concatenate([run.position for run in runs]), axis=0)
    shares = []
    for run in runs:
        way = np.zeros(run.position.shape)
        rows = _inner_rows(run, lowest_hz)
        way[rows] = np.abs(np.diff(run.position[rows], axis=0, prepend=run.position[rows][:1]))
        shares.append(np.sum(way / np.where(span > 0, span, 1.0), axis=1))
    sums = np.cumsum(np.concatenate(shares))
    number = np.minimum(sums * BLOCKS // max(sums[-1], 1e-300), BLOCKS - 1).astype(np.intp)
    return np.split(number, np.cumsum([run.samples for run in runs])[:-1])


def _inner_rows(run: Run, lowest_hz: float, step: int = 1) -> slice:
    """Every step-th row without the ends that the lowest cut-off disturbs, a tenth at most."""
    margin = min(int(2 * run.rate_hz / lowest_hz), run.samples // 10)
    return slice(margin, run.samples - margin, max(step, 1))
