"""The arms in MuJoCo: bodies, joints, rotors, hidden parts with joints of their own, and tracks of simulated runs."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from armlab.common.arrays import Array
from problem.arm import Arm, Joint, Link
from problem.motion import Motion
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia


@dataclass(frozen=True, eq=False)
class Track:
    """A motion of the motor side and the torque that moves the mechanism, all at one instant a row.

    time: (steps,), s, from the first sample. position, velocity, acceleration: (steps, joints); velocities are
    those of the middle of two half steps. load: (steps, joints), N m, torque that the mechanism takes: that of
    the motors without what the laws of the hidden effects take on top.
    """

    time: Array
    motion: Motion
    load: Array

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.motion.joints

    @property
    def step_s(self) -> float:
        """Step of the simulation, s."""
        return float(self.time[1] - self.time[0])

    @cached_property
    def position(self) -> Array:
        """(steps, joints), rad."""
        return self.motion.position

    @cached_property
    def velocity(self) -> Array:
        """(steps, joints), rad/s."""
        return self.motion.velocity

    @cached_property
    def acceleration(self) -> Array:
        """(steps, joints), rad/s2."""
        return self.motion.acceleration

    def at(self, time: Array) -> "Track":
        """The track at other instants, interpolated linearly."""
        position = _interpolate(time, self.time, self.position)
        velocity = _interpolate(time, self.time, self.velocity)
        acceleration = _interpolate(time, self.time, self.acceleration)
        return Track(time, Motion(position, velocity, acceleration), _interpolate(time, self.time, self.load))

    def means(self, signal: Array, centre: Array, width_s: float) -> Array:
        """Mean of a signal (steps, joints) over an interval about each instant of `centre` (samples, joints).

        Drives log torque in this way. The interval is centred on the instant, so that the mean has no delay.
        """
        integral = np.vstack([np.zeros((1, signal.shape[1])), np.cumsum((signal[1:] + signal[:-1]) / 2, axis=0)])
        late, early = centre + width_s / 2, centre - width_s / 2
        out = np.empty(centre.shape)
        for joint in range(signal.shape[1]):
            until_late = np.interp(late[:, joint], self.time, integral[:, joint])
            until_early = np.interp(early[:, joint], self.time, integral[:, joint])
            out[:, joint] = (until_late - until_early) * self.step_s / width_s
        return out


def _interpolate(time: Array, known: Array, signal: Array) -> Array:
    return np.column_stack([np.interp(time, known, column) for column in signal.T])


DISABLED_FEATURES = ("EULERDAMP", "CONTACT", "WARMSTART", "SENSOR", "FRICTIONLOSS", "EQUALITY")  # no arm needs them
TINY_MASS, TINY_INERTIA = (
    1e-8,
    1e-9,
)  # kg, kg m2, of a body between two joints of one axis: MuJoCo needs positive values


@dataclass(frozen=True)
class Spring:
    """A spring between motor and link of a joint (from 0): N m/rad, N m s/rad; hardening in N m/rad3.

    gap: rad, play within which nothing is transmitted; stiffness and damping are those of its walls then, and MuJoCo
    takes them by the inertia that they move, 1/s2 and 1/s.
    """

    joint: int
    stiffness: float
    damping: float
    hardening: float = 0.0
    gap: float = 0.0

    def at_rest(self, load: float) -> float:
        """Twist of the link against its motor, rad, where it carries a load, N m; at the wall where there is play."""
        if self.gap > 0:
            return -float(np.copysign(self.gap / 2, load))
        soft = abs(load) / self.stiffness
        twist = brentq(lambda twist: twist * (self.stiffness + self.hardening * twist**2) - abs(load), 0.0, 1.01 * soft)
        return -float(np.copysign(twist, load))


@dataclass(frozen=True)
class Mount:
    """A base that gives way about a horizontal axis (3,): N m/rad, N m s/rad."""

    axis: tuple[float, float, float]
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Pendulum:
    """A mass that swings about an axis at a point of a link (from 0): kg, m, N m s/rad."""

    link: int
    mass: float
    length: float
    damping: float
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Parts:
    """The hidden parts of one machine."""

    springs: tuple[Spring, ...] = ()
    mount: Mount | None = None
    pendulum: Pendulum | None = None

    def __add__(self, other: "Parts") -> "Parts":
        """The parts of both; the first of two mounts or pendulums."""
        return Parts(self.springs + other.springs, self.mount or other.mount, self.pendulum or other.pendulum)


@dataclass(frozen=True, eq=False)
class Plant:
    """A compiled model. places, dofs: index of each motor joint among the positions and the velocities."""

    model: Any
    places: NDArray[np.intp]
    dofs: NDArray[np.intp]


def build_plant(
    arm: Arm, parts: Parts | None = None, step_s: float = 1 / 8000, gains: tuple[Array, Array] | None = None
) -> Plant:
    """The arm in MuJoCo; joint i turns about z of the frame before it.

    gains: position and velocity gains (joints,) of the servos, torque = control - gain q - gain qd.
    Raises ValueError for an arm without links, or a body that could not exist.
    """
    if arm.links is None:
        raise ValueError(f"the arm {arm.name!r} has no `links`: nothing to simulate")
    parts = parts or Parts()
    spec = mujoco.MjSpec()
    spec.compiler.degree = False  # or the range of a play would be read in degrees
    spec.option.timestep = step_s
    spec.option.gravity = arm.gravity
    for name in DISABLED_FEATURES:
        spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")
    parent, behind = _add_base(spec, parts.mount), np.eye(4)
    rotors = arm.rotor_inertia or (0.0,) * len(arm)
    for index, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
        spring = next((part for part in parts.springs if part.joint == index), None)
        parent = _add_link(parent, index, behind @ joint.before, joint, link, rotors[index], spring)
        if parts.pendulum is not None and parts.pendulum.link == index:
            _add_pendulum(parent, joint, parts.pendulum)
        behind = joint.after
    if gains is not None:
        for index, (position_gain, velocity_gain) in enumerate(zip(*gains, strict=True)):
            _add_servo(spec, index, position_gain, velocity_gain)
    model = spec.compile()
    motors = [model.joint(f"motor{index}") for index in range(len(arm))]
    places = np.array([motor.qposadr[0] for motor in motors])
    dofs = np.array([motor.dofadr[0] for motor in motors])
    return Plant(model, places, dofs)


def inverse_dynamics(arm: Arm, motion: Motion) -> Array:
    """Torques (samples, joints) that MuJoCo finds for a motion, rotors included, N m."""
    made = build_plant(arm)
    data = mujoco.MjData(made.model)
    torques = np.empty(motion.position.shape)
    states = zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    for sample, (position, velocity, acceleration) in enumerate(states):
        data.qpos[:] = position
        data.qvel[:] = velocity
        data.qacc[:] = acceleration
        mujoco.mj_inverse(made.model, data)
        torques[sample] = data.qfrc_inverse
    return torques


def _add_base(spec: Any, mount: Mount | None) -> Any:
    if mount is None:
        return spec.worldbody
    body = _add_empty_body(spec.worldbody, "base", np.eye(4))
    hinge = body.add_joint(name="mount", type=mujoco.mjtJoint.mjJNT_HINGE, axis=mount.axis)
    hinge.stiffness[0], hinge.damping[0] = mount.stiffness, mount.damping
    hinge.armature = 0.5  # of the plate that gives way, kg m2
    return body


def _add_link(
    parent: Any, index: int, pose: Array, joint: Joint, link: Link, rotor: float, spring: Spring | None
) -> Any:
    kind = mujoco.mjtJoint.mjJNT_HINGE if joint.kind == "revolute" else mujoco.mjtJoint.mjJNT_SLIDE
    if spring is not None:
        parent, pose = _add_empty_body(parent, f"rotor{index}", pose), np.eye(4)
        parent.add_joint(name=f"motor{index}", type=kind, axis=(0, 0, 1), armature=rotor)
    body = parent.add_body(name=f"link{index}", **_pose_arguments(pose))
    if spring is None:
        body.add_joint(name=f"motor{index}", type=kind, axis=(0, 0, 1), armature=rotor)
    else:
        _add_spring(body, index, kind, spring)
    _set_inertia(body, link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(link), joint.after)))
    return body


def _add_spring(body: Any, index: int, kind: Any, spring: Spring) -> None:
    hinge = body.add_joint(name=f"spring{index}", type=kind, axis=(0, 0, 1))
    if spring.gap > 0:  # the play's walls are a limit with stiffness and damping of their own
        hinge.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        hinge.range = (-spring.gap / 2, spring.gap / 2)
        hinge.solref_limit = (-spring.stiffness, -spring.damping)
        hinge.solimp_limit = (0.99, 0.99, 0.001, 0.5, 2)
        return
    hinge.damping[0] = spring.damping
    hinge.stiffness[0] = spring.stiffness
    hinge.stiffness[2] = spring.hardening


def _add_pendulum(parent: Any, joint: Joint, pendulum: Pendulum) -> None:
    pose = joint.after.copy()
    pose[:3, 3] += joint.after[:3, :3] @ np.array(pendulum.point)
    body = parent.add_body(name="pendulum", **_pose_arguments(pose))
    hinge = body.add_joint(name="pendulum", type=mujoco.mjtJoint.mjJNT_BALL)
    hinge.damping[0] = pendulum.damping
    inertia = 0.1 * pendulum.mass * pendulum.length**2
    body.mass, body.ipos = pendulum.mass, (0, 0, -pendulum.length)
    body.inertia, body.explicitinertial = (inertia,) * 3, True


def _add_servo(spec: Any, index: int, position_gain: float, velocity_gain: float) -> None:
    servo = spec.add_actuator(name=f"servo{index}", target=f"motor{index}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0] = 1.0
    servo.biasprm[1], servo.biasprm[2] = -position_gain, -velocity_gain


def _add_empty_body(parent: Any, name: str, pose: Array) -> Any:
    body = parent.add_body(name=name, **_pose_arguments(pose))
    body.mass, body.inertia, body.explicitinertial = TINY_MASS, (TINY_INERTIA,) * 3, True
    return body


def _pose_arguments(pose: Array) -> dict[str, Any]:
    return {"pos": pose[:3, 3], "quat": Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)}


def _set_inertia(body: Any, link: Link) -> None:
    """Mass, centre and the principal inertia about it."""
    centre = np.array(link.first_moment) / link.mass
    back = np.eye(4)
    back[:3, 3] = -centre
    xx, yy, zz, xy, xz, yz = link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(link), back)).inertia
    body.mass, body.ipos, body.explicitinertial = link.mass, centre, True
    body.fullinertia = (xx, yy, zz, xy, xz, yz)
