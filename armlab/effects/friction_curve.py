"""Friction that no formula fits: a curve of torque against the joint's own velocity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import ANGLE, TORQUE, Effect, Parameter, Scene, Value
from armlab.effects.friction import direction_of_motion
from armlab.effects.term import SIGN_SIGMAS, EveryJoint, Term, format_number, top_speed
from problem.arm import Arm

FRICTION_CURVE_FACTS = Effect(
    "friction_curve",
    "friction that follows a curve against velocity, where no formula fits",
    (Parameter("velocities", f"{ANGLE}/s"), Parameter("torques", TORQUE)),
    sentence="The friction of {place} follows a curve over velocity that {model} does not have",
    law=r"\Delta\tau_j = F(|\dot{q}_j|) \, \operatorname{sgn} \dot{q}_j, \quad F \text{ linear between knots}",
    dissipates=True,
    sticks=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    last_resort=True,
    axis="velocity",
    experiment="record constant speeds in both directions over the whole range of the joint's speed",
)
KNOT_SHARES = (  # of the top speed: from a coarse curve to a fine one
    (0.1, 0.4, 1.0),
    (0.05, 0.15, 0.35, 0.65, 1.0),
    (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0),
)
MAX_FALL = 0.05  # of the largest torque: a broken line swings about a smooth curve by less (chosen by eye)


@dataclass(frozen=True)
class FrictionCurve(Term):
    """F(|qd|) sgn(qd), F linear between knots, above the last one as below it.

    velocities: of the knots, from zero up, rad/s (m/s). Coefficients: F just above zero velocity, then by how much F
    rises from each knot to the next. Both directions have the same curve: what differs by a constant is an offset, and
    a curve of each direction would hold the offset as well. largest: torque that no coefficient is much larger than,
    where that is known.
    """

    facts = FRICTION_CURVE_FACTS
    names = ("velocities", "torques")
    replaces = ("coulomb_friction", "viscous_friction")
    velocities: tuple[float, ...] = ()
    largest: float = float("inf")

    def prior_scale(self, inertial: Array | None) -> float:
        """The largest torque."""
        return self.largest

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """From a coarse curve to a fine one."""
        top = top_speed(scenes, joint)
        return [cls.at(arm, joint, velocities=(0.0, *(share * top for share in shares))) for shares in KNOT_SHARES]

    @property
    def size(self) -> int:
        """One coefficient a knot."""
        return len(self.velocities)

    @property
    def label(self) -> str:
        """Effect, number of knots and place."""
        return f"{self.effect} ({self.size} knots), joint {self.joint}"

    def columns(self, scene: Scene) -> Array:
        """Coulomb's column, and a ramp for each interval between knots."""
        velocity = scene.motion.velocity[:, self.own]
        return self._stacked(direction_of_motion(scene, self.own), *(np.sign(velocity) * self._ramps(np.abs(velocity))))

    def _ramps(self, speed: Array) -> Array:
        """Share of each interval between knots that lies below a speed, (intervals, samples); the last one grows on."""
        knots = np.array(self.velocities)
        ramps = np.maximum((speed - knots[:-1, None]) / np.diff(knots)[:, None], 0)
        ramps[:-1] = np.minimum(ramps[:-1], 1)
        return np.asarray(ramps)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The knots: velocities, and the torque against the motion at each."""
        return {"velocities": self.velocities, "torques": tuple(np.cumsum(coefficients).tolist())}

    def equation(self, coefficients: Array) -> str:
        pairs = zip(self.velocities, np.cumsum(coefficients).tolist(), strict=True)
        knots = ", ".join(f"({format_number(speed)}, {format_number(torque)})" for speed, torque in pairs)
        return f"tau_{self.joint} += F(|qd_{self.joint}|) sgn(qd_{self.joint}), F linear between {knots}"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """Friction that drives at some speed, or that falls as the joint gets faster, beyond its uncertainty."""
        torques = np.cumsum(coefficients)
        spread = np.zeros((self.size, self.size)) if covariance is None else covariance.cumsum(axis=0).cumsum(axis=1)
        variances = np.diag(spread)
        if np.any(torques + SIGN_SIGMAS * np.sqrt(np.maximum(variances, 0)) < 0):
            return "friction that drives at some speed"
        falls = np.triu(torques[:, None] - torques)  # from a knot to each faster one
        doubts = SIGN_SIGMAS * np.sqrt(np.maximum(variances[:, None] + variances - 2 * spread, 0))
        if np.any(falls - doubts > MAX_FALL * torques.max()):
            return "a friction curve that falls as the joint gets faster"
        return None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The curve through knots; ValueError where they are no curve from zero velocity up."""
        velocities, torques = (tuple(float(each) for each in np.atleast_1d(parameters[name])) for name in cls.names)
        if len(velocities) != len(torques) or len(velocities) < 2:
            raise ValueError(f"friction_curve has {len(velocities)} velocities and {len(torques)} torques")
        if velocities[0] != 0 or np.any(np.diff(velocities) <= 0):
            raise ValueError(f"velocities of friction_curve should rise from 0, not {list(velocities)}")
        return cls.at(arm, joints[0], velocities=velocities), np.diff(torques, prepend=0.0)


FRICTION_CURVE = EveryJoint(FRICTION_CURVE_FACTS, (FrictionCurve,))
