"""ROS bags with the joint states of a small recording."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

ORDER = [2, 0, 1]  # a driver lists the joints as it likes
START = 1_700_000_000 * 10**9  # ns
TYPE = "sensor_msgs/msg/JointState"


def write_bag(path: Path, storage: str, table: pd.DataFrame) -> Path:
    """A ROS 2 bag (sqlite3, mcap) in a new folder; returns the file that holds the messages."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        link = writer.add_connection("/joint_states", TYPE, typestore=store)
        for row in table.to_numpy():
            message = _message(row, store)
            writer.write(link, _nanoseconds(row), store.serialize_cdr(message, link.msgtype))
    return next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))


def write_ros1_bag(path: Path, table: pd.DataFrame) -> Path:
    """A ROS 1 bag; returns its path."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        link = writer.add_connection("/joint_states", TYPE, typestore=store)
        for row in table.to_numpy():
            message = _message(row, store, 0)
            writer.write(link, _nanoseconds(row), store.serialize_ros1(message, link.msgtype))
    return path


def _nanoseconds(row: np.ndarray) -> int:
    return START + round(row[0] * 1e9)


def _message(row: np.ndarray, store: Any, *sequence: int) -> Any:
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(_nanoseconds(row), 10**9))
    header = types["std_msgs/msg/Header"](*sequence, stamp, "")
    names = [f"j{n + 1}" for n in ORDER]
    return types[TYPE](header, names, row[1:4][ORDER], np.array([]), row[4:7][ORDER])
