"""From files of other formats to a recording folder: read the files, assign columns and units, write the recording."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from armlab.common.documents import Document
from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.lerobot import COMMAND, STATE, is_lerobot, read_lerobot
from armlab.recordings.imports.matlab import read_mat
from armlab.recordings.imports.recognition import (
    Found,
    check_joint_order,
    order_by_joint,
    recognise_signal,
    recognise_time,
    unit_by_name,
)
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.recording import Role
from armlab.recordings.recording_file import Draft, DraftRun, Keys, write_recording
from armlab.recordings.table import Table, read_table
from armlab.recordings.units import DRIVE_UNITS, SENSOR_SIGNALS, SIGNAL_QUANTITIES
from problem.arm import Arm
from problem.robot_file import built_in_arms, load_arm

BAG_SUFFIXES = (".db3", ".mcap", ".bag")
TEXT_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".log", ".asc")
BAG_COMMAND = "command"
BAG_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N.m", "command": "rad"}


@dataclass(frozen=True)
class ReadOptions:
    """How to read a file, where the file does not tell: layout of a text; topics of a bag, and the robot's joints."""

    separator: str | None = None
    decimal: str | None = None
    topic: str | None = None
    commands: str | None = None
    joints: tuple[str, ...] = ()


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
        table = read_bag(path, options.topic, options.commands, options.joints)
        return Source(table, _bag_units(table), "joint states; rad, rad/s and N.m by ROS convention")
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
        runs.append(DraftRun(_run_file(path, sources), role, wanted, values))
    units = _choose_units(next(iter(sources.values())).units, assignment)
    others = {"gains": list(assignment.gains)} if assignment.gains else {}
    note = tuple(f"{run.file}: imported from {Path(path).name}" for path, run in zip(sources, runs, strict=True))
    return Draft(robot, columns, units, tuple(runs), others, note)


def _run_file(path: str, paths: Iterable[str]) -> str:
    """The name of a run: that of its file, with its folder's where two files have one name."""
    own = Path(path)
    alike = sum(Path(each).stem == own.stem for each in paths)
    place = list(paths).index(path) + 1
    return f"{own.stem}.csv" if alike == 1 else f"{own.resolve().parent.name}-{own.stem}-{place}.csv"


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


@dataclass(frozen=True, eq=False)
class ImportedRecording:
    """A recording that was written. sources: by the path that was given. columns: names by the signal."""

    folder: Path
    sources: Mapping[str, Source]
    columns: Mapping[str, Sequence[str]]
    draft: Draft

    @property
    def lines(self) -> list[str]:
        """How each file was read, what each signal was taken from, and what to do next."""
        return [
            *(_describe_source(path, source) for path, source in self.sources.items()),
            *(_describe_signal(self.draft, signal, names) for signal, names in self.columns.items()),
            f"{self.folder}: written; `armlab recording check {self.folder}` examines it",
        ]

    @property
    def document(self) -> Document:
        """The same for programs."""
        runs = zip(self.draft.runs, self.sources.items(), strict=True)
        return {
            "recording": self.folder,
            "robot": self.draft.robot,
            "runs": [
                {
                    "file": run.file,
                    "role": run.role,
                    "rows": len(source.table.values),
                    "from": path,
                    "read_as": source.note,
                    "findings": [each.text for each in source.table.findings],
                }
                for run, (path, source) in runs
            ],
            "columns": self.columns,
            "units": {signal: self.draft.units[signal] for signal in self.columns},
        }


