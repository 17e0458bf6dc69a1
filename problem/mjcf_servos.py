"""Which actuators of an MJCF are position servos, and why the others are no drives that a motion alone tells of."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from problem.mjcf_laws import is_joint_drive
from problem.mjcf_names import actuator_name, joint_name


def actuators_of(model: Any, joint: int) -> list[int]:
    """The actuators that drive a joint itself, all from 0."""
    found = np.flatnonzero(model.actuator_trnid[:, 0] == joint).tolist()
    return [number for number in found if is_joint_drive(model, number)]


def reason_no_servo(model: Any, actuator: int) -> str | None:
    """Why an actuator is no position servo, in a few words; None where it is one."""
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    if model.actuator_dyntype[actuator] != 0:
        return "filters its command"
    if gain[0] > 0 and not np.any(bias[:3]):
        return "is a motor, which takes torques"
    if gain[0] <= 0 or bias[1] != -gain[0] or bias[0] != 0:
        return "is no position servo"
    return None


def refuse_other_drives(model: Any, joints: Iterable[int], path: Path) -> None:
    """Raises InputError for a joint, from 0, that one position servo does not drive: no motion alone tells of it."""
    for joint in joints:
        actuators = actuators_of(model, joint)
        reason = reason_no_servo(model, actuators[0]) if actuators else None
        if len(actuators) > 1:
            reason = f"is not alone ({', '.join(actuator_name(model, each) for each in actuators)})"
        if reason is not None:
            raise InputError(
                f"{path}: the actuator of joint '{joint_name(model, joint)}' {reason}: the recording needs columns of "
                "torque, or the key `controller` of recording.yaml with the drive that took the commands"
            )
