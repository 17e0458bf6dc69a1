"""Effects OUTSIDE the library of the diagnosis, frozen before any diagnosis was run on them.

The right answer to each is `unknown`, as long as the library has no name for it. They were fixed once, with their
equations, and are not to be changed, added to or taken away after a result is known. What the library has learnt since
counts as an effect of the library (`is_outside`): `flexible_base`.

q, v, a: position, velocity, acceleration; tau: motor torque; i: the joint; j: another joint; s: the size; R: the rated
torque.

| name | equation |
|---|---|
| viscous_map | tau_i += s m(q_i) v_i, m a random smooth map with mean zero and unit power |
| field_weakening | tau_i is read as tau_i (1 + s (v_i / 1 rad/s)^2): the torque constant falls with speed |
| quadratic_sensor | tau_i is read as tau_i + s tau_i^2 / R |
| hose_hysteresis | tau_i += s z, z' = v_j (1 - abs(z)^1.5 (0.7 sgn(v_j z) + 0.3)) / w: Bouc-Wen of joint j's motion |
| flexible_base | the base turns about a horizontal axis on a spring of compliance s, lightly damped |
| slosh | a pendulum of mass s swings in the last link |
| acceleration_friction | tau_i += s tanh(v_i / 0.01) tanh(a_i / 1): friction that is larger while speed grows |
| product_of_positions | tau_i += s sin(q_i) sin(q_j + p): the torque of a magnet or hose between two joints |
| current_dead_band | tau_i is read as tau_i - s tanh(tau_i / s) exp(-(tau_i / (2 s))^2): small currents are lost |
| sticky_patches | tau_i += s g(q_i) sgn(v_i), g one within three random narrow patches of position, else zero |
"""

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.effects.friction import bouc_wen
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues, smooth_sign, torque_share
from armlab.proof.blind.engine import Mount, Parts, Pendulum, Track


class OutsideEffect(HiddenEffect):
    """An effect that had no name in the library of the diagnosis when it was frozen; see `is_outside`."""

    forms = ("frozen",)
    is_outside = True


def draw_other_joint(rng: np.random.Generator, machine: Machine, joint: int) -> float:
    """A joint that is not this one, as a number of the shape."""
    return float(rng.choice([other for other in range(machine.joints) if other != joint]))


class ViscousMap(OutsideEffect):
    """Viscous friction that depends on position by a random smooth map."""

    effect = "viscous_map"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {f"c{index}": float(value) for index, value in enumerate(rng.normal(0, 0.5, 8))}
        coefficient = torque_share(0.03, machine, joint)
        return cls(joint, coefficient, 8 * coefficient, "frozen", shape)

    def torque(self, track: Track, run: int) -> Array:
        position = track.position[:, self.joint]
        waves = [wave(order * position) for order in (1, 2, 3, 4) for wave in (np.sin, np.cos)]
        levels = sum(self.shape[f"c{index}"] * wave for index, wave in enumerate(waves))
        return np.asarray(self.size * levels * track.velocity[:, self.joint])


class FieldWeakening(OutsideEffect):
    """A torque constant that falls with speed; the reading follows the current. A fault of the channel."""

    effect = "field_weakening"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.05, 0.4, "frozen")

    def torque(self, track: Track, run: int) -> Array:
        return np.asarray(self.size * track.load[:, self.joint] * track.velocity[:, self.joint] ** 2)


class QuadraticSensor(OutsideEffect):
    """A torque sensor that is not straight."""

    effect = "quadratic_sensor"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.1, 2.0, "frozen", {"rating": torque_share(1.0, machine, joint)})

    def read(self, torque: Array) -> Array:
        read, column = torque.copy(), torque[:, self.joint]
        read[:, self.joint] += self.size * column**2 / self.shape["rating"]
        return read


class HoseHysteresis(OutsideEffect):
    """A hose between two joints that remembers how it was bent (Bouc-Wen)."""

    effect = "hose_hysteresis"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"from": draw_other_joint(rng, machine, joint), "way": float(rng.uniform(0.1, 0.5))}
        level = torque_share(0.03, machine, joint)
        return cls(joint, level, 8 * level, "frozen", shape)

    def torque(self, track: Track, run: int) -> Array:
        steps = np.diff(track.position[:, int(self.shape["from"])], prepend=track.position[0, int(self.shape["from"])])
        return self.size * bouc_wen(steps / self.shape["way"])


