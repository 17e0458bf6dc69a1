"""The changes tier: pairs of recordings of one robot, with one thing changed between them or nothing."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.proof.blind.pairs.pair_cases import SIDES, make_pair, write_pair
from armlab.proof.blind.pairs.pair_plan import PairPlan, draw_pair
from armlab.proof.blind.pairs.pair_score import score_lines, score_pairs
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, Score, SealedTier
from armlab.proof.tiers.torque import TIERS


@dataclass(frozen=True)
class PairSet:
    """How many pairs with nothing changed and with one thing changed, from a seed.

    Seeds 1000-1999 are for development: they leave out the kinds of noise that are kept for judged sets.
    """

    nulls: int
    changed: int
    seed: int

    def plans(self) -> Iterator[PairPlan]:
        """The plans of all pairs; tiers in turn, so that each kind of change comes in both."""
        development = self.seed in DEVELOPMENT_SEEDS
        for number in range(self.nulls):
            yield draw_pair(self.seed, number, TIERS[number % 2], False, development)
        for number in range(self.changed):
            yield draw_pair(self.seed, number, TIERS[number // 4 % 2], True, development)


def _make(plan: PairPlan, draft: Path) -> None:
    write_pair(make_pair(plan), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: PairPlan, observation: Path) -> list[str]:
    return ["diagnose", "--compare", *(str(observation / side) for side in SIDES)]


def _judge(settings: PairSet, work: Path, results: Path) -> Score:
    names = [plan.name for plan in settings.plans()]
    score = score_pairs(work, names, results)
    return Score(list(score_lines(score)), len(names), {"changes": [each.entry for each in score.measures]})


CHANGES = SealedTier("changes", PairSet.plans, _make, _question, _judge, done="compared")
