"""Friction of a joint of the field: every law at once, on a state that remembers the last reversal.

    tau = z (F + S exp(-(v / vs)^2) + k |load|) (1 + a sgn z) heat + c v heat + n |v|^p sgn v

z is Dahl's state (1968), z' = (v - |v| z) / w: within the way w after a reversal the friction turns from one side to
the other, and it keeps its value where the joint stands still. heat = 1 + h exp(-(t + t0) / T): a cold joint rubs more.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.effects.friction import recursion
from armlab.proof.blind.engine import Track

LEAST_WAY = 3e-4  # rad (m), of a joint without noticeable presliding
DIRECTION_WIDTH = 0.05  # of z, in which the direction of the asymmetry changes


@dataclass(frozen=True)
class JointFriction:
    """The numbers of one joint, N m, rad, s.

    coulomb, viscous: F, c. fall, fall_speed: S, vs. power, exponent: n, p. asymmetry: a. load_share: k. way: w. cold,
    warming_s, running_s: h, T, t0.
    """

    coulomb: float
    viscous: float
    fall: float
    fall_speed: float
    power: float
    exponent: float
    asymmetry: float
    load_share: float
    way: float
    cold: float
    warming_s: float
    running_s: float = 0.0

    def state(self, position: Array) -> Array:
        """z along a path (steps,)."""
        steps = np.diff(position, prepend=position[0])
        kept = np.exp(-np.abs(steps) / self.way)
        return recursion(kept, np.sign(steps) * (1 - kept))

    def heat(self, time: Array) -> Array:
        """Factor of level and slope at times since the start of a run (steps,), s."""
        return np.asarray(1 + self.cold * np.exp(-(np.maximum(time, 0) + self.running_s) / self.warming_s))

    def torque(self, track: Track, joint: int) -> Array:
        """Torque that the motor gives on top, (steps,), N m."""
        velocity, state = track.velocity[:, joint], self.state(track.position[:, joint])
        level = self.coulomb + self.fall * np.exp(-((velocity / self.fall_speed) ** 2))
        level = level + self.load_share * np.abs(track.load[:, joint])
        level = level * (1 + self.asymmetry * np.tanh(state / DIRECTION_WIDTH))
        grown = self.power * np.sign(velocity) * np.abs(velocity) ** self.exponent
        return np.asarray((state * level + self.viscous * velocity) * self.heat(track.time) + grown)


def draw_friction(rng: np.random.Generator, rating: float, top_speed: float, noticeable_way: bool) -> JointFriction:
    """Friction in proportion to the torque and speed of a joint; cold and presliding in some."""
    coulomb = rating * float(np.exp(rng.uniform(np.log(0.02), np.log(0.2))))
    viscous = rating / top_speed * float(np.exp(rng.uniform(np.log(0.02), np.log(0.25))))
    exponent = float(rng.uniform(0.4, 0.7) if rng.random() < 0.4 else rng.uniform(1.6, 2.5))
    way = float(np.exp(rng.uniform(np.log(3e-3), np.log(3e-2)))) if noticeable_way else LEAST_WAY
    return JointFriction(
        coulomb=coulomb,
        viscous=viscous,
        fall=coulomb * float(rng.uniform(0.05, 0.5)),
        fall_speed=top_speed * float(np.exp(rng.uniform(np.log(0.01), np.log(0.08)))),
        power=coulomb * float(rng.uniform(0.05, 0.4)) / top_speed**exponent,
        exponent=exponent,
        asymmetry=float(rng.normal(0, 0.06)),
        load_share=float(rng.uniform(0.0, 0.08)),
        way=way,
        cold=float(rng.uniform(0.0, 0.1)) if rng.random() < 0.6 else float(rng.uniform(0.1, 0.4)),
        warming_s=float(np.exp(rng.uniform(np.log(20), np.log(600)))),
        running_s=float(rng.uniform(0, 300)),
    )


LawNumber = Literal["fall", "power", "asymmetry", "load_share", "cold"]
LAW_NUMBERS: Mapping[str, LawNumber] = {
    "stribeck_friction": "fall",
    "nonlinear_viscous_friction": "power",
    "asymmetric_friction": "asymmetry",
    "load_dependent_friction": "load_share",
    "friction_drift": "cold",
}
