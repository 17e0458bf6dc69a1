"""Mutations inside MuPSO's runs: when they happen, and whether the best point comes before or after them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed, parallel_config

from bench.execute import Trial, replay
from bench.plan import Entry


@dataclass(frozen=True)
class MutationHistory:
    """One run: the iterations whose population was drawn anew, and the iteration of its last improvement.

    iterations: number of iterations after the first population.
    """

    mutations: tuple[int, ...]
    last_improvement: int
    iterations: int

    @property
    def best_before_mutation(self) -> bool | None:
        """Whether nothing better came after the first mutation; None without one."""
        return self.last_improvement < self.mutations[0] if self.mutations else None


def replay_mutations(entries: Sequence[Entry], workers: int, **changed: Any) -> list[MutationHistory]:
    """Repeat the runs of MuPSO, with other hyper-parameters where `changed` names them."""
    trials = [replace(entry.trial, params=replace(entry.trial.params, **changed)) for entry in entries]
    with parallel_config(backend="loky", inner_max_num_threads=1):
        return list(Parallel(n_jobs=workers)(delayed(_replay_mutations_of_trial)(trial) for trial in trials))


def _replay_mutations_of_trial(trial: Trial) -> MutationHistory:
    result = replay(trial)
    improvements = np.flatnonzero(np.diff(result.best_so_far) < 0)
    last = int(improvements[-1]) + 1 if len(improvements) else 0
    return MutationHistory(tuple(result.final_state.mutations), last, len(result.best_so_far) - 1)


def mutation_table(entries: Sequence[Entry], workers: int) -> pd.DataFrame:
    """One row a problem and variant of MuPSO, from its runs at the smallest budget of the entries."""
    budget = min(entry.trial.evaluations for entry in entries)
    chosen = [e for e in entries if e.trial.algorithm == "mupso" and e.trial.evaluations == budget]
    lives = zip(chosen, replay_mutations(chosen, workers), strict=True)
    groups = groupby(lives, key=lambda pair: (pair[0].problem, pair[0].algorithm))
    return pd.DataFrame([_variant_row(*names, budget, [life for _, life in pairs]) for names, pairs in groups])


def _variant_row(problem: str, label: str, budget: int, lives: list[MutationHistory]) -> dict[str, object]:
    first = [life.mutations[0] for life in lives if life.mutations]
    before = [bool(life.best_before_mutation) for life in lives if life.mutations]
    return {
        "problem": problem,
        "algorithm": label,
        "budget": budget,
        "runs": len(lives),
        "runs_that_mutate": len(first),
        "mutations_a_run": float(np.mean([len(life.mutations) for life in lives])),
        "median_first_iteration": float(np.median(first)) if first else np.nan,
        "share_best_before_first": float(np.mean(before)) if before else np.nan,
    }
