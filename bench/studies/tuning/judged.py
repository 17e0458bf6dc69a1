"""The judged runs of a tuning: every algorithm as published and as tuned, and one hyper-parameter at several values."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from armlab.common.errors import InputError
from armlab.common.markdown import markdown_table
from bench.files import settings_path
from bench.printed import display_name
from bench.statistics import is_feasible, quantile
from bench.statistics.critical_difference import CriticalDifference, block_losses, critical_difference
from bench.statistics.pairwise import Duel, duel_row, duels, log_losses
from bench.studies.tuning.tuning_settings import TuningSettings, read_tuning
from bench.tables import GROUP_COLUMNS

TUNED = " tuned"
"""Ends the label of an algorithm with its tuned hyper-parameters."""
SUBJECT = "mupso"
ALL_TUNED = "all tuned"
"""The comparison of MuPSO with every other algorithm, all tuned."""
ProblemDuels = list[tuple[str, list[Duel]]]
"""Duels by problem."""


def sweep_label(algorithm: str, parameter: str, value: float) -> str:
    """The label of one value of the sweep."""
    return f"{algorithm} {parameter}={value:g}"


def median_ends(frame: pd.DataFrame) -> dict[str, float]:
    """Median of the ends by problem, infinite where half of them are infeasible; frame: tidy, of one algorithm."""
    feasible = is_feasible(frame["value"].to_numpy(), frame["violation"].to_numpy())
    ends = frame.assign(end=np.where(feasible, frame["value"], np.inf))
    return {str(problem): quantile(rows["end"].to_numpy(), 0.5) for problem, rows in ends.groupby("problem")}


@dataclass(frozen=True, eq=False)
class JudgedRuns:
    """frame: tidy outcomes on the judging problems, of each algorithm as published, as tuned, and of the sweep."""

    settings: TuningSettings
    frame: pd.DataFrame

    @property
    def sweep_labels(self) -> dict[float, str]:
        """Labels of the sweep by value; empty without a sweep."""
        sweep = self.settings.sweep
        if sweep is None:
            return {}
        return {value: sweep_label(sweep.algorithm, sweep.parameter, value) for value in sweep.values}

    def of(self, labels: Sequence[str]) -> pd.DataFrame:
        """The rows of these labels."""
        return self.frame[self.frame["algorithm"].isin(labels)].reset_index(drop=True)

    def labels(self, *, tuned: bool, without: str = "") -> list[str]:
        """The algorithms as tuned, or as published, but one."""
        return [name + TUNED * tuned for name in self.settings.algorithms if name != without]

    def contest(self) -> pd.DataFrame:
        """The rows without the sweep."""
        return self.of([*self.labels(tuned=True), *self.labels(tuned=False)])

    def ranking(self, labels: Sequence[str]) -> CriticalDifference:
        """Average ranks of these labels over the judging problems."""
        problems = self.of(labels).groupby("problem", sort=False)
        return critical_difference(block_losses([log_losses(rows) for _, rows in problems]))

    def medians(self) -> pd.DataFrame:
        """One row a label, in the order of the runs, and one column a judging problem: the median of its ends."""
        rows = {str(label): median_ends(group) for label, group in self.frame.groupby("algorithm", sort=False)}
        return pd.DataFrame(rows).T[list(self.settings.judge)].rename_axis("algorithm")

    def tuning_duels(self) -> ProblemDuels:
        """Each tuned algorithm against itself as published, Holm over the algorithms."""
        return self._duels([(f"{name}{TUNED}", name) for name in self.settings.algorithms])

    def subject_duels(self, *, tuned: bool) -> ProblemDuels:
        """MuPSO against every other algorithm, all tuned or all as published, Holm over the others."""
        return self._duels([(SUBJECT + TUNED * tuned, rival) for rival in self.labels(tuned=tuned, without=SUBJECT)])

    def sweep_duels(self, *, tuned: bool) -> ProblemDuels:
        """Each value of the sweep against every other algorithm, as tuned or as published, Holm over all of them."""
        sweep = self.settings.sweep
        rivals = [] if sweep is None else self.labels(tuned=tuned, without=sweep.algorithm)
        return self._duels([(label, rival) for label in self.sweep_labels.values() for rival in rivals])

    def _duels(self, pairs: Iterable[tuple[str, str]]) -> ProblemDuels:
        return _fight(self, tuple(pairs))

    def duels_table(self) -> pd.DataFrame:
        """All duels with effect sizes and 95 % intervals; `comparison` says over what Holm's correction goes."""
        comparisons = {"tuned against published": self.tuning_duels()}
        if SUBJECT in self.settings.algorithms:
            comparisons[ALL_TUNED] = self.subject_duels(tuned=True)
            comparisons["all as published"] = self.subject_duels(tuned=False)
        comparisons["sweep against published"] = self.sweep_duels(tuned=False)
        comparisons["sweep against tuned"] = self.sweep_duels(tuned=True)
        return pd.DataFrame(
            [
                {"comparison": comparison, "problem": problem, **duel_row(duel)}
                for comparison, by_problem in comparisons.items()
                for problem, found in by_problem
                for duel in found
            ]
        )


