"""The design as the closed loop calls it."""

from pathlib import Path
from typing import get_args

from diagnosis.next.design import Budget
from diagnosis.next.second import Kind, second_motion
from problem.transforms import Array

HARMONICS = 6


def move(
    duration: float, evaluations: int, kind: str, verdict: Path, robot: Path, recording: Path, seed: int
) -> Array | None:
    """A second motion of a kind, (samples, 1 + joints), s and rad."""
    known: Kind = next(each for each in get_args(Kind) if each == kind)
    budget = Budget(duration, HARMONICS, evaluations=evaluations, seed=seed % 2**31)
    return second_motion(known, verdict, robot, recording, budget)
