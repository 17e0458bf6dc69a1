"""How far a condition number is from the best that is known for its problem."""

from pathlib import Path
from typing import Any

from bench.best_known.record import Record, read_records
from bench.trial import canonical
from problem.registry import ProblemSettings, parse_problem

_NO_MATTER = ("criterion", "penalty", "frame_seed")  # they change neither a trajectory's value nor its limits


def record_key(settings: ProblemSettings) -> str:
    """Canonical text of what decides the values and limits of a problem: equal text, equal best."""
    kept = {name: value for name, value in settings.model_dump(mode="json").items() if name not in _NO_MATTER}
    if kept["preset"] == "random-frame":
        kept["preset"] = "joint-fourier"  # the same trajectories in other coordinates
    return canonical(kept)


def best_known(path: Path) -> dict[str, Record]:
    """Records of a file by the key of their problem."""
    records = read_records(path)
    return {record_key(parse_problem(_own(record), f"{path}, '{name}'")): record for name, record in records.items()}


def gap_to_best_known(settings: ProblemSettings, value: float, known: dict[str, Record]) -> float | None:
    """Relative excess of a condition number over the best known, 0.1 for 10 % more; None without a record.

    known: as `best_known` gives it. Negative for a value that beats the record.
    """
    record = known.get(record_key(settings))
    return None if record is None else value / record.value - 1


def _own(record: Record) -> dict[str, Any]:
    return record.settings
