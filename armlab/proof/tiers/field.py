"""The field tier: recordings that resemble real ones, on which torque and reading are judged together."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.proof.blind.field.field_cases import make_field_case
from armlab.proof.blind.field.field_plan import FieldKind, FieldPlan, draw_field_plan
from armlab.proof.blind.field.field_score import score_field
from armlab.proof.blind.sealed import OBSERVATION, TRUTH, TRUTH_FILE, VERDICTS, Score, SealedTier


@dataclass(frozen=True)
class FieldSet:
    """How many cases of each kind: hidden effects, nulls, reading mistakes.

    Seeds 1000-1999 are for development.
    """

    cases: int
    nulls: int
    mistakes: int
    seed: int

    def plans(self) -> Iterator[FieldPlan]:
        """The plans of all cases, kind by kind."""
        counts: tuple[tuple[FieldKind, int], ...] = (
            ("null", self.nulls),
            ("hidden", self.cases),
            ("mistake", self.mistakes),
        )
        for kind, count in counts:
            for index in range(count):
                yield draw_field_plan(self.seed, index, kind)


def _make(plan: FieldPlan, draft: Path) -> None:
    make_field_case(plan, draft / OBSERVATION, draft / TRUTH_FILE)


def _question(plan: FieldPlan, observation: Path) -> list[str]:
    """A diagnosis, of the reading alone where only a mistake is judged."""
    return ["diagnose", str(observation), *(["--only-setup"] if plan.kind == "mistake" else [])]


def _judge(settings: FieldSet, work: Path, results: Path) -> Score:
    names = [plan.name for plan in settings.plans()]
    score = score_field(work / TRUTH, work / VERDICTS, names, results)
    lines = [f"{each.name}: {each.text}" for each in score.measures]
    return Score(lines, len(names), {"field": [each.entry for each in score.measures]})


FIELD_TIER = SealedTier("field", FieldSet.plans, _make, _question, _judge)
