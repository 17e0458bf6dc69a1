"""The ranking under each choice that the paper leaves open, and whether MuPSO differs significantly from the others."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from algorithms.parameter_types import OURS
from bench.printed import display_name
from bench.statistics import is_feasible, quantile
from bench.statistics.pairwise import Duel, duels_against_all

SUBJECT = "mupso"
READINGS = {OURS: "as here", "text": "the sources' text as printed", "program": "their authors' programs"}
"""Readings of the algorithms; one that an algorithm lacks is that of here. No program of MuPSO is published."""


TWO_PROGRAMS = ("woa", "goa")
"""The algorithms whose authors' programs differ most from what their texts say."""


def frames_by_reading(frame: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """By reading, the rows of each algorithm under its own name; a label is NAME, or NAME and the reading."""
    names = dict.fromkeys(str(label).partition(" ")[0] for label in frame["algorithm"])
    return {reading: frame_read_as(frame, dict.fromkeys(names, reading)) for reading in READINGS}


def frame_read_as(frame: pd.DataFrame, readings: Mapping[str, str]) -> pd.DataFrame:
    """The rows of each algorithm under its own name, of these readings by name; of ours where there is none."""
    labels = dict.fromkeys(map(str, frame["algorithm"]))
    names = dict.fromkeys(label.partition(" ")[0] for label in labels)
    wanted = {name: f"{name} {readings.get(name, OURS)}" for name in names}
    chosen = {label if label in labels else name: name for name, label in wanted.items()}
    rows = frame[frame["algorithm"].isin(list(chosen))]
    return rows.assign(algorithm=rows["algorithm"].map(chosen)).reset_index(drop=True)


@dataclass(frozen=True)
class Standing:
    """One choice of conventions. medians: by algorithm, infinite where half of the ends are infeasible.

    duels: MuPSO against each other algorithm, with Holm's correction over them. best_known: condition number, None
    without a record.
    """

    problem: str
    feasible_share: float
    medians: dict[str, float]
    minima: dict[str, float]
    averages: dict[str, float]
    deviations: dict[str, float]
    duels: list[Duel]
    best_known: float | None

    @property
    def usable(self) -> bool:
        """Whether any algorithm found a feasible point."""
        return self.feasible_share > 0

    @property
    def best(self) -> str | None:
        """The algorithm with the least median; None where no median is finite."""
        winner = min(self.medians, key=self.medians.__getitem__)
        return winner if np.isfinite(self.medians[winner]) else None

    def count(self, outcome: str) -> int:
        """To how many algorithms MuPSO is `better` or `worse`, at 5 % after Holm's correction."""
        winners = [duel.winner() for duel in self.duels]
        return sum(winner is not None and (winner == SUBJECT) == (outcome == "better") for winner in winners)


def standings(frame: pd.DataFrame, known: Mapping[str, float]) -> list[Standing]:
    """One standing a problem of a tidy frame, in its order; known: best condition numbers by problem."""
    groups = [(str(problem), rows) for problem, rows in frame.groupby("problem", sort=False)]
    return [_make_standing(problem, rows, known.get(problem)) for problem, rows in groups]


def _make_standing(problem: str, rows: pd.DataFrame, best_known: float | None) -> Standing:
    feasible = is_feasible(rows["value"].to_numpy(), rows["violation"].to_numpy())
    ends = rows.assign(end=np.where(feasible, rows["value"], np.inf), good=rows["value"].where(feasible))
    groups = {str(label): group for label, group in ends.groupby("algorithm", sort=False)}
    return Standing(
        problem,
        float(feasible.mean()),
        {label: quantile(group["end"].to_numpy(), 0.5) for label, group in groups.items()},
        {label: float(group["good"].min()) for label, group in groups.items()},
        {label: float(group["good"].mean()) for label, group in groups.items()},
        {label: float(group["good"].std()) for label, group in groups.items()},
        duels_against_all(rows, SUBJECT),
        best_known,
    )


def count_duels(found: list[Standing]) -> tuple[int, int, int]:
    """In how many duels of the usable conventions MuPSO is better, in how many worse, and of how many."""
    usable = [standing for standing in found if standing.usable]
    better, worse = (sum(standing.count(outcome) for standing in usable) for outcome in ("better", "worse"))
    return better, worse, sum(len(standing.duels) for standing in usable)


def ranking_table(found: list[Standing]) -> pd.DataFrame:
    """One row a choice: the algorithm with the least median, MuPSO's median, and MuPSO against each other algorithm.

    `+` MuPSO is better, `-` worse, `=` no significant difference at 5 % after Holm's correction; in brackets the
    probability that a run of MuPSO ends better (A12) and the corrected p-value. A single `-`: nothing is feasible.
    """
    return pd.DataFrame([_standing_row(standing) for standing in found])


def _standing_row(standing: Standing) -> dict[str, str]:
    best = standing.best
    return {
        "box, duration, columns, joint 1": standing.problem,
        "feasible": f"{standing.feasible_share:.0%}",
        "least median": f"{display_name(best)} {standing.medians[best]:.3g}" if best else "-",
        "MuPSO's median": f"{standing.medians[SUBJECT]:.3g}",
        "best known": f"{standing.best_known:.3g}" if standing.best_known else "-",
        "MuPSO's gap": f"{standing.medians[SUBJECT] / standing.best_known - 1:.0%}" if standing.best_known else "-",
    } | {f"against {display_name(duel.rival)}": _duel_cell(duel) if standing.usable else "-" for duel in standing.duels}


def _duel_cell(duel: Duel) -> str:
    sign = {None: "=", duel.subject: "+", duel.rival: "-"}[duel.winner()]
    return f"{sign} ({duel.superiority:.2f}, p {duel.p:.2g})"
