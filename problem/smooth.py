"""What a search with derivatives sees of an excitation problem: a smooth criterion, and the distances to all limits.

At a good trajectory several singular values meet at either end of the spectrum, and the condition number has no
gradient. The largest singular value and the inverse of the smallest are therefore replaced by p-norms of the whole
spectrum, ||sigma||_p and ||1 / sigma||_p, which have one; their limits for large p are the two themselves.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from problem.arm import Limits
from problem.feasible import FeasibleFourier
from problem.fitness import Criterion
from problem.gradient import DifferentiableExcitation, SpectralFunction, motion_of, spectral_gradient_along, tangents
from problem.motion import Motion


def smooth_criterion(criterion: Criterion, power: float) -> SpectralFunction:
    """The criterion with p-norms in place of both ends of the spectrum; eq. 44 as its logarithm.

    log(||sigma||_p ||1 / sigma||_p) exceeds log(cond) by at most 2 log(n) / p. D-optimality is smooth as it is.
    """

    def function(values: Array) -> tuple[float, Array]:
        large, small = (values / values[0]) ** power, (values[-1] / values) ** power
        top = np.log(values[0]) + np.log(large.sum()) / power  # log ||sigma||_p
        bottom = -np.log(values[-1]) + np.log(small.sum()) / power  # log ||1 / sigma||_p
        top_slope, bottom_slope = large / large.sum() / values, -small / small.sum() / values
        if criterion.kind == "d_optimality":
            return float(-2.0 * np.log(values).mean()), -2.0 / (len(values) * values)
        if criterion.kind == "e_optimality":
            return float(-np.exp(-bottom)), np.exp(-bottom) * bottom_slope
        weights = np.array([1.0, criterion.weight_smallest, criterion.weight_largest])
        terms = np.log(weights) + np.array([top + bottom, bottom, top])
        shares = np.exp(terms - terms.max())
        condition, smallest, largest = shares / shares.sum()
        value = terms.max() + np.log(shares.sum())
        return float(value), (condition + largest) * top_slope + (condition + smallest) * bottom_slope

    def guarded(values: Array) -> tuple[float, Array]:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a weight of 0; a spectrum with a zero
            return function(values)

    return guarded


@dataclass(frozen=True, eq=False)
class LimitRows:
    """Distances of positions, velocities and accelerations at all samples to their limits.

    First to the upper limits, then to the lower ones, in units of half of the range between the two; infinite where
    there is no limit, or where the search space keeps it. Then the constraints' own margins, of parts that must not
    come close.
    """

    problem: DifferentiableExcitation

    def distances(self, motion: Motion) -> Array:
        """Distances (rows,) of a motion (samples, joints); negative where a limit is broken."""
        values = np.stack([motion.position, motion.velocity, motion.acceleration])
        low, high, half = self._limits
        own = self.problem.constraints.margins(motion.position)
        return np.concatenate([((high - values) / half).ravel(), ((values - low) / half).ravel(), own])

    def slopes(self, motion: Motion, basis: Array, chosen: NDArray[np.intp]) -> Array:
        """Derivatives (chosen, dimension) of chosen distances along the tangents (3, dimension, samples, joints)."""
        each = np.moveaxis(basis / self._limits[2][:, None], 1, 0).reshape(basis.shape[1], -1)
        limits, own = chosen[chosen < 2 * each.shape[1]], chosen[chosen >= 2 * each.shape[1]]
        signs = np.where(limits < each.shape[1], -1.0, 1.0)[:, None]
        samples, slopes = self.problem.constraints.margin_slopes(motion.position, own - 2 * each.shape[1])
        along = np.einsum("rj,drj->rd", slopes, basis[0][:, samples])
        return np.concatenate([signs * each[:, limits % each.shape[1]].T, along])

    @cached_property
    def _limits(self) -> tuple[Array, Array, Array]:
        """Lower and upper limits and half of the range (1 where there is none), (3, 1, joints) each."""
        limits = self.problem.constraints.limits
        if isinstance(self.problem.trajectory, FeasibleFourier):  # kept by construction: nothing is left to be watched
            limits = (Limits(),) * len(limits)
        rates = np.array([[limit.velocity, limit.acceleration] for limit in limits]).T
        low = np.vstack([[limit.position[0] for limit in limits], -rates])[:, None]
        high = np.vstack([[limit.position[1] for limit in limits], rates])[:, None]
        return low, high, np.where(np.isfinite(high - low), (high - low) / 2, 1.0)


def differentiate(problem: DifferentiableExcitation, rows: LimitRows, point: Array, question: Question) -> Derivatives:
    """The answer of an excitation problem to a question about a point (dimension,)."""
    with np.errstate(all="ignore"):  # a line search may leave what the arm can reach
        motion = motion_of(problem, point)
        basis = tangents(problem.trajectory, motion, point, problem.times)
        smooth = smooth_criterion(problem.criterion, question.sharpness)
        value, slope = spectral_gradient_along(problem, motion, basis, smooth)
        margins = rows.distances(motion)
        near = np.flatnonzero(margins < question.within)
        watched = np.union1d(question.watched, near).astype(np.intp)
        return Derivatives(value, slope, margins, watched, rows.slopes(motion, basis, watched))
