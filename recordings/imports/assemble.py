"""From columns of imported files to a recording: which column is what, in which unit."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from problem.errors import InputError
from problem.settings import nearest
from recordings.imports.read import Source
from recordings.run import Role
from recordings.units import KNOWN
from recordings.write import Draft, DraftRun, Keys

ALIASES = {
    "sec": "s",
    "seconds": "s",
    "°": "deg",
    "degrees": "deg",
    "degree": "deg",
    "°/s": "deg/s",
    "Nm": "N.m",
    "N*m": "N.m",
    "N m": "N.m",
    "N·m": "N.m",
    "µs": "us",
    "°C": "degC",
    "C": "degC",
}
PATTERNS = {
    "time": r"t|time.*|stamp.*|timestamp.*|seconds",
    "position": r"(q|pos|position|angle|theta|act_pos|qm)[._ ]?.*",
    "torque": r"(tau|torque|trq|effort|moment|gamma)[._ ]?.*",
}


@dataclass(frozen=True)
class Assignment:
    """What a person says of the columns: names of each signal, units by signal, and the transmission's gains."""

    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, str] = field(default_factory=dict)
    gains: tuple[float, ...] | None = None


def guessed_columns(names: Sequence[str], signal: str) -> tuple[str, ...]:
    """Columns that look like a signal by their name: offered as an answer, never taken silently."""
    found = tuple(name for name in names if re.fullmatch(PATTERNS[signal], name.split(".")[-1], re.IGNORECASE))
    return found[:1] if signal == "time" else found


def assembled(sources: Mapping[str, Source], robot: str, assignment: Assignment, validate: Sequence[str]) -> Draft:
    """The draft of a recording from read files.

    sources: by the path that was given. validate: those that validate. Raises InputError for a column that a
    file does not have and for an unknown unit.
    """
    columns: Keys = {
        signal: names[0] if signal == "time" else tuple(names) for signal, names in assignment.columns.items()
    }
    wanted = tuple(name for names in assignment.columns.values() for name in names)
    runs = []
    for path, source in sources.items():
        for signal, names in assignment.columns.items():
            source.table.columns(names, signal)
        role: Role = "validate" if path in validate else "identify"
        values = source.table.columns(wanted, "import")
        runs.append(DraftRun(f"{Path(path).stem}.csv", role, wanted, values))
    units = _units(next(iter(sources.values())).units, assignment)
    others = {"gains": list(assignment.gains)} if assignment.gains else {}
    note = tuple(f"{run.file}: imported from {Path(path).name}" for path, run in zip(sources, runs, strict=True))
    return Draft(robot, columns, units, tuple(runs), others, note)


def _units(found: Mapping[str, str], assignment: Assignment) -> Keys:
    """Units of each signal: as the person says, else as the file says of its columns."""
    units: Keys = {}
    for signal, names in assignment.columns.items():
        said = assignment.units.get(signal)
        listed = [known_unit(signal, said)] * len(names) if said else [found.get(name) for name in names]
        if any(unit is None for unit in listed):
            raise InputError(f"no unit is known for {signal}: give --unit {signal}=UNIT ({', '.join(KNOWN[signal])})")
        checked = tuple(known_unit(signal, str(unit)) for unit in listed)
        units[signal] = checked[0] if len(set(checked)) == 1 else checked
    return units


def known_unit(signal: str, name: str) -> str:
    """The unit as `recording.yaml` writes it; InputError for an unknown one."""
    unit = ALIASES.get(name.strip(), name.strip())
    if unit not in KNOWN[signal]:
        raise InputError(f"unknown unit '{name}' of {signal}: {nearest(unit, list(KNOWN[signal]))}")
    return unit
