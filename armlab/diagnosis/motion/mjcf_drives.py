"""The actuators of an MJCF as the replay takes them: one position servo of gear 1 at each joint that is driven."""

from pathlib import Path
from typing import Any

import numpy as np

from problem.mjcf import compile_mjcf, import_mujoco, mjcf_spec
from problem.mjcf_servos import actuators_of, reason_no_servo


def servo_spec(path: Path, replaced: frozenset[str]) -> Any:
    """A mujoco.MjSpec of a file whose commands are positions of joints, rad (m).

    replaced: joints whose drive the recording states: a first actuator that is no servo becomes one with gain 1, and
    further ones of the joint go. A servo behind a gear g, whose command counts g times the angle, becomes one at its
    joint with g^2 times its gains and |g| times its force.
    """
    mujoco = import_mujoco()
    spec, model, gone = mjcf_spec(path), compile_mjcf(path), list[Any]()
    for joint in range(model.njnt):
        name = model.joint(joint).name
        for place, number in enumerate(actuators_of(model, joint)):
            actuator = spec.actuators[number]
            if name in replaced and place > 0:
                gone.append(actuator)
            elif reason_no_servo(model, number) is not None:
                if name in replaced:
                    _make_servo(actuator)
            elif model.actuator_gear[number, 0] != 1:
                _move_to_joint(actuator, model, number)
    names = {each.name for each in gone}
    sensors = [each for each in spec.sensors if each.objtype == mujoco.mjtObj.mjOBJ_ACTUATOR and each.objname in names]
    for each in (*sensors, *gone):
        spec.delete(each)
    return spec


def _make_servo(actuator: Any) -> None:
    """Turns an actuator into a servo with gain 1 and no limits, whatever it was."""
    mujoco = import_mujoco()
    actuator.set_to_position(kp=1.0)
    actuator.gear = np.array([1.0, 0, 0, 0, 0, 0])
    actuator.forcelimited = actuator.ctrllimited = actuator.actlimited = mujoco.mjtLimited.mjLIMITED_FALSE


def _move_to_joint(actuator: Any, model: Any, number: int) -> None:
    """Gains and limits of a servo behind a gear as its joint feels them. model, number: of the compiled file."""
    gear = float(model.actuator_gear[number, 0])
    gain, bias = gear**2 * model.actuator_gainprm[number], gear**2 * model.actuator_biasprm[number]
    low, high = np.sort(gear * model.actuator_forcerange[number]).tolist()
    actuator.gear = np.array([1.0, 0, 0, 0, 0, 0])
    actuator.gainprm, actuator.biasprm, actuator.forcerange = gain, bias, np.array([low, high])
    for name in ("armature", "damping"):
        if np.any(getattr(model, f"actuator_{name}", np.zeros(model.nu))[number]):
            setattr(actuator, name, gear**2 * np.asarray(getattr(actuator, name)))
