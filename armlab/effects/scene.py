"""A run as effects see it that are more than linear terms of a motion."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion
from problem.pseudo_inertia import least_eigenvalues
from problem.regressor import inertia_column, rigid_body_torque

MOTION_STEP = 1e-4  # rad (m), rad/s (m/s) each way, for differences
NO_INERTIA = 1e-9  # an eigenvalue of a pseudo-inertia, which rounding leaves of none


@dataclass(frozen=True, eq=False)
class Scene:
    """One run as effects see it: even in time, not yet passed through the torque's filter.

    Nothing of the measured torque is in it: its noise would leak into the candidates.
    time: (samples,), s, from the first sample of the run. inertial: (10 * joints,), the links of the present
    model. torque: (samples, joints), what the present model predicts, friction included, faults of the torque's
    channel left out, N m (N). temperature: (samples, sensors), degrees Celsius; link_position: (samples, joints),
    rad (m); None where the run has none. beside: (samples, joints), N m (N), torque simulated elsewhere that the model
    adds to; None where the model is the whole torque. start: stamp of the first sample, s, on the clock of the
    recording.
    """

    run: str
    time: Array
    motion: Motion
    arm: Arm
    inertial: Array
    torque: Array
    temperature: Array | None = None
    link_position: Array | None = None
    beside: Array | None = None
    start: float = 0.0

    def __post_init__(self) -> None:
        """Make the arrays read-only for laws: what one writes, all others would see."""
        moved = self.motion
        shown = [_read_only(each) for each in (moved.position, moved.velocity, moved.acceleration)]
        object.__setattr__(self, "motion", Motion(*shown))
        for name in ("time", "inertial", "torque", "temperature", "link_position", "beside"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _read_only(getattr(self, name)))

    @cached_property
    def rigid_torque(self) -> Array:
        """What the links of the present model need, without friction: (samples, joints), N m (N)."""
        return self.links_torque

    @cached_property
    def links_torque(self) -> Array:
        """The rigid torque of this motion, (samples, joints), N m (N): what its derivatives start from."""
        return rigid_body_torque(self.arm, self.motion, self.inertial)

    def torque_along(self, joint: int, change: Array) -> Array:
        """The change of the rigid torque of all joints, to first order, where the motion of one joint (from 0) changes.

        change: (3, samples), of its angle, speed and acceleration. Returns (samples, joints), N m (N).
        """
        angle, speed, acceleration = change[:, :, None]
        by_angle, by_speed = self.torque_slopes(joint)
        return np.asarray(by_angle * angle + by_speed * speed + self.torque_by_acceleration(joint) * acceleration)

    def torque_by_acceleration(self, joint: int) -> Array:
        """How the rigid torque of all joints grows with the acceleration of one (from 0), (samples, joints), kg m2.

        Its own entry is the inertia that the joint feels of the links of the present model, its rotor left out.
        """
        if joint not in self._by_acceleration:
            column = inertia_column(self.arm, self.motion.position, joint, self.inertial)
            self._by_acceleration[joint] = _read_only(column)
        return self._by_acceleration[joint]

    def torque_slopes(self, joint: int) -> tuple[Array, Array]:
        """How the rigid torque of all joints grows with the angle, and with the speed, of one joint (from 0).

        Central differences, computed once: hundreds of springs and gaps of a joint ask for them.
        """
        if joint not in self._slopes:
            self._slopes[joint] = self._compute_slopes(joint)
        return self._slopes[joint]

    @cached_property
    def _by_acceleration(self) -> dict[int, Array]:
        return {}

    @cached_property
    def _slopes(self) -> dict[int, tuple[Array, Array]]:
        return {}

    def _compute_slopes(self, joint: int) -> tuple[Array, Array]:
        motion, ends = self.motion, []
        for sign in (1, -1):
            position, velocity = motion.position.copy(), motion.velocity.copy()
            position[:, joint] += sign * MOTION_STEP
            velocity[:, joint] += sign * MOTION_STEP
            changed = (
                Motion(position, motion.velocity, motion.acceleration),
                Motion(motion.position, velocity, motion.acceleration),
            )
            ends.append([rigid_body_torque(self.arm, each, self.inertial) for each in changed])
        by_angle, by_speed = ((more - less) / (2 * MOTION_STEP) for more, less in zip(*ends, strict=True))
        return _read_only(by_angle), _read_only(by_speed)

    @cached_property
    def has_bodies(self) -> bool:
        """Whether the links of the present model could exist; a fit of base parameters need not."""
        return bool(np.all(least_eigenvalues(self.inertial) > -NO_INERTIA))

    @cached_property
    def derived(self) -> dict[tuple[object, ...], object]:
        """What a law makes of this scene and asks for again, by what it makes it with; it keeps few."""
        return {}

    @property
    def step(self) -> float:
        """Time from sample to sample, s."""
        return float((self.time[-1] - self.time[0]) / max(len(self.time) - 1, 1))


@dataclass(frozen=True, eq=False)
class LoadedScene(Scene):
    """A scene whose links need the same torque at all times. load: (joints,), N m (N)."""

    load: Array = field(kw_only=True)

    @cached_property
    def rigid_torque(self) -> Array:
        """That torque, (samples, joints), N m (N)."""
        return np.broadcast_to(self.load, self.torque.shape)


def _read_only(values: Array) -> Array:
    view = values.view()
    view.flags.writeable = False
    return view


def scene_of(run: Run, motion: Motion, arm: Arm) -> Scene:
    """The scene of a run that is even in time and of its motion, before any model: links and torque are zeros."""
    zero, start = np.zeros(motion.position.shape), float(run.time[0])
    links, sensors = np.zeros(10 * len(arm)), (run.temperature, run.link_position)
    return Scene(run.name, run.time - start, motion, arm, links, zero, *sensors, start=start)


def instants(arm: Arm, motion: Motion, inertial: Array | None = None) -> Scene:
    """States that do not follow one another, as a scene of no duration: friction has the sign of each velocity.

    inertial: (10 * joints,), the links; zeros where it is left out.
    """
    samples, joints = motion.position.shape
    links = np.zeros(10 * joints) if inertial is None else inertial
    return Scene("", np.zeros(samples), motion, arm, links, np.zeros((samples, joints)))
