"""From files of other formats to a recording folder: read the files, assign columns and units, write the recording."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.lerobot import COMMAND, STATE, is_lerobot, read_lerobot
from armlab.recordings.imports.matlab import read_mat
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.recording import Role
from armlab.recordings.recording_file import Draft, DraftRun, Keys, write_recording
from armlab.recordings.table import Table, read_table
from armlab.recordings.units import SIGNAL_QUANTITIES
from problem.robot_file import built_in_arms, load_arm

BAG_SUFFIXES = (".db3", ".mcap", ".bag")
TEXT_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".log", ".asc")
BAG_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N.m"}


@dataclass(frozen=True)
class ReadOptions:
    """How to read a file, where the file does not tell: layout of a text, topic of a bag."""

    separator: str | None = None
    decimal: str | None = None
    topic: str | None = None


@dataclass(frozen=True, eq=False)
class Source:
    """Content of a file: its columns, the units that it names, and a line on how it was read."""

    table: Table
    units: dict[str, str]
    note: str


def read_source(path: Path, options: ReadOptions) -> Source:
    """The columns of a file, whatever its format; InputError for an unknown one and a broken file."""
    if not path.exists():
        raise InputError(f"no file {path}")
    suffix = path.suffix.lower()
    if suffix in BAG_SUFFIXES or path.is_dir():
        table = read_bag(path, options.topic)
        return Source(table, _bag_units(table), "joint states; positions rad, efforts N.m by ROS convention")
    if suffix == ".mat":
        return Source(read_mat(path), {}, "MATLAB variables")
    if suffix == ".parquet":
        return Source(read_table(path), {}, "Parquet columns")
    if suffix in TEXT_SUFFIXES:
        text = read_odd_csv(path, options.separator, options.decimal)
        return Source(text.table, text.units, str(text.layout))
    known = ", ".join((".mat", ".parquet", *BAG_SUFFIXES, *TEXT_SUFFIXES))
    raise InputError(f"cannot import {path}: its ending should be one of {known}, or it should be a bag's folder")


def read_sources(path: Path, options: ReadOptions) -> dict[str, Source]:
    """The content of a path by the paths of its runs: several for a LeRobot dataset, which holds episodes."""
    if not is_lerobot(path):
        return {str(path): read_source(path, options)}
    note = "LeRobot episode; action is the command, observation.state the position"
    return {str(path / name): Source(table, {"timestamp": "s"}, note) for name, table in read_lerobot(path).items()}


def _bag_units(table: Table) -> dict[str, str]:
    units = {name: BAG_UNITS[name.split("_")[0]] for name in table.names if name.split("_")[0] in BAG_UNITS}
    return {"t": "s", **units}


UNIT_ALIASES = {
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
COLUMN_NAME_PATTERNS = {
    "time": r"t|time.*|stamp.*|timestamp.*|seconds",
    "position": r"(q|pos|position|angle|theta|act_pos|qm)[._ ]?.*",
    "torque": r"(tau|torque|trq|effort|moment|gamma)[._ ]?.*",
}


@dataclass(frozen=True)
class Assignment:
    """What the user gives: column names of each signal, units of signals, and the gains of the transmission."""

    columns: Mapping[str, Sequence[str]]
    units: Mapping[str, str] = field(default_factory=dict)
    gains: tuple[float, ...] | None = None


def guess_columns(names: Sequence[str], signal: str) -> tuple[str, ...]:
    """Columns whose names look like a signal: the default answer to a question, not used without asking."""
    found = tuple(
        name for name in names if re.fullmatch(COLUMN_NAME_PATTERNS[signal], name.split(".")[-1], re.IGNORECASE)
    )
    return found[:1] if signal == "time" else found


def assemble_draft(sources: Mapping[str, Source], robot: str, assignment: Assignment, validate: Sequence[str]) -> Draft:
    """The draft of a recording from read files.

    sources: by the path that was given. validate: paths of the runs with the role validate.
    Raises InputError for a column that a file does not have and for an unknown unit.
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
    units = _choose_units(next(iter(sources.values())).units, assignment)
    others = {"gains": list(assignment.gains)} if assignment.gains else {}
    note = tuple(f"{run.file}: imported from {Path(path).name}" for path, run in zip(sources, runs, strict=True))
    return Draft(robot, columns, units, tuple(runs), others, note)


def _choose_units(found: Mapping[str, str], assignment: Assignment) -> Keys:
    """Units of each signal: those that the user gives, else those that the file names."""
    units: Keys = {}
    for signal, names in assignment.columns.items():
        given = assignment.units.get(signal)
        listed = [parse_unit(signal, given)] * len(names) if given else [found.get(name) for name in names]
        if any(unit is None for unit in listed):
            raise _missing_unit(signal)
        checked = tuple(parse_unit(signal, str(unit)) for unit in listed)
        units[signal] = checked[0] if len(set(checked)) == 1 else checked
    return units


def _missing_unit(signal: str) -> InputError:
    known = ", ".join(SIGNAL_QUANTITIES[signal].units)
    return InputError(f"no unit is known for {signal}: give --unit {signal}=UNIT ({known})")


def parse_unit(signal: str, name: str) -> str:
    """The unit as `recording.yaml` writes it; InputError for an unknown one."""
    unit = UNIT_ALIASES.get(name.strip(), name.strip())
    known = list(SIGNAL_QUANTITIES[signal].units)
    if unit not in known:
        raise InputError(f"unknown unit '{name}' of {signal}: {suggest_name(unit, known)}")
    return unit


