"""A base that gives way: the arm stands on a spring that turns it a little about a horizontal axis.

The base is one joint more, without a body of its own, before the first one. The moment that the links need of it is its
load. It turns like a drive train that gives (`transmission.py`):

    inertia phi'' = -moment - moment_phi' phi' - moment_phi phi - (phi + T phi') / compliance

and the torque of the arm's joints changes as its motion does, to first order. A base that is soft about all axes is one
that is soft about its softest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Effect, Parameter, Scene, Value
from armlab.effects.scene import NO_INERTIA
from armlab.effects.sensitivity import directional_derivative, horizontal_directions
from armlab.effects.term import Term, TermFamily, format_number
from armlab.effects.transmission import Twist, felt_inertia, integrate_twist
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.pseudo_inertia import least_eigenvalues
from problem.regressor import MAX_JOINTS, inertia_column
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
TURN_RANGE = (-np.pi, 2 * np.pi)  # of a direction that is found anywhere from 0 to pi


@dataclass(frozen=True, eq=False)
class StandingScene(Scene):
    """A scene whose arm has the base as one joint more, before its own, which stands still."""

    @cached_property
    def own_inertia(self) -> Array:
        """Inertia about the axis of the base, (samples, 1), kg m2; that of the arm's joints is not asked."""
        return inertia_column(self.arm, self.motion.position, 0, self.inertial)[:, :1]

    @cached_property
    def has_bodies(self) -> bool:
        return bool(np.all(least_eigenvalues(self.inertial[10:]) > -NO_INERTIA))

    def stiffness(self, hertz: float) -> float:
        """Of a base with this resonance, N m/rad."""
        return float(felt_inertia(self, 0).mean()) * (2 * np.pi * hertz) ** 2

    def torque_on_spring(self, law: Twist) -> Array:
        """Change of the torque of the arm's own joints as the base turns, (samples, joints)."""
        moved = np.zeros((3, *self.motion.position.shape))
        moved[:, :, 0] = integrate_twist(self, 0, law)
        return directional_derivative(self, Motion(*moved))[:, 1:]


def standing_scene(scene: Scene, axis: Array) -> StandingScene:
    """The scene with the base as a joint. axis: its direction in the base frame, (3,).

    The axes of a first look, which come first, are kept: each resonance is asked about each of them.
    """
    key = ("standing", *axis.tolist())
    if key not in scene.derived:
        made = _make_standing_scene(scene, axis)
        if len(scene.derived) >= len(DIRECTIONS):
            return made
        scene.derived[key] = made
    return scene.derived[key]  # type: ignore[return-value]


def _make_standing_scene(scene: Scene, axis: Array) -> StandingScene:
    arm, motion = scene.arm, scene.motion
    turn = turn_z_to(axis)
    base = Joint("base", "revolute", turn, inverse(turn))
    coupled = tuple(replace(each, behind=each.behind + 1, leader=each.leader + 1) for each in arm.coupled)
    still = np.zeros((len(scene.time), 1))
    moved = (np.hstack([still, each]) for each in (motion.position, motion.velocity, motion.acceleration))
    return StandingScene(
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
        standing = standing_scene(scene, self.axis)
        stiffness = standing.stiffness(hertz)
        changed = standing.torque_on_spring(Twist(stiffness, damping / (np.pi * hertz)))
        return stiffness * changed[:, :, None]

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
