"""Descent from one point to a local optimum within all limits, by sequential quadratic programming on a smoothed
condition number.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.excitation import ExcitationProblem
from problem.gradient import SpectralFunction, spectral_gradient, tangents
from problem.motion import Motion


@dataclass(frozen=True, eq=False)
class LimitRows:
    """Distances of positions, velocities and accelerations at all samples to their limits.

    First to the upper limits, then to the lower ones, in units of half of the range between the two; infinite where
    there is no limit. margin: share of that half by which the limits are tightened, so that rounding breaks none.
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


def smooth_log_condition(power: float) -> SpectralFunction:
    """log(||sigma||_p ||1 / sigma||_p), which exceeds log(cond) by at most 2 log(n) / p.

    At a good trajectory several singular values meet at either end of the spectrum, and the condition number has no
    gradient. This function of the whole spectrum has one, and its limit for large p is the condition number.
    """

    def function(values: Array) -> tuple[float, Array]:
        large, small = (values / values[0]) ** power, (values[-1] / values) ** power
        value = np.log(values[0] / values[-1]) + (np.log(large.sum()) + np.log(small.sum())) / power
        return float(value), (large / large.sum() - small / small.sum()) / values

    return function


SMOOTHING_POWERS = (10.0, 100.0, 1000.0, 10000.0)  # of the smoothed condition number, one after the other
MAX_CUTS = 6  # times that broken limits are added to the watched ones, for each power
MAX_STEPS = 100
SOLVER_TOLERANCE = 1e-10
WATCHED_DISTANCE = 0.05  # distances below this are watched from the start
LIMIT_MARGIN = 1e-9
_OUT_OF_REACH_VALUE = 1e3  # log of a condition number: where a line search leaves what the arm can reach


@dataclass(frozen=True, eq=False)
class SearchEnd:
    """The end of a search: point (dimension,), its condition number and violation, and the effort."""

    point: Array
    value: float
    violation: float
    evaluations: int = 0
    gradients: int = 0

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation == 0.0 and bool(np.isfinite(self.value))

    def better_than(self, other: "SearchEnd | None") -> bool:
        """Whether this end may replace the other one in a record."""
        return self.feasible and (other is None or not other.feasible or self.value < other.value)


def evaluate_point(problem: ExcitationProblem, point: Array) -> SearchEnd:
    """The problem's own evaluation of a point (dimension,)."""
    told = problem.evaluate(point[None])
    return SearchEnd(point, float(told.value[0]), float(told.violation[0]), evaluations=1)


def check_supported(problem: ExcitationProblem, name: str) -> None:
    """Raise InputError if a problem has limits whose derivatives are not known."""
    torques = any(np.isfinite(limit.torque) for limit in problem.constraints.limits)
    if torques or problem.constraints.workspace.limited:
        raise InputError(f"{name}: a best-known record needs limits of position, velocity and acceleration alone")


def descend(problem: ExcitationProblem, start: Array) -> SearchEnd:
    """The best feasible point on the descent from `start` (dimension,), else the last point.

    Each stage sharpens the smoothing. The solver gets only the rows near their limits; if its answer breaks others,
    they are added and the stage is repeated.
    """
    rows = LimitRows(problem, LIMIT_MARGIN)
    best, point = evaluate_point(problem, start), start
    evaluations, gradients = 1, 0
    for power in SMOOTHING_POWERS:
        watched = np.zeros(0, dtype=np.intp)
        for _ in range(MAX_CUTS):
            watched = np.union1d(watched, _rows_near_limits(rows, point)).astype(np.intp)
            point, calls = _Stage(problem, rows, watched, power).solve(point)
            end = evaluate_point(problem, point)
            evaluations, gradients = evaluations + 1, gradients + calls
            if end.better_than(best):
                best = end
            if end.violation == 0:
                break
    chosen = best if best.feasible else evaluate_point(problem, point)
    return replace(chosen, evaluations=evaluations, gradients=gradients)


def _rows_near_limits(rows: LimitRows, point: Array) -> NDArray[np.intp]:
    return np.flatnonzero(rows.distances(motion_of(rows.problem, point)) < WATCHED_DISTANCE)


def motion_of(problem: ExcitationProblem, point: Array) -> Motion:
    """The motion (samples, joints) of a point (dimension,)."""
    return problem.trajectory.motions(point[None], problem.times).motion.select(np.intp(0))


@dataclass(frozen=True, eq=False)
class _Stage:
    """One call of the solver, in coordinates that run from -1 to 1 over the box."""

    problem: ExcitationProblem
    rows: LimitRows
    watched: NDArray[np.intp]
    power: float

    def solve(self, point: Array) -> tuple[Array, int]:
        """The solver's answer (dimension,) and the gradients it took."""
        with np.errstate(all="ignore"):  # a line search may leave what the arm can reach
            answer = minimize(
                self._objective,
                np.clip((point - self._middle) / self._half, -1.0, 1.0),
                jac=True,
                bounds=[(-1.0, 1.0)] * len(point),
                constraints=[{"type": "ineq", "fun": self._distances, "jac": self._distance_slopes}],
                method="SLSQP",
                options={"maxiter": MAX_STEPS, "ftol": SOLVER_TOLERANCE},
            )
        solved = answer.x if np.all(np.isfinite(answer.x)) else np.clip((point - self._middle) / self._half, -1, 1)
        return np.clip(self._point(solved), self.problem.lower, self.problem.upper), int(answer.njev)

    @property
    def _middle(self) -> Array:
        return (self.problem.lower + self.problem.upper) / 2

    @property
    def _half(self) -> Array:
        return (self.problem.upper - self.problem.lower) / 2

    def _point(self, share: Array) -> Array:
        return np.asarray(self._middle + self._half * share)

    def _objective(self, share: Array) -> tuple[float, Array]:
        value, slope = spectral_gradient(self.problem, self._point(share), smooth_log_condition(self.power))
        if not (np.isfinite(value) and np.all(np.isfinite(slope))):
            return _OUT_OF_REACH_VALUE, np.zeros(len(share))
        return value, slope * self._half

    def _distances(self, share: Array) -> Array:
        return self.rows.distances(motion_of(self.problem, self._point(share)))[self.watched]

    def _distance_slopes(self, share: Array) -> Array:
        point = self._point(share)
        return self.rows.slopes(motion_of(self.problem, point), point, self.watched) * self._half
