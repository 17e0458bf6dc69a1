"""Names of bodies, joints and actuators of an MJCF, also of those to which the file gives none."""

from typing import Any


def body_name(model: Any, body: int) -> str:
    """The name of a body of a mujoco.MjModel; one without is called by its number."""
    return str(model.body(body).name) or f"body{body}"


def joint_name(model: Any, joint: int) -> str:
    """The name of a joint; one without is called by its body, and by its place among several of that body."""
    own, body = str(model.joint(joint).name), int(model.jnt_bodyid[joint])
    place = joint - int(model.body_jntadr[body]) + 1
    return own or f"{body_name(model, body)}_joint{place if model.body_jntnum[body] > 1 else ''}"


def actuator_name(model: Any, actuator: int) -> str:
    """The name of an actuator; one without is called by its number, from 1."""
    return str(model.actuator(actuator).name) or f"number {actuator + 1}"


def name_joints(spec: Any) -> None:
    """Gives the joints of a mujoco.MjSpec the names that `joint_name` has for them."""
    if all(each.name for each in spec.joints):
        return
    model = spec.compile()
    names = {each: joint_name(model, int(each.id)) for each in spec.joints}
    for each, name in names.items():
        each.name = name
