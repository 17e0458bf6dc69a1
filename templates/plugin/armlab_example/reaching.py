"""Reach a point with a planar arm whose links are one metre long, and keep every joint angle small."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge

from armlab.common.arrays import Array
from armlab.common.settings import Settings
from problem.contract import Evaluation, Problem


@dataclass(frozen=True)
class Reaching:
    """value: distance to the target, m. violation: how far the joint angles exceed their limit, rad, in sum."""

    name: str
    joints: int
    target: tuple[float, float]
    angle_limit: float

    @property
    def lower(self) -> Array:
        return np.full(self.joints, -np.pi)

    @property
    def upper(self) -> Array:
        return np.full(self.joints, np.pi)

    def evaluate(self, points: Array) -> Evaluation:
        angles = np.cumsum(points, axis=1)
        x, y = np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)
        distance = np.hypot(x - self.target[0], y - self.target[1])
        violation = np.maximum(np.abs(points) - self.angle_limit, 0.0).sum(axis=1)
        return Evaluation(fitness=distance + 10.0 * violation, value=distance, violation=violation)


class ReachingSettings(Settings):
    """What a configuration may set; unknown keys and wrong types are refused for you."""

    preset: Literal["reaching"] = "reaching"
    joints: Annotated[int, Ge(1)] = 6
    target: tuple[float, float] = (2.0, 3.0)
    angle_limit: Annotated[float, Ge(0)] = 1.0

    def build(self) -> Problem:
        """The problem; called once a process."""
        return Reaching("reaching", self.joints, self.target, self.angle_limit)
