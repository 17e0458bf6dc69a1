"""Distances of an arm from itself, from a floor and from boxes, computed by MuJoCo.

The shape of the arm is the collision geometry of its URDF or MJCF, meshes as their convex hulls. An arm without such
geometry is taken for capsules along the lines from joint to joint.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from problem.arm import Arm, Limits
from problem.mjcf import import_mujoco

RADIUS_SHARE = 0.06  # of the length of the stretched arm: about the tubes of six- and seven-joint industrial arms
MIN_RADIUS = 0.01  # m: of an arm whose joints are all at one place
MAX_DISTANCE = 10.0  # m: distances are not measured beyond it
STATIC = 0  # number of the part that does not move; links count from 1

Vector = tuple[float, float, float]
Box = tuple[Vector, Vector]


@dataclass(frozen=True)
class Surroundings:
    """What stands around an arm, in its base frame, m.

    floor: its height, None where it is not known. boxes: lower and upper corner of each keep-out box.
    """

    floor: float | None = None
    boxes: tuple[Box, ...] = ()


@dataclass(frozen=True, eq=False)
class PartPair:
    """Two parts of an arm, or one and what it has to keep off.

    kind: what it belongs to. names: of both. geoms: numbers in MuJoCo, (pairs, 2). reach: (joints,), the most that a
    point of one part moves as seen from the other, m per rad (m per m).
    """

    kind: str
    names: tuple[str, str]
    geoms: NDArray[np.intp]
    reach: Array


@dataclass(frozen=True, eq=False)
class ArmShape:
    """Geometry of an arm in MuJoCo with what stands around it.

    words: which geometry it is. model, data: of MuJoCo, of all joints of the robot file; the last ones, which `arm` may
    lack, stand at zero.
    """

    arm: Arm
    words: str
    pairs: tuple[PartPair, ...]
    model: Any
    data: Any

    @property
    def reach(self) -> Array:
        """The most that a point of one part of each pair moves, m per rad, (pairs, joints)."""
        return np.array([pair.reach for pair in self.pairs]).reshape(-1, len(self.arm))

    def keeping(self, chosen: NDArray[np.bool_]) -> "ArmShape":
        """The shape with some of its pairs (pairs,)."""
        return replace(self, pairs=tuple(pair for pair, kept in zip(self.pairs, chosen, strict=True) if kept))

    def distances(self, positions: Array, close: float = MAX_DISTANCE) -> Array:
        """Distance of each pair at positions (samples, joints), (samples, pairs), m; negative: how deep they overlap.

        A pair whose bounding spheres are farther apart than `close` has their distance, which is a lower bound.
        """
        if not self.pairs:
            return np.empty((len(positions), 0))
        return np.array([self._distances_at(position, close) for position in positions])

    def _distances_at(self, position: Array, close: float) -> Array:
        mujoco, (first, second) = import_mujoco(), self._geoms
        self.data.qpos[: len(position)] = position
        mujoco.mj_kinematics(self.model, self.data)
        gaps = self._bounds(self.data.geom_xpos[first], self.data.geom_xpos[second])
        for number in np.flatnonzero(gaps < close).tolist():
            one, other = int(first[number]), int(second[number])
            gaps[number] = mujoco.mj_geomDistance(self.model, self.data, one, other, MAX_DISTANCE, None)
        return np.asarray(np.minimum.reduceat(gaps, self._starts))

    def distance_slopes(self, positions: Array, samples: NDArray[np.intp], pairs: NDArray[np.intp]) -> Array:
        """Derivatives of the distances of pairs (chosen,) at samples (chosen,) of positions (samples, joints).

        Returns (chosen, joints), m per rad (m per m): n . (v - u), where n points from the nearest point of the first
        part to that of the second, and u and v are their movements. The nearest points themselves do not count
        (envelope theorem); where two are equally near, the slope is that of one.
        """
        mujoco, out = import_mujoco(), np.empty((len(samples), len(self.arm)))
        for sample in np.unique(samples).tolist():
            self.data.qpos[: positions.shape[1]] = positions[sample]
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            for row in np.flatnonzero(samples == sample).tolist():
                out[row] = self._slope(self.pairs[int(pairs[row])])
        return out

    def _slope(self, pair: PartPair) -> Array:
        """The same for one pair at the present pose, (joints,)."""
        mujoco, nearest, ends = import_mujoco(), np.inf, np.empty(6)
        for one, other in pair.geoms.tolist():
            between = np.empty(6)
            distance = mujoco.mj_geomDistance(self.model, self.data, one, other, MAX_DISTANCE, between)
            if distance < nearest:
                nearest, ends, bodies = distance, between, self.model.geom_bodyid[[one, other]]
        moves = np.empty((2, 3, self.model.nv))
        for move, point, body in zip(moves, ends.reshape(2, 3), bodies, strict=True):
            mujoco.mj_jac(self.model, self.data, move, None, point, int(body))
        normal = np.diff(ends.reshape(2, 3), axis=0)[0] / (nearest or np.inf)
        return np.asarray(normal @ (moves[1] - moves[0]))[: len(self.arm)]

    def _bounds(self, first: Array, second: Array) -> Array:
        """Distances of the bounding spheres about centres (pairs, 3) of geoms; of a plane its own."""
        radii = self.model.geom_rbound[np.array(self._geoms)].sum(axis=0)
        gaps = np.linalg.norm(second - first, axis=1) - radii
        planes = self._plane_first
        if planes.any():
            normals = self.data.geom_xmat[self._geoms[0][planes]][:, 2::3]
            gaps[planes] = np.sum((second - first)[planes] * normals, axis=1) - radii[planes]
        return np.asarray(gaps)

    @cached_property
    def _geoms(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The geoms of all pairs, planes first: (geom pairs,) twice."""
        both = np.concatenate([pair.geoms for pair in self.pairs])
        return both[:, 0], both[:, 1]

    @cached_property
    def _plane_first(self) -> NDArray[np.bool_]:
        return np.asarray(self.model.geom_type[self._geoms[0]] == import_mujoco().mjtGeom.mjGEOM_PLANE)

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        counts = [len(pair.geoms) for pair in self.pairs]
        return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)


