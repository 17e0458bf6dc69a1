"""ROS 1 and ROS 2 bags and MCAP files: columns of joint states, of controller states, and of the commands beside them.

The states set the times. Commands of another topic are held from one to the next, as a servo holds them, and put on
the times of the states; joints that have a topic each are put on the times of the first by linear interpolation.
"""

import struct
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError, UndecidedError, in_one_line
from armlab.common.packages import MissingPackageError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.ros_messages import (
    COMMAND_TYPES,
    DEFINITIONS,
    SINGLE_STATE,
    STATE_TYPES,
    Parser,
    parse_command,
    parse_state,
    stamp_of,
)
from armlab.recordings.recording import Finding
from armlab.recordings.table import Table
from armlab.recordings.text_rows import Progress, silent

PROGRESS_MESSAGES = 50_000  # from one line of progress to the next
BAG_READ_ERRORS = (
    ValueError,
    TypeError,
    LookupError,
    OSError,
    AssertionError,
    AttributeError,  # a joint state without positions, by the definition that the file brings
    SyntaxError,  # a message type whose name is none: rosbags makes classes of the file's definitions
    NameError,
    struct.error,
    OverflowError,
    MemoryError,
)


@dataclass(frozen=True, eq=False)
class Series:
    """The messages of one topic as they were recorded.

    times: (messages,), ns; rows: (messages, 1 + names), stamps in s from the first one, and values, NaN where a message
    leaves one out. delay: how much later than stamped the messages were recorded, the median, ns; None without stamps.
    foreign: messages without a joint of the robot, which are left out.
    """

    names: tuple[str, ...]
    times: NDArray[np.int64]
    rows: Array
    delay: int | None
    foreign: int = 0

    @property
    def values(self) -> Array:
        """(messages, names)."""
        return self.rows[:, 1:]


def read_bag(
    path: Path,
    topic: str | None = None,
    commands: str | None = None,
    joints: Sequence[str] = (),
    progress: Progress = silent,
) -> Table:
    """Columns `t` (s, from the first state) and `position_`, `velocity_`, `effort_`, `command_` plus the joint's name.

    path: a .db3, .mcap or .bag file, or the folder of a ROS 2 bag. topic: of the states, needed if several topics carry
    some. commands: topic of the commands, where the states hold none. joints: of the robot, for messages that name no
    joints. The stamps are those of the headers, or the times of recording where the headers have none. Values that a
    message leaves out are NaN. Raises InputError for a file that is not a bag, and for topics that it does not have.
    """
    states, command = _read_series(path, topic, commands, joints, progress)
    if not all(len(series.times) for series in states):
        raise InputError(f"{path} holds no joint states")
    if command is not None and not len(command.times):
        raise InputError(f"{path} holds no message on {commands}")
    first, findings = states[0], list[Finding]()
    for series in states:
        if series.foreign:
            text = f"{series.foreign} messages hold no joint of the robot, such as a gripper's, and are left out"
            findings.append(Finding("foreign_messages", "note", text))
    names, columns, known = list(first.names), [first.rows], np.ones(len(first.times), dtype=bool)
    for other in states[1:]:
        columns.append(_on_times(other, first.times))
        names += other.names
        known &= np.isfinite(columns[-1]).all(axis=1)
    if command is not None:
        held, text = _commands_at(command, first)
        columns.append(held)
        names += command.names
        known &= np.isfinite(held).all(axis=1)
        findings.append(Finding("held_commands", "note", text))
    if not known.all():
        text = (
            f"{int((~known).sum())} of {len(known)} states are left out: not all joints and commands had come by then"
        )
        findings.append(Finding("incomplete_states", "note", text))
    table = first.rows if len(columns) == 1 else np.column_stack(columns)
    table = table if known.all() else table[known]
    return Table(path.name, ("t", *names), table, 1 + np.flatnonzero(known), tuple(findings))


