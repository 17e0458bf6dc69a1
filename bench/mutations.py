"""What happened inside MuPSO's runs: when it mutated, and when it found its best."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from joblib import Parallel, delayed, parallel_config

from bench.execute import replay
from bench.plan import Entry
from bench.trial import Trial


@dataclass(frozen=True)
class InnerLife:
    """One run: iterations whose population was drawn anew, and the iteration of its last improvement.

    iterations: how many followed the first population.
    """

    mutations: tuple[int, ...]
    last_improvement: int
    iterations: int

    @property
    def best_before_mutation(self) -> bool | None:
        """Whether nothing better came after the first mutation; None without one."""
        return self.last_improvement < self.mutations[0] if self.mutations else None


def inner_lives(entries: Sequence[Entry], workers: int, **changed: Any) -> list[InnerLife]:
    """The runs of MuPSO once more, with other hyper-parameters where `changed` names them."""
    trials = [replace(entry.trial, params=replace(entry.trial.params, **changed)) for entry in entries]
    with parallel_config(backend="loky", inner_max_num_threads=1):
        return list(Parallel(n_jobs=workers)(delayed(_inner_life)(trial) for trial in trials))


def _inner_life(trial: Trial) -> InnerLife:
    result = replay(trial)
    improvements = np.flatnonzero(np.diff(result.best_so_far) < 0)
    last = int(improvements[-1]) + 1 if len(improvements) else 0
    return InnerLife(tuple(result.final_state.mutations), last, len(result.best_so_far) - 1)
