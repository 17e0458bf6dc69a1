"""Outcomes from the run store as one tidy table: a row a trial, a column a fact."""

from collections.abc import Iterable, Iterator
from itertools import chain, islice

import pandas as pd

from bench.plan import Entry
from bench.store import RunStore

GROUP = ["problem", "swarm_size", "budget", "algorithm"]
_ROWS = 4096  # that are Python objects at a time; in the table a row takes some tens of bytes


def tidy_frame(entries: Iterable[Entry], store: RunStore) -> pd.DataFrame:
    """One row a trial in the order of the entries, which must all be in the store; their arrays stay there."""
    rows = (_row(entry, store) for entry in entries)
    return pd.concat(_pieces(rows), ignore_index=True)


def _pieces(rows: Iterator[dict[str, object]]) -> Iterator[pd.DataFrame]:
    for first in rows:
        yield pd.DataFrame(list(chain([first], islice(rows, _ROWS - 1))))


def _row(entry: Entry, store: RunStore) -> dict[str, object]:
    """The facts of one trial by column."""
    return names_of(entry) | store.figures(entry.key)._asdict()


def names_of(entry: Entry) -> dict[str, object]:
    """Which trial it is, by column."""
    return {
        "problem": entry.problem,
        "swarm_size": entry.trial.swarm_size,
        "budget": entry.trial.evaluations,
        "algorithm": entry.algorithm,
        "repetition": entry.trial.repetition,
    }
