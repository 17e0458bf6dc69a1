"""Hoses and cables: springs between a joint's two links, linear or stiffer the further they bend."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.term import CERTAIN, EveryJoint, Term, number
from problem.arm import Arm
from recordings.run import Array

RESTS = (0.25, 0.5, 0.75)  # of the travel: rest positions of a first look


@dataclass(frozen=True)
class LinearSpring(Term):
    """stiffness (q - rest), fitted as a q + b."""

    effect = "cable_stiffness"
    form = "linear"
    names = ("stiffness", "rest")

    def columns(self, scene: Scene) -> Array:
        """Position and a constant: neither alone is a spring."""
        return self._stacked(scene.motion.position[:, self.own], np.ones(len(scene.time)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Stiffness and rest position."""
        slope, constant = (float(value) for value in coefficients)
        return {"stiffness": slope, "rest": -constant / slope if slope else 0.0}

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        named = self.parameters(coefficients)
        rest = float(np.asarray(named["rest"]))
        sign = "+" if rest < 0 else "-"
        return f"tau_{self.joint} += {number(coefficients[0])} (q_{self.joint} {sign} {number(abs(rest))})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with stiffness and rest position."""
        stiffness, rest = float(parameters["stiffness"]), float(parameters["rest"])
        return cls.at(arm, joints[0]), np.array([stiffness, -stiffness * rest])


@dataclass(frozen=True)
class HardeningSpring(Term):
    """stiffness x + cubic x^3, x = q - rest; shape: the rest position."""

    effect = "cable_stiffness"
    form = "cubic"
    names = ("stiffness", "rest", "cubic")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Rest positions over the travel."""
        low = min(float(scene.motion.position[:, joint - 1].min()) for scene in scenes)
        high = max(float(scene.motion.position[:, joint - 1].max()) for scene in scenes)
        bounds = ((low - 0.5 * (high - low), high + 0.5 * (high - low)),)
        return [cls.at(arm, joint, shape=(low + share * (high - low),), bounds=bounds) for share in RESTS]

    def columns(self, scene: Scene) -> Array:
        """The bend and its cube."""
        bend = scene.motion.position[:, self.own] - self.shape[0]
        return self._stacked(bend, bend**3)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Stiffness at rest, rest position, and what the cube adds."""
        return {"stiffness": float(coefficients[0]), "rest": self.shape[0], "cubic": float(coefficients[1])}

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        if name == "cubic":
            return f"{'N.m' if self.kind == 'revolute' else 'N'}/{'rad' if self.kind == 'revolute' else 'm'}3"
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        linear, cubic = (number(value) for value in coefficients)
        return f"tau_{self.joint} += {linear} x + {cubic} x^3, x = q_{self.joint} - ({number(self.shape[0])})"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A cable that pushes, or gets softer."""
        spread = np.zeros(2) if covariance is None else CERTAIN * np.sqrt(np.maximum(np.diag(covariance), 0))
        return "a stiffness below zero" if np.any(coefficients + spread < 0) else None

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its three parameters."""
        rest = float(parameters["rest"])
        spring = cls.at(arm, joints[0], shape=(rest,), bounds=((rest - 1, rest + 1),))
        return spring, np.array([parameters["stiffness"], parameters["cubic"]], dtype=float)


CABLE_STIFFNESS = EveryJoint("cable_stiffness", (LinearSpring, HardeningSpring))
