"""Friction that changes from cold to warm over the time of a run, or of runs that follow one another."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import direction
from diagnosis.effects.term import Term, number
from problem.arm import Arm
from recordings.run import Array


@dataclass(frozen=True)
class Drift(Term):
    """(initial + (final - initial) w) f(qd), w from 0 cold to 1 warm; f: qd for viscous friction, else sgn qd.

    shape: the time constant, s. began: seconds of motion before each run, by name; a run that is not among
    them follows the others. Empty where each run begins cold.
    """

    effect = "friction_drift"
    names: ClassVar[tuple[str, ...]] = ("initial", "final", "time_constant")
    coulomb: ClassVar[bool] = False
    began: tuple[tuple[str, float], ...] = ()

    def warmth(self, scene: Scene) -> Array:
        """How far the joint has warmed, (samples,)."""
        before = dict(self.began).get(scene.run, max((seconds for _, seconds in self.began), default=0.0))
        return np.asarray(1 - np.exp(-(scene.time + before) / self.shape[0]))

    def columns(self, scene: Scene) -> Array:
        """Friction, and how it has changed."""
        friction = direction(scene, self.own) if self.coulomb else scene.motion.velocity[:, self.own]
        return self._stacked(friction, friction * self.warmth(scene))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Cold and warm friction, and the time constant."""
        cold, change = (float(value) for value in coefficients)
        return {"initial": cold, "final": cold + change, **dict(zip(("time_constant",), self.shape, strict=False))}

    def unit(self, name: str) -> str:
        """Unit of a coefficient or a level."""
        if self.coulomb and name in ("initial", "final"):
            return "N.m" if self.kind == "revolute" else "N"
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own = self.joint
        friction = f"sgn(qd_{own})" if self.coulomb else f"qd_{own}"
        cold, change = number(coefficients[0]), number(abs(coefficients[1]))
        sign = "-" if coefficients[1] < 0 else "+"
        return f"tau_{own} += ({cold} {sign} {change} {self._warming()}) {friction}"

    def _warming(self) -> str:
        return f"(1 - exp(-t/{number(self.shape[0])}))"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its parameters, for runs that begin cold."""
        constant = float(parameters["time_constant"])
        own = {"power": float(parameters["power"])} if "power" in cls.names else {}
        effect = cls.at(arm, joints[0], shape=(constant,), bounds=((constant / 10, constant * 10),), **own)
        return effect, levels(parameters)


@dataclass(frozen=True)
class ViscousDrift(Drift):
    """Viscous friction over the time."""

    form = "viscous over time"
    replaces = ("viscous_friction",)


@dataclass(frozen=True)
class CoulombDrift(Drift):
    """Coulomb friction over the time."""

    form = "Coulomb over time"
    coulomb = True
    replaces = ("coulomb_friction",)


def levels(parameters: Mapping[str, Any]) -> Array:
    """Coefficients of cold and warm friction."""
    cold, warm = float(parameters["initial"]), float(parameters["final"])
    return np.array([cold, warm - cold])
