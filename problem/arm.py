"""The arm: a chain of joints between links, and the links' inertial parameters.
Forward kinematics gives the poses of links and the points of whole motions.

Each joint moves along or about its own z axis, between two fixed transforms: the pose of link i in link i-1
is `before @ motion(q) @ after`. Standard D-H (motion first, then a and alpha), modified D-H (a and alpha
first) and URDF (an origin and any axis) are three ways to write this.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import Literal, TypeVar

import numpy as np

from armlab.common.arrays import Array
from problem.transforms import rotation_z, translation

PARAMETER_NAMES = ("m", "mcx", "mcy", "mcz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")  # eq. 31
_T = TypeVar("_T")
PARAMETER_UNITS = ("kg", *("kg.m",) * 3, *("kg.m2",) * 6)


@dataclass(frozen=True)
class Limits:
    """Limits of a joint: rad or m, per second, per second squared, N m or N; infinite where unknown."""

    position: tuple[float, float] = (-np.inf, np.inf)
    velocity: float = np.inf
    acceleration: float = np.inf
    torque: float = np.inf


@dataclass(frozen=True, eq=False)
class Joint:
    """One degree of freedom: a motion about (revolute) or along (prismatic) z between two fixed transforms."""

    name: str
    kind: Literal["revolute", "prismatic"]
    before: Array
    after: Array
    limits: Limits = Limits()

    def pose(self, position: float) -> Array:
        """Pose (4, 4) of this joint's link in the link before it, at `position` (rad or m)."""
        turn = self.kind == "revolute"
        motion = rotation_z(position) if turn else translation(0, 0, position)
        return self.before @ motion @ self.after

    def counted_from(self, position: float) -> "Joint":
        """The joint whose link stands at `position`, rad or m, where that of this one stands at zero."""
        if not position:
            return self
        turn = self.kind == "revolute"
        back = rotation_z(-position) if turn else translation(0, 0, -position)
        return replace(self, before=self.before @ back)


@dataclass(frozen=True)
class Link:
    """Inertial parameters about the origin of the link's frame: kg, kg m, kg m2."""

    mass: float
    first_moment: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]  # Ixx Iyy Izz Ixy Ixz Iyz

    @property
    def parameters(self) -> Array:
        """The ten parameters in the order of eq. 31."""
        return np.array([self.mass, *self.first_moment, *self.inertia])


@dataclass(frozen=True)
class JointLaw:
    """What a simulator's joint has beside the links and rotors; SI units, for a slide N, m in place of N m, rad.

    The drive has to give damping qd + friction sgn(qd) + stiffness (q - rest). drive_compensates: the drive itself, not
    the simulator beside it, gives the torque that compensates gravity (see `Arm.compensated`).
    """

    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    drive_compensates: bool = False


NO_BODY = Link(0.0, (0.0,) * 3, (0.0,) * 6)