def import_files(files: Sequence[Path], out: Path, options: Mapping[str, Any], ask: Ask | None) -> ImportedRecording:
    """Writes the recording, and tells how each file was read and what each signal was taken from.

    options: robot, the columns of each signal, units, gains, validate, separator, decimal, topic; None if not given.
    ask: asks the user for a missing option.
    Raises InputError for a wrong option, and for all missing ones together if `ask` is None.
    """
    separator = options["separator"]
    missing: list[str] = []
    robot = _choose_robot(options["robot"], ask, missing)
    chosen = tuple(_split_names(options["joints"])) if options.get("joints") else ()
    whole = None if robot is None or chosen else load_arm(robot)  # of --joints, the reader checks them
    joints = chosen if whole is None else tuple(joint.name for joint in whole.joints)
    reading = ReadOptions(
        separator=SEPARATOR_WORDS.get(separator, separator),
        decimal=options["decimal"],
        topic=options["topic"],
        commands=options.get("command_topic"),
        joints=joints,
    )
    sources: dict[str, Source] = {}
    for path in files:
        for name, source in read_sources(path, reading).items():
            if name in sources:
                raise InputError(f"{name} is given twice: a run cannot both identify and validate")
            sources[name] = source
    first = next(iter(sources.values()))
    usual: dict[str, str] = {}
    if any(is_lerobot(path) for path in files):
        usual = _lerobot_columns(first, options.get("joints"))
    elif joints and options.get("torque") is None and _has_commands(first):
        usual = _bag_columns(first, joints, options)
    options = {**options, **{name: each for name, each in usual.items() if options.get(name) is None}}
    assignment = _make_assignment(first, whole, options, ask, missing)
    if missing or robot is None:
        raise InputError("; ".join(missing))
    validate = [str(path) for path in options["validate"]]
    unknown = sorted(set(validate) - set(sources))
    if unknown:
        raise InputError(f"--validate {unknown[0]} should be one of the imported files")
    draft = assemble_draft(sources, robot, assignment, validate)
    if chosen:
        draft = replace(draft, others={**draft.others, "joints": list(chosen)})
    write_recording(draft, out)
    return ImportedRecording(out, sources, assignment.columns, draft)


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


def _has_commands(source: Source) -> bool:
    return any(name.startswith(f"{BAG_COMMAND}_") and name in source.units for name in source.table.names)


def _bag_columns(source: Source, joints: Sequence[str], options: Mapping[str, Any]) -> dict[str, str]:
    """Columns of a bag with commands, by the names of the robot's joints.

    Raises InputError where a joint has none and the columns were not listed.
    """
    columns = {"time": "t"}
    for signal, prefix in (("position", "position"), ("reference_position", BAG_COMMAND)):
        listed = [name.removeprefix(f"{prefix}_") for name in source.table.names if name.startswith(f"{prefix}_")]
        lacking = [joint for joint in joints if joint not in listed]
        if lacking and options.get(signal) is None:
            raise InputError(
                f"{source.table.file} has no {prefix} of joint {', '.join(lacking)}, only of {', '.join(listed)}: give "
                f"--joints with those that were recorded, or --{signal.replace('_', '-')} NAME,... in their order"
            )
        columns[signal] = ",".join(f"{prefix}_{joint}" for joint in joints)
    return columns


def _describe_signal(draft: Draft, signal: str, names: Sequence[str]) -> str:
    unit = draft.units[signal]
    return f"{signal}: {', '.join(names)} [{unit if isinstance(unit, str) else ', '.join(unit)}]"


def _describe_source(path: str, source: Source) -> str:
    found = "".join(f"; {finding.text}" for finding in source.table.findings)
    return f"{path}: {len(source.table.values)} rows ({source.note}){found}"


def _choose_robot(given: str | None, ask: Ask | None, missing: list[str]) -> str | None:
    """The robot as the recording names it; what is missing is added to the list."""
    robot = given or (ask(f"robot ({', '.join(built_in_arms())}, or a file)", None) if ask else None)
    if robot is None:
        known = ", ".join(built_in_arms())
        missing.append(f"the robot is missing: give --robot with one of {known}, or with the path of a robot file")
        return None
    load_arm(robot)
    return robot if robot in built_in_arms() else str(Path(robot).resolve())


