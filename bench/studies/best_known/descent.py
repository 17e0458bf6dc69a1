"""Descent from one point to a local optimum within all limits, and the ends of searches."""

from dataclasses import dataclass, replace

import numpy as np

from algorithms.contract import Box
from algorithms.sqp import SQPParams
from algorithms.sqp import descend as descend_with_derivatives
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from armlab.common.errors import InputError
from problem.excitation import ExcitationProblem
from problem.feasible import FeasibleFourier
from problem.safe_motion import SafeConstraints
from problem.safety_proof import UnsafeMotionError, check_motion
from problem.trajectories import JointFourier

DESCENT = SQPParams(powers=(10.0, 100.0, 1000.0, 10000.0), steps=100, cuts=6, watch=0.05)  # to the end, at any price
COLLISION_WATCH = 0.2  # m: at 0.05 a descent of the UR10 ends inside the floor, since a step goes farther than that


@dataclass(frozen=True, eq=False)
class SearchEnd:
    """The end of a search: point (dimension,), its value and violation, and the effort.

    value: the condition number; of a problem of D-optimality det(W'W)^(-1/n), n columns of W.
    violation: infinite where parts come too close between the samples.
    """

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
    found = problem.evaluate(point[None])
    violation = float(found.violation[0])
    if violation == 0 and not _is_clear_between_samples(problem, point):
        violation = np.inf
    d_optimal = problem.spectral and problem.criterion.kind == "d_optimality"
    value = float(np.exp(found.fitness[0])) if d_optimal and violation == 0 else float(found.value[0])
    return SearchEnd(point, value, violation, evaluations=1)


def _is_clear_between_samples(problem: ExcitationProblem, point: Array) -> bool:
    if not isinstance(problem.constraints, SafeConstraints):
        return True
    try:
        check_motion(problem.constraints.rules, problem.trajectory, point, problem.duration)
    except UnsafeMotionError:
        return False
    return True


def check_supported(problem: ExcitationProblem, name: str) -> None:
    """Raise InputError if a problem has limits whose derivatives are not known."""
    if problem.spectral and problem.no_derivatives_because:
        raise InputError(f"{name}: a best-known record needs limits of position, velocity and acceleration alone")


def keep_limits(problem: ExcitationProblem, points: Array) -> Array:
    """Points (points, dimension) of a problem for those of its feasible space, where that is searched."""
    space = _feasible_space(problem)
    return points if space is None else space.numbers(points)


def _feasible_space(problem: ExcitationProblem) -> FeasibleFourier | None:
    """The space in which a problem with collisions is searched: limits of motion are kept at every instant."""
    if isinstance(problem.constraints, SafeConstraints) and isinstance(problem.trajectory, JointFourier):
        return FeasibleFourier(problem.trajectory, problem.constraints.limits)
    return None


def descend(problem: ExcitationProblem, start: Array) -> SearchEnd:
    """The best feasible point on the descent from `start` (dimension,), else the last point.

    With collisions, limits of motion are kept at every instant.
    """
    space = _feasible_space(problem)
    if space is None:
        return _descend(problem, start)
    end = _descend(replace(problem, trajectory=space), space.points(start[None])[0])
    own = evaluate_point(problem, space.numbers(end.point[None])[0])
    return replace(own, evaluations=end.evaluations + 1, gradients=end.gradients)


def _descend(problem: ExcitationProblem, start: Array) -> SearchEnd:
    gradients = 0

    def differentiate(point: Array, question: Question) -> Derivatives:
        nonlocal gradients
        gradients += 1
        return problem.differentiate(point, question)

    ends, params = [evaluate_point(problem, start)], DESCENT
    if isinstance(problem.constraints, SafeConstraints):
        params = replace(params, watch=COLLISION_WATCH)
    if problem.criterion.kind == "d_optimality":
        params = replace(params, powers=(1.0,))  # it is smooth as it is
    for point in descend_with_derivatives(params, differentiate, Box(problem.lower, problem.upper), start):
        ends.append(evaluate_point(problem, point))
    feasible = [end for end in ends if end.feasible]
    chosen = min(feasible, key=lambda end: end.value) if feasible else ends[-1]
    return replace(chosen, evaluations=len(ends), gradients=gradients)
