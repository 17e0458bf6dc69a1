"""Probabilities of claims against how often they are right, for sets that are judged without tables of their own."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pandas as pd

from armlab.common.markdown import markdown_table
from armlab.proof.blind.score.cases import UNKNOWN_NAME, Category
from armlab.proof.blind.score.measures import MEASURE_TEXTS, Measure, reliability_measures, wrong_name_measures
from armlab.proof.blind.score.score_page import format_measure

HEADING = "## Probabilities of names"


@dataclass(frozen=True)
class StatedClaim:
    """A claim beyond what every case has. effect: its name. probability: of that, None where none is stated. right:
    whether it is there. in_class: whether one of its class of names is. all_names: probability of all its names
    together, where that is less than 1 and counted.
    """

    effect: str
    probability: float | None
    right: bool
    in_class: bool
    all_names: float | None = None

    @property
    def category(self) -> Category:
        """As in the score of torque."""
        return "injected" if self.right else "unknown" if self.effect == UNKNOWN_NAME else "wrong"


def stated_measures(claims: Sequence[StatedClaim]) -> list[Measure]:
    """Wrong names, the share that is right in each bin of probability, and skills."""
    table = pd.DataFrame(
        {
            "effect": [each.effect for each in claims],
            "probability": pd.Series([each.probability for each in claims], dtype=float),
            "category": [each.category for each in claims],
            "class_right": [each.right or each.in_class for each in claims],
        }
    )
    return [*wrong_name_measures(table), *reliability_measures(table)]


def stated_table(measures: Sequence[Measure]) -> str:
    """Of a page: each measure, its number of claims, and what is wanted."""
    rows = [(each.title, format_measure(each), each.number, MEASURE_TEXTS[each.id].wanted) for each in measures]
    return markdown_table(("measure", "value", "claims", "wanted"), rows)


def stated_lines(measures: Sequence[Measure]) -> Iterator[str]:
    """For a terminal."""
    for each in measures:
        yield f"{each.title}: {format_measure(each)}, of {each.number}; wanted {MEASURE_TEXTS[each.id].wanted}"