def _read_series(
    path: Path, topic: str | None, commands: str | None, joints: Sequence[str], progress: Progress
) -> tuple[list[Series], Series | None]:
    """The states, one series a topic, and the commands."""
    try:
        from apsw import Error as SqliteError  # what rosbags reads .db3 files with
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag1 import ReaderError as Ros1Error
        from rosbags.rosbag2 import ReaderError as Ros2Error
        from rosbags.serde import SerdeError
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise MissingPackageError("rosbags", f"{path}: a bag") from None
    store = get_typestore(Stores.ROS2_HUMBLE)
    for kind, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, kind))
    if path.is_dir() and not (path / "metadata.yaml").is_file():
        bags = sorted(each.name for each in path.iterdir() if each.suffix.lower() in (".db3", ".mcap", ".bag"))
        if len(bags) == 1:
            path = path / bags[0]
        else:
            held = f"name one of its files: {', '.join(bags)}" if bags else "nor has it a .db3, .mcap or .bag file"
            raise InputError(f"{path} has no metadata.yaml, so it is no ROS 2 bag as a folder; {held}")
    try:
        with AnyReader([path], default_typestore=store) as reader:
            if commands is not None:
                _check_topic(reader, commands, COMMAND_TYPES, "commands", path)
            topics = _state_topics(reader, topic, commands, path)
            states = [_read_topic(reader, each, parse_state, joints, progress) for each in topics]
            if commands is None:
                return states, None
            if any(name.startswith("command_") for series in states for name in series.names):
                raise InputError(f"the states on {topics[0]} hold the commands: leave out --command-topic")
            return states, _read_topic(reader, commands, parse_command, joints, progress)
    except (AnyReaderError, Ros1Error, Ros2Error, SerdeError, SqliteError, *BAG_READ_ERRORS) as error:
        reason = in_one_line(error) or type(error).__name__
        raise InputError(f"cannot read {path} as a bag of joint states: {reason[:200]}") from None


def _state_topics(reader: Any, wanted: str | None, commands: str | None, path: Path) -> list[str]:
    """The topic of the states; several where each joint has a controller state of its own. commands: another topic."""
    if wanted is not None:
        _check_topic(reader, wanted, STATE_TYPES, "joint states", path)
        return [wanted]
    links = [link for link in reader.connections if link.msgtype in STATE_TYPES and link.topic != commands]
    kinds = {str(link.topic): link.msgtype for link in links}
    if not kinds:
        carried = sorted({link.msgtype for link in reader.connections})
        types = ", ".join(STATE_TYPES)
        raise InputError(f"{path} holds none of {types}, only {', '.join(carried) or 'nothing'}")
    if len(kinds) > 1 and set(kinds.values()) != {SINGLE_STATE}:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(kinds.items()))
        raise UndecidedError(
            f"{path} holds joint states on {listed}: choose one with --topic", "topic", tuple(sorted(kinds))
        )
    return sorted(kinds)


def _check_topic(reader: Any, wanted: str, types: Sequence[str], what: str, path: Path) -> None:
    topics = sorted({link.topic for link in reader.connections if link.msgtype in types})
    if wanted not in topics:
        raise InputError(f"no {what} on topic '{wanted}' in {path}: {suggest_name(wanted, topics)}")


@dataclass(frozen=True, eq=False)
class _Kind:
    """Messages of one topic that hold the same names. places: of the messages.

    values: one after the other, each with a place for its stamp: of a large bag, no second table is made.
    """

    of_robot: bool
    values: "array[float]" = field(default_factory=lambda: array("d"))
    places: "array[int]" = field(default_factory=lambda: array("q"))