@dataclass(frozen=True, eq=False)
class CoupledJoint:
    """A joint whose position is a straight line over that of one of the arm's own joints, its leader.

    position = multiplier q_leader + offset. behind: how many own joints lie before it; leader: the place of that joint
    among them, from 0. link, law, rotor_inertia, compensated: its own, as in `Arm`; its law and its rotor count in
    those of the leader, too.
    """

    joint: Joint
    behind: int
    leader: int
    multiplier: float
    offset: float
    link: Link = NO_BODY
    law: JointLaw = JointLaw()
    rotor_inertia: float = 0.0
    compensated: Link = NO_BODY


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm; `links` is None where its inertial parameters are unknown.

    gravity: (3,), m/s2, in the base frame. rotor_inertia: one a joint, kg m2 (kg) on the joint side. joint_laws: what
    the file of a simulator says of each joint; empty where it says nothing. compensated: of each link the masses whose
    weight the simulator carries; empty where it carries none. coupled: joints of the chain that others lead, from the
    base on; they are none of `joints`, and their links none of `links` (see `coupled_joints`). unmeasured: joints, from
    0, whose torque nobody knows: the dynamics leave their rows zero.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...] | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    rotor_inertia: tuple[float, ...] = ()
    joint_laws: tuple[JointLaw, ...] = ()
    compensated: tuple[Link, ...] = ()
    coupled: tuple[CoupledJoint, ...] = ()
    unmeasured: frozenset[int] = frozenset()

    def __repr__(self) -> str:
        """Joints, what is known of the links, and how many joints have limits."""
        kinds = "".join(joint.kind[0].upper() for joint in self.joints)
        links = "unknown" if self.links is None else f"{sum(link.mass for link in self.links):.4g} kg in all"
        finite = {
            "position": sum(np.isfinite(joint.limits.position).all() for joint in self.joints),
            **{
                name: sum(np.isfinite(getattr(joint.limits, name)) for joint in self.joints)
                for name in ("velocity", "acceleration", "torque")
            },
        }
        limits = ", ".join(f"{name} {count}" for name, count in finite.items())
        return f"Arm {self.name!r}; joints: {len(self)} ({kinds})\n  links: {links}\n  joints with limits: {limits}"

    def __len__(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def parameters(self) -> Array:
        """All links' parameters, (10 * joints,); ValueError for an arm without links."""
        if self.links is None:
            raise ValueError(f"the arm {self.name!r} has no `links`: its inertial parameters are unknown")
        return np.concatenate([link.parameters for link in self.links])

    @property
    def measured(self) -> tuple[int, ...]:
        """The joints, from 0, whose torque is known."""
        return tuple(joint for joint in range(len(self)) if joint not in self.unmeasured)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names like `mcx2`: the parameter of eq. 31 and the number of the link, from 1."""
        return tuple(f"{name}{link + 1}" for link in range(len(self)) for name in PARAMETER_NAMES)

    def first(self, joints: int) -> "Arm":
        """The arm with its first `joints` joints only; the later joints and links are removed, not locked."""
        return replace(
            self,
            joints=self.joints[:joints],
            links=self.links[:joints] if self.links is not None else None,
            rotor_inertia=self.rotor_inertia[:joints],
            joint_laws=self.joint_laws[:joints],
            compensated=self.compensated[:joints],
            coupled=tuple(each for each in self.coupled if each.behind <= joints),
            unmeasured=frozenset(each for each in self.unmeasured if each < joints),
        )

    @cached_property
    def chain_places(self) -> tuple[int, ...]:
        """Places of the own joints in the chain of all joints, from 0."""
        behind = [sum(each.behind <= joint for each in self.coupled) for joint in range(len(self))]
        return tuple(joint + before for joint, before in enumerate(behind))

    @cached_property
    def coupling(self) -> tuple[Array, Array]:
        """Matrix (chain, joints) and offsets (chain,) that make positions of all joints of those of the own ones."""
        matrix = np.zeros((len(self) + len(self.coupled), len(self)))
        offsets = np.zeros(len(matrix))
        matrix[list(self.chain_places), np.arange(len(self))] = 1.0
        for place, each in zip(self._coupled_places, self.coupled, strict=True):
            matrix[place, each.leader], offsets[place] = each.multiplier, each.offset
        return matrix, offsets

    @property
    def _coupled_places(self) -> list[int]:
        return [each.behind + number for number, each in enumerate(self.coupled)]

    @cached_property
    def chain(self) -> "Arm":
        """The arm of all joints of the chain, as if nothing coupled them; laws and rotors of leaders count twice."""
        if not self.coupled:
            return self

        def whole(own: Sequence[_T], coupled: Sequence[_T]) -> tuple[_T, ...]:
            places = [*self.chain_places, *self._coupled_places]
            return tuple(value for _, value in sorted(zip(places, [*own, *coupled], strict=True), key=itemgetter(0)))

        count = len(self)
        return Arm(
            self.name,
            whole(self.joints, [each.joint for each in self.coupled]),
            whole(self.links or (NO_BODY,) * count, [each.link for each in self.coupled]),
            self.gravity,
            whole(self.rotor_inertia or (0.0,) * count, [each.rotor_inertia for each in self.coupled]),
            whole(self.joint_laws or (JointLaw(),) * count, [each.law for each in self.coupled]),
            whole(self.compensated or (NO_BODY,) * count, [each.compensated for each in self.coupled]),
        )


def link_poses(arm: Arm, positions: Array) -> list[Array]:
    """Pose (4, 4) of each link in the base frame at joint positions (joints,), rad or m."""
    if arm.coupled:
        matrix, offsets = arm.coupling
        of_chain = link_poses(arm.chain, matrix @ positions + offsets)
        return [of_chain[place] for place in arm.chain_places]
    poses, pose = [], np.eye(4)
    for joint, position in zip(arm.joints, positions, strict=True):
        pose = pose @ joint.pose(float(position))
        poses.append(pose)
    return poses


def body_points(arm: Arm, positions: Array, tool: Array) -> Array:
    """Origins of all links' frames and the tool point, in the base frame.

    positions: (..., joints), rad or m; tool: (3,) in the last link's frame, m.
    Returns (..., joints + 1, 3), m.
    """
    if arm.coupled:
        matrix, offsets = arm.coupling
        return body_points(arm.chain, positions @ matrix.T + offsets, tool)[..., [*arm.chain_places, -1], :]
    rotation = np.broadcast_to(np.eye(3), (*positions.shape[:-1], 3, 3))
    origin = np.zeros((*positions.shape[:-1], 3))
    points = []
    for index, joint in enumerate(arm.joints):
        turn, shift = _joint_rotation_and_shift(joint.kind, positions[..., index])
        origin = origin + rotation @ joint.before[:3, 3]
        rotation = rotation @ joint.before[:3, :3]
        origin = origin + rotation[..., 2] * shift[..., None]
        rotation = rotation @ turn
        origin = origin + rotation @ joint.after[:3, 3]
        rotation = rotation @ joint.after[:3, :3]
        points.append(origin)
    return np.stack([*points, origin + rotation @ tool], axis=-2)


def _joint_rotation_and_shift(kind: str, position: Array) -> tuple[Array, Array]:
    """Rotation (..., 3, 3) and shift (...,) along z of a joint's own motion."""
    turning = position if kind == "revolute" else np.zeros_like(position)
    rotation = np.zeros((*position.shape, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(turning)
    rotation[..., 1, 0] = np.sin(turning)
    rotation[..., 0, 1] = -rotation[..., 1, 0]
    rotation[..., 2, 2] = 1.0
    return rotation, position - turning
