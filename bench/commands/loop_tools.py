"""The design as the closed loop calls it."""

from pathlib import Path
from typing import get_args

from concealed.loop.case import Forecast, Moved
from diagnosis.next.design import Budget
from diagnosis.next.second import Kind, second_motion

DURATION_S = 2.0  # so short that a random motion often leaves it open: the difficulty, alike for all kinds
HARMONICS = 6
EVALUATIONS = 1000


def move(kind: str, verdict: Path, robot: Path, recording: Path, seed: int) -> Moved | None:
    """A second motion of a kind, and what is expected of it."""
    known: Kind = next(each for each in get_args(Kind) if each == kind)
    budget = Budget(DURATION_S, HARMONICS, evaluations=EVALUATIONS, seed=seed % 2**31)
    found = second_motion(known, verdict, robot, recording, budget)
    if found is None:
        return None
    forecasts = tuple(
        Forecast(frozenset((name.effect, name.joint) for name in names), each.right, each.wrong, each.open)
        for names, each in found.expected
    )
    return Moved(found.motion, forecasts)
