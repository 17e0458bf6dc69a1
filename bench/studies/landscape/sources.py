"""The results that the page about the choice reads: summary tables with their settings, and who is chosen from them."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from algorithms.registry import names_with_derivatives
from armlab.common.errors import InputError
from armlab.common.settings import read_yaml
from bench.files import settings_path
from bench.studies.landscape.ratios import Ratio, mean_ratio
from bench.studies.landscape.standing import standings


@dataclass(frozen=True, eq=False)
class SummaryTable:
    """A summary table and the settings that it was made with."""

    table: pd.DataFrame
    settings: dict[str, Any]

    @staticmethod
    def read(folder: Path, name: str) -> "SummaryTable":
        """Raises InputError where one of the two files is missing."""
        path = folder / f"{name}.csv"
        if not path.is_file():
            raise InputError(f"{path}: there are no such results; `armlab run` or its study makes them")
        return SummaryTable(pd.read_csv(path), read_yaml(settings_path(folder, name)))

    @property
    def repetitions(self) -> int:
        """Runs behind each median."""
        return int(self.settings["repetitions"])

    @cached_property
    def algorithms(self) -> list[str]:
        """In the order of the table."""
        return [str(name) for name in self.table["algorithm"].unique()]

    def only(self, algorithms: Sequence[str]) -> "SummaryTable":
        """The rows of some algorithms."""
        return SummaryTable(self.table[self.table["algorithm"].isin(algorithms)], self.settings)

    def medians(self, algorithm: str) -> "pd.Series[float]":
        """By problem; infinite where most ends are infeasible."""
        return self.table[self.table["algorithm"] == algorithm].set_index("problem")["median"]

    def of_problems(self, problems: Sequence[str]) -> "SummaryTable":
        """The rows of some problems."""
        return SummaryTable(self.table[self.table["problem"].isin(problems)], self.settings)

    def average_ranks(self) -> "pd.Series[float]":
        """Least first."""
        return standings(self.table).mean().sort_values(kind="stable")

    def with_budgets(self) -> pd.DataFrame:
        """The table with the column `budget`: the configured number of evaluations that a row used up."""
        budgets = np.sort(np.atleast_1d(self.settings["evaluations"]))
        places = np.searchsorted(budgets, self.table["evaluations"].to_numpy())
        return self.table.assign(budget=budgets[np.minimum(places, len(budgets) - 1)])


def _read_prices(path: Path) -> dict[str, dict[str, float]]:
    """Of `armlab tools speed`; raises InputError where there is no such file."""
    try:
        found: dict[str, dict[str, float]] = json.loads(path.read_text())["derivative_price"]
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"cannot read {path}, which `armlab tools speed` writes: {error}".splitlines()[0]) from None
    return {name: price for name, price in found.items() if "," not in name}


@dataclass(frozen=True, eq=False)
class Sources:
    """All results that the page reads. features, correlations: of the landscapes.

    prices: of a point with derivatives by problem, `stated` as budgets count it, and `in_population` as its time does.
    """

    suite: SummaryTable
    held_out: SummaryTable
    readings: SummaryTable
    derivatives: SummaryTable
    derivative_budgets: SummaryTable
    budgets: SummaryTable
    space: SummaryTable
    space_duels: pd.DataFrame
    tuned: pd.DataFrame
    prices: dict[str, dict[str, float]]
    features: pd.DataFrame
    correlations: pd.DataFrame

    @staticmethod
    def read(results: Path, features: pd.DataFrame, correlations: pd.DataFrame) -> "Sources":
        """From the folder of results; raises InputError where one is missing."""
        for path in (results / "search_space" / "comparison.csv", results / "tune" / "tune_judged.csv"):
            if not path.is_file():
                target = path.parent.name.replace("_", "-")
                raise InputError(f"{path}: there are no such results; `make {target}` makes them")
        return Sources(
            suite=SummaryTable.read(results / "suite", "suite"),
            held_out=SummaryTable.read(results / "suite", "suite_heldout"),
            readings=SummaryTable.read(results / "suite", "suite_readings"),
            derivatives=SummaryTable.read(results / "derivatives", "derivatives"),
            derivative_budgets=SummaryTable.read(results / "derivatives", "derivatives_budgets"),
            budgets=SummaryTable.read(results / "study", "study_budgets"),
            space=SummaryTable.read(results / "search_space", "search_space"),
            space_duels=pd.read_csv(results / "search_space" / "comparison.csv"),
            tuned=pd.read_csv(results / "tune" / "tune_judged.csv").set_index("algorithm"),
            prices=_read_prices(results / "speed" / "speed.json"),
            features=features,
            correlations=correlations,
        )

    @cached_property
    def groups(self) -> "pd.Series[Any]":
        """The landscape of each problem."""
        return self.features.set_index("problem")["landscape"]

    @cached_property
    def asking(self) -> list[str]:
        """Algorithms of the suite that ask for derivatives."""
        return [name for name in self.suite.algorithms if name in names_with_derivatives()]

    @cached_property
    def plain(self) -> list[str]:
        """Algorithms of the suite that do not."""
        return [name for name in self.suite.algorithms if name not in self.asking]

    @cached_property
    def choice(self) -> str:
        """Of the algorithms without derivatives, the one with the least average rank on the suite."""
        return str(self.suite.only(self.plain).average_ranks().index[0])

    @cached_property
    def asking_choice(self) -> str | None:
        """The same of those that ask for derivatives; None where the suite has none."""
        return str(self.suite.only(self.asking).average_ranks().index[0]) if self.asking else None

    def ratio(self, comparison: SummaryTable, ours: str, theirs: str) -> Ratio:
        """Of the medians of two algorithms over the problems of a comparison."""
        return mean_ratio(comparison.medians(ours), comparison.medians(theirs), self.groups)
