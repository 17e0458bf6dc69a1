"""The best known condition number of each problem of an experiment."""

from collections.abc import Sequence
from pathlib import Path

from bench.best_known.gap import best_known, record_key
from bench.plan import Entry


def known_values(entries: Sequence[Entry], records: Path) -> dict[str, float]:
    """By the problem's label; problems without a record are left out."""
    known = best_known(records)
    keys = {entry.problem: record_key(entry.trial.problem) for entry in entries}
    return {label: known[key].value for label, key in keys.items() if key in known}
