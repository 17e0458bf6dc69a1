"""What the columns of a log are, from the names that robot drivers give them: signal, joint, unit.

A column's name is a stem that tells the signal, a key that tells the joint (a number or a joint's name), and perhaps a
unit: `actual_q_0`, `tau_J[3]`, `position_elbow_joint`, `/joint_states/elbow_joint/position`, `timestamp_ns`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.imports.time_columns import find_two_columns
from armlab.recordings.units import TIME_UNITS

TIME_NAMES = ("__time", "time", "timestamp", "timestamps", "stamp", "t", "robot_time", "header_stamp")


@dataclass(frozen=True)
class Stem:
    """What the columns with a stem hold; unit: None where the stem does not tell it. writer: whose logs have it."""

    signal: str
    unit: str | None = None
    writer: str | None = None


UR, FRANKA, ROS = "UR's RTDE", "Franka's library", "ROS joint states"
STEMS: Mapping[str, Stem] = {
    "tau_j": Stem("torque", "N.m", FRANKA),
    "effort": Stem("torque", "N.m", ROS),
    "measured_torque": Stem("torque", "N.m", "KUKA's FRI"),
    "geartorque.a": Stem("torque", "N.m", "KUKA's RSI"),  # on the side of the gear's output
    "macur.a": Stem("torque", None, "KUKA's RSI"),  # motor current
    "actual_joint_torque": Stem("torque", "N.m"),
    "joint_torque": Stem("torque"),
    "torque": Stem("torque"),
    "tau": Stem("torque"),
    "trq": Stem("torque"),
    "actual_current": Stem("torque", "A", UR),
    "joint_current": Stem("torque"),
    "motor_current": Stem("torque"),
    "current": Stem("torque"),
    "actual_q": Stem("position", "rad", UR),
    "measured_joint_position": Stem("position", "rad", "KUKA's FRI"),
    "aipos.a": Stem("position", "deg", "KUKA's RSI"),
    "position": Stem("position", "rad", ROS),
    "joint_position": Stem("position"),
    "joint_pos": Stem("position"),
    "joint_angle": Stem("position"),
    "q": Stem("position"),
    "pos": Stem("position"),
    "observation.state": Stem("position", None, "LeRobot datasets"),
}
STEMS_BEFORE_JOINT_NAMES = ("position", "effort", "torque", "joint_position", "joint_torque")
FRANKA_STEM, FRANKA_UNITS = "tau_j", {"q": "rad"}
UNIT_SUFFIXES = {
    "ns": "ns",
    "us": "us",
    "ms": "ms",
    "s": "s",
    "sec": "s",
    "rad": "rad",
    "deg": "deg",
    "mm": "mm",
    "nm": "N.m",
    "ma": "mA",
    "a": "A",
}
RATES_HZ = (10.0, 5000.0)  # of logs: narrower than a factor of 1000, so that at most one unit of time fits


class JointNamesError(InputError):
    """Columns name other joints than the robot, so that their order is unknown."""


@dataclass(frozen=True)
class Column:
    """A column's name in parts; unit: None where the name does not tell it."""

    name: str
    stem: str
    key: str
    unit: str | None


@dataclass(frozen=True)
class Known:
    """What is known of a signal, the names of its columns or its unit, and the reason."""

    value: tuple[str, ...]
    reason: str


def recognise_time(names: Sequence[str], stamps: Sequence[str]) -> Known | None:
    """The time column, by its name, or two of seconds and their fraction, or the one column of stamps as text.

    stamps: columns of stamps as text.
    """
    found = next((name for name in names if _split_unit(name).stem in TIME_NAMES), None)
    if found is not None:
        return Known((found,), "a usual name")
    two = find_two_columns(names)
    if two is not None:
        return Known(two, "seconds and their fraction")
    return Known(tuple(stamps), "stamps as text") if len(stamps) == 1 else None


def time_unit(name: str, stamps: Array) -> Known | None:
    """The unit of a time column: by its name, else by its steps, of which at most one unit makes a usual rate."""
    named = _split_unit(name).unit
    if named in TIME_UNITS:
        return Known((named,), _reason_of_suffix((name,)))
    steps = np.diff(stamps[np.isfinite(stamps)])
    steps = steps[steps > 0]
    if not len(steps):
        return None
    rate = 1 / float(np.median(steps))
    fitting = [name for name, unit in TIME_UNITS.items() if RATES_HZ[0] <= rate / unit.factor <= RATES_HZ[1]]
    if not fitting:
        return None
    return Known((fitting[0],), f"by its steps, {rate / TIME_UNITS[fitting[0]].factor:.4g} Hz")