class FlexibleBase(OutsideEffect):
    """A base on a spring. size: compliance, rad/(N m)."""

    effect = "flexible_base"
    where = "robot"
    units: ClassVar = {"compliance": "rad/(N.m)"}
    is_outside = False

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """The base below the first joint."""
        return range(1)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        direction = float(rng.uniform(0, np.pi))
        return cls(joint, 2e-5, 4e-4, "frozen", {"direction": direction})

    def parts(self) -> Parts:
        axis = (float(np.cos(self.shape["direction"])), float(np.sin(self.shape["direction"])), 0.0)
        return Parts(mount=Mount(axis, 1 / self.size, 3e-3 / self.size))

    @property
    def joints(self) -> tuple[int, ...]:
        """The first one, which feels it."""
        return (self.joint + 1,)

    def parameters(self) -> ParameterValues:
        return {"compliance": self.size}


class Slosh(OutsideEffect):
    """A liquid load, as a pendulum in the last link. size: mass, kg."""

    effect = "slosh"

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        return range(machine.joints - 1, machine.joints)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.5, 4.0, "frozen", {"length": float(rng.uniform(0.05, 0.15))})

    def parts(self) -> Parts:
        """The pendulum has a tenth of critical damping."""
        length = self.shape["length"]
        damping = 0.2 * self.size * length**2 * float(np.sqrt(9.81 / length))
        return Parts(pendulum=Pendulum(self.joint, self.size, length, damping))


class AccelerationFriction(OutsideEffect):
    """Friction that is larger while speed grows than while it falls."""

    effect = "acceleration_friction"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        level = torque_share(0.02, machine, joint)
        return cls(joint, level, 8 * level, "frozen")

    def torque(self, track: Track, run: int) -> Array:
        velocity, acceleration = track.velocity[:, self.joint], track.acceleration[:, self.joint]
        return np.asarray(self.size * smooth_sign(velocity, 0.01) * np.tanh(acceleration))


class ProductOfPositions(OutsideEffect):
    """A magnet or hose between two joints."""

    effect = "product_of_positions"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"from": draw_other_joint(rng, machine, joint), "phase": float(rng.uniform(0, 2 * np.pi))}
        level = torque_share(0.03, machine, joint)
        return cls(joint, level, 8 * level, "frozen", shape)

    def torque(self, track: Track, run: int) -> Array:
        other = np.sin(track.position[:, int(self.shape["from"])] + self.shape["phase"])
        return np.asarray(self.size * np.sin(track.position[:, self.joint]) * other)


class CurrentDeadBand(OutsideEffect):
    """A current loop that loses small currents. size: half the band, N m."""

    effect = "current_dead_band"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        band = torque_share(0.02, machine, joint)
        return cls(joint, band, 8 * band, "frozen")

    def read(self, torque: Array) -> Array:
        read, column = torque.copy(), torque[:, self.joint]
        read[:, self.joint] -= self.size * np.tanh(column / self.size) * np.exp(-((column / (2 * self.size)) ** 2))
        return read


class StickyPatches(OutsideEffect):
    """Friction within narrow patches of position: dents, dried grease."""

    effect = "sticky_patches"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        low, high = machine.range[:, joint]
        reach = 0.5 * min((high - low) / 2, 2.0)
        places = (low + high) / 2 + rng.uniform(-reach, reach, 3)
        shape = {f"p{index}": float(place) for index, place in enumerate(places)}
        level = torque_share(0.05, machine, joint)
        return cls(joint, level, 8 * level, "frozen", {**shape, "width": float(rng.uniform(0.03, 0.12))})

    def torque(self, track: Track, run: int) -> Array:
        position = track.position[:, self.joint]
        patches = [np.exp(-(((position - self.shape[f"p{index}"]) / self.shape["width"]) ** 4)) for index in range(3)]
        return np.asarray(self.size * np.maximum.reduce(patches) * smooth_sign(track.velocity[:, self.joint]))


OUTSIDE: tuple[type[OutsideEffect], ...] = (
    ViscousMap,
    FieldWeakening,
    QuadraticSensor,
    HoseHysteresis,
    FlexibleBase,
    Slosh,
    AccelerationFriction,
    ProductOfPositions,
    CurrentDeadBand,
    StickyPatches,
)
