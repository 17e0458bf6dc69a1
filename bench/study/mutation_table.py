"""How often each variant of MuPSO mutates, and when."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np
import pandas as pd

from bench.mutations import InnerLife, inner_lives
from bench.plan import Entry


def mutation_table(entries: Sequence[Entry], workers: int) -> pd.DataFrame:
    """One row a problem and variant of MuPSO, from its runs at the smallest budget of the entries."""
    budget = min(entry.trial.evaluations for entry in entries)
    chosen = [e for e in entries if e.trial.algorithm == "mupso" and e.trial.evaluations == budget]
    lives = zip(chosen, inner_lives(chosen, workers), strict=True)
    groups = groupby(lives, key=lambda pair: (pair[0].problem, pair[0].algorithm))
    return pd.DataFrame([_row(*names, budget, [life for _, life in pairs]) for names, pairs in groups])


def _row(problem: str, label: str, budget: int, lives: list[InnerLife]) -> dict[str, object]:
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
