"""The contract of a problem: a box, and the evaluation of a population of points in it."""

from typing import NamedTuple, Protocol, runtime_checkable

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question


class Evaluation(NamedTuple):
    """Results of a population, (points,) each.

    fitness: what is minimised, with penalties. value: what is reported, without penalties (for an excitation the
    condition number of the trajectory); not negative, since statistics take its logarithm. violation: 0 where every
    limit is kept.
    """

    fitness: Array
    value: Array
    violation: Array


class Problem(Protocol):
    """A black box to minimise over lower <= x <= upper, (dimension,) each."""

    @property
    def name(self) -> str:
        """Short name for tables."""
        ...

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        ...

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        ...

    def evaluate(self, points: Array) -> Evaluation:
        """Results of points (points, dimension); each is the same to the bit in any batch."""
        ...


@runtime_checkable
class DifferentiableProblem(Protocol):
    """What a problem has beside the contract if it offers derivatives."""

    @property
    def no_derivatives_because(self) -> str:
        """Why these settings have no derivatives, in words; empty where they have."""
        ...

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """Derivatives at one point (dimension,), the same to the bit whenever it is asked."""
        ...


def why_not_differentiable(problem: Problem) -> str:
    """Why a problem offers no derivatives; empty where it does."""
    if isinstance(problem, DifferentiableProblem):
        return problem.no_derivatives_because
    return "its class has no method `differentiate`"
