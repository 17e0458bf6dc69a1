"""A claim of the paper with its verdict, and the evidence by which all claims are judged."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import pandas as pd

from algorithms.parameter_types import OURS
from bench.printed import Printed
from bench.studies.mutations import MutationHistory
from bench.studies.paper.literal import LITERAL_READINGS, Identifiability, Reading, identifiability, literal_matrix
from bench.studies.paper.published_coefficients import PublishedReading
from bench.studies.paper.ranking import Standing
from bench.studies.paper.simulated_identification import BestRun, SimulatedIdentification
from bench.tables import summary_table, times_table

Verdict = Literal["reproduced", "not reproduced", "cannot be checked"]
VERDICTS: tuple[Verdict, ...] = ("reproduced", "not reproduced", "cannot be checked")
PRINTED_TOLERANCE = 0.10


@dataclass(frozen=True)
class Claim:
    """place: in the paper. says: its statement. ours: our number. why: the reason of the verdict.

    If a claim cannot be checked, `why` names the missing datum. alone: the verdict by our readings of the algorithms
    alone, where it is another one.
    """

    place: str
    says: str
    ours: str
    verdict: Verdict
    why: str
    alone: Verdict | None = None


def verdict_if(condition: bool) -> Verdict:
    """`reproduced` if the condition holds, else `not reproduced`."""
    return "reproduced" if condition else "not reproduced"


def is_close_to_printed(ours: float, printed: float) -> bool:
    """Whether a number agrees with the printed one within 10 %."""
    return abs(ours - printed) <= PRINTED_TOLERANCE * abs(printed)


def percent_change(new: float, old: float) -> float:
    return 100 * (new / old - 1)


@dataclass(frozen=True, eq=False)
class Evidence:
    """frames: tidy outcomes by experiment. deviations, differences: from Tables 1 and 2.

    rankings: by reading of the algorithms; two_programs: with the authors' programs of `TWO_PROGRAMS` alone.
    default: the label of Table 3's problem among the conventions.
    mutation_histories: MuPSO's runs of Table 3 by the reading of eq. 6. readings: the paper's dynamics as printed.
    """

    paper: Printed
    frames: Mapping[str, pd.DataFrame]
    deviations: list[str]
    differences: list[str]
    rankings: Mapping[str, list[Standing]]
    two_programs: list[Standing]
    default: str
    mutation_histories: Mapping[str, list[MutationHistory]]
    best: BestRun
    found: SimulatedIdentification
    published: list[PublishedReading]
    readings: list[tuple[Reading, Identifiability]]

    @property
    def ranking(self) -> list[Standing]:
        """The standings by our readings of the algorithms."""
        return self.rankings[OURS]

    def default_standing(self, found: list[Standing]) -> Standing:
        """The standing under the default conventions, those of Table 3."""
        return next(standing for standing in found if standing.problem == self.default)

    def column(self, experiment: str, statistic: str) -> dict[Any, float]:
        """A statistic of the ends or the seconds of an experiment, by algorithm, or by (swarm size, algorithm)."""
        frame = self.frames[experiment]
        keys = ["swarm_size", "algorithm"] if frame["swarm_size"].nunique() > 1 else ["algorithm"]
        table = summary_table(frame).merge(times_table(frame), on=keys, suffixes=("", "_of_seconds"))
        return {key: float(value) for key, value in table.set_index(keys)[statistic].items()}


def literal_readings(paper: Printed) -> list[tuple[Reading, Identifiability]]:
    """The identifiability of the parameters under each literal reading of the paper's dynamics."""
    return [(reading, identifiability(literal_matrix(paper, reading))) for reading in LITERAL_READINGS]
