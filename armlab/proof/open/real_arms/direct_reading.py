"""The level of friction read from the force itself, without a model: the median in the middle of each stroke.

A stroke goes from one reversal to the next. Its middle half is far from both, so that play is taken up, the force of
inertia is small, and what is left at about constant speed is friction.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from armlab.recordings.differentiate import differentiate
from armlab.recordings.recording import Run

MIN_TRAVEL_SHARE = 0.9  # of the longest stroke: what is shorter was cut off by an end of the run
MIDDLE = (0.25, 0.75)  # of a stroke's travel


@dataclass(frozen=True)
class DirectLevel:
    """Levels that the strokes of one run in one direction have, N m (N): median, lowest, highest; strokes: how many."""

    run: str
    direction: int
    median: float
    lowest: float
    highest: float
    strokes: int


def direct_levels(run: Run) -> tuple[DirectLevel, ...]:
    """Level of |torque| of a single joint by direction: over strokes, of the median in the middle of each.

    Raises ValueError for a run of more than one joint.
    """
    if run.joints != 1:
        raise ValueError(f"{run.name} has {run.joints} joints: the torque of one shows no level alone")
    signals = differentiate(run)
    position, direction = signals.motion.position[:, 0], np.sign(signals.motion.velocity[:, 0])
    edges = np.concatenate([[0], np.flatnonzero(np.diff(direction)) + 1, [len(position)]])
    strokes = [slice(start, stop) for start, stop in pairwise(edges.tolist())]
    travels = [float(np.ptp(position[each])) for each in strokes]
    whole = [each for each, travel in zip(strokes, travels, strict=True) if travel >= MIN_TRAVEL_SHARE * max(travels)]
    levels: dict[int, list[float]] = {1: [], -1: []}
    for each in whole:
        share = (position[each] - position[each].min()) / np.ptp(position[each])
        middle = (share > MIDDLE[0]) & (share < MIDDLE[1])
        levels[int(direction[each.start])].append(float(np.median(np.abs(signals.run.torque[each, 0][middle]))))
    return tuple(
        DirectLevel(run.name, way, float(np.median(found)), min(found), max(found), len(found))
        for way, found in levels.items()
        if found
    )
