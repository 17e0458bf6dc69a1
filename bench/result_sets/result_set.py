"""A result set: the outcomes of an experiment as tidy tables, with their settings and provenance."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd
import yaml

from armlab.common.errors import InputError
from bench import execute
from bench.dispatch import count_missing
from bench.plan import Entry, Plan
from bench.run import load_experiment
from bench.statistics import is_feasible
from bench.statistics.performance import Run
from bench.store import open_store
from bench.tables import CELL_COLUMNS, cell_label, entry_labels, failed_sentences, missing_sentences, tidy_frame

TRIAL_COLUMNS = [*CELL_COLUMNS, "algorithm", "repetition"]
CellKey = tuple[Any, ...]
"""Problem, swarm size and budget."""


class CurveSource(Protocol):
    """Gives the curves: one row a trial and population, with evaluations, value and violation of the best so far.

    The curves take most of the space, so only those of one cell are read at a time.
    """

    def of(self, cell: CellKey) -> pd.DataFrame:
        """The curves of one problem, swarm size and budget, in the order of the trials."""
        ...


@dataclass(frozen=True, eq=False)
class TableOfCurves:
    """Curves in a table that was read from a file."""

    table: pd.DataFrame

    def of(self, cell: CellKey) -> pd.DataFrame:
        wanted = np.logical_and.reduce(
            [self.table[name] == value for name, value in zip(CELL_COLUMNS, cell, strict=True)]
        )
        return self.table[wanted]


@dataclass(frozen=True, eq=False)
class StoredCurves:
    """Curves that stay in the run store until they are needed."""

    store: Path
    plan: Plan

    def of(self, cell: CellKey) -> pd.DataFrame:
        with open_store(self.store) as store:
            entries = [entry for entry in self.plan.of(*cell) if store.has(entry.key)]
            return _curve_table(entries, [store.get(entry.key).curves for entry in entries])


@dataclass(frozen=True, eq=False)
class ResultSet:
    """trials: one row a trial, as `bench.tables` makes it. settings: YAML text. origins: provenance of the outcomes.

    missing: which trials were not run, a sentence each.
    """

    name: str
    settings: str
    origins: tuple[dict[str, Any], ...]
    trials: pd.DataFrame
    curves: CurveSource
    missing: tuple[str, ...] = ()

    @property
    def gaps(self) -> tuple[str, ...]:
        """What failed and what is missing, a sentence each; empty for a whole set."""
        return (*failed_sentences(self.trials), *self.missing)

    @property
    def seed(self) -> int:
        """The seed of the experiment."""
        return int(yaml.safe_load(self.settings)["seed"])

    @property
    def problems(self) -> dict[str, Any]:
        """The settings of each problem by its label."""
        found: dict[str, Any] = yaml.safe_load(self.settings)["problem"]
        return found

    @property
    def algorithms(self) -> list[str]:
        """Labels in the order of the configuration."""
        return [str(label) for label in self.trials["algorithm"].unique()]

    def cells(self) -> Iterator[tuple[str, pd.DataFrame, pd.DataFrame]]:
        """Label, trials and curves of each problem, swarm size and budget."""
        for label, trials in self.ends():
            yield label, trials, self.curves.of(tuple(trials[CELL_COLUMNS].iloc[0]))

    def ends(self) -> Iterator[tuple[str, pd.DataFrame]]:
        """Label and trials of each problem, swarm size and budget."""
        for cell, trials in self.trials.groupby(CELL_COLUMNS, sort=False):
            yield cell_label(self.trials, cell), trials


def runs_by_algorithm(trials: pd.DataFrame, curves: pd.DataFrame) -> dict[str, dict[int, Run]]:
    """The runs of one cell by algorithm and repetition, in the order of the trials.

    An infeasible best counts as infinite. A trial that failed has a run that spent its budget and found nothing.
    """
    found: dict[str, dict[int, Run]] = {str(label): {} for label in trials["algorithm"].unique()}
    for row in trials[trials["failure"] != ""].to_dict("records"):
        nothing = Run(np.array([float(row["budget"])]), np.array([np.inf]))
        found[str(row["algorithm"])][int(row["repetition"])] = nothing
    feasible = is_feasible(curves["value"].to_numpy(), curves["violation"].to_numpy())
    best = curves.assign(value=np.where(feasible, curves["value"], np.inf))
    for (algorithm, repetition), rows in best.groupby(["algorithm", "repetition"], sort=False):
        run = Run(rows["evaluations"].to_numpy(float), rows["value"].to_numpy())
        found[str(algorithm)][int(str(repetition))] = run
    return found


def read_stored_results(config: Path, path: Path) -> ResultSet:
    """The outcomes of a configuration in a run store, as far as they are there.

    Raises InputError, in one line, for a mistake in the configuration, and if there is no outcome at all.
    """
    loaded = load_experiment(config)
    if not path.exists():
        raise InputError(f"there is no run store {path}: `armlab run {config}` makes it")
    with open_store(path) as store:
        if count_missing(loaded.entries, store) == len(loaded.entries):
            raise InputError(f"none of the trials of {config} has an outcome in {path}: `armlab run {config}` first")
        trials = tidy_frame(loaded.entries, store)
        origins = tuple(json.loads(facts) for facts in store.origins(entry.key for entry in loaded.entries))
    planned = Counter[tuple[str, str]]()
    for series in loaded.entries.series:
        planned[series.problem, series.algorithm] += loaded.entries.repetitions
    curves = StoredCurves(path, loaded.entries)
    missing = tuple(missing_sentences(trials, planned))
    return ResultSet(loaded.experiment.name, loaded.settings, origins, trials, curves, missing)


def _curve_table(entries: Sequence[Entry], curves: Sequence[execute.Curves]) -> pd.DataFrame:
    names = pd.DataFrame([entry_labels(entry) for entry in entries])
    table = names.loc[names.index.repeat([len(curve.evaluations) for curve in curves])].reset_index(drop=True)
    return table.assign(
        evaluations=np.concatenate([curve.evaluations for curve in curves]).astype(int),
        value=np.concatenate([curve.best_value for curve in curves]),
        violation=np.concatenate([curve.best_violation for curve in curves]),
    )
