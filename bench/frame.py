"""Outcomes from the run store as one tidy table: a row a trial, a column a fact."""

from collections.abc import Sequence

import pandas as pd

from bench.outcome import Outcome
from bench.plan import Entry
from bench.store import RunStore

GROUP = ["problem", "swarm_size", "budget", "algorithm"]


def tidy_frame(entries: Sequence[Entry], store: RunStore) -> pd.DataFrame:
    """One row a trial in the order of the entries, which must all be in the store."""
    return pd.DataFrame([row_of(entry, store.get(entry.key)) for entry in entries])


def row_of(entry: Entry, outcome: Outcome) -> dict[str, object]:
    """The facts of one trial by column."""
    return {
        "problem": entry.problem,
        "swarm_size": entry.trial.swarm_size,
        "budget": entry.trial.evaluations,
        "algorithm": entry.algorithm,
        "repetition": entry.trial.repetition,
        "value": outcome.value,
        "violation": outcome.violation,
        "fitness": outcome.fitness,
        "evaluations": outcome.evaluations,
        "seconds": outcome.seconds,
    }
