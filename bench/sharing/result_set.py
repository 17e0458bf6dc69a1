"""A result set: the outcomes of an experiment as tidy tables, with the settings and the machines they come from."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from bench.experiment import load_experiment
from bench.frame import row_of
from bench.outcome import Outcome
from bench.plan import Entry
from bench.runner import missing
from bench.statistics import is_feasible
from bench.statistics.targets import Run
from bench.store import open_store
from problem.errors import InputError

CELL = ["problem", "swarm_size", "budget"]
TRIAL = [*CELL, "algorithm", "repetition"]


@dataclass(frozen=True, eq=False)
class ResultSet:
    """trials: one row a trial, as `bench.frame` has it, and its dimension. curves: one row a trial and population:
    TRIAL, evaluations, value and violation of the best so far. settings: YAML text. origins: who computed them.
    """

    name: str
    settings: str
    origins: tuple[dict[str, Any], ...]
    trials: pd.DataFrame
    curves: pd.DataFrame

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
        curves = dict(list(self.curves.groupby(CELL, sort=False)))
        for cell, trials in self.trials.groupby(CELL, sort=False):
            yield self._label(cell), trials, curves[cell]

    def _label(self, cell: tuple[Any, ...]) -> str:
        problem, swarm_size, budget = cell
        parts = [str(problem)]
        parts += [f"{swarm_size} points"] if self.trials["swarm_size"].nunique() > 1 else []
        parts += [f"{budget} evaluations"] if self.trials["budget"].nunique() > 1 else []
        return ", ".join(parts)


def runs_of(curves: pd.DataFrame) -> dict[str, dict[int, Run]]:
    """The runs of one cell by algorithm and repetition; an infeasible best counts as infinite."""
    found: dict[str, dict[int, Run]] = {}
    feasible = is_feasible(curves["value"].to_numpy(), curves["violation"].to_numpy())
    best = curves.assign(value=np.where(feasible, curves["value"], np.inf))
    for (algorithm, repetition), rows in best.groupby(["algorithm", "repetition"], sort=False):
        run = Run(rows["evaluations"].to_numpy(float), rows["value"].to_numpy())
        found.setdefault(str(algorithm), {})[int(str(repetition))] = run
    return found


def from_store(config: Path, path: Path) -> ResultSet:
    """The outcomes of a configuration in a run store.

    Raises InputError, in one line, for a mistake in the configuration, and if trials are missing.
    """
    loaded = load_experiment(config)
    if not path.exists():
        raise InputError(f"there is no run store {path}: `armlab run {config}` makes it")
    with open_store(path) as store:
        left = len(missing(loaded.entries, store))
        if left:
            raise InputError(
                f"{left} of {len(loaded.entries)} trials of {config} are not in {path}: `armlab run {config}` first"
            )
        outcomes = [store.get(entry.key) for entry in loaded.entries]
        origins = tuple(json.loads(facts) for facts in store.origins(entry.key for entry in loaded.entries))
    trials = _trials(loaded.entries, outcomes)
    return ResultSet(loaded.experiment.name, loaded.settings, origins, trials, _curves(trials, outcomes))


def _trials(entries: Sequence[Entry], outcomes: Sequence[Outcome]) -> pd.DataFrame:
    rows = [row_of(entry, outcome) for entry, outcome in zip(entries, outcomes, strict=True)]
    return pd.DataFrame(rows).assign(dimension=[len(outcome.best_x) for outcome in outcomes])


def _curves(trials: pd.DataFrame, outcomes: Sequence[Outcome]) -> pd.DataFrame:
    curves = [outcome.curves for outcome in outcomes]
    table = trials[TRIAL].loc[np.repeat(trials.index, [len(curve.evaluations) for curve in curves])]
    return table.reset_index(drop=True).assign(
        evaluations=np.concatenate([curve.evaluations for curve in curves]).astype(int),
        value=np.concatenate([curve.best_value for curve in curves]),
        violation=np.concatenate([curve.best_violation for curve in curves]),
    )
