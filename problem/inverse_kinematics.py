"""Joint motion of a three-joint arm whose tool point follows a path in space.

For arms with a vertical first axis and two parallel axes behind it (anthropomorphic arms such as the first
three joints of the IRB 120): the first joint turns the arm's plane, and the law of cosines gives the rest.
Speeds and accelerations are the exact time derivatives of the same formulas.
"""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm, link_poses
from problem.motion import Motion

MIN_SINE = 1e-6  # of the elbow's angle and of the distance (m) to the first axis: keeps the rates finite
GEOMETRY_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Path:
    """A path in space with its derivatives: arrays (points, samples) of x, y, z in the base frame, m."""

    position: tuple[Array, Array, Array]
    velocity: tuple[Array, Array, Array]
    acceleration: tuple[Array, Array, Array]


@dataclass(frozen=True)
class PlanarArm:
    """The arm in its own vertical plane: lengths in m, angles in rad from the horizontal at joint zeros.

    azimuth: direction of that plane at the zero of joint 1; height, offset: of the second axis.
    """

    azimuth: float
    offset: float
    height: float
    upper_length: float
    upper_angle: float
    fore_length: float
    fore_angle: float

    def joint_motion(self, path: Path, elbow_up: bool) -> tuple[Motion, Array]:
        """Joint motion (points, samples, 3) along a path, and how far it leaves the reach, (points,), m.

        The first joint is continuous along the path and starts within half a turn of its zero.
        """
        turn, radial = _cylindrical_motion(path)
        height = (path.position[2] - self.height, path.velocity[2], path.acceleration[2])
        radial = (radial[0] - self.offset, radial[1], radial[2])
        upper, elbow, overreach = self._planar(radial, height, -1.0 if elbow_up else 1.0)
        first = (_unwrap_angles(turn[0] - self.azimuth), turn[1], turn[2])
        second = (_wrap_angles(self.upper_angle - upper[0]), -upper[1], -upper[2])
        third = (_wrap_angles(self.fore_angle - self.upper_angle - elbow[0]), -elbow[1], -elbow[2])
        states = np.empty((3, *turn[0].shape, 3))
        for joint, parts in enumerate((first, second, third)):
            for state, part in zip(states, parts, strict=True):
                state[..., joint] = part
        position, velocity, acceleration = states
        return Motion(position, velocity, acceleration), overreach

    def _planar(
        self, radial: tuple[Array, ...], height: tuple[Array, ...], side: float
    ) -> tuple[tuple[Array, ...], tuple[Array, ...], Array]:
        """Angles of the upper arm and of the elbow with two derivatives, and the overreach."""
        upper, fore = self.upper_length, self.fore_length
        (x, dx, ddx), (z, dz, ddz) = radial, height
        square = x * x + z * z
        half_rate = x * dx + z * dz
        half_bend = dx * dx + dz * dz + x * ddx + z * ddz
        scale = 1.0 / (upper * fore)
        cosine = np.minimum(np.maximum((square - upper**2 - fore**2) * (0.5 * scale), -1.0), 1.0)
        sine = side * np.maximum(np.sqrt(1.0 - cosine * cosine), MIN_SINE)
        elbow = side * np.arccos(cosine)
        elbow_rate = -half_rate * scale / sine
        elbow_bend = -(half_bend * scale + cosine * elbow_rate**2) / sine
        inverse = 1.0 / np.maximum(square, MIN_SINE**2)
        lever = fore * (upper * cosine + fore) * inverse
        growth = 2.0 * half_rate * inverse
        aim_rate = (x * dz - z * dx) * inverse
        lag_rate = elbow_rate * lever
        lag_bend = elbow_bend * lever - upper * fore * sine * elbow_rate**2 * inverse
        angle = np.arctan2(z, x) - np.arctan2(fore * sine, upper + fore * cosine)
        rate = aim_rate - lag_rate
        bend = (x * ddz - z * ddx) * inverse - lag_bend - rate * growth
        distance = np.sqrt(square)
        overreach = np.maximum(distance - (upper + fore), abs(upper - fore) - distance).max(axis=-1)
        return (angle, rate, bend), (elbow, elbow_rate, elbow_bend), np.maximum(overreach, 0.0)


