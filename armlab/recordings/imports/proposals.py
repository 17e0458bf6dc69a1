"""Answers to offer where an import has to ask: from names, values and files beside the log. None is used unasked."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError, UndecidedError
from armlab.recordings.imports.families import choose_measured
from armlab.recordings.imports.recognition import split_name, time_unit
from armlab.recordings.units import SIGNAL_QUANTITIES
from problem.robot_file import load_arm

COLUMN_NAME_PATTERNS = {
    "position": r"(q|pos|position|angle|theta|act_pos|qm)[._ ]?.*",
    "torque": r"(tau|tor|torque|trq|effort|moment|gamma|current)[._ ]?.*",
    "reference_position": r"(c|cmd|command|goal|target|target_q|ref|reference|desired|set_?point|q_d)[._ ]?.*",
}
ROBOT_SUFFIXES = (".urdf", ".xml", ".yaml", ".yml")
MAX_ROBOT_FILES = 20  # beside a log; of more, none is proposed
MAX_ANGLE_RAD = 4 * np.pi  # of usual joints: greater numbers are degrees
MAX_CURRENT_A = 60.0  # of usual joint motors: greater numbers are milliamperes


def propose_robot(log: Path, count: int | None, joints: Sequence[str]) -> str | None:
    """The one robot file beside a log that fits it, if there is just one.

    count: of the position's columns, None while unknown. joints: their names, where the format tells them: a robot may
    have more.
    """
    files = [path for path in sorted(log.resolve().parent.iterdir()) if path.suffix.lower() in ROBOT_SUFFIXES]
    if len(files) > MAX_ROBOT_FILES:
        return None
    fitting = [path for path in files if _fits(path, count, joints)]
    return str(log.parent / fitting[0].name) if len(fitting) == 1 else None


def _fits(path: Path, count: int | None, joints: Sequence[str]) -> bool:
    try:
        arm = load_arm(str(path))
    except UndecidedError:  # a robot with a gripper, or with several arms
        return count is None
    except InputError:
        return False
    names = {joint.name for joint in arm.joints}
    return count in (None, len(arm)) or (bool(joints) and set(joints) <= names)


def propose_time(names: Sequence[str], values: Array) -> str | None:
    """The one column that rises from row to row and whose steps make a usual rate. values: (samples, columns)."""
    rising = [
        name
        for name, column in zip(names, values.T, strict=True)
        if np.all(np.diff(column) > 0) and time_unit(name, column) is not None
    ]
    return rising[0] if len(rising) == 1 else None


def propose_columns(
    names: Sequence[str], signal: str, joints: Sequence[str], chosen: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Columns whose names look like a signal, one a joint, in the robot's order; empty where names do not tell it.

    joints: of the robot; empty while it is unknown. chosen: columns of the signals that are known.
    """
    pattern = COLUMN_NAME_PATTERNS.get(signal)
    taken = {name for columns in chosen.values() for name in columns}
    free = [name for name in names if name not in taken]
    found = [name for name in free if pattern and re.fullmatch(pattern, name.split(".")[-1], re.IGNORECASE)]
    if signal != "reference_position":
        found = list(choose_measured(found, len(joints)))
    matched = match_joints(found, joints) or follow_order(found, chosen.get("position", ()))
    if matched:
        return matched
    numbered = len(joints) == 1 or all(re.search(r"\d", name) for name in found)
    return tuple(found) if numbered and len(found) == (len(joints) or len(found)) else ()


def match_joints(names: Sequence[str], joints: Sequence[str]) -> tuple[str, ...]:
    """The columns in the robot's order by the words of their names: `main_shoulder_pan` is `shoulder_pan_joint`.

    Empty where a joint has no column or several.
    """
    words = {name: _words(split_name(name).key or name) for name in names}
    matched = []
    for joint in joints:
        own = _words(joint)
        fitting = [name for name, each in words.items() if own and each and (own <= each or each <= own)]
        if len(fitting) != 1:
            return ()
        matched += fitting
    return tuple(matched) if len(set(matched)) == len(matched) else ()


def follow_order(names: Sequence[str], position: Sequence[str]) -> tuple[str, ...]:
    """The columns in the order of the position's joints; empty where they name other joints."""
    keys = {split_name(name).key: name for name in names}
    wanted = [split_name(name).key for name in position]
    known = all(wanted) and all(key in keys for key in wanted)
    return tuple(keys[key] for key in wanted) if known else ()


def propose_unit(signal: str, names: Sequence[str], values: Array, sliding: bool) -> str:
    """The unit that the size of the values suggests, else the SI unit.

    values: (samples, columns). sliding: whether all joints are prismatic.
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    units = SIGNAL_QUANTITIES[signal]
    if signal == "torque" and any("cur" in name.lower() for name in names):
        return "mA" if largest > MAX_CURRENT_A else "A"
    if "deg" in units.units and not sliding and largest > MAX_ANGLE_RAD:
        return "deg"
    return units.si[1 if sliding else 0]


def _words(name: str) -> frozenset[str]:
    return frozenset(re.findall(r"[a-z]+|\d+", name.lower())) - {"joint"}
