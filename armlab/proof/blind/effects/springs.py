"""Effects that depend on position: springs, hoses, ripple."""

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues, torque_share
from armlab.proof.blind.engine import Track
from problem.motion import Motion
from problem.regressor import rigid_body_torque

MEAN_TOOTH = float(np.exp(-2.0) * np.i0(2.0))  # of exp(2 (sin x - 1)) over a turn


def gravity_wave(machine: Machine, joint: int) -> tuple[float, float]:
    """Amplitude (N m) and phase of the gravity torque A sin(q + phase) as this joint alone turns."""
    angles = np.linspace(-np.pi, np.pi, 24, endpoint=False)
    position = np.zeros((len(angles), machine.joints))
    position[:, joint] = angles
    still = np.zeros_like(position)
    torque = rigid_body_torque(machine.arm, Motion(position, still, still))[:, joint]
    sine, cosine = 2 * np.mean(torque * np.sin(angles)), 2 * np.mean(torque * np.cos(angles))
    return float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine))


class Compensator(HiddenEffect):
    """tau = A sin(q + p), a spring against gravity; other forms: a coil spring on a linkage, a gas cylinder.

    size: A, the largest torque over a turn, N m.
    """

    effect, forms = "gravity_compensator", ("sine", "linkage", "gas")
    units: ClassVar = {"amplitude": "N.m", "phase": "rad"}

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """Joints whose gravity torque exceeds 3 % of the rating."""
        loads = [gravity_wave(machine, joint)[0] for joint in range(machine.joints)]
        return [joint for joint, load in enumerate(loads) if load > 0.03 * machine.rating[joint]]

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Balances about half of the gravity torque, mounted up to 0.2 rad off."""
        load, phase = gravity_wave(machine, joint)
        shape = {"phase": phase + np.pi + float(rng.uniform(-0.2, 0.2)), "crank": float(rng.uniform(0.2, 0.4))}
        return cls(joint, 0.5 * load, 1.2 * load, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"amplitude": self.size, "phase": float(np.angle(np.exp(1j * self.shape["phase"])))}

    def torque(self, track: Track, run: int) -> Array:
        return self.size * self._unit(track.position[:, self.joint] + self.shape["phase"])

    def _unit(self, angle: Array) -> Array:
        if self.form == "sine":
            return np.asarray(np.sin(angle))
        fine = np.linspace(-np.pi, np.pi, 361)
        return np.asarray(self._pull(angle) / np.abs(self._pull(fine)).max())

    def _pull(self, angle: Array) -> Array:
        """Force along a rod from a crank to a fixed point at distance 1, times its lever."""
        crank = self.shape["crank"]
        length = np.sqrt(1 + crank**2 + 2 * crank * np.cos(angle))
        force = length - 0.3 if self.form == "linkage" else 0.8 * (1.6 / (2.6 - length)) ** 1.2
        return np.asarray(force * crank * np.sin(angle) / length)


class Cable(HiddenEffect):
    """tau = k (q - r); other form: tau = k ((q - r) + b (q - r)^3), a hose that stiffens. size: k, N m/rad."""

    effect, forms = "cable_stiffness", ("linear", "stiffening")
    units: ClassVar = {"stiffness": "N.m/rad", "rest": "rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        low, high = machine.range[:, joint]
        rest = (low + high) / 2 + rng.uniform(-0.4, 0.4)
        shape = {"rest": float(rest), "cubic": float(rng.uniform(0.2, 0.8))}
        stiffness = torque_share(0.01, machine, joint)
        return cls(joint, stiffness, 10 * stiffness, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"stiffness": self.size, "rest": self.shape["rest"]}

    def torque(self, track: Track, run: int) -> Array:
        bent = track.position[:, self.joint] - self.shape["rest"]
        cubic = self.shape["cubic"] * bent**3 if self.form == "stiffening" else 0.0
        return np.asarray(self.size * (bent + cubic))


class Ripple(HiddenEffect):
    """tau = A sin(n q + p); other form: narrow teeth of the same order that do no work over a turn. size: A, N m."""

    effect, forms = "torque_ripple", ("sine", "teeth")
    units: ClassVar = {"order": "1/rev", "amplitude": "N.m", "phase": "rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Orders of the poles of direct drives and of the teeth of last gear stages."""
        shape = {"order": float(rng.integers(6, 60)), "phase": float(rng.uniform(-np.pi, np.pi))}
        amplitude = torque_share(0.008, machine, joint)
        return cls(joint, amplitude, 10 * amplitude, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"order": self.shape["order"], "amplitude": self.size, "phase": self.shape["phase"]}

    def torque(self, track: Track, run: int) -> Array:
        angle = self.shape["order"] * track.position[:, self.joint] + self.shape["phase"]
        if self.form == "sine":
            return np.asarray(self.size * np.sin(angle))
        return np.asarray(self.size * (np.exp(2 * (np.sin(angle) - 1)) - MEAN_TOOTH))
