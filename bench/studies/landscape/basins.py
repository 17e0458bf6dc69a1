"""Basins: where descents from many starts end, and which ends are the same trajectory up to symmetry.

Two motions are the same up to what leaves the condition number of every trajectory of the arm as it is: the direction
of time, another mean of a joint about the vertical, and joints that turn the other way round. Which of these an arm has
is found by trying them. A periodic series may also begin at another instant; its limits and its condition number hold
at samples alone, so this changes the number a little.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from algorithms.contract import Box, uniform_points
from algorithms.sqp import SQPParams, descend
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from armlab.common.streams import named_generator
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.trajectories import JointFourier, sample_instants

SHARPNESS = 100.0  # of the criterion at an end: at most 2 log(n) / 100 above log(cond)
DESCENT = SQPParams(powers=(10.0, SHARPNESS), steps=100, cuts=4, watch=0.3, tolerance=1e-8)
POLISH = SQPParams(powers=(SHARPNESS,), steps=100, cuts=4, watch=0.3, tolerance=1e-8)
DRAWS = 50  # random points, the best of which is a start, as the row `sqp` has them
INSTANTS = 1001  # at which motions are compared
SAME_MOTION = 0.05  # relative distance of motions
SAME_VALUE = 0.01  # relative difference of condition numbers
_SYMMETRY_TOLERANCE = 1e-6  # relative, of condition numbers
_TURN = 0.3  # rad, by which the mean of a joint is moved
_TRIED_MOTIONS = 3


@dataclass(frozen=True)
class End:
    """The end of a descent: point (dimension,), its condition number, and whether it keeps every limit.

    gradients: points whose derivatives were asked.
    """

    point: tuple[float, ...]
    value: float
    feasible: bool
    gradients: int


def random_start(problem: ExcitationProblem, name: str, number: int) -> Array:
    """The best of DRAWS random points, (dimension,); name and number decide which."""
    rng = named_generator("landscape", "descent", name, number)
    points = uniform_points(DRAWS, Box(problem.lower, problem.upper), rng)
    return np.asarray(points[np.argmin(problem.evaluate(points).fitness)])


def find_end(problem: ExcitationProblem, start: Array, params: SQPParams = DESCENT) -> End:
    """The last feasible point on a descent from a start (dimension,), else its last point."""
    asked = 0

    def differentiate(point: Array, question: Question) -> Derivatives:
        nonlocal asked
        asked += 1
        return problem.differentiate(point, question)

    points = np.array(list(descend(params, differentiate, Box(problem.lower, problem.upper), start)))
    found = problem.evaluate(points)
    kept = np.flatnonzero((found.violation == 0) & np.isfinite(found.value))
    chosen = int(kept[-1]) if len(kept) else len(points) - 1
    return End(tuple(map(float, points[chosen])), float(found.value[chosen]), bool(len(kept)), asked)


@dataclass(frozen=True, eq=False)
class Symmetry:
    """What leaves every condition number as it is.

    signs: (kinds, joints), joints that turn the other way round. reversible: the direction of time. turning: (joints,),
    joints whose mean does not matter. periodic: the series may begin at another instant.
    """

    signs: Array
    reversible: bool
    turning: NDArray[np.bool_]
    periodic: bool

    def images(self, positions: Array) -> Array:
        """All images (images, instants, joints) of positions (instants, joints), without those of other beginnings."""
        each = self.signs[:, None, :] * positions
        return np.concatenate([each, each[:, ::-1]]) if self.reversible else each

    def distance(self, one: Array, other: Array) -> float:
        """Relative distance of positions (instants, joints), the least over all images of the other one."""
        one, images = self._without_means(one), self.images(self._without_means(other))
        power = (one**2).sum() + (images**2).sum(axis=(1, 2))
        if self.periodic:  # the last instant is the first one
            spectra = np.fft.rfft(images[:, :-1], axis=1).conj() * np.fft.rfft(one[:-1], axis=0)
            product_sums = np.fft.irfft(spectra.sum(axis=2), len(one) - 1, axis=1).max(axis=1)
            power = (one[:-1] ** 2).sum() + (images[:, :-1] ** 2).sum(axis=(1, 2))
        else:
            product_sums = (images * one).sum(axis=(1, 2))
        squared = np.maximum(power - 2 * product_sums, 0.0).min()
        swings = [((each - each.mean(axis=0)) ** 2).sum() for each in (one, images[0])]
        return float(np.sqrt(squared / max(np.mean(swings), np.finfo(float).tiny)))

    def _without_means(self, positions: Array) -> Array:
        return np.asarray(positions - np.where(self.turning, positions.mean(axis=0), 0.0))


def find_symmetry(problem: ExcitationProblem, points: Array) -> Symmetry:
    """The symmetries of a problem's arm, tried on the motions of some points (n, dimension) within reach."""
    found = problem.trajectory.motions(points, problem.times)
    motion = found.motion.select(found.overreach == 0)
    motion = Motion(*(each[:_TRIED_MOTIONS] for each in (motion.position, motion.velocity, motion.acceleration)))
    values = _condition(problem, motion)

    def same(position: Array, velocity: Array, acceleration: Array) -> bool:
        tried = _condition(problem, Motion(position, velocity, acceleration))
        return bool(np.allclose(tried, values, rtol=_SYMMETRY_TOLERANCE, atol=0))

    kinds = [
        signs
        for signs in product((1.0, -1.0), repeat=motion.joints)
        if same(motion.position * signs, motion.velocity * signs, motion.acceleration * signs)
    ]
    moved = [
        same(motion.position + _TURN * axis, motion.velocity, motion.acceleration) for axis in np.eye(motion.joints)
    ]
    reverse = same(motion.position[:, ::-1], -motion.velocity[:, ::-1], motion.acceleration[:, ::-1])
    series = problem.trajectory
    return Symmetry(np.array(kinds), reverse, np.array(moved), isinstance(series, JointFourier) and not series.rest)


