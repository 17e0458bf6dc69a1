"""The columns of each signal: as given, else as recognised, else a question."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.families import MEASURED_WORDS, Family, rival_torques
from armlab.recordings.imports.proposals import match_joints, propose_columns, propose_time
from armlab.recordings.imports.questions import NO_TORQUE, Options, Question
from armlab.recordings.imports.recognition import (
    JointNamesError,
    Known,
    check_joint_order,
    order_by_joint,
    recognise_signal,
    recognise_time,
)
from armlab.recordings.imports.sources import Source
from armlab.recordings.table import Table
from armlab.recordings.units import SENSOR_SIGNALS, SIGNAL_QUANTITIES
from problem.arm import Arm

ASKED_SIGNALS = ("time", "position", "torque")
SHOWN_COLUMNS = 20  # of a file, in a message


@dataclass(frozen=True, eq=False)
class Log:
    """The first file, the options and the robot. joints: names in the order of the columns; empty while unknown."""

    source: Source
    options: Options
    arm: Arm | None
    joints: tuple[str, ...]

    @property
    def sliding(self) -> bool:
        """Whether all joints of the robot are prismatic."""
        return self.arm is not None and all(joint.kind == "prismatic" for joint in self.arm.joints)


def choose_commands(log: Log) -> tuple[Log, dict[str, tuple[str, ...]], tuple[Question, ...]]:
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


def choose_columns(
    log: Log, commands: Mapping[str, tuple[str, ...]], unmatched: Sequence[Question]
) -> tuple[dict[str, Known], tuple[Question, ...]]:
    """Columns of each signal as given, else as recognised; a question for each that is missing.

    commands, unmatched: columns and questions of a log whose format tells its commands.
    """
    columns: dict[str, Known] = {}
    questions: list[Question] = []
    motion = bool(commands or unmatched or log.options.get("reference_position") is not None)
    settled = {question.option for question in unmatched if question.option not in commands}
    for signal in SIGNAL_QUANTITIES:
        given = log.options.get(signal)
        if given is None and signal in commands:
            columns[signal] = Known(commands[signal], "the format tells it, joints matched by name")
        elif given or (given is not None and signal != "reference_position"):
            try:
                expanded = _expand_names(given, log.source.table, signal, log.joints, motion)
                columns[signal] = Known(expanded, f"given with --{signal.replace('_', '-')}")
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
            rivals = rival_torques(log.source.table, found.value, log.joints) if found and signal == "torque" else ()
            if rivals:
                questions.append(_ask_torque(rivals, log.joints))
            elif found is not None:
                columns[signal] = found
            else:
                questions.append(_ask_columns(log, signal, columns, None))
    return columns, tuple(questions)


def _recognise(log: Log, signal: str) -> Known | None:
    names = log.source.table.filled
    return (
        recognise_time(names, tuple(log.source.stamps))
        if signal == "time"
        else recognise_signal(names, signal, log.joints)
    )


def _ask_columns(log: Log, signal: str, columns: Mapping[str, Known], reason: str | None) -> Question:
    table = log.source.table
    names = table.filled
    shown = ", ".join(names[:SHOWN_COLUMNS]) + (", ..." if len(names) > SHOWN_COLUMNS else "")
    other = ", or --reference-position of a position servo" if signal == "torque" else ""
    flag = signal.replace("_", "-")
    count = f" with {len(log.joints)} columns, one a joint of the robot" if log.joints and signal != "time" else ""
    chosen = {name: known.value for name, known in columns.items()}
    proposal = "" if signal == "time" else ",".join(propose_columns(names, signal, log.joints, chosen))
    perhaps = f" (perhaps {proposal})" if proposal else ""
    missing = reason or f"the columns of {signal} are missing: give --{flag}{count}{perhaps}{other}"
    holds = None if reason else f"the file holds {shown}"
    text = _column_text(signal, log.joints)
    if signal == "torque":
        text += f", or '{NO_TORQUE}' for a log of commands and positions"
    if signal == "time":
        proposal = propose_time(table.names, table.values) or ""
    return Question(signal, missing, text, proposal or None, context=holds)


def _ask_torque(rivals: Sequence[Family], joints: Sequence[str]) -> Question:
    """Which of several torques is to be compared with the model."""
    best = next((each for each in rivals if each.words & MEASURED_WORDS), rivals[0])
    missing = (
        f"the file holds {len(rivals)} torques of each joint ({'; '.join(each.text for each in rivals)}): give "
        "--torque with the one that a sensor or the motor current measures, which holds the friction; one that a model "
        "computed, or a controller wanted, holds none"
    )
    names = order_by_joint(best.names, joints, "torque")
    return Question("torque", missing, f"{_column_text('torque', joints)}, measured", ",".join(names))


def _expand_names(given: str, table: Table, signal: str, joints: Sequence[str], some_joints: bool) -> tuple[str, ...]:
    """Names and patterns with commas between them as column names, in the order of the robot's joints.

    A pattern names no column without numbers. some_joints: whether a log of this kind may have some of the robot's
    joints.
    Raises InputError for a name that is no column, for more or fewer columns than the robot has joints, and for listed
    joints in another order than the robot's.
    """
    wanted, empty = list[str](), list[str]()
    listed = True
    for part in (part.strip() for part in given.split(",")):
        pattern = part.replace("[", "[[]")
        found = [part] if part in table.names else [name for name in table.filled if fnmatchcase(name, pattern)]
        numberless = [] if part in table.names else [name for name in table.empty if fnmatchcase(name, pattern)]
        empty += numberless
        if not found and not numberless:
            raise InputError(f"no column '{part}' for {signal}: {suggest_name(part, table.filled)}")
        listed = listed and part in table.names
        wanted += found
    chosen = tuple(wanted)
    twice = [name for name in chosen if chosen.count(name) > 1]
    if twice:
        raise InputError(f"--{signal.replace('_', '-')} {given} names column {twice[0]} twice")
    if signal == "time" and len(chosen) > 2:
        raise InputError(
            f"--time {given} names {len(chosen)} columns: {', '.join(chosen)}; give one, or two: of seconds and their "
            "fraction, of date and time"
        )
    if not joints or signal in ("time", *SENSOR_SIGNALS):
        return chosen
    if len(chosen) != len(joints):
        flag = signal.replace("_", "-")
        shown = ", ".join(chosen) or "none"
        hollow = f"; no number is in {', '.join(empty)}" if empty else ""
        other = ": name those that were recorded with --joints" if len(chosen) < len(joints) and some_joints else ""
        raise InputError(
            f"--{flag} {given} names {len(chosen)} columns ({shown}{hollow}); the robot has {len(joints)} joints{other}"
        )
    if listed:
        check_joint_order(chosen, joints, signal)
        return chosen
    return order_by_joint(chosen, joints, signal)