@lru_cache(maxsize=16)  # the page, the tables and the figures ask for the same duels
def _fight(runs: JudgedRuns, pairs: tuple[tuple[str, str], ...]) -> ProblemDuels:
    if not pairs:
        return []
    rows = runs.of([label for pair in pairs for label in pair]).groupby("problem", sort=False)
    return [(str(problem), duels(group, pairs)) for problem, group in rows]


def count_wins(by_problem: ProblemDuels, subject: str) -> tuple[int, int, int]:
    """In how many duels a label is significantly better, in how many worse, and of how many."""
    fought = [duel for _, found in by_problem for duel in found if duel.subject == subject]
    won = sum(duel.winner() == duel.subject for duel in fought)
    lost = sum(duel.winner() == duel.rival for duel in fought)
    return won, lost, len(fought)


def duel_sign(duel: Duel) -> str:
    """` +` if the subject is significantly better, ` -` if worse, else nothing."""
    return {duel.subject: " +", duel.rival: " -"}.get(str(duel.winner()), "")


def duels_by_rival(by_problem: ProblemDuels) -> str:
    """One row a rival, one column a problem: A12 of the subject with its 95 % interval, and who wins."""
    rivals = dict.fromkeys(duel.rival for _, found in by_problem for duel in found)
    cells = {(problem, duel.rival): _effect_text(duel) for problem, found in by_problem for duel in found}
    problems = [problem for problem, _ in by_problem]
    rows = [
        [display_name(rival.removesuffix(TUNED)), *(cells[problem, rival] for problem in problems)] for rival in rivals
    ]
    return markdown_table(["A12 against", *problems], rows)


def _effect_text(duel: Duel) -> str:
    return f"{duel.superiority:.2f} ({duel.low:.2f}-{duel.high:.2f}){duel_sign(duel)}"


_END_COLUMNS = [*GROUP_COLUMNS, "repetition", "value", "violation"]


def ends_path(folder: Path, name: str) -> Path:
    """The file with the ends of the judged runs."""
    return folder / f"{name}_ends.csv"


def ends_table(frame: pd.DataFrame) -> pd.DataFrame:
    """One row a judged run, with its end."""
    return frame[_END_COLUMNS]


def read_judged_runs(folder: Path, name: str = "tune") -> JudgedRuns:
    """Judged runs that `armlab bench tune` wrote into a folder; raises InputError, in one line, if there are none."""
    path = ends_path(folder, name)
    try:
        frame = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}, which `armlab bench tune` writes: {error!s}".splitlines()[0]) from None
    missing = [column for column in _END_COLUMNS if column not in frame]
    if missing:
        raise InputError(f"{path} lacks the columns {', '.join(missing)}: `armlab bench tune` writes it anew")
    return JudgedRuns(read_tuning(settings_path(folder, name)), frame)
