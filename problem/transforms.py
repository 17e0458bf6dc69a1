"""Homogeneous transforms, (4, 4), lengths in metres and angles in radians."""

import numpy as np

from armlab.common.arrays import Array


def translation(x: float, y: float, z: float) -> Array:
    """Shift by (x, y, z)."""
    transform = np.eye(4)
    transform[:3, 3] = x, y, z
    return transform


def rotation_x(angle: float) -> Array:
    """Turn about x."""
    return _rotation(angle, 1, 2)


def rotation_y(angle: float) -> Array:
    """Turn about y."""
    return _rotation(angle, 2, 0)


def rotation_z(angle: float) -> Array:
    """Turn about z."""
    return _rotation(angle, 0, 1)


def roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """Turn about the fixed axes x, y, z in this order (the URDF convention)."""
    return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


def inverse(transform: Array) -> Array:
    """The transform that undoes a rigid one."""
    rotation = transform[:3, :3].T
    undone = np.eye(4)
    undone[:3, :3] = rotation
    undone[:3, 3] = -rotation @ transform[:3, 3]
    return undone


def turn_z_to(axis: Array) -> Array:
    """A turn that maps the unit vector z to the direction of `axis` (3,); Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    if z < 0:  # 1 + z would lose its digits near -z
        return rotation_x(np.pi) @ turn_z_to(np.array([x, -y, -z]))
    cross = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])
    transform = np.eye(4)
    transform[:3, :3] += cross + cross @ cross / (1 + z)
    return transform


def _rotation(angle: float, first: int, second: int) -> Array:
    """A turn in the plane of two axes; exact at multiples of a quarter turn."""
    quarter_turns = angle / (np.pi / 2)
    near = round(quarter_turns)
    if abs(quarter_turns - near) < 1e-15 * max(1, abs(near)) * 4:
        cosine, sine = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][near % 4]
    else:
        cosine, sine = float(np.cos(angle)), float(np.sin(angle))
    transform = np.eye(4)
    transform[first, first] = transform[second, second] = cosine
    transform[second, first] = sine
    transform[first, second] = -sine
    return transform
