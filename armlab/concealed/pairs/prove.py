"""The proof of a comparison: make pairs, seal the answers, compare each pair in a process of its own, and score."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.concealed.pairs.make import SIDES, make_pair, write_pair
from armlab.concealed.pairs.plan import PairPlan, draw_pair
from armlab.concealed.pairs.score import score_lines, score_pairs
from armlab.concealed.plan import DEVELOPMENT_SEEDS
from armlab.concealed.sealed_set import OBSERVATION, TRUTH_FILE, SetMaker, log_judged_set
from armlab.concealed.sets import TIERS


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


def prove_pairs(settings: PairSet, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, compares and scores; yields the lines that report it. InputError for a folder of another set."""
    plans = list(settings.plans())
    yield from SetMaker(_make, _question, "compared").prove(settings, plans, work, jobs)
    score = score_pairs(work, [plan.name for plan in plans], results)
    yield from score_lines(score)
    log_judged_set("changes", settings.seed, len(plans), work, score.measures)


def _make(plan: PairPlan, draft: Path) -> None:
    write_pair(make_pair(plan), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: PairPlan, observation: Path) -> list[str]:
    return ["diagnose", "--compare", *(str(observation / side) for side in SIDES)]