def planar_arm(arm: Arm, tool: Array) -> PlanarArm:
    """The plane geometry of a three-joint arm with a tool point (3,) in the frame of its last link, m.

    Raises InputError where the arm is not anthropomorphic.
    """
    if len(arm) != 3 or any(joint.kind != "revolute" for joint in arm.joints):
        raise InputError(f"a Cartesian path needs an arm of three revolute joints; '{arm.name}' is another")
    axes, origins = _joint_axes(arm)
    tip = (link_poses(arm, np.zeros(3))[-1] @ [*tool, 1.0])[:3]
    forward = np.cross(axes[1], axes[0])
    upright = np.allclose(axes[0], [0, 0, 1], atol=GEOMETRY_TOLERANCE) and np.allclose(
        origins[0][:2], 0, atol=GEOMETRY_TOLERANCE
    )
    parallel = np.allclose(axes[1], axes[2], atol=GEOMETRY_TOLERANCE) and abs(axes[1][2]) < GEOMETRY_TOLERANCE
    in_plane = abs(float(axes[1] @ tip)) < GEOMETRY_TOLERANCE
    if not (upright and parallel and in_plane):
        raise InputError(
            f"a Cartesian path needs axis 1 along z of the base, axes 2 and 3 parallel and level, "
            f"and the tool in the plane of the arm; '{arm.name}' is built differently"
        )
    upper_length, upper_angle = _length_and_angle(origins[2] - origins[1], forward)
    fore_length, fore_angle = _length_and_angle(tip - origins[2], forward)
    return PlanarArm(
        azimuth=float(np.arctan2(forward[1], forward[0])),
        offset=float(forward @ origins[1]),
        height=float(origins[1][2]),
        upper_length=upper_length,
        upper_angle=upper_angle,
        fore_length=fore_length,
        fore_angle=fore_angle,
    )


def _length_and_angle(span: Array, forward: Array) -> tuple[float, float]:
    """Length of a span (3,) and its angle above the direction `forward` (3,)."""
    along, up = forward @ span, span[2]
    return float(np.hypot(along, up)), float(np.arctan2(up, along))


def _joint_axes(arm: Arm) -> tuple[list[Array], list[Array]]:
    """Directions and points of the joints' axes at joint zeros, in the base frame."""
    frames, pose = [], np.eye(4)
    for joint in arm.joints:
        frames.append(pose @ joint.before)
        pose = pose @ joint.pose(0.0)
    return [frame[:3, 2] for frame in frames], [frame[:3, 3] for frame in frames]


def _cylindrical_motion(path: Path) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Angle and distance about z with two derivatives."""
    (x, y, _), (dx, dy, _), (ddx, ddy, _) = path.position, path.velocity, path.acceleration
    distance = np.maximum(np.sqrt(x * x + y * y), MIN_SINE)
    inverse = 1.0 / distance
    rate = (x * dx + y * dy) * inverse
    bend = (dx * dx + dy * dy + x * ddx + y * ddy - rate * rate) * inverse
    square = inverse * inverse
    turn_rate = (x * dy - y * dx) * square
    turn_bend = (x * ddy - y * ddx) * square - 2.0 * turn_rate * rate * inverse
    return (np.arctan2(y, x), turn_rate, turn_bend), (distance, rate, bend)


def _wrap_angles(angle: Array) -> Array:
    """Angles in [-pi, pi)."""
    return angle - 2 * np.pi * np.floor(angle / (2 * np.pi) + 0.5)


def _unwrap_angles(angle: Array) -> Array:
    """Angles without jumps of a turn along the samples, the first in [-pi, pi)."""
    jumps = np.empty(angle.shape)
    jumps[..., 0] = angle[..., 0] - _wrap_angles(angle[..., 0])
    jumps[..., 1:] = angle[..., 1:] - angle[..., :-1]
    return angle - 2 * np.pi * np.cumsum(np.floor(jumps / (2 * np.pi) + 0.5), axis=-1)
