"""The drive of the simulation, as an import takes it: `--controller "kp=25 kd=5 delay=0.1"`, a configuration of Isaac
Lab, or a question for it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name, to_plain_data, validate
from armlab.recordings.imports.isaac_lab import read_isaac_lab
from armlab.recordings.imports.questions import Question
from armlab.recordings.imports.robots import ImportedRobot
from armlab.recordings.motion import PER_JOINT_KEYS
from armlab.recordings.recording_file import ControllerEntry
from problem.mjcf import compile_mjcf
from problem.mjcf_servos import actuators_of, refuse_other_drives

OPTION = "--controller"
UNKNOWN = "none"  # a number of a joint that is not known
FILTERS = (2, 3)  # MuJoCo's mjDYN_FILTER and mjDYN_FILTEREXACT, as numbers of a compiled model
KEYS = tuple(key for key in ControllerEntry.model_fields if key != "type")


def read_controller(given: str | None, joints: Sequence[str]) -> dict[str, Any] | None:
    """The key `controller` of `recording.yaml`; None where nothing is given, and while the robot is open.

    given: KEY=VALUES with blanks between; values have commas between them, one a joint, or one for all joints; or a
    Python file with actuators of Isaac Lab. joints: names, in the order of the columns.
    Raises InputError for an unknown key, and for what is no number.
    """
    if not given or not joints:
        return None
    if given.endswith(".py"):
        read = read_isaac_lab(Path(given), joints)
        return _checked({key: values for key, values in read.items() if any(each is not None for each in values)})
    content: dict[str, Any] = {}
    for part in given.split():
        key, equals, text = part.partition("=")
        if not equals or key not in KEYS:
            raise InputError(f"{OPTION} {part}: should be KEY=VALUES: {suggest_name(key, KEYS)}")
        values = [_read_value(each, part) for each in text.split(",")]
        if key in PER_JOINT_KEYS and len(values) not in (1, len(joints)):
            raise InputError(
                f"{OPTION} {part}: should hold one number, or {len(joints)}, one a joint, not {len(values)}"
            )
        content[key] = values * (len(joints) if len(values) == 1 else 1) if key in PER_JOINT_KEYS else values[0]
    return _checked({"kd": [None] * len(joints), **content})


def _checked(content: dict[str, Any]) -> dict[str, Any]:
    entry = validate(ControllerEntry, {"type": "pd", **content}, OPTION)
    return dict(to_plain_data(entry.model_dump(exclude_unset=True)))


def _read_value(text: str, part: str) -> float | str | None:
    if text == UNKNOWN and "=" in part and part.partition("=")[0] in PER_JOINT_KEYS:
        return None
    try:
        return float(text)
    except ValueError:
        if part.partition("=")[0] in ("reference_velocity", "feedforward"):
            return text
        raise InputError(f"{OPTION} {part}: '{text}' is no number; {UNKNOWN} where one is unknown") from None


def ask_controller(robot: ImportedRobot | None, joints: Sequence[str]) -> tuple[Question, ...]:
    """A question for the drive where the actuators of an MJCF are no position servos; none for other robots.

    joints: names of those that were recorded, in the order of the columns.
    """
    if robot is None or Path(robot.source).suffix != ".xml" or robot.locked:
        return ()
    known = [joint.name for joint in robot.arm.joints]
    model, places = compile_mjcf(Path(robot.source)), [known.index(name) for name in joints]
    try:
        refuse_other_drives(model, places, Path(robot.source))
    except InputError as error:
        proposal = _propose_controller(model, places)
        flag = f"{OPTION} '{proposal}', which takes a filter for a delay of its time constant" if proposal else OPTION
        missing = f"{error}: give {flag}"
        text = "drive that took the commands, as KEY=VALUES with blanks between"
        return (Question("controller", missing, text, proposal),)
    return ()


def _propose_controller(model: Any, joints: Sequence[int]) -> str | None:
    """The servos behind first-order filters of their commands, 1 / (1 + T s), as servos that are late by T.

    Both have the same phase where the command is slow, T s << 1. None where an actuator is another drive.
    """
    numbers: dict[str, list[float]] = {key: [] for key in ("kp", "kd", "torque_limit", "delay")}
    for joint in joints:
        own = actuators_of(model, joint)
        if len(own) != 1:
            return None
        gain, bias = model.actuator_gainprm[own[0]], model.actuator_biasprm[own[0]]
        filters = int(model.actuator_dyntype[own[0]]) in FILTERS
        if gain[0] <= 0 or bias[1] != -gain[0] or bias[0] != 0 or model.actuator_gear[own[0], 0] != 1:
            return None
        numbers["kp"].append(float(gain[0]))
        numbers["kd"].append(float(-bias[2]))
        numbers["delay"].append(float(model.actuator_dynprm[own[0], 0]) if filters else 0.0)
        if model.actuator_forcelimited[own[0]]:
            numbers["torque_limit"].append(float(model.actuator_forcerange[own[0], 1]))
    whole = {key: values for key, values in numbers.items() if len(values) == len(joints)}
    return " ".join(f"{key}={','.join(f'{value:g}' for value in values)}" for key, values in whole.items())
