"""An arm whose base does not stand upright: gravity in another direction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Candidate, Family, Scene, Value
from diagnosis.effects.sensitivity import by_gravity
from diagnosis.effects.term import Term, number, restored_by
from problem.arm import Arm
from recordings.run import Array

STEEPEST = 20.0  # degrees: more is no tilt but another way to mount the arm


@dataclass(frozen=True)
class BaseTilt(Term):
    """Gravity along two directions across the nominal one.

    nominal: gravity of the robot file, across: the two directions; all in the base frame.
    """

    effect = "base_tilt"
    names = ("gravity",)
    follows_model = True
    nominal: tuple[float, ...] = (0.0, 0.0, -9.81)
    across: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect of the whole robot."""
        first, second = _across(np.array(arm.gravity))
        across = (tuple(first.tolist()), tuple(second.tolist()))
        return cls(None, (), tuple(range(len(arm))), nominal=arm.gravity, across=across, **details)

    def columns(self, scene: Scene) -> Array:
        """Torque of one m/s2 along each direction."""
        return np.stack([by_gravity(scene, np.array(direction)) for direction in self.across], axis=-1)

    def gravity(self, coefficients: Array) -> Array:
        """Gravity in the base frame, of its nominal strength, (3,), m/s2."""
        nominal, sideways = np.array(self.nominal), coefficients @ np.array(self.across)
        strength = np.linalg.norm(nominal)
        left = np.sqrt(max(1 - float(np.linalg.norm(sideways) / strength) ** 2, 0.0))
        return np.asarray(left * nominal + sideways)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Gravity in the base frame."""
        return {"gravity": tuple(self.gravity(coefficients).tolist())}

    def equation(self, coefficients: Array) -> str:
        """Gravity, and the angle to the nominal one."""
        place = ", ".join(number(value) for value in self.gravity(coefficients))
        return f"gravity = ({place}) m/s2, tilted by {number(self.degrees(coefficients))} degrees"

    def degrees(self, coefficients: Array) -> float:
        """The tilt."""
        sine = np.linalg.norm(coefficients) / np.linalg.norm(self.nominal)
        return float(np.degrees(np.arcsin(min(float(sine), 1.0))))

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A base that would fall over."""
        return f"a tilt of more than {STEEPEST:g} degrees" if self.degrees(coefficients) > STEEPEST else None

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The tilt with a vector of gravity."""
        tilt = cls.at(arm, 0)
        return tilt, np.array(tilt.across) @ np.array(parameters["gravity"], dtype=float)


@dataclass(frozen=True)
class TiltFamily(Family):
    """One place: the whole robot."""

    effect: str = "base_tilt"

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """The tilt."""
        return [[BaseTilt.at(arm, 0)]]

    def restored(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The tilt with a vector of gravity."""
        return restored_by((BaseTilt,), arm, joints, parameters, form)


def _across(gravity: Array) -> tuple[Array, Array]:
    """Two directions across gravity: x and y of the base, where gravity is along z."""
    strength = np.linalg.norm(gravity)
    down = gravity / strength if strength else np.array([0.0, 0.0, -1.0])
    axis = np.eye(3)[1 if abs(down[0]) > 0.9 else 0]
    first = axis - (axis @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(-down, first)


BASE_TILT = TiltFamily()