def _make_assignment(
    source: Source, arm: Arm | None, options: Mapping[str, Any], ask: Ask | None, missing: list[str]
) -> Assignment:
    """Columns and units as given, else as recognised, else as asked for; what is missing is added to the list."""
    units = dict(_parse_unit_option(text) for text in options["units"])
    columns: dict[str, tuple[str, ...]] = {}
    for signal in SIGNAL_QUANTITIES:
        given = options.get(signal)
        asked = signal in ASKED_SIGNALS and not (signal == "torque" and options.get("reference_position"))
        found = _recognise(source, signal, arm) if given is None and asked else None
        if found is not None:
            columns[signal] = found.names
            if found.unit and signal not in units and not all(name in source.units for name in found.names):
                units[signal] = found.unit
            continue
        if given is None and asked:
            given = _ask_columns(source, signal, ask, missing)
        if given is not None:
            columns[signal] = _expand_names(given, source.table.names, signal, arm)
            unit = _unit_by_name(source, signal, columns[signal])
            if unit and signal not in units and not all(name in source.units for name in columns[signal]):
                units[signal] = unit
    for signal, names in columns.items():
        if signal not in units and not all(name in source.units for name in names):
            units |= _ask_unit(signal, ask, missing)
    gains = _parse_gains(options["gains"])
    drive = [units.get("torque", ""), *(source.units.get(name, "") for name in columns.get("torque", ()))]
    if gains is None and any(unit in DRIVE_UNITS for unit in drive):
        wanted = f"gains of {', '.join(columns['torque'])}, N.m per A or V, with commas between them"
        gains = _parse_gains(ask(wanted, None)) if ask else None
        if gains is None:
            missing.append(f"the torque is measured in A or V: give --gains, {wanted}")
    if gains is not None and "torque" in columns and len(gains) != len(columns["torque"]):
        raise InputError(f"--gains holds {len(gains)} numbers for {len(columns['torque'])} columns of torque")
    return Assignment(columns, units, gains)


def _unit_by_name(source: Source, signal: str, names: tuple[str, ...]) -> str | None:
    if signal == "time":
        found = recognise_time(names, source.table.columns(names, signal))
        return found.unit if found else None
    unit = unit_by_name(names, source.table.names)
    return unit if unit in SIGNAL_QUANTITIES[signal].units else None


def _recognise(source: Source, signal: str, arm: Arm | None) -> Found | None:
    if signal == "time":
        return recognise_time(source.table.names, source.table.values)
    return recognise_signal(source.table.names, signal, arm) if arm else None


def _ask_columns(source: Source, signal: str, ask: Ask | None, missing: list[str]) -> str | None:
    names = source.table.names
    if ask is None:
        shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        other = ", or --reference-position of a position servo" if signal == "torque" else ""
        missing.append(f"the columns of {signal} are missing: give --{signal}{other}; the file holds {shown}")
        return None
    guess = ",".join(guess_columns(names, signal)) or None
    return ask(f"column(s) of {signal}, of {', '.join(names)}", guess)


def _ask_unit(signal: str, ask: Ask | None, missing: list[str]) -> dict[str, str]:
    """The unit by the signal; none where it is missing."""
    if ask is None:
        missing.append(str(_missing_unit(signal)))
        return {}
    quantity = SIGNAL_QUANTITIES[signal]
    return {signal: parse_unit(signal, ask(f"unit of {signal} ({', '.join(quantity.units)})", quantity.si[0]))}


def _expand_names(given: str, names: Sequence[str], signal: str, arm: Arm | None) -> tuple[str, ...]:
    """Names and patterns with commas between them as column names, in the order of the robot's joints.

    Raises InputError for a name that is no column, for more or fewer columns than the robot has joints, and for listed
    joints in another order than the robot's.
    """
    wanted: list[str] = []
    listed = True
    for part in (part.strip() for part in given.split(",")):
        pattern = part.replace("[", "[[]")
        found = [part] if part in names else [name for name in names if fnmatchcase(name, pattern)]
        if not found:
            raise InputError(f"no column '{part}' for {signal}: {suggest_name(part, names)}")
        listed = listed and part in names
        wanted += found
    chosen = tuple(wanted)
    if signal == "time" and len(chosen) > 1:
        raise InputError(f"--time {given} names {len(chosen)} columns: {', '.join(chosen)}; give one")
    if arm is None or signal in ("time", *SENSOR_SIGNALS):
        return chosen
    if len(chosen) != len(arm):
        flag = signal.replace("_", "-")
        shown = ", ".join(chosen)
        raise InputError(f"--{flag} {given} names {len(chosen)} columns ({shown}); the robot has {len(arm)} joints")
    if listed:
        check_joint_order(chosen, arm, signal)
        return chosen
    return order_by_joint(chosen, arm, signal)


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