def arm_shape(
    arm: Arm, robot: str, surroundings: Surroundings, limits: tuple[Limits, ...], radius: float | None = None
) -> ArmShape:
    """The shape of an arm among its surroundings.

    robot: the file or the built-in name that the arm is of. limits: in force, for the travel of prismatic joints.
    radius: of capsules, m; a share of the stretched arm if left out. Neighbouring links are no pair: they touch at
    their joint. Raises InputError where MuJoCo is missing.
    """
    spec, words = _spec_of_file(arm, robot, radius)
    floor, boxes = _add_surroundings(spec, surroundings)
    model = spec.compile()
    data = import_mujoco().MjData(model)
    import_mujoco().mj_kinematics(model, data)
    pairs = _Pairs(arm, limits, model, data, frozenset({*floor, *boxes})).all(floor, boxes)
    return ArmShape(arm, words, tuple(pairs), model, data)


def _spec_of_file(arm: Arm, robot: str, radius: float | None) -> tuple[Any, str]:
    """A mujoco.MjSpec with the arm, and in words which geometry it has."""
    mujoco, path = import_mujoco(), Path(robot)
    if path.suffix not in (".urdf", ".xml"):
        return _capsules(arm, radius, "the robot file has no geometry")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.boundmass = spec.compiler.boundinertia = 1e-6
        spec.compiler.balanceinertia = True
        model = spec.compile()
    except ValueError as error:
        reason = in_one_line(error).removeprefix("Error: ")
        return _capsules(arm, radius, f"MuJoCo cannot read the geometry of {path.name}: {reason}")
    moving = model.body_weldid[model.geom_bodyid[_collides(model)]] > 0
    if not moving.any():
        return _capsules(arm, radius, f"{path.name} has no collision geometry")
    return spec, f"the collision geometry of {path.name}, meshes as their convex hulls"


