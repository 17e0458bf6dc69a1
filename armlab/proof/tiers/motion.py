"""The motion tier: recordings without torque of small arms with position servos."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, Score, SealedTier
from armlab.proof.blind.servo.servo_cases import make_case, write_case
from armlab.proof.blind.servo.servo_plan import ServoCase, draw_cases
from armlab.proof.blind.servo.servo_score import score_motion


@dataclass(frozen=True)
class MotionSet:
    """How many cases with something hidden and with nothing, from a seed; seeds 1000-1999 are for development."""

    cases: int
    nulls: int
    seed: int

    def plans(self) -> Iterator[ServoCase]:
        """The plans of all cases."""
        return draw_cases(self.seed, self.cases, self.nulls)


def _make(case: ServoCase, draft: Path) -> None:
    write_case(make_case(case), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: ServoCase, observation: Path) -> list[str]:
    return ["diagnose", str(observation)]


def _judge(settings: MotionSet, work: Path, results: Path) -> Score:
    names = [plan.name for plan in settings.plans()]
    score = score_motion(work, names, results)
    return Score(list(score.lines), len(names), {"motion": [share.entry for share, _ in score.measures]})


MOTION = SealedTier("motion", MotionSet.plans, _make, _question, _judge)
