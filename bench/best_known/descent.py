"""Down from one point to a local optimum within all limits, by sequential quadratic programming."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bench.best_known.rows import Rows
from bench.best_known.smooth import smooth_log_condition
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.gradient import spectral_gradient
from problem.motion import Motion
from problem.transforms import Array

POWERS = (10.0, 100.0, 1000.0, 10000.0)  # of the smoothed condition number, one after the other
CUTS = 6  # times that broken limits are added to the watched ones, for each power
STEPS = 100
TOLERANCE = 1e-10
CLOSE = 0.05  # distances below this are watched from the start
MARGIN = 1e-9
_HOPELESS = 1e3  # log of a condition number: where a line search leaves what the arm can reach


@dataclass(frozen=True, eq=False)
class End:
    """Where a search ended: point (dimension,), its condition number and violation, and what it took."""

    point: Array
    value: float
    violation: float
    evaluations: int = 0
    gradients: int = 0

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation == 0.0 and bool(np.isfinite(self.value))

    def better_than(self, other: "End | None") -> bool:
        """Whether this may stand in a record and the other one is worse."""
        return self.feasible and (other is None or not other.feasible or self.value < other.value)


def judge(problem: ExcitationProblem, point: Array) -> End:
    """What the problem itself says of a point (dimension,)."""
    told = problem.evaluate(point[None])
    return End(point, float(told.value[0]), float(told.violation[0]), evaluations=1)


def check_supported(problem: ExcitationProblem, name: str) -> None:
    """Raise InputError where a problem has limits that no derivatives are known for."""
    torques = any(np.isfinite(limit.torque) for limit in problem.constraints.limits)
    if torques or problem.constraints.workspace.limited:
        raise InputError(f"{name}: a best-known record needs limits of position, velocity and acceleration alone")


def descend(problem: ExcitationProblem, start: Array) -> End:
    """The best feasible point on the way down from `start` (dimension,), else the last point.

    Each stage sharpens the smoothing. Only rows near their limits are handed to the solver; where its answer
    breaks others, those are added and it goes on.
    """
    rows = Rows(problem, MARGIN)
    best, point = judge(problem, start), start
    evaluations, gradients = 1, 0
    for power in POWERS:
        watched = np.zeros(0, dtype=np.intp)
        for _ in range(CUTS):
            watched = np.union1d(watched, _close(rows, point)).astype(np.intp)
            point, calls = _Stage(problem, rows, watched, power).solve(point)
            end = judge(problem, point)
            evaluations, gradients = evaluations + 1, gradients + calls
            if end.better_than(best):
                best = end
            if end.violation == 0:
                break
    chosen = best if best.feasible else judge(problem, point)
    return replace(chosen, evaluations=evaluations, gradients=gradients)


def _close(rows: Rows, point: Array) -> NDArray[np.intp]:
    return np.flatnonzero(rows.distances(motion_of(rows.problem, point)) < CLOSE)


def motion_of(problem: ExcitationProblem, point: Array) -> Motion:
    """The motion (samples, joints) of a point (dimension,)."""
    return problem.trajectory.motions(point[None], problem.times).motion.select(np.intp(0))


@dataclass(frozen=True, eq=False)
class _Stage:
    """One call of the solver, in coordinates that run from -1 to 1 over the box."""

    problem: ExcitationProblem
    rows: Rows
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
                options={"maxiter": STEPS, "ftol": TOLERANCE},
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
            return _HOPELESS, np.zeros(len(share))
        return value, slope * self._half

    def _distances(self, share: Array) -> Array:
        return self.rows.distances(motion_of(self.problem, self._point(share)))[self.watched]

    def _distance_slopes(self, share: Array) -> Array:
        point = self._point(share)
        return self.rows.slopes(motion_of(self.problem, point), point, self.watched) * self._half