def _read_topic(reader: Any, topic: str, parse: Parser, joints: Sequence[str], progress: Progress) -> Series:
    """The messages of a topic; those without a joint of the robot are left out where others have one."""
    links = [link for link in reader.connections if link.topic == topic]
    kinds, recorded, stamps = dict[tuple[str, ...], _Kind](), array("q"), array("q")
    for place, (link, time, raw) in enumerate(reader.messages(connections=links)):
        message = reader.deserialize(raw, link.msgtype)
        numbers = parse(message, link.msgtype, topic, joints)
        if place % PROGRESS_MESSAGES == PROGRESS_MESSAGES - 1:
            progress(f"{topic}: {place + 1:,} messages read")
        names = tuple(numbers)
        if names not in kinds:
            kinds[names] = _Kind(any(name.endswith(f"_{joint}") for name in names for joint in joints))
        kinds[names].values.append(0.0)
        kinds[names].values.extend(numbers.values())
        kinds[names].places.append(place)
        recorded.append(time)
        stamps.append(stamp_of(message))
    own = {names: kind for names, kind in kinds.items() if kind.of_robot} or kinds  # else listed by hand
    names = tuple(dict.fromkeys(name for held in own for name in held))
    written, headers = np.frombuffer(recorded, dtype=np.int64), np.frombuffer(stamps, dtype=np.int64)
    foreign = len(recorded) - sum(len(kind.places) for kind in own.values())
    if len(own) == 1 and not foreign:
        rows = np.frombuffer(own[names].values).reshape(len(recorded), 1 + len(names))
    else:
        rows, of_robot = np.full((len(recorded), 1 + len(names)), np.nan), np.zeros(len(recorded), dtype=bool)
        for held, kind in own.items():
            places = np.frombuffer(kind.places, dtype=np.int64)
            columns = [0, *(1 + names.index(name) for name in held)]
            rows[places[:, None], columns] = np.frombuffer(kind.values).reshape(len(places), 1 + len(held))
            of_robot[places] = True
        written, headers, rows = written[of_robot], headers[of_robot], rows[of_robot]
    stamped = bool(len(headers)) and bool(np.any(headers != headers[0]))
    delay = int(np.median(written - headers)) if stamped else None
    times, rows = _join_messages(headers if stamped else written, rows)
    if len(times):
        rows[:, 0] = (times - times[0]) / 1e9
    return Series(names, times, rows, delay, foreign)


def _join_messages(times: NDArray[np.int64], rows: Array) -> tuple[NDArray[np.int64], Array]:
    """One row for messages in a row with one stamp that hold different joints; rows: as of `Series`."""
    if not np.isnan(rows).any():
        return times, rows
    joined = rows.copy()
    first = np.ones(len(times), dtype=bool)
    for row in np.flatnonzero(np.diff(times) == 0) + 1:
        if np.all(np.isnan(joined[row - 1, 1:]) | np.isnan(joined[row, 1:])):
            joined[row] = np.where(np.isnan(joined[row]), joined[row - 1], joined[row])
            first[row - 1] = False
    return times[first], joined[first]


def _on_times(series: Series, times: NDArray[np.int64]) -> Array:
    """Values (times, names): commands held, all else by linear interpolation; NaN outside of the series."""
    order = np.argsort(series.times, kind="stable")
    own, wanted = (series.times[order] - times[0]) / 1e9, (times - times[0]) / 1e9
    interpolated = [np.interp(wanted, own, column[order], left=np.nan, right=np.nan) for column in series.values.T]
    commands = [name.startswith("command_") for name in series.names]
    return np.where(commands, _held(series.values, series.times, times), np.stack(interpolated, axis=1))


def _held(values: Array, times: NDArray[np.int64], wanted: NDArray[np.int64]) -> Array:
    """The last value of each column at or before the wanted times, (wanted, columns); NaN before the first."""
    order = np.argsort(times, kind="stable")
    held = np.full((len(wanted), values.shape[1]), np.nan)
    for place, column in enumerate(values[order].T):
        known = np.isfinite(column)
        rows = np.searchsorted(times[order][known], wanted, side="right") - 1
        held[rows >= 0, place] = column[known][rows[rows >= 0]]
    return held


def _commands_at(commands: Series, states: Series) -> tuple[Array, str]:
    """The commands that held at the times of the states, (times, names), and a line on how they were put there.

    Commands without stamps come by the clock of the recording: they are moved by the delay of the states' messages.
    """
    times, text = commands.times, "commands are held from one to the next, at the times of the states"
    if commands.delay is None and states.delay is not None:
        times = times - states.delay
        text += f"; they have no stamps: times of recording, less {states.delay / 1e6:.3g} ms that states take"
    return _held(commands.values, times, states.times), text
