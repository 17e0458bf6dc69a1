"""A model as a chain of bodies on joints that turn about or slide along z: what URDF and MJCF both write."""

from dataclasses import dataclass

import numpy as np

from identification.pseudo_inertia import link_of
from identification.torque_model import TorqueModel
from problem.errors import InputError
from problem.inertia import about_origin, moved
from recordings.run import Array

FLAT = 1e-12  # of a body's size: simulators refuse points, rods and plates
EXPORTED = {"viscous_friction": "damping", "coulomb_friction": "friction", "rotor_inertia": "armature"}


@dataclass(frozen=True, eq=False)
class Body:
    """One moving body and its joint, in SI units.

    origin: pose (4, 4) of the joint in the frame of the body before. centre: (3,), inertia: (3, 3) about it,
    in the body's frame, whose z is the joint's axis.
    """

    name: str
    kind: str
    origin: Array
    mass: float
    centre: Array
    inertia: Array
    limits: tuple[float, float]
    velocity: float
    effort: float
    damping: float
    friction: float
    armature: float


def bodies(model: TorqueModel) -> tuple[Body, ...]:
    """The bodies of a model; InputError where it has no links or one that no simulator takes."""
    if model.inertial is None:
        raise InputError("the model has base parameters only: identify it with --method physical to export links")
    origin, out = np.eye(4), []
    own = joint_values(model)
    for index, (joint, ten) in enumerate(zip(model.arm.joints, model.inertial.reshape(-1, 10), strict=True)):
        pseudo = moved(about_origin(link_of(ten)), joint.after)
        if np.linalg.eigvalsh(pseudo)[0] <= FLAT * np.trace(pseudo):
            raise InputError(f"link {index + 1} is no body with extent in space: identify with --method physical")
        centre = pseudo[:3, 3] / pseudo[3, 3]
        spread = pseudo[:3, :3] - pseudo[3, 3] * np.outer(centre, centre)
        inertia = np.trace(spread) * np.eye(3) - spread
        limits = joint.limits
        out.append(
            Body(
                joint.name, joint.kind, origin @ joint.before, float(pseudo[3, 3]), centre, inertia, limits.position,
                limits.velocity, limits.torque, **{name: float(values[index]) for name, values in own.items()},
            )
        )  # fmt: skip
        origin = joint.after
    return tuple(out)


def joint_values(model: TorqueModel) -> dict[str, Array]:
    """damping, friction and armature of each joint, (joints,)."""
    values = {name: np.zeros(len(model.arm)) for name in EXPORTED.values()}
    for part, place in zip(model.structure.components, model.structure.slices, strict=True):
        if part.effect in EXPORTED:
            values[EXPORTED[part.effect]][part.joint - 1] += model.values[place][0]
    return values


def left_out(model: TorqueModel) -> tuple[str, ...]:
    """Components for which these formats have no place."""
    return tuple(part.label for part in model.structure.components if part.effect not in EXPORTED)


def numbers(values: Array | tuple[float, ...]) -> str:
    """Numbers to their last digit."""
    return " ".join(repr(float(value)) for value in values)