def _condition(problem: ExcitationProblem, motion: Motion) -> Array:
    return problem.spectrum(motion).condition_number


@dataclass(frozen=True, eq=False)
class Ends:
    """Feasible ends of descents: values (n,), distances of the motions up to symmetry (n, n)."""

    values: Array
    distances: Array

    @staticmethod
    def of(problem: ExcitationProblem, ends: list[End], symmetry: Symmetry) -> "Ends":
        """The feasible ones of all ends."""
        kept = [end for end in ends if end.feasible]
        instants = sample_instants(problem.duration, INSTANTS)
        points = np.array([end.point for end in kept]).reshape(len(kept), -1)
        positions = problem.trajectory.motions(points, instants).motion.position if kept else np.zeros((0, 1, 1))
        distances = np.zeros((len(kept), len(kept)))
        for i in range(len(kept)):
            for j in range(i):
                distances[i, j] = distances[j, i] = symmetry.distance(positions[i], positions[j])
        return Ends(np.array([end.value for end in kept]), distances)

    def basins(self, share: float = 1.0) -> NDArray[np.intp]:
        """Number of the basin of each end, (n,), from 0; share: of both tolerances."""
        if len(self.values) < 2:
            return np.zeros(len(self.values), dtype=np.intp)
        apart = np.abs(np.subtract.outer(np.log(self.values), np.log(self.values))) / np.log1p(share * SAME_VALUE)
        scaled = np.maximum(self.distances / (share * SAME_MOTION), apart)
        tree = linkage(squareform(scaled, checks=False), "average")
        return np.asarray(fcluster(tree, 1.0, "distance") - 1, dtype=np.intp)

    @cached_property
    def count(self) -> int:
        """Basins that were met."""
        return len(np.unique(self.basins()))

    def meeting_share(self, share: float = 1.0) -> float:
        """Share of pairs of descents that end in the same basin (Simpson 1949); NaN for fewer than two ends."""
        sizes = np.bincount(self.basins(share))
        n = len(self.values)
        return float((sizes * (sizes - 1)).sum() / (n * (n - 1))) if n > 1 else float("nan")
