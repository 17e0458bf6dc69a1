"""`armlab recording import`: options and answers become a recording folder."""

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from problem.errors import InputError
from problem.robot_file import built_in_arms, load_arm
from problem.settings import nearest
from recordings.imports.assemble import Assignment, assembled, guessed_columns, known_unit
from recordings.imports.read import ReadOptions, Source, read_source
from recordings.units import KNOWN, SI_UNITS
from recordings.write import write_recording

Ask = Callable[[str, str | None], str]  # a question and the answer to offer
ASKED = ("time", "position", "torque")
WORDS = {"tab": "\t", "blank": " ", "space": " ", "comma": ",", "semicolon": ";"}


def import_files(files: Sequence[Path], out: Path, options: Mapping[str, Any], ask: Ask | None) -> list[str]:
    """Writes the recording and returns lines that say how each file was read.

    options: robot, the columns of each signal, units, gains, validate, separator, decimal, topic; None where
    they were not given. ask: how to ask for what is missing. Raises InputError for what is missing where
    nobody can be asked, and for what is wrong.
    """
    separator = options["separator"]
    reading = ReadOptions(WORDS.get(separator, separator), options["decimal"], options["topic"])
    sources = {str(path): read_source(path, reading) for path in files}
    first = next(iter(sources.values()))
    robot = _robot(options["robot"], ask)
    assignment = _assignment(first, options, ask)
    validate = [str(path) for path in options["validate"]]
    unknown = sorted(set(validate) - set(sources))
    if unknown:
        raise InputError(f"--validate {unknown[0]} is none of the imported files")
    draft = assembled(sources, robot, assignment, validate)
    write_recording(draft, out)
    return [*(_line(path, source) for path, source in sources.items()), f"{out}: written; look at it with `check`"]


def _line(path: str, source: Source) -> str:
    found = "".join(f"; {finding.text}" for finding in source.table.findings)
    return f"{path}: {len(source.table.values)} rows ({source.note}){found}"


def _robot(given: str | None, ask: Ask | None) -> str:
    robot = given or (ask(f"robot ({', '.join(built_in_arms())}, or a file)", None) if ask else None)
    if robot is None:
        raise InputError(f"which robot? Give --robot: one of {', '.join(built_in_arms())}, or the path of a file")
    load_arm(robot)
    return robot if robot in built_in_arms() else str(Path(robot).resolve())


def _assignment(source: Source, options: Mapping[str, Any], ask: Ask | None) -> Assignment:
    units = dict(_pair(text) for text in options["units"])
    columns: dict[str, tuple[str, ...]] = {}
    for signal in SI_UNITS:
        given = options.get(signal)
        if given is None and signal in ASKED:
            given = _asked_columns(source, signal, ask)
        if given is not None:
            columns[signal] = _expanded(given, source.table.names, signal)
    for signal, names in columns.items():
        if signal not in units and not all(name in source.units for name in names):
            units[signal] = _asked_unit(signal, ask)
    return Assignment(columns, units, _gains(options["gains"]))


def _asked_columns(source: Source, signal: str, ask: Ask | None) -> str:
    names = source.table.names
    if ask is None:
        shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        raise InputError(f"which columns are {signal}? Give --{signal}; the file holds {shown}")
    guess = ",".join(guessed_columns(names, signal)) or None
    return ask(f"column(s) of {signal}, of {', '.join(names)}", guess)


def _asked_unit(signal: str, ask: Ask | None) -> str:
    if ask is None:
        raise InputError(f"no unit is known for {signal}: give --unit {signal}=UNIT ({', '.join(KNOWN[signal])})")
    return known_unit(signal, ask(f"unit of {signal} ({', '.join(KNOWN[signal])})", SI_UNITS[signal][0]))


def _expanded(given: str, names: Sequence[str], signal: str) -> tuple[str, ...]:
    """Names and patterns with commas between them as column names, patterns in the order of the file."""
    wanted: list[str] = []
    for part in (part.strip() for part in given.split(",")):
        found = [part] if part in names else [name for name in names if fnmatchcase(name, part)]
        if not found:
            raise InputError(f"no column '{part}' for {signal}: {nearest(part, names)}")
        wanted += found
    return tuple(wanted)


def _pair(text: str) -> tuple[str, str]:
    signal, sign, unit = text.partition("=")
    if not sign or signal not in KNOWN:
        raise InputError(f"--unit {text} should be SIGNAL=UNIT: {nearest(signal, list(KNOWN))}")
    return signal, known_unit(signal, unit)


def _gains(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--gains {text} should be numbers with commas between them") from None
