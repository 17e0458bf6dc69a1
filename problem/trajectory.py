"""What every family of trajectories offers: a box of numbers, and the motion that a point in it stands for."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from problem.motion import Motion
from problem.native import lib, pointer
from problem.transforms import Array


@dataclass(frozen=True, eq=False)
class Excitation:
    """Motions of a population of points.

    motion: (points, samples, joints). overreach: (points,), m: how far a path leaves what the arm can reach;
    where it is positive, the motion is only a stand-in.
    """

    motion: Motion
    overreach: Array


class Trajectory(Protocol):
    """A family of trajectories with `lower` and `upper` (dimension,) bounds of its numbers."""

    @property
    def lower(self) -> Array:
        """Lower bounds of the numbers, (dimension,)."""
        ...

    @property
    def upper(self) -> Array:
        """Upper bounds of the numbers, (dimension,)."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """A name for each number."""
        ...

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions of points (points, dimension) at the given instants (samples,), s."""
        ...


def instants(duration: float, samples: int) -> Array:
    """Evenly spaced instants from 0 to `duration`, both included, s."""
    return np.linspace(0.0, duration, samples)


def series(basis: Array, coefficients: Array) -> Array:
    """Sums of basis functions, the same to the bit in any batch.

    basis: (samples, terms); coefficients: (points, joints, terms). Returns (points, samples, joints).
    """
    basis = np.ascontiguousarray(basis)
    coefficients = np.ascontiguousarray(coefficients)
    points, joints, terms = coefficients.shape
    out = np.empty((points, len(basis), joints))
    lib.series(points, len(basis), joints, terms, pointer(basis), pointer(coefficients), pointer(out))
    return out
