"""Stretches of the stacked rows that belong together, and those in which a joint stands still."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_opening

from recordings.cutoff import acceleration_spectrum, noise_level
from recordings.differentiate import Signals
from recordings.filters import LowPass
from recordings.run import Array, Role

CERTAIN = 5.0  # standard deviations of the velocity's noise: slower is standing still
CREEP = 0.01  # of a joint's high speed: below it friction takes any value up to its level
HIGH = 0.95  # quantile of the speed
STILL_S = 0.004  # s that it takes to be more than a single sample
MARGIN = 1.5  # periods of the cut-off around a standstill: how far the filter carries it
SHORTEST = 40  # rows: shorter parts tell too little of the noise
LEAST = 0.1  # of the rows have to be left; else a joint counts as moving all the time


@dataclass(frozen=True, eq=False)
class Segment:
    """Rows [start, stop) of the stacked runs that stand together in time and share a role."""

    run: int
    role: Role
    start: int
    stop: int


def moving(signals: Sequence[Signals], segments: Sequence[Segment], cutoff_hz: float) -> NDArray[np.bool_]:
    """Rows (rows, joints) in which a joint moves. cutoff_hz: of the positions."""
    speed = np.quantile(np.abs(np.concatenate([each.motion.velocity for each in signals])), HIGH, axis=0)
    whole = np.concatenate([_moving(each, cutoff_hz, CREEP * speed) for each in signals])
    for joint in range(whole.shape[1]):
        for role in ("identify", "validate"):
            own = [each for each in segments if each.role == role]
            left = sum(part.stop - part.start for each in own for part in parts(each, whole[:, joint]))
            if left < LEAST * sum(each.stop - each.start for each in own):
                for each in own:
                    whole[each.start : each.stop, joint] = True
    return whole


def _moving(signals: Signals, cutoff_hz: float, creep: Array) -> NDArray[np.bool_]:
    """Rows (kept, joints) in which a joint is faster than its noise and than creeping (joints,)."""
    run = signals.run
    frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
    density = noise_level(frequency, spectrum, shape, run.rate_hz)
    noise = 2 * np.pi * np.sqrt(density * cutoff_hz**3 / 3)  # of white noise, differentiated, up to the cut-off
    slow = np.abs(signals.motion.velocity) < np.maximum(CERTAIN * noise, creep)
    still = binary_opening(slow, structure=np.ones((max(round(STILL_S * run.rate_hz), 1), 1)))
    low_pass = signals.filter
    reach = MARGIN / (low_pass.cutoff_hz if isinstance(low_pass, LowPass) else cutoff_hz)
    near = binary_dilation(still, structure=np.ones((2 * round(reach * run.rate_hz) + 1, 1)))
    return np.asarray(~near[signals.filter.rows])


def parts(segment: Segment, chosen: NDArray[np.bool_], shortest: int = SHORTEST) -> list[Segment]:
    """The stretches of a segment in which `chosen` (rows,) holds, short ones left out."""
    inside = np.concatenate([[False], chosen[segment.start : segment.stop], [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8))) + segment.start
    found = [Segment(segment.run, segment.role, int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    return [each for each in found if each.stop - each.start >= shortest]


def rows_of(segments: Sequence[Segment], rows: int) -> NDArray[np.bool_]:
    """Which of the stacked rows are in these segments, (rows,)."""
    chosen = np.zeros(rows, dtype=bool)
    for each in segments:
        chosen[each.start : each.stop] = True
    return chosen
