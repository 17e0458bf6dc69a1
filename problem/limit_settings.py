"""Settings of limits: those of the robot file, or others in their place."""

from collections.abc import Sized
from typing import Annotated, Literal, TypeVar

import numpy as np
from annotated_types import Gt

from problem.arm import Arm, Limits
from problem.errors import InputError
from problem.limits import Workspace
from problem.settings import Settings

Positive = Annotated[float, Gt(0)]
Vector = tuple[float, float, float]
Range = tuple[float, float]
PerJoint = Positive | tuple[Positive, ...]
T = TypeVar("T")


class LimitSettings(Settings):
    """Limits in place of the robot file's: one number for all joints, or one a joint; rad (m), s, N m (N).

    position: `robot` keeps the file's; a list has one [lower, upper] a joint, or null where there is none.
    torque: `none` drops the file's.
    """

    position: Literal["robot"] | tuple[Range | None, ...] = "robot"
    velocity: PerJoint | None = None
    acceleration: PerJoint | None = None
    torque: PerJoint | Literal["none"] | None = None

    def of(self, arm: Arm) -> tuple[Limits, ...]:
        """The limits in force, one a joint. Raises InputError for a wrong number of entries or order."""
        rates = [self._rates(arm, name) for name in ("velocity", "acceleration", "torque")]
        return tuple(Limits(*entries) for entries in zip(self._positions(arm), *rates, strict=True))

    def _positions(self, arm: Arm) -> list[Range]:
        if self.position == "robot":
            return [joint.limits.position for joint in arm.joints]
        given: list[Range] = [(-np.inf, np.inf) if limits is None else limits for limits in self.position]
        for low, high in given:
            if low >= high:
                raise InputError(f"limits.position should be [lower, upper], so [{high}, {low}]")
        _check_count("limits.position", given, arm)
        return given

    def _rates(self, arm: Arm, name: str) -> list[float]:
        given = getattr(self, name)
        if given is None:
            return [getattr(joint.limits, name) for joint in arm.joints]
        if given == "none":
            return [np.inf] * len(arm)
        return list(one_a_joint(f"limits.{name}", given, arm))


class WorkspaceSettings(Settings):
    """Largest distance from the base, floor, and two opposite corners of a keep-out box; base frame, m."""

    reach: Positive | None = None
    floor: float | None = None
    keep_out: tuple[Vector, Vector] | None = None

    def build(self, tool: Vector) -> Workspace:
        """The workspace for the links' frames and a tool point in the last link's frame, m."""
        given = {name: value for name, value in self.model_dump().items() if value is not None}
        return Workspace(**given, tool=tool)


def one_a_joint(name: str, given: T | tuple[T, ...], arm: Arm) -> tuple[T, ...]:
    """The given value for each joint. Raises InputError if a list has not one entry a joint."""
    if not isinstance(given, tuple):
        return (given,) * len(arm)
    _check_count(name, given, arm)
    return given


def _check_count(name: str, given: Sized, arm: Arm) -> None:
    if len(given) != len(arm):
        raise InputError(f"{name} should have {len(arm)} entries, one a joint of '{arm.name}', has {len(given)}")
