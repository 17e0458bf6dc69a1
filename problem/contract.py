"""The contract of a problem: a box, and the evaluation of a population of points in it."""

from typing import NamedTuple, Protocol

from armlab.common.arrays import Array


class Evaluation(NamedTuple):
    """Results of a population, (points,) each.

    fitness: what is minimised, with penalties. value: what is reported, without penalties (for an excitation the
    condition number of the trajectory). violation: 0 where every limit is kept.
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
