"""All that the claims are judged by: the outcomes of the experiments and what was computed from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from bench.mutations import InnerLife
from bench.paper.best_run import BestRun
from bench.paper.identify import Identification
from bench.paper.literal import READINGS, Identifiability, Reading, identifiability, literal_matrix
from bench.paper.published import PublishedReading
from bench.paper.ranking import Standing
from bench.printed import Printed
from bench.table import summary_table, times_table


@dataclass(frozen=True, eq=False)
class Evidence:
    """frames: tidy outcomes by experiment. deviations, differences: from Tables 1 and 2.

    lives: MuPSO's runs of Table 3 by the reading of eq. 6. readings: the paper's dynamics to the letter.
    """

    paper: Printed
    frames: Mapping[str, pd.DataFrame]
    deviations: list[str]
    differences: list[str]
    ranking: list[Standing]
    lives: Mapping[str, list[InnerLife]]
    best: BestRun
    found: Identification
    published: list[PublishedReading]
    readings: list[tuple[Reading, Identifiability]]

    def column(self, experiment: str, statistic: str) -> dict[Any, float]:
        """A statistic of the ends or the seconds of an experiment, by algorithm, or by (swarm size, algorithm)."""
        frame = self.frames[experiment]
        keys = ["swarm_size", "algorithm"] if frame["swarm_size"].nunique() > 1 else ["algorithm"]
        table = summary_table(frame).merge(times_table(frame), on=keys, suffixes=("", "_of_seconds"))
        return {key: float(value) for key, value in table.set_index(keys)[statistic].items()}


def literal_readings(paper: Printed) -> list[tuple[Reading, Identifiability]]:
    """What each literal reading of the paper's dynamics tells of the parameters."""
    return [(reading, identifiability(literal_matrix(paper, reading))) for reading in READINGS]
