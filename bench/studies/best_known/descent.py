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

DESCENT = SQPParams(powers=(10.0, 100.0, 1000.0, 10000.0), steps=100, cuts=6, watch=0.05)  # to the end, at any price


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
    if problem.spectral and problem.no_derivatives_because:
        raise InputError(f"{name}: a best-known record needs limits of position, velocity and acceleration alone")


def descend(problem: ExcitationProblem, start: Array) -> SearchEnd:
    """The best feasible point on the descent from `start` (dimension,), else the last point."""
    gradients = 0

    def differentiate(point: Array, question: Question) -> Derivatives:
        nonlocal gradients
        gradients += 1
        return problem.differentiate(point, question)

    ends = [evaluate_point(problem, start)]
    for point in descend_with_derivatives(DESCENT, differentiate, Box(problem.lower, problem.upper), start):
        ends.append(evaluate_point(problem, point))
    feasible = [end for end in ends if end.feasible]
    chosen = min(feasible, key=lambda end: end.value) if feasible else ends[-1]
    return replace(chosen, evaluations=len(ends), gradients=gradients)
