"""ROS 1 and ROS 2 bags and MCAP files: the columns of a topic of sensor_msgs/JointState messages."""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.table import Table

JOINT_STATE = "sensor_msgs/msg/JointState"
JOINT_STATE_FIELDS = ("position", "velocity", "effort")
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
class JointState:
    """One joint state: times in ns, and the values of each field by the joint's name."""

    recorded: int
    stamp: int
    values: dict[str, float]


def read_bag(path: Path, topic: str | None = None) -> Table:
    """Columns `t` (s, from the first message) and `position_`, `velocity_`, `effort_` plus the joint's name.

    path: a .db3, .mcap or .bag file, or the folder of a ROS 2 bag. topic: needed if several topics carry
    joint states. The stamps are those of the headers, or the times of recording where the headers have none.
    Values that a message leaves out are NaN. Raises InputError for a file that is not a bag or has no joint states.
    """
    messages = _read_messages(path, topic)
    if not messages:
        raise InputError(f"{path} holds no joint states")
    names = list(dict.fromkeys(name for message in messages for name in message.values))
    values = [[message.values.get(name, np.nan) for name in names] for message in messages]
    table = np.column_stack([_message_times(messages), np.array(values).reshape(len(messages), len(names))])
    return Table(path.name, ("t", *names), table, 1 + np.arange(len(messages)))


def _read_messages(path: Path, topic: str | None) -> list[JointState]:
    try:
        from apsw import Error as SqliteError  # what rosbags reads .db3 files with
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag1 import ReaderError as Ros1Error
        from rosbags.rosbag2 import ReaderError as Ros2Error
        from rosbags.serde import SerdeError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f"{path}: to read bags install rosbags: pip install 'armlab[recordings]'") from None
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            chosen = _choose_topic(reader, topic, path)
            connections = [link for link in reader.connections if link.topic == chosen]
            read = reader.messages(connections=connections)
            return [_parse_message(time, reader.deserialize(raw, link.msgtype)) for link, time, raw in read]
    except (AnyReaderError, Ros1Error, Ros2Error, SerdeError, SqliteError, *BAG_READ_ERRORS) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"cannot read {path} as a bag of joint states: {reason[:200]}") from None


def _choose_topic(reader: Any, wanted: str | None, path: Path) -> str:
    topics = sorted({link.topic for link in reader.connections if link.msgtype == JOINT_STATE})
    if wanted is None and len(topics) == 1:
        return str(topics[0])
    if not topics:
        carried = sorted({link.msgtype for link in reader.connections})
        raise InputError(f"{path} holds no {JOINT_STATE}, only {', '.join(carried) or 'nothing'}")
    if wanted is None:
        raise InputError(f"{path} holds joint states on {', '.join(topics)}: choose one with --topic")
    if wanted not in topics:
        raise InputError(f"no joint states on topic '{wanted}' in {path}: {suggest_name(wanted, topics)}")
    return wanted


def _parse_message(recorded: int, message: Any) -> JointState:
    stamp = int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)
    values = {}
    for field in JOINT_STATE_FIELDS:
        numbers = getattr(message, field)
        if len(numbers) not in (0, len(message.name)):
            raise InputError(f"a joint state names {len(message.name)} joints but holds {len(numbers)} of {field}")
        values.update({f"{field}_{name}": float(value) for name, value in zip(message.name, numbers, strict=False)})
    return JointState(recorded, stamp, values)


def _message_times(messages: list[JointState]) -> Array:
    """Stamps from the first one, s; exact in the nanoseconds, which absolute times in floats are not."""
    stamped = any(message.stamp != messages[0].stamp for message in messages)
    times = [message.stamp if stamped else message.recorded for message in messages]
    return np.array([(time - times[0]) / 1e9 for time in times])
