"""A base that gives way: the arm stands on a spring that turns it a little about a horizontal axis.

The base is one joint more, without a body of its own, before the first one. The moment that the links need of it is its
load. It turns like a drive train that gives (`transmission.py`):

    inertia phi'' = -moment - moment_phi' phi' - moment_phi phi - (phi + T phi') / compliance

and the torque of the arm's joints changes as its motion does, to first order. A base that is soft about all axes is one
that is soft about its softest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Effect, Parameter, Scene, Value
from armlab.effects.sensitivity import horizontal_directions
from armlab.effects.term import Term, TermFamily, format_number
from armlab.effects.transmission import Load, Twist, integrate_twist, positive_inertia
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.regressor import MAX_JOINTS
from problem.transforms import inverse, turn_z_to

FLEXIBLE_BASE_FACTS = Effect(
    "flexible_base",
    "a base that gives way",
    (
        Parameter("compliance", "rad/(N.m)", positive=True),
        Parameter("direction", "rad", detail=True),
        Parameter("resonance", "Hz", positive=True, detail=True),
        Parameter("damping", "1", positive=True, detail=True),
    ),
    sentence="What the arm stands on gives way",
    figures="{compliance}",
    law=(
        r"\Delta\tau = \partial_\varphi \tau_{\text{rigid}}, \quad I \ddot\varphi = -M_{\text{base}} - C^{-1} "
        r"(\varphi + T \dot\varphi), \quad C = \text{compliance}"
    ),
    where="robot",
    prior_scale=5e-4,
    origin="transmission",
    experiment="touch the base with a dial gauge or an accelerometer while the arm stops hard, stretched out",
)

DAMPING, DAMPING_RANGE = 0.1, (0.01, 0.3)  # of the critical one: bolted steel has some hundredths, rubber feet more
RIGID_HZ = 200.0  # a resonance that no recording shows: the base follows its moment at once
LOOKS_HZ = (RIGID_HZ, 20.0, 12.0, 8.0, 5.0)  # of a first look
RESONANCE_RANGE = (2.0, RIGID_HZ)
DIRECTIONS = tuple(np.linspace(0, np.pi, 4, endpoint=False).tolist())  # of the axis, rad, of a first look
BASIS = (0.0, np.pi / 4, np.pi / 2)  # directions of three axes, rad, from which that about any other axis follows
TURN_RANGE = (-np.pi, 2 * np.pi)  # of a direction that is found anywhere from 0 to pi


@dataclass(frozen=True, eq=False)
class TurningBase:
    """A base that turns about an axis. load: of its spring. by_turn: how the torque of the joints grows with its angle,
    its speed and its acceleration, (3, samples, joints).
    """

    load: Load
    by_turn: Array

    def stiffness(self, hertz: float) -> float:
        """Of a base with this resonance, N m/rad."""
        return float(self.load.inertia.mean()) * (2 * np.pi * hertz) ** 2

    def torque_on_spring(self, law: Twist) -> Array:
        """Change of the torque of the joints as the base turns, (samples, joints)."""
        return np.asarray(np.einsum("ds,dsj->sj", integrate_twist(self.load, law), self.by_turn))


@dataclass(frozen=True, eq=False)
class StandingArm:
    """The arm of a scene on a base that stands still, and what turning it about the axes of `BASIS` changes.

    moments: of the base about the first and the last axis, (2, samples). growth: how the moment about each axis grows
    with the turn about it, its speed and its acceleration, (3 axes, 3, samples). by_turn: the same of the torque of the
    joints, about the first and the last axis, (2, 3, samples, joints).
    """

    step: float
    has_bodies: bool
    moments: Array
    growth: Array
    by_turn: Array

    @classmethod
    def of(cls, scene: Scene, first: Array, second: Array) -> "StandingArm":
        """first, second: horizontal axes across each other, in the base frame, (3,)."""
        turns = [_scene_on_base(scene, np.cos(turn) * first + np.sin(turn) * second) for turn in BASIS]
        slopes = [np.stack([*each.torque_slopes(0), each.torque_by_acceleration(0)]) for each in turns]
        return cls(
            scene.step,
            scene.has_bodies,
            np.stack([turns[0].rigid_torque[:, 0], turns[-1].rigid_torque[:, 0]]),
            np.stack([each[:, :, 0] for each in slopes]),
            np.stack([slopes[0][:, :, 1:], slopes[-1][:, :, 1:]]),
        )

    def about(self, turn: float) -> TurningBase:
        """About any horizontal axis, without an error: moments and torques are linear in the axis.

        How the moment about the axis itself grows is of second degree in it.
        """
        cos, sin = np.cos(turn), np.sin(turn)
        linear, square = np.array([cos, sin]), np.array([cos * (cos - sin), 2 * cos * sin, sin * (sin - cos)])
        by_angle, by_speed, inertia = np.tensordot(square, self.growth, 1)
        slopes = (by_angle, by_speed) if self.has_bodies else None
        load = Load(self.step, linear @ self.moments, positive_inertia(inertia), slopes)
        return TurningBase(load, np.tensordot(linear, self.by_turn, 1))


def _scene_on_base(scene: Scene, axis: Array) -> Scene:
    """The scene with the base as one joint more, which stands still. axis: its direction in the base frame, (3,)."""
    arm, motion = scene.arm, scene.motion
    turn = turn_z_to(axis)
    base = Joint("base", "revolute", turn, inverse(turn))
    coupled = tuple(replace(each, behind=each.behind + 1, leader=each.leader + 1) for each in arm.coupled)
    still = np.zeros((len(scene.time), 1))
    moved = (np.hstack([still, each]) for each in (motion.position, motion.velocity, motion.acceleration))
    return Scene(
        scene.run,
        scene.time,
        Motion(*moved),
        Arm(arm.name, (base, *arm.joints), None, arm.gravity, coupled=coupled),
        np.concatenate([np.zeros(10), scene.inertial]),
        np.hstack([still, scene.torque]),
    )


@dataclass(frozen=True)
class FlexibleBase(Term):
    """A base on a spring. Coefficient: its compliance, rad/(N m).

    shape: the resonance of the base with the arm on it, Hz; its damping, as a share of the critical one; the direction
    of its axis, rad, from the first horizontal axis of the base frame to the second one. horizontal: these two axes.
    """

    facts = FLEXIBLE_BASE_FACTS
    names = ("compliance", "direction", "resonance", "damping")
    follows_model = True
    of_time = True
    horizontal: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        first, second = horizontal_directions(np.array(arm.gravity))
        horizontal = (tuple(first.tolist()), tuple(second.tolist()))
        bounds = (RESONANCE_RANGE, DAMPING_RANGE, TURN_RANGE)
        return cls(None, (), tuple(range(len(arm))), bounds=bounds, horizontal=horizontal, **details)

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Resonances beyond and within what a recording shows, about some axes."""
        return [cls.at(arm, joint, shape=(hertz, DAMPING, turn)) for hertz in LOOKS_HZ for turn in DIRECTIONS]

    @property
    def axis(self) -> Array:
        """In the base frame, (3,)."""
        (first, second), turn = np.array(self.horizontal), self.shape[2]
        return np.asarray(np.cos(turn) * first + np.sin(turn) * second)

    def columns(self, scene: Scene) -> Array:
        """Torque of the compliance at one."""
        hertz, damping, _ = self.shape
        base = self.base_of(scene)
        stiffness = base.stiffness(hertz)
        changed = base.torque_on_spring(Twist(stiffness, damping / (np.pi * hertz)))
        return stiffness * changed[:, :, None]

    def base_of(self, scene: Scene) -> TurningBase:
        """The base of a scene about the axis of this shape."""
        key = ("standing", *self.horizontal)
        if key not in scene.derived:
            scene.derived[key] = StandingArm.of(scene, *np.array(self.horizontal))
        standing = scene.derived[key]
        assert isinstance(standing, StandingArm)
        return standing.about(self.shape[2])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        hertz, damping, turn = self.shape
        values = (float(coefficients[0]), float(np.mod(turn, np.pi)), hertz, damping)
        return dict(zip(self.names, values, strict=True))

    def equation(self, coefficients: Array) -> str:
        place = ", ".join(format_number(value) for value in self.axis)
        return f"base turns by {format_number(coefficients[0])} rad/(N.m) M about ({place})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        shape = tuple(float(parameters[name]) for name in ("resonance", "damping", "direction"))
        return cls.at(arm, 0, shape=shape), np.array([float(parameters["compliance"])])


@dataclass(frozen=True)
class BaseFamily(TermFamily):
    """One place: below the first joint. An arm with too many joints for one more has none."""

    facts: Effect = FLEXIBLE_BASE_FACTS
    terms: tuple[type[Term], ...] = (FlexibleBase,)

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """The base with each shape of a first look."""
        return [] if len(arm) + 1 > MAX_JOINTS else [list(FlexibleBase.initial_shapes(arm, 1, scenes))]


FLEXIBLE_BASE = BaseFamily()
