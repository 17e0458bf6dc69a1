"""The design of the next experiment in the form in which the closed loop calls it.

Apart from the click commands, since it imports the diagnosis, and `armlab --help` imports all modules of commands.
"""

from pathlib import Path
from typing import get_args

from armlab.diagnosis.next.motion import Budget
from armlab.proof.blind.loop.case import Forecast, SecondMotion
from armlab.proof.open.second_motion import MotionKind, design_second_motion

SECOND_DURATION_S = 2.0  # so short that a random motion often leaves it open: the difficulty, alike for all kinds
SECOND_HARMONICS = 6
SECOND_EVALUATIONS = 1000


def plan_second_motion(kind: str, verdict: Path, robot: Path, recording: Path, seed: int) -> SecondMotion | None:
    """A second motion of a kind, and what is expected of it."""
    motion_kind: MotionKind = next(each for each in get_args(MotionKind) if each == kind)
    budget = Budget(SECOND_DURATION_S, SECOND_HARMONICS, evaluations=SECOND_EVALUATIONS, seed=seed % 2**31)
    second = design_second_motion(motion_kind, verdict, robot, recording, budget)
    if second is None:
        return None
    forecasts = tuple(
        Forecast(frozenset((name.effect, name.joint) for name in names), each.right, each.wrong, each.open)
        for names, each in second.expected
    )
    return SecondMotion(second.motion, forecasts)