def _collides(model: Any) -> NDArray[np.bool_]:
    return np.asarray((model.geom_contype | model.geom_conaffinity) != 0)


def _capsules(arm: Arm, radius: float | None, reason: str) -> tuple[Any, str]:
    """A mujoco.MjSpec of capsules from joint to joint."""
    mujoco = import_mujoco()
    lines = _joint_lines(arm)
    length = sum(float(np.linalg.norm(end - start)) for part in lines for start, end in part)
    thick = max(RADIUS_SHARE * length, MIN_RADIUS) if radius is None else radius
    spec = mujoco.MjSpec()
    body, pose = spec.worldbody, np.eye(4)
    _add_lines(body, lines[STATIC], thick)
    for joint, own in zip(arm.joints, lines[1:], strict=True):
        quaternion = np.empty(4)
        frame = pose @ joint.before
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame[:3, :3]).ravel())
        body = body.add_body(pos=frame[:3, 3], quat=quaternion, name=f"the link of {joint.name}")
        kind = mujoco.mjtJoint.mjJNT_HINGE if joint.kind == "revolute" else mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(name=joint.name, type=kind, axis=[0, 0, 1])
        _add_lines(body, own, thick)
        pose = joint.after
    return spec, f"capsules of {thick:.3g} m radius from joint to joint ({reason})"


def _joint_lines(arm: Arm) -> list[list[tuple[Array, Array]]]:
    """Lines of the base, then of each link in the frame of its joint: along the fixed transforms to the next joint."""
    before = [joint.before for joint in arm.joints] + [np.eye(4)]
    lines = [[(np.zeros(3), before[0][:3, 3])]]
    for joint, following in zip(arm.joints, before[1:], strict=True):
        corner = joint.after[:3, 3]
        end = (joint.after @ following)[:3, 3]
        lines.append([(np.zeros(3), corner), (corner, end)])
    return lines


MIN_LINE = 1e-6  # m: a shorter line is a sphere


def _add_lines(body: Any, lines: list[tuple[Array, Array]], radius: float) -> None:
    shape = import_mujoco().mjtGeom
    long = [each for each in lines if np.linalg.norm(each[1] - each[0]) > MIN_LINE]
    for start, end in long:
        body.add_geom(type=shape.mjGEOM_CAPSULE, size=[radius, 0, 0], fromto=[*start, *end], mass=1.0)
    if not long:
        body.add_geom(type=shape.mjGEOM_SPHERE, size=[radius, 0, 0], pos=lines[0][0], mass=1.0)


def _add_surroundings(spec: Any, surroundings: Surroundings) -> tuple[list[int], list[int]]:
    """Adds floor and boxes to the world of a mujoco.MjSpec; the numbers of their geoms in the compiled model."""
    shape, names = import_mujoco().mjtGeom, list[str]()
    if surroundings.floor is not None:
        place = [0.0, 0.0, surroundings.floor]
        names.append("armlab floor")
        spec.worldbody.add_geom(name=names[-1], type=shape.mjGEOM_PLANE, size=[0, 0, 1], pos=place)
    for number, box in enumerate(surroundings.boxes, 1):
        low, high = np.array(box)
        names.append(f"armlab box {number}")
        spec.worldbody.add_geom(name=names[-1], type=shape.mjGEOM_BOX, size=(high - low) / 2, pos=(low + high) / 2)
    model = spec.compile()
    numbers = [int(model.geom(name).id) for name in names]
    return (numbers[:1], numbers[1:]) if surroundings.floor is not None else ([], numbers)


