"""The limits of a problem as distances that must not be negative."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.tangents import tangents
from problem.transforms import Array


@dataclass(frozen=True, eq=False)
class Rows:
    """Distances of positions, velocities and accelerations at all samples to their limits.

    First those to the upper limits, then those to the lower, each in halves of the range between the two;
    infinite where there is no limit. `margin` is the share of that half by which limits are drawn in, so that
    rounding breaks none.
    """

    problem: ExcitationProblem
    margin: float

    def distances(self, motion: Motion) -> Array:
        """Distances (rows,) of a motion (samples, joints); negative where a limit is broken."""
        values = np.stack([motion.position, motion.velocity, motion.acceleration])
        low, high, half = self._limits
        return np.concatenate([((high - values) / half).ravel(), ((values - low) / half).ravel()]) - self.margin

    def slopes(self, motion: Motion, point: Array, chosen: NDArray[np.intp]) -> Array:
        """Derivatives (chosen, dimension) of chosen distances with respect to the numbers of the point."""
        basis = tangents(self.problem.trajectory, motion, point, self.problem.times)
        each = np.moveaxis(basis / self._limits[2][:, None], 1, 0).reshape(len(point), -1)
        upper = chosen < each.shape[1]
        return np.asarray(np.where(upper, -1.0, 1.0)[:, None] * each[:, chosen % each.shape[1]].T)

    @cached_property
    def _limits(self) -> tuple[Array, Array, Array]:
        """Lower and upper limits and half of the range (1 where there is none), (3, 1, joints) each."""
        limits = self.problem.constraints.limits
        rates = np.array([[limit.velocity, limit.acceleration] for limit in limits]).T
        low = np.vstack([[limit.position[0] for limit in limits], -rates])[:, None]
        high = np.vstack([[limit.position[1] for limit in limits], rates])[:, None]
        return low, high, np.where(np.isfinite(high - low), (high - low) / 2, 1.0)