Ask = Callable[[str, str | None], str]  # a question and the answer to offer
ASKED_SIGNALS = ("time", "position", "torque")
SEPARATOR_WORDS = {"tab": "\t", "blank": " ", "space": " ", "comma": ",", "semicolon": ";"}


def import_files(files: Sequence[Path], out: Path, options: Mapping[str, Any], ask: Ask | None) -> list[str]:
    """Writes the recording and returns lines that tell how each file was read.

    options: robot, the columns of each signal, units, gains, validate, separator, decimal, topic; None if not given.
    ask: asks the user for a missing option.
    Raises InputError for a wrong option, and for a missing one if `ask` is None.
    """
    separator = options["separator"]
    reading = ReadOptions(SEPARATOR_WORDS.get(separator, separator), options["decimal"], options["topic"])
    sources = {name: source for path in files for name, source in read_sources(path, reading).items()}
    first = next(iter(sources.values()))
    robot = _choose_robot(options["robot"], ask)
    if any(is_lerobot(path) for path in files):
        usual = _lerobot_columns(first, options.get("joints"))
        options = {**options, **{name: each for name, each in usual.items() if options.get(name) is None}}
    assignment = _make_assignment(first, options, ask)
    validate = [str(path) for path in options["validate"]]
    unknown = sorted(set(validate) - set(sources))
    if unknown:
        raise InputError(f"--validate {unknown[0]} should be one of the imported files")
    draft = assemble_draft(sources, robot, assignment, validate)
    if options.get("joints"):
        draft = replace(draft, others={**draft.others, "joints": _split_names(options["joints"])})
    write_recording(draft, out)
    return [
        *(_describe_source(path, source) for path, source in sources.items()),
        f"{out}: written; `armlab recording check {out}` examines it",
    ]


def _split_names(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _lerobot_columns(source: Source, joints: str | None) -> dict[str, str]:
    """Columns of a dataset's signals: of the named joints, else of all."""
    states = [name.removeprefix(f"{STATE}.") for name in source.table.names if name.startswith(f"{STATE}.")]
    chosen = _split_names(joints) if joints else states
    return {
        "time": "timestamp",
        "position": ",".join(f"{STATE}.{name}" for name in chosen),
        "reference_position": ",".join(f"{COMMAND}.{name}" for name in chosen),
    }


def _describe_source(path: str, source: Source) -> str:
    found = "".join(f"; {finding.text}" for finding in source.table.findings)
    return f"{path}: {len(source.table.values)} rows ({source.note}){found}"


def _choose_robot(given: str | None, ask: Ask | None) -> str:
    robot = given or (ask(f"robot ({', '.join(built_in_arms())}, or a file)", None) if ask else None)
    if robot is None:
        known = ", ".join(built_in_arms())
        raise InputError(f"the robot is missing: give --robot with one of {known}, or with the path of a robot file")
    load_arm(robot)
    return robot if robot in built_in_arms() else str(Path(robot).resolve())


def _make_assignment(source: Source, options: Mapping[str, Any], ask: Ask | None) -> Assignment:
    units = dict(_parse_unit_option(text) for text in options["units"])
    columns: dict[str, tuple[str, ...]] = {}
    for signal in SIGNAL_QUANTITIES:
        given = options.get(signal)
        if given is None and signal in ASKED_SIGNALS and not (signal == "torque" and options.get("reference_position")):
            given = _ask_columns(source, signal, ask)
        if given is not None:
            columns[signal] = _expand_names(given, source.table.names, signal)
    for signal, names in columns.items():
        if signal not in units and not all(name in source.units for name in names):
            units[signal] = _ask_unit(signal, ask)
    return Assignment(columns, units, _parse_gains(options["gains"]))


def _ask_columns(source: Source, signal: str, ask: Ask | None) -> str:
    names = source.table.names
    if ask is None:
        shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        other = ", or --reference-position of a position servo" if signal == "torque" else ""
        raise InputError(f"the columns of {signal} are missing: give --{signal}{other}; the file holds {shown}")
    guess = ",".join(guess_columns(names, signal)) or None
    return ask(f"column(s) of {signal}, of {', '.join(names)}", guess)


def _ask_unit(signal: str, ask: Ask | None) -> str:
    if ask is None:
        raise _missing_unit(signal)
    quantity = SIGNAL_QUANTITIES[signal]
    return parse_unit(signal, ask(f"unit of {signal} ({', '.join(quantity.units)})", quantity.si[0]))


def _expand_names(given: str, names: Sequence[str], signal: str) -> tuple[str, ...]:
    """Names and patterns with commas between them as column names, patterns in the order of the file."""
    wanted: list[str] = []
    for part in (part.strip() for part in given.split(",")):
        found = [part] if part in names else [name for name in names if fnmatchcase(name, part)]
        if not found:
            raise InputError(f"no column '{part}' for {signal}: {suggest_name(part, names)}")
        wanted += found
    return tuple(wanted)


def _parse_unit_option(text: str) -> tuple[str, str]:
    signal, sign, unit = text.partition("=")
    if not sign or signal not in SIGNAL_QUANTITIES:
        raise InputError(f"--unit {text} should be SIGNAL=UNIT: {suggest_name(signal, list(SIGNAL_QUANTITIES))}")
    return signal, parse_unit(signal, unit)


def _parse_gains(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--gains {text} should be numbers with commas between them") from None
