"""Coordinates that are shifted at random: nothing changes but where the origin lies.

An algorithm that is drawn to the origin of coordinates gains or loses by the choice of the frame; one that is
not finds the same trajectories in every frame.
"""

from dataclasses import dataclass

import numpy as np

from problem.contract import Evaluation, Problem
from problem.transforms import Array

SPAN = 2.0  # widths of the box by which the origin may move


@dataclass(frozen=True, eq=False)
class ShiftedProblem:
    """A problem in coordinates x + shift (dimension,)."""

    problem: Problem
    shift: Array
    name: str

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return self.problem.lower + self.shift

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return self.problem.upper + self.shift

    def evaluate(self, points: Array) -> Evaluation:
        """Results of the points (points, dimension) in the problem's own coordinates."""
        return self.problem.evaluate(points - self.shift)


def in_random_frame(problem: Problem, seed: int) -> ShiftedProblem:
    """The problem with its origin moved by up to two widths of the box in each coordinate."""
    shift = np.random.default_rng(seed).uniform(-SPAN, SPAN, len(problem.lower))
    return ShiftedProblem(problem, shift * (problem.upper - problem.lower), f"{problem.name}-frame-{seed}")
