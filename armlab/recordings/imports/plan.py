"""What an import knows and what it has to ask: files, options and robot together, before anything is written.

A plan is made anew with each answer: an answer is an option, as if it had been given with the command.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError, UndecidedError
from armlab.common.settings import suggest_name
from armlab.recordings.channels import MAX_GAIN
from armlab.recordings.imports.proposals import match_joints, propose_columns, propose_robot, propose_time, propose_unit
from armlab.recordings.imports.recognition import (
    JointNamesError,
    check_joint_order,
    order_by_joint,
    recognise_signal,
    recognise_time,
    time_unit,
    unit_by_name,
)
from armlab.recordings.imports.sources import ReadOptions, Source, read_sources
from armlab.recordings.recording_file import check_new_folder
from armlab.recordings.units import DRIVE_UNITS, SENSOR_SIGNALS, SIGNAL_QUANTITIES
from problem.arm import Arm
from problem.robot_file import built_in_arms, load_arm

ASKED_SIGNALS = ("time", "position", "torque")
SHOWN_COLUMNS = 20  # of a file, in a message
NO_TORQUE = "none"  # the answer to a question for torque in a log of commands and positions
SEPARATOR_WORDS = {"tab": "\t", "blank": " ", "space": " ", "comma": ",", "semicolon": ";"}
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
Options = Mapping[str, Any]  # of the command, by name; None or an empty tuple where one is not given
ReadSources = Callable[[Path, ReadOptions], Mapping[str, Source]]


@dataclass(frozen=True)
class Question:
    """What neither the files nor the options tell.

    option: of the command, by name. missing: the sentence of a message, with the flag. text: what a form asks.
    proposal: the answer to offer, or None. signal: whose unit is asked for, where the option is `units`.
    """

    option: str
    missing: str
    text: str
    proposal: str | None = None
    signal: str | None = None

    def with_answer(self, options: Options, answer: str) -> dict[str, Any]:
        """The options with an answer in its place."""
        given = answer.strip()
        if self.option == "units":
            return {**options, "units": (*options["units"], f"{self.signal}={given}")}
        if self.option == "torque" and given.lower() == NO_TORQUE:
            return {**options, "reference_position": ""}
        return {**options, self.option: given}


@dataclass(frozen=True, eq=False)
class ImportPlan:
    """A recording to be written once no question is open.

    options: as they were given. robot: as the recording names it. sources: by the path of the run. columns: names by
    the signal. units: of each signal, one for all its columns or one a column. gains: of the torque, where it is in A
    or V. joints: of the robot, in the order of the columns, where the recording has only some of them.
    """

    options: Options
    robot: str | None
    sources: Mapping[str, Source] = field(default_factory=dict)
    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    units: Mapping[str, str | tuple[str, ...]] = field(default_factory=dict)
    gains: tuple[float, ...] | None = None
    joints: tuple[str, ...] = ()
    questions: tuple[Question, ...] = ()


def plan_import(files: Sequence[Path], options: Options, read: ReadSources = read_sources) -> ImportPlan:
    """What is known of an import, and the questions that are open.

    options: out, robot, the columns of each signal, units, gains, joints, validate, separator, decimal, topic,
    command_topic. read: reads a file; a form that plans after each answer gives one that keeps what it read.
    Raises InputError for an option that cannot be right, whatever the answers to the questions are.
    """
    robot = options.get("robot")
    arm = None if robot is None else load_arm(robot)
    whole = tuple(joint.name for joint in arm.joints) if arm else ()
    chosen = _choose_joints(options.get("joints"), whole)
    if options.get("out") is not None:
        check_new_folder(Path(options["out"]))
    place = robot if robot is None or robot in built_in_arms() else str(Path(robot).resolve())
    try:
        sources = _read_files(files, options, chosen or whole, read)
    except UndecidedError as error:
        robots = () if robot else (_ask_robot(files[0], None, ()),)
        return ImportPlan(options, place, questions=(*robots, _ask_choice(error), *_ask_out(files, options)))
    _check_validate(options["validate"], sources)
    log = _Log(next(iter(sources.values())), options, arm, chosen or whole)
    log, commands, unmatched = _choose_commands(log)
    columns, unnamed = _choose_columns(log, commands, unmatched)
    _check_sources(sources, columns)
    units, unmeasured = _choose_units(log, columns)
    gains, unscaled = _choose_gains(options.get("gains"), columns, units)
    count = len(columns["position"]) if "position" in columns else None
    robots = () if robot else (_ask_robot(files[0], count, log.joints),)
    return ImportPlan(
        options=options,
        robot=place,
        sources=sources,
        columns=columns,
        units=units,
        gains=gains,
        joints=log.joints if arm and (log.joints != whole or chosen) else (),
        questions=(*robots, *unmatched, *unnamed, *unmeasured, *unscaled, *_ask_out(files, options)),
    )


@dataclass(frozen=True, eq=False)
class _Log:
    """The first file, the options and the robot. joints: names in the order of the columns; empty while unknown."""

    source: Source
    options: Options
    arm: Arm | None
    joints: tuple[str, ...]

    @property
    def sliding(self) -> bool:
        """Whether all joints of the robot are prismatic."""
        return self.arm is not None and all(joint.kind == "prismatic" for joint in self.arm.joints)


def _choose_joints(given: str | None, whole: tuple[str, ...]) -> tuple[str, ...]:
    chosen = tuple(part.strip() for part in given.split(",")) if given else ()
    for name in chosen:
        if whole and name not in whole:
            raise InputError(f"--joints names '{name}', which the robot does not have: {suggest_name(name, whole)}")
    return chosen


def _read_files(
    files: Sequence[Path], options: Options, joints: tuple[str, ...], read: ReadSources
) -> dict[str, Source]:
    separator = options["separator"]
    reading = ReadOptions(
        separator=SEPARATOR_WORDS.get(separator, separator),
        decimal=options["decimal"],
        topic=options["topic"],
        commands=options.get("command_topic"),
        joints=joints,
    )
    sources: dict[str, Source] = {}
    for path in files:
        for name, source in read(path, reading).items():
            if name in sources:
                raise InputError(f"{name} is given twice: a run cannot both identify and validate")
            sources[name] = source
    return sources


def _check_validate(validate: Sequence[Path], sources: Mapping[str, Source]) -> None:
    unknown = sorted({str(path) for path in validate} - set(sources))
    if unknown:
        raise InputError(f"--validate {unknown[0]} should be one of the imported files")


def _check_sources(sources: Mapping[str, Source], columns: Mapping[str, tuple[str, ...]]) -> None:
    """Raises InputError for a file that lacks a column, or that names another unit than the first file."""
    first_path, first = next(iter(sources.items()))
    for path, source in sources.items():
        for signal, names in columns.items():
            source.table.columns(names, signal)
            for name in names:
                unit, other = first.units.get(name), source.units.get(name)
                if unit != other:
                    raise InputError(
                        f"{name} is in {other or 'no unit'} in {path}, in {unit or 'no unit'} in {first_path}: "
                        "import files of one kind together"
                    )


def _ask_robot(log: Path, count: int | None, joints: tuple[str, ...]) -> Question:
    known = ", ".join(built_in_arms())
    missing = f"the robot is missing: give --robot with one of {known}, or with the path of a robot file"
    return Question("robot", missing, f"robot: a file, or one of {known}", propose_robot(log, count, joints))


def _ask_choice(error: UndecidedError) -> Question:
    return Question(error.option, str(error), f"{error.option}: one of {', '.join(error.choices)}", error.choices[0])


def _ask_out(files: Sequence[Path], options: Options) -> tuple[Question, ...]:
    if options.get("out") is not None:
        return ()
    name = f"{files[0].resolve().stem}-recording"
    return (Question("out", "the folder to write is missing: give --out FOLDER", "new folder for the recording", name),)


def _choose_commands(log: _Log) -> tuple[_Log, dict[str, tuple[str, ...]], tuple[Question, ...]]:
    """Columns of positions and commands where the format tells them, by the names of the joints.

    The log that is returned has the joints that the columns belong to. A joint that was not recorded is a question;
    one whose numbers are no angles is left out, unless joints or columns are listed.
    """
    source, options = log.source, log.options
    open_signals = [signal for signal in source.prefixes if options.get(signal) is None]
    if options.get("torque") is not None or not source.has_commands or not open_signals:
        return log, {}, ()
    listed = options.get("joints") is not None or len(open_signals) < len(source.prefixes)
    recorded = {signal: source.joints_of(signal) for signal in source.prefixes}
    both = [joint for joint in recorded["position"] if joint in recorded["reference_position"]]
    angles = [joint for joint in log.joints or both if listed or joint not in source.not_angles]
    own = tuple(joint for joint in angles if joint in both)
    wanted = angles if own else list(log.joints)
    columns, questions = {}, list[Question]()
    for signal in open_signals:
        prefix = source.prefixes[signal]
        lacking = [joint for joint in wanted if joint not in recorded[signal]]
        missing = (
            f"{source.table.file} has no {prefix.strip('._')} of joint {', '.join(lacking)}, only of "
            f"{', '.join(recorded[signal])}: give --joints with those that were recorded, or "
            f"--{signal.replace('_', '-')} NAME,... in their order"
        )
        if lacking and own and not listed:
            text = "joints of the robot that were recorded"
            questions = questions or [Question("joints", missing, text, ",".join(own))]
        elif lacking:
            names = [f"{prefix}{joint}" for joint in recorded[signal]]
            matched = ",".join(match_joints(names, wanted))
            questions.append(Question(signal, missing, _column_text(signal, wanted), matched or None))
            continue
        columns[signal] = tuple(f"{prefix}{joint}" for joint in (own if not listed else wanted))
    return replace(log, joints=tuple(wanted) if listed or not own else own), columns, tuple(questions)


def _column_text(signal: str, joints: Sequence[str]) -> str:
    words = signal.replace("_", " ")
    if signal == "time":
        return "column of time"
    return f"columns of {words}, joint by joint ({', '.join(joints)})" if joints else f"columns of {words}"


def _choose_columns(
    log: _Log, commands: Mapping[str, tuple[str, ...]], unmatched: Sequence[Question]
) -> tuple[dict[str, tuple[str, ...]], tuple[Question, ...]]:
    """Columns of each signal as given, else as recognised; a question for each that is missing.

    commands, unmatched: columns and questions of a log whose format tells its commands.
    """
    columns: dict[str, tuple[str, ...]] = {}
    questions: list[Question] = []
    motion = bool(commands or unmatched or log.options.get("reference_position") is not None)
    settled = {question.option for question in unmatched if question.option not in commands}
    names = log.source.table.names
    for signal in SIGNAL_QUANTITIES:
        given = log.options.get(signal)
        if given is None and signal in commands:
            columns[signal] = commands[signal]
        elif given or (given is not None and signal != "reference_position"):
            try:
                columns[signal] = _expand_names(given, names, signal, log.joints, motion)
            except JointNamesError as error:
                questions.append(_ask_columns(log, signal, columns, str(error)))
        elif given is not None or (signal in ASKED_SIGNALS and not (signal == "torque" and motion)):
            if signal in settled:
                continue
            try:
                found = _recognise(log, signal)
            except JointNamesError as error:
                questions.append(_ask_columns(log, signal, columns, str(error)))
                continue
            if found is not None:
                columns[signal] = found
            else:
                questions.append(_ask_columns(log, signal, columns, None))
    return columns, tuple(questions)


def _recognise(log: _Log, signal: str) -> tuple[str, ...] | None:
    table = log.source.table
    if signal == "time":
        found = recognise_time(table.names, table.values)
    else:
        found = recognise_signal(table.names, signal, log.joints)
    return found.names if found else None


def _ask_columns(log: _Log, signal: str, columns: Mapping[str, Sequence[str]], reason: str | None) -> Question:
    names, values = log.source.table.names, log.source.table.values
    shown = ", ".join(names[:SHOWN_COLUMNS]) + (", ..." if len(names) > SHOWN_COLUMNS else "")
    other = ", or --reference-position of a position servo" if signal == "torque" else ""
    flag = signal.replace("_", "-")
    missing = reason or f"the columns of {signal} are missing: give --{flag}{other}; the file holds {shown}"
    text = _column_text(signal, log.joints)
    if signal == "torque":
        text += f", or '{NO_TORQUE}' for a log of commands and positions"
    if signal == "time":
        return Question(signal, missing, text, propose_time(names, values))
    proposal = ",".join(propose_columns(names, signal, log.joints, columns))
    return Question(signal, missing, text, proposal or None)


def _choose_units(
    log: _Log, columns: Mapping[str, tuple[str, ...]]
) -> tuple[dict[str, str | tuple[str, ...]], tuple[Question, ...]]:
    """Units of each signal as given, else as the file or the names tell; a question for each that is missing."""
    given = dict(_parse_unit_option(text) for text in log.options["units"])
    source = log.source
    units: dict[str, str | tuple[str, ...]] = {}
    questions: list[Question] = []
    for signal, names in columns.items():
        known = [parsed_unit(signal, source.units[name]) if name in source.units else None for name in names]
        one = given.get(signal) or (None if all(known) else _unit_by_name(source, signal, names))
        if one is None and source.same_units.get(signal) in columns and not any(known):
            same = source.same_units[signal]
            if same in units:
                units[signal] = units[same]
            continue
        if one is not None:
            _check_unit(signal, one, log)
            units[signal] = one
        elif all(known):
            listed = tuple(unit for unit in known if unit)
            units[signal] = listed[0] if len(set(listed)) == 1 else listed
        else:
            values = source.table.columns(names, signal)
            proposal = propose_unit(signal, names, values, log.sliding)
            text = f"unit of {signal.replace('_', ' ')}: one of {', '.join(SIGNAL_QUANTITIES[signal].units)}"
            questions.append(Question("units", _missing_unit(signal, proposal), text, proposal, signal))
    return units, tuple(questions)


def _check_unit(signal: str, unit: str, log: _Log) -> None:
    """Raises InputError for a length where all joints turn, and for an angle where all slide."""
    kinds = {joint.kind for joint in log.arm.joints if joint.name in log.joints} if log.arm else set()
    if signal in ("time", *SENSOR_SIGNALS) or unit in DRIVE_UNITS or len(kinds) != 1:
        return
    quantity = SIGNAL_QUANTITIES[signal]
    right = quantity.si[1 if kinds == {"prismatic"} else 0]
    if quantity.units[unit].quantity != right:
        known = ", ".join(name for name, each in quantity.units.items() if each.quantity == right)
        raise InputError(f"--unit {signal}={unit} does not fit joints that are {kinds.pop()}: give one of {known}")


def _unit_by_name(source: Source, signal: str, names: tuple[str, ...]) -> str | None:
    if signal == "time":
        return time_unit(names[0], source.table.columns(names, signal)[:, 0])
    unit = unit_by_name(names, source.table.names)
    return unit if unit in SIGNAL_QUANTITIES[signal].units else None


def _missing_unit(signal: str, proposal: str) -> str:
    known = ", ".join(SIGNAL_QUANTITIES[signal].units)
    other = "; a torque in A or V needs --gains, too" if signal == "torque" else ""
    return f"no unit is known for {signal}: give --unit {signal}=UNIT ({known}), perhaps {proposal}{other}"


def _parse_unit_option(text: str) -> tuple[str, str]:
    signal, sign, name = text.partition("=")
    if not sign or signal not in SIGNAL_QUANTITIES:
        raise InputError(f"--unit {text} should be SIGNAL=UNIT: {suggest_name(signal, list(SIGNAL_QUANTITIES))}")
    unit = parsed_unit(signal, name)
    if unit is None:
        raise InputError(
            f"unknown unit '{name}' of {signal}: {suggest_name(name, list(SIGNAL_QUANTITIES[signal].units))}"
        )
    return signal, unit


def parsed_unit(signal: str, name: str) -> str | None:
    """The unit as `recording.yaml` writes it; None for one that a signal does not have."""
    unit = UNIT_ALIASES.get(name.strip(), name.strip())
    return unit if unit in SIGNAL_QUANTITIES[signal].units else None


def _choose_gains(
    given: str | None, columns: Mapping[str, tuple[str, ...]], units: Mapping[str, str | tuple[str, ...]]
) -> tuple[tuple[float, ...] | None, tuple[Question, ...]]:
    """The gains of the torque as given; a question where it is in A or V and they are missing."""
    gains = _parse_gains(given)
    names, unit = columns.get("torque", ()), units.get("torque", ())
    if gains is not None and names and len(gains) != len(names):
        raise InputError(f"--gains holds {len(gains)} numbers for {len(names)} columns of torque")
    listed = (unit,) if isinstance(unit, str) else unit
    if gains is not None or not any(each in DRIVE_UNITS for each in listed):
        return gains, ()
    missing = f"give --gains, gains of {', '.join(names)}, N.m per A or V, with commas between them"
    text = f"gains of the joints, N.m per A or V: {len(names)} numbers with commas between them"
    return None, (Question("gains", f"the torque is measured in A or V: {missing}", text),)


def _parse_gains(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        gains = tuple(float(part) for part in text.split(","))
    except ValueError:
        gains = ()
    if not gains or not all(0 < abs(gain) <= MAX_GAIN for gain in gains):
        raise InputError(
            f"--gains {text} should be numbers from -{MAX_GAIN:g} to {MAX_GAIN:g} with commas between them, not zero"
        )
    return gains


def _expand_names(
    given: str, names: Sequence[str], signal: str, joints: Sequence[str], some_joints: bool
) -> tuple[str, ...]:
    """Names and patterns with commas between them as column names, in the order of the robot's joints.

    some_joints: whether a log of this kind may have some of the robot's joints.
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
    twice = [name for name in chosen if chosen.count(name) > 1]
    if twice:
        raise InputError(f"--{signal.replace('_', '-')} {given} names column {twice[0]} twice")
    if signal == "time" and len(chosen) > 1:
        raise InputError(f"--time {given} names {len(chosen)} columns: {', '.join(chosen)}; give one")
    if not joints or signal in ("time", *SENSOR_SIGNALS):
        return chosen
    if len(chosen) != len(joints):
        flag = signal.replace("_", "-")
        shown = ", ".join(chosen)
        other = ": name those that were recorded with --joints" if len(chosen) < len(joints) and some_joints else ""
        raise InputError(
            f"--{flag} {given} names {len(chosen)} columns ({shown}); the robot has {len(joints)} joints{other}"
        )
    if listed:
        check_joint_order(chosen, joints, signal)
        return chosen
    return order_by_joint(chosen, joints, signal)