@dataclass(frozen=True, eq=False)
class _Pairs:
    """The pairs of parts of a compiled arm. added: geoms of floor and boxes, which are no part of it."""

    arm: Arm
    limits: tuple[Limits, ...]
    model: Any
    data: Any
    added: frozenset[int]

    def all(self, floor: list[int], boxes: list[int]) -> list[PartPair]:
        """Links two or more joints apart, then links and floor, then links and boxes."""
        links = range(1, len(self.arm) + 1)
        out = [
            self._pair("the arm itself", one, other, self._parts[one])
            for one in range(len(self.arm) + 1)
            for other in range(one + 2, len(self.arm) + 1)
        ]
        out += [
            self._pair("the floor", STATIC, link, floor, "the floor")
            for link in links
            if link > 1 or not self._first_keeps_height
        ]
        for number, box in enumerate(boxes, 1):
            out += [self._pair("the boxes", STATIC, link, [box], f"box {number}") for link in links]
        return [pair for pair in out if len(pair.geoms)]

    def _pair(self, kind: str, one: int, other: int, geoms: list[int], name: str = "") -> PartPair:
        both = [(first, second) for first in geoms for second in self._parts[other]]
        names = (name or self._name(one), self._name(other))
        numbers = np.array(both, dtype=np.intp).reshape(-1, 2)
        return PartPair(kind, names, numbers, self._reach(one, other))

    @cached_property
    def _parts(self) -> list[list[int]]:
        """Geoms of the base and of each link that can collide; bodies behind the last joint count as its link."""
        parts: list[list[int]] = [[] for _ in range(len(self.arm) + 1)]
        shape = import_mujoco().mjtGeom
        left_out = (shape.mjGEOM_HFIELD, shape.mjGEOM_SDF)
        for geom in np.flatnonzero(_collides(self.model)).tolist():
            plane = self.model.geom_type[geom] == shape.mjGEOM_PLANE
            link = self._link_of(int(self.model.geom_bodyid[geom]))
            if geom not in self.added and self.model.geom_type[geom] not in left_out and (link == STATIC or not plane):
                parts[link].append(geom)
        return parts

    def _link_of(self, body: int) -> int:
        joint = int(self.model.body_jntadr[self.model.body_weldid[body]])
        return min(joint + 1, len(self.arm))

    def _name(self, link: int) -> str:
        if link == STATIC:
            return "the base"
        name = self.model.body(int(self.model.jnt_bodyid[link - 1])).name
        return str(name or f"the link of {self.arm.joints[link - 1].name}")

    @property
    def _first_keeps_height(self) -> bool:
        """Whether the first joint turns about the vertical, so that no height of its link changes."""
        first = self.arm.joints[0]
        return first.kind == "revolute" and abs(first.before[2, 2]) > 1 - 1e-9

    def _reach(self, one: int, other: int) -> Array:
        """Most movement of a point of link `other`, seen from link `one`, per unit of each joint, (joints,)."""
        out = np.zeros(len(self.arm))
        distance = self._extents[other] + self._travels[other - 1]
        for joint in range(other - 1, one - 1, -1):
            out[joint] = distance if self.arm.joints[joint].kind == "revolute" else 1.0
            if joint:
                behind, ahead = self.arm.joints[joint - 1].after[:3, 3], self.arm.joints[joint].before[:3, 3]
                distance += float(np.linalg.norm(behind) + np.linalg.norm(ahead)) + self._travels[joint - 1]
        return out

    @cached_property
    def _extents(self) -> list[float]:
        """Largest distance of a point of each part from its joint, m."""
        out = [0.0]
        for link, geoms in enumerate(self._parts[1:], 1):
            offsets = np.linalg.norm(self.data.geom_xpos[geoms] - self.data.xanchor[link - 1], axis=1)
            out.append(float(np.max(offsets + self.model.geom_rbound[geoms], initial=0.0)))
        return out

    @cached_property
    def _travels(self) -> list[float]:
        """How far each prismatic joint goes from zero, m; 0 for the others."""
        out = []
        for joint, limit in zip(self.arm.joints, self.limits, strict=True):
            travel = float(np.max(np.abs(limit.position))) if joint.kind == "prismatic" else 0.0
            if not np.isfinite(travel):
                raise InputError(f"{self.arm.name}, {joint.name}: give position_limits, from which its travel is known")
            out.append(travel)
        return out
