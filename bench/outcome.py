"""What a finished trial leaves behind."""

from dataclasses import dataclass

from algorithms.contract import Array


@dataclass(frozen=True)
class Curves:
    """Convergence, one entry a population (k,), of the problem's own figure without weights and penalty.

    evaluations: used up to and with the population.
    best_*: of the best point so far. present_*: of the algorithm's own present best.
    """

    evaluations: Array
    best_value: Array
    best_violation: Array
    present_value: Array
    present_violation: Array


@dataclass(frozen=True)
class Outcome:
    """The end of a trial: its best point (d,) and what the problem says of it.

    value: the problem's own figure, e.g. the condition number, without weights and penalty.
    violation: 0 when feasible. fitness: what was minimised. seconds: of processor time, for the search alone.
    """

    value: float
    violation: float
    fitness: float
    evaluations: int
    seconds: float
    best_x: Array
    curves: Curves