def recognise_signal(names: Sequence[str], signal: str, joints: Sequence[str]) -> Known | None:
    """The columns of a signal, one a joint, or None.

    joints: names, in the robot's order; empty while the robot is unknown, and then any number of columns will do.
    Of several stems the first of the table counts that has a column for each joint. Columns of joints that the robot
    does not have are left out where all others carry the names of its joints. Raises JointNamesError where the columns
    name other joints.
    """
    columns = [split_name(name) for name in names]
    for stem, meaning in STEMS.items():
        group = tuple(column.name for column in columns if column.stem == stem and column.key)
        if meaning.signal != signal or not group:
            continue
        reason = f"named as in {meaning.writer}" if meaning.writer else "usual names"
        if not joints:
            return Known(group, reason)
        own = tuple(name for name, owner in zip(group, owners_of(group, joints), strict=True) if owner)
        if len(own) == len(joints) or len(group) == len(joints):
            chosen = order_by_joint(own if len(own) == len(joints) else group, joints, signal)
            return Known(chosen, reason + (", joints matched by name" if set(chosen) == set(own) else ""))
    return None


def unit_by_name(chosen: Sequence[str], names: Sequence[str]) -> Known | None:
    """The unit that the names of a signal's columns tell, or their driver; names: of all columns of the file."""
    columns = [split_name(name) for name in chosen]
    stems, units = {column.stem for column in columns}, {column.unit for column in columns}
    if len(stems) > 1 or len(units) > 1:
        return None
    stem, suffix = stems.pop(), units.pop()
    if suffix is not None:
        return Known((suffix,), _reason_of_suffix(chosen))
    known = STEMS.get(stem)
    if known is not None and known.unit is not None:
        return Known((known.unit,), f"as in {known.writer}" if known.writer else "as the name tells")
    franka = FRANKA_UNITS.get(stem) if any(split_name(name).stem == FRANKA_STEM for name in names) else None
    return Known((franka,), f"as in {FRANKA}") if franka else None


def _reason_of_suffix(names: Sequence[str]) -> str:
    return f"from _{names[0].rpartition('_')[2]}"


def split_name(name: str) -> Column:
    """A column's name as stem, key and unit."""
    bare = _split_unit(name)
    numbered = re.fullmatch(r"(.*?)[\[_ .]?(\d+)\]?", bare.stem)
    if numbered and numbered[1] in STEMS:
        return Column(name, numbered[1], numbered[2], bare.unit)
    for stem in STEMS_BEFORE_JOINT_NAMES:
        if bare.stem.startswith(f"{stem}_"):
            return Column(name, stem, bare.stem[len(stem) + 1 :], bare.unit)
    owner = name.strip().split("/")[:-1]
    if bare.stem in STEMS_BEFORE_JOINT_NAMES and owner and owner[-1]:  # PlotJuggler: /topic/joint/position
        return Column(name, bare.stem, owner[-1].lower(), bare.unit)
    return Column(name, bare.stem, "", bare.unit)


def _split_unit(name: str) -> Column:
    last = name.rsplit("/", 1)[-1].strip().lower()
    stem, _, suffix = last.rpartition("_")
    if stem and suffix in UNIT_SUFFIXES:
        return Column(name, stem, "", UNIT_SUFFIXES[suffix])
    return Column(name, last, "", None)


def order_by_joint(names: tuple[str, ...], joints: Sequence[str], signal: str) -> tuple[str, ...]:
    """The columns in the order of the robot's joints, whose names they carry or whose numbers they end with.

    Raises JointNamesError where they name other joints: their order in a file says nothing.
    """
    if len(names) == 1:
        return names
    owners = owners_of(names, joints)
    if sorted(owners) == sorted(joints):
        return tuple(names[owners.index(joint)] for joint in joints)
    numbers = [re.search(r"(\d+)\D*$", name) for name in names]
    found = [int(number[1]) for number in numbers if number]
    if len(set(found)) == len(names):
        return tuple(name for _, name in sorted(zip(found, names, strict=True)))
    raise JointNamesError(
        f"the columns of {signal} ({', '.join(names)}) name other joints than the robot ({', '.join(joints)}): "
        f"list them in the robot's order, --{signal.replace('_', '-')} NAME,NAME,..."
    )


def check_joint_order(names: tuple[str, ...], joints: Sequence[str], signal: str) -> None:
    """Raises InputError where listed columns carry the names of the robot's joints in another order."""
    owners = owners_of(names, joints)
    if sorted(owners) == sorted(joints) and owners != list(joints):
        raise InputError(
            f"--{signal.replace('_', '-')} lists the joints {', '.join(owners)}; the robot's order is "
            f"{', '.join(joints)}"
        )


def owners_of(names: Sequence[str], joints: Sequence[str]) -> list[str]:
    """The joint that each column's name carries, the longest of several; empty where it carries none."""
    return [max((joint for joint in joints if _carries(name, joint)), key=len, default="") for name in names]


def _carries(name: str, joint: str) -> bool:
    """Whether a column's name ends with a joint's, or has it before its last part: `/topic/joint/position`."""
    return name.split("/")[-2:-1] == [joint] or name == joint or name.endswith((f"_{joint}", f"/{joint}", f".{joint}"))
