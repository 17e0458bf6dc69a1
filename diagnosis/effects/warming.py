"""Friction that changes with the heat of its own work, or with a temperature that was recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.signal import lfilter

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.drift import Drift, levels
from diagnosis.effects.term import number
from problem.arm import Arm
from recordings.run import Array


@dataclass(frozen=True)
class HeatedFriction(Drift):
    """Viscous friction that follows the power which velocity dissipates, through a first order lag.

    power: mean of the squared speed over the recording, (rad/s)^2, at which w ends up at 1.
    """

    form = "viscous over heat"
    names = ("initial", "final", "time_constant", "power")
    replaces = ("viscous_friction",)
    power: float = 1.0

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Cold and warm friction, the time constant, and the power that keeps it warm."""
        return {**super().parameters(coefficients), "power": self.power}

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        speed = "rad" if self.kind == "revolute" else "m"
        return f"{speed}2/s2" if name == "power" else super().unit(name)

    def warmth(self, scene: Scene) -> Array:
        """Lagged power, from the heat that earlier runs have left, at their mean power."""
        decay = float(np.exp(-scene.step / self.shape[0]))
        power = scene.motion.velocity[:, self.own] ** 2 / self.power
        between = np.append(power[0], (power[1:] + power[:-1]) / 2)
        before = dict(self.began).get(scene.run, max((seconds for _, seconds in self.began), default=0.0))
        start = 1 - np.exp(-before / self.shape[0])
        return np.asarray(lfilter([1 - decay], [1, -decay], between, zi=[decay * start])[0])

    def _warming(self) -> str:
        return f"w, {number(self.shape[0])} dw/dt = qd_{self.joint}^2/{number(self.power)} - w"


@dataclass(frozen=True)
class ThermometerFriction(Drift):
    """Viscous friction that follows a thermometer; sensor: from 0. span: lowest and highest temperature."""

    form = "viscous over temperature"
    names = ("initial", "final", "sensor", "coldest", "warmest")
    replaces = ("viscous_friction",)
    sensor: int = 0
    span: tuple[float, float] = (20.0, 40.0)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Friction at both ends of the span, and which thermometer shows it (from 1)."""
        levels = super().parameters(coefficients)
        return levels | {"sensor": float(self.sensor + 1), "coldest": self.span[0], "warmest": self.span[1]}

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        return {"sensor": "1", "coldest": "degC", "warmest": "degC"}.get(name) or super().unit(name)

    def warmth(self, scene: Scene) -> Array:
        """Where the temperature stands in its span; zero in a run without thermometer."""
        if scene.temperature is None:
            return np.zeros(len(scene.time))
        low, high = self.span
        return np.asarray((scene.temperature[:, self.sensor] - low) / (high - low))

    def _warming(self) -> str:
        low, high = self.span
        return f"(T - {number(low)})/{number(high - low)}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its parameters."""
        span = (float(parameters["coldest"]), float(parameters["warmest"]))
        return cls.at(arm, joints[0], sensor=int(parameters["sensor"]) - 1, span=span), levels(parameters)
