"""Forward kinematics of whole motions."""

import numpy as np

from problem.arm import Arm
from problem.transforms import Array


def body_points(arm: Arm, positions: Array, tool: Array) -> Array:
    """Origins of all links' frames and the tool point, in the base frame.

    positions: (..., joints), rad or m; tool: (3,) in the last link's frame, m.
    Returns (..., joints + 1, 3), m.
    """
    rotation = np.broadcast_to(np.eye(3), (*positions.shape[:-1], 3, 3))
    origin = np.zeros((*positions.shape[:-1], 3))
    points = []
    for index, joint in enumerate(arm.joints):
        turn, shift = _motion(joint.kind, positions[..., index])
        origin = origin + rotation @ joint.before[:3, 3]
        rotation = rotation @ joint.before[:3, :3]
        origin = origin + rotation[..., 2] * shift[..., None]
        rotation = rotation @ turn
        origin = origin + rotation @ joint.after[:3, 3]
        rotation = rotation @ joint.after[:3, :3]
        points.append(origin)
    return np.stack([*points, origin + rotation @ tool], axis=-2)


def _motion(kind: str, position: Array) -> tuple[Array, Array]:
    """Rotation (..., 3, 3) and shift (...,) along z of a joint's own motion."""
    turning = position if kind == "revolute" else np.zeros_like(position)
    rotation = np.zeros((*position.shape, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(turning)
    rotation[..., 1, 0] = np.sin(turning)
    rotation[..., 0, 1] = -rotation[..., 1, 0]
    rotation[..., 2, 2] = 1.0
    return rotation, position - turning
