"""Faults of the measurement: gains, offsets, delays, clipping; and a push from outside."""

from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues, torque_share
from armlab.proof.blind.engine import Track

SATURATION_SHARPNESS = 8  # of saturation: the larger, the sharper


class TorqueGain(HiddenEffect):
    """tau is read as (1 + e) tau; other form: less error below a knee. size: |e|."""

    effect, forms = "torque_gain_error", ("factor", "bent")
    units: ClassVar = {"gain": "1"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"direction": float(rng.choice([-1, 1])), "knee": float(rng.uniform(-0.2, 0.2)), "peak": 0.0}
        return cls(joint, 0.06, 0.5, cls.draw_form(rng), shape)

    def with_peak_torque(self, peak: Array) -> Self:
        """The knee is a share of the largest torque."""
        return replace(self, shape={**self.shape, "peak": float(peak[self.joint])})

    def parameters(self) -> ParameterValues:
        return {"gain": 1 + self.shape["direction"] * self.size}

    def read(self, torque: Array) -> Array:
        """Below its knee, the bent form has six tenths of the error."""
        read, error = torque.copy(), self.shape["direction"] * self.size
        own, knee = torque[:, self.joint], self.shape["knee"] * self.shape["peak"]
        bent = 0.6 * own + 0.4 * (np.maximum(own - knee, 0) - max(-knee, 0.0))
        read[:, self.joint] += error * (own if self.form == "factor" else bent)
        return read


class Offset(HiddenEffect):
    """tau is read as tau + o; other form: o creeps by a tenth of itself during a run. size: |o|, N m."""

    effect, forms = "torque_offset", ("constant", "creeping")
    units: ClassVar = {"offset": "N.m"}
    blurred = ("offset",)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        offset = torque_share(0.01, machine, joint)
        return cls(joint, offset, 10 * offset, cls.draw_form(rng), {"direction": float(rng.choice([-1, 1]))})

    def parameters(self) -> ParameterValues:
        return {"offset": self.shape["direction"] * self.size}

    def read(self, torque: Array) -> Array:
        read = torque.copy()
        creep = np.linspace(-0.05, 0.05, len(torque)) if self.form == "creeping" else 0.0
        read[:, self.joint] += self.shape["direction"] * self.size * (1 + creep)
        return read


class Delay(HiddenEffect):
    """All torque channels are stamped later than the motion; other form: each by its own time. size: s."""

    effect, forms = "time_delay", ("shift", "uneven shift")
    where = "robot"
    units: ClassVar = {"seconds": "s"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 4e-3, 5e-2, cls.draw_form(rng))

    def parameters(self) -> ParameterValues:
        return {"seconds": self.size}

    def lag(self, joints: int) -> Array:
        """The uneven form differs by a tenth from the first joint to the last."""
        spread = np.linspace(0.9, 1.1, joints) if self.form == self.forms[1] else np.ones(joints)
        return np.asarray(self.size * spread)


class Skew(HiddenEffect):
    """One torque channel is stamped later, or earlier, than the others. size: s."""

    effect, forms = "channel_skew", ("shift",)
    units: ClassVar = {"seconds": "s"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 4e-3, 5e-2, cls.draw_form(rng), {"direction": float(rng.choice([-1, 1]))})

    def parameters(self) -> ParameterValues:
        return {"seconds": self.shape["direction"] * self.size}

    def lag(self, joints: int) -> Array:
        lag = np.zeros(joints)
        lag[self.joint] = self.shape["direction"] * self.size
        return lag


class EncoderOffset(HiddenEffect):
    """q is read as q + o: the zero of a joint is elsewhere. size: |o|, rad."""

    effect, forms = "encoder_offset", ("constant",)
    units: ClassVar = {"offset": "rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.02, 0.08, cls.draw_form(rng), {"direction": float(rng.choice([-1, 1]))})

    def parameters(self) -> ParameterValues:
        return {"offset": self.shape["direction"] * self.size}

    def shift(self, joints: int) -> Array:
        shift = np.zeros(joints)
        shift[self.joint] = self.shape["direction"] * self.size
        return shift


class Saturation(HiddenEffect):
    """tau is read as at most L; other form: it bends towards L. size: share of the highest torque that is lost."""

    effect, forms = "torque_saturation", ("clip", "bend")
    units: ClassVar = {"limit": "N.m"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.15, 0.6, cls.draw_form(rng), {"peak": torque_share(1.0, machine, joint)})

    def with_peak_torque(self, peak: Array) -> Self:
        """The limit is a share of the largest torque."""
        return replace(self, shape={"peak": float(peak[self.joint])})

    def parameters(self) -> ParameterValues:
        return {"limit": self.limit}

    @property
    def limit(self) -> float:
        """Largest torque that the channel can read, N m."""
        kept = 1 - self.size
        if self.form == "bend":  # so that the highest torque is read as that share of itself
            kept = 1 / (kept**-SATURATION_SHARPNESS - 1) ** (1 / SATURATION_SHARPNESS)
        return self.shape["peak"] * kept

    def read(self, torque: Array) -> Array:
        read, limit = torque.copy(), self.limit
        column = torque[:, self.joint]
        if self.form == "bend":
            bent = (1 + (np.abs(column) / limit) ** SATURATION_SHARPNESS) ** (1 / SATURATION_SHARPNESS)
            read[:, self.joint] = column / bent
        else:
            read[:, self.joint] = np.clip(column, -limit, limit)
        return read


class Contact(HiddenEffect):
    """A push during one run: half a sine; other forms: a plateau with ramps, a Gaussian. size: peak, N m."""

    effect, forms = "external_contact", ("half sine", "plateau", "gauss")
    units: ClassVar = {"start": "s", "end": "s", "peak": "N.m"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Takes half a second to two seconds, in the first or second run."""
        start, length = rng.uniform(1.5, 6.5), rng.uniform(0.5, 2.0)
        shape = {
            "start": float(start),
            "end": float(start + length),
            "run": float(rng.integers(0, 2)),
            "direction": float(rng.choice([-1, 1])),
        }
        peak = torque_share(0.06, machine, joint)
        return cls(joint, peak, 5 * peak, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        peak = self.shape["direction"] * self.size
        return {"start": self.shape["start"], "end": self.shape["end"], "peak": peak}

    def torque(self, track: Track, run: int) -> Array:
        if run != int(self.shape["run"]):
            return np.zeros(len(track.time))
        share = (track.time - self.shape["start"]) / (self.shape["end"] - self.shape["start"])
        inside = (share > 0) & (share < 1)
        bump = {
            "half sine": np.sin(np.pi * share),
            "plateau": np.clip(5 * np.minimum(share, 1 - share), 0, 1),
            "gauss": np.exp(-(((share - 0.5) / 0.17) ** 2)),
        }[self.form]
        return np.asarray(self.shape["direction"] * self.size * np.where(inside, bump, 0.0))
