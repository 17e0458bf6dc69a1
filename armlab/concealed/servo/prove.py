"""The proof: make the cases, seal the answers, diagnose each in a process of its own, and score."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.concealed.sealed_set import OBSERVATION, TRUTH_FILE, SetMaker, log_judged_set
from armlab.concealed.servo.make import make_case, write_case
from armlab.concealed.servo.plan import ServoCase, draw_cases
from armlab.concealed.servo.score import score_motion


@dataclass(frozen=True)
class MotionSet:
    """How many cases with something hidden and with nothing, from a seed; seeds 1000-1999 are for development."""

    cases: int
    nulls: int
    seed: int


def prove_motion(settings: MotionSet, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, diagnoses and scores; yields the lines that report it. InputError for a folder of another set."""
    plans = list(draw_cases(settings.seed, settings.cases, settings.nulls))
    yield from SetMaker(_make, _question, "diagnosed").prove(settings, plans, work, jobs)
    score = score_motion(work, [plan.name for plan in plans], results)
    yield from score.lines
    log_judged_set("motion", settings.seed, len(plans), work, [share for share, _ in score.measures])


def _make(case: ServoCase, draft: Path) -> None:
    write_case(make_case(case), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: ServoCase, observation: Path) -> list[str]:
    return ["diagnose", str(observation)]
