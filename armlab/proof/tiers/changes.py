"""The changes tier: pairs of recordings of one robot, with one thing changed between them or nothing.

Half of them are simulated with noise that is known, half resemble real recordings (those of the field tier).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.proof.blind.field.field_plan import FieldPlan, draw_field_plan
from armlab.proof.blind.pairs.field_pairs import write_field_pair
from armlab.proof.blind.pairs.pair_cases import SIDES, make_pair, write_pair
from armlab.proof.blind.pairs.pair_plan import PairPlan, draw_pair
from armlab.proof.blind.pairs.pair_score import score_pairs
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, Score, SealedTier
from armlab.proof.tiers.torque import TIERS


@dataclass(frozen=True)
class PairSet:
    """How many pairs with nothing changed and with one thing changed, simulated and of the field tier, from a seed.

    Seeds 1000-1999 are for development: they leave out the kinds of noise that are kept for judged sets.
    """

    nulls: int
    changed: int
    field_nulls: int
    field_changed: int
    seed: int

    def plans(self) -> Iterator[PairPlan | FieldPlan]:
        """The plans of all pairs; tiers in turn, so that each kind of change comes in both."""
        development = self.seed in DEVELOPMENT_SEEDS
        for number in range(self.nulls):
            yield draw_pair(self.seed, number, TIERS[number % 2], False, development)
        for number in range(self.changed):
            yield draw_pair(self.seed, number, TIERS[number // 4 % 2], True, development)
        for number in range(self.field_nulls):
            yield draw_field_plan(self.seed, number, "pair null")
        for number in range(self.field_changed):
            yield draw_field_plan(self.seed, number, "pair changed")


def _make(plan: PairPlan | FieldPlan, draft: Path) -> None:
    if isinstance(plan, FieldPlan):
        write_field_pair(plan, draft / OBSERVATION, draft / TRUTH_FILE)
    else:
        write_pair(make_pair(plan), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: PairPlan | FieldPlan, observation: Path) -> list[str]:
    return ["diagnose", "--compare", *(str(observation / side) for side in SIDES)]


def _judge(settings: PairSet, work: Path, results: Path) -> Score:
    names = [plan.name for plan in settings.plans()]
    measures = score_pairs(work, names, results)
    lines = [f"{each.name}: {each.text}" for each in measures]
    return Score(lines, len(names), {"changes": [each.entry for each in measures]})


CHANGES = SealedTier("changes", PairSet.plans, _make, _question, _judge, done="compared")
"""Pairs of recordings of one robot, with nothing changed or one thing: the proof of a comparison."""
