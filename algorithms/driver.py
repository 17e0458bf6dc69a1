"""The loop that every algorithm runs in: ask, bring into the box, evaluate, keep the best, tell.

Bound policies bring asked points into the box, coordinate by coordinate. Each is a function of the points (n, d) and
the box alone and leaves a coordinate inside as it is, to the bit.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import (
    AnyAlgorithm,
    AsksDerivatives,
    Box,
    BrokenContractError,
    as_loss,
    fewest_points,
)
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question

BoundPolicy = Callable[[Array, Box], Array]


def clip(X: Array, box: Box) -> Array:
    """A coordinate outside goes to the bound it crossed."""
    return np.minimum(np.maximum(X, box.lower), box.upper)


def reflect(X: Array, box: Box) -> Array:
    """A coordinate outside is mirrored at the bound, as often as it takes to be inside."""
    width = box.upper - box.lower
    return _replace_outside(X, box, box.upper - np.abs(np.mod(X - box.lower, 2 * width) - width))


def wrap(X: Array, box: Box) -> Array:
    """A coordinate outside comes in again at the opposite bound."""
    return _replace_outside(X, box, box.lower + np.mod(X - box.lower, box.upper - box.lower))


def _replace_outside(X: Array, box: Box, replacement: Array) -> Array:
    inside = (box.lower <= X) & (box.upper >= X)
    return np.where(inside, X, clip(replacement, box))  # clip: rounding may leave the box by one bit


BOUND_POLICIES: dict[str, BoundPolicy] = {"clip": clip, "reflect": reflect, "wrap": wrap}


def bound_policy(name: str) -> BoundPolicy:
    """The policy of that name; raises ValueError with the known names."""
    if name not in BOUND_POLICIES:
        raise ValueError(f"unknown bound policy {name!r}: choose one of {', '.join(BOUND_POLICIES)}")
    return BOUND_POLICIES[name]


Objective = Callable[[Array], Array]


class DerivativeSource(NamedTuple):
    """Where derivatives come from, and how many evaluations a point with derivatives counts for, at least one."""

    differentiate: Callable[[Array, Question], Derivatives]
    price: int


class Batch(NamedTuple):
    """One evaluated population: points (n, d), their fitness (n,), and the algorithm after it was told them.

    cost: evaluations that it counts for. present_best: fitness of the algorithm's incumbent.
    """

    X: Array
    fitness: Array
    cost: int
    present_best: float
    state: Any


@dataclass(frozen=True)
class Result:
    """What a run found; histories have one entry a batch (k).

    best_x (d,), best_fitness: best of all evaluated points, the first of equals; +inf if none was finite.
    history_evaluations (k,): evaluations used up to and with the batch.
    best_so_far (k,), best_x_history (k, d): the best up to and with the batch.
    present_best (k,): fitness of the algorithm's incumbent after it was told the batch.
    final_state: can be pickled and given to `iterate` to go on.
    """

    best_x: Array
    best_fitness: float
    evaluations: int
    history_evaluations: NDArray[np.int64]
    best_so_far: Array
    best_x_history: Array
    present_best: Array
    final_state: Any

    def __repr__(self) -> str:
        point = np.array2string(self.best_x, precision=4, threshold=8, edgeitems=3)
        return (
            f"Result: fitness {self.best_fitness:.6g}; {self.evaluations} evaluations in {len(self.best_so_far)} "
            f"populations\n  best point, {len(self.best_x)} dimensions: {point}"
        )


def planned_iterations(evaluations: int, swarm_size: int) -> int:
    """The horizon: populations that fit into the budget after the first one."""
    return max(evaluations // swarm_size - 1, 0)


def minimise(
    algorithm: AnyAlgorithm,
    params: Any,
    objective: Objective,
    box: Box,
    population: Array,
    evaluations: int,
    rng: np.random.Generator,
    bounds: str = "clip",
    source: DerivativeSource | None = None,
) -> Result:
    """Run an algorithm from the first population (n, d) until the budget is used up or it is finished.

    objective: (n, d) -> (n,), smaller is better. evaluations: the budget, never exceeded.
    bounds: name of the policy in `algorithms.driver`. Points are never rescaled.
    source: of derivatives, for an algorithm that asks for them.
    Raises ValueError for a budget below 1, an impossible box, fewer points than the algorithm takes, or an objective
    that returns another shape; BrokenContractError for an algorithm that asks for what is no point of the box's space.
    """
    _check_problem(box, population, evaluations)
    if len(population) < fewest_points(algorithm):
        raise ValueError(f"{algorithm.name} takes {fewest_points(algorithm)} points or more, not {len(population)}")
    horizon = planned_iterations(evaluations, len(population))
    state = algorithm.init(params, population, box, horizon, rng)
    batches = list(iterate(algorithm, state, objective, box, evaluations, bounds, source))
    if not batches:
        raise BrokenContractError(f"algorithm {algorithm.name!r} was finished before its first population")
    return summarise_batches(batches)


def iterate(
    algorithm: AnyAlgorithm,
    state: Any,
    objective: Objective,
    box: Box,
    evaluations: int,
    bounds: str = "clip",
    source: DerivativeSource | None = None,
) -> Iterator[Batch]:
    """Go on from a State for at most so many evaluations, one batch at a time.

    A last batch that the budget cuts is evaluated as far as it goes and counts for the best, but is not told:
    an algorithm is only told whole populations. So a run is resumed from the state after a whole batch. The
    state of a batch is used up when the next batch is taken: pickle it before, to keep it. A point with derivatives
    that costs more than what is left of the budget ends the run. Raises ValueError if an algorithm asks for
    derivatives and there is no source, BrokenContractError if it asks for what is no point.
    """
    into_box = bound_policy(bounds)
    walls = box
    asking = algorithm if issubclass(algorithm, AsksDerivatives) else None
    while evaluations > 0 and not algorithm.finished(state):
        points, state = algorithm.ask(state)
        asked = _checked_points(algorithm, points, len(box.lower))
        question = asking.question(state) if asking is not None else None
        if question is not None and _price(algorithm, asked, source) > evaluations:
            return
        if walls.lower.shape != asked.shape:
            walls = Box(*(np.full(asked.shape, wall) for wall in box))  # numpy is faster on equal shapes
        X = into_box(asked, walls)[:evaluations]
        fitness = _evaluate(objective, X)
        cost = len(X)
        if asking is not None and question is not None and source is not None:
            state = asking.tell_derivatives(state, source.differentiate(X[0], question))
            cost = source.price
        if len(X) == len(asked):
            state = algorithm.tell(state, X.copy(), fitness.copy())  # it may write into what it is told
        evaluations -= cost
        yield Batch(X, fitness, cost, algorithm.incumbent(state)[1], state)


def _price(algorithm: AnyAlgorithm, asked: Array, source: DerivativeSource | None) -> int:
    if source is None:
        raise ValueError(f"algorithm {algorithm.name!r} asks for derivatives, and the problem offers none")
    if len(asked) != 1:
        raise BrokenContractError(
            f"algorithm {algorithm.name!r} asks for derivatives at {len(asked)} points at once, not at 1"
        )
    return source.price


def _checked_points(algorithm: AnyAlgorithm, points: Any, dimension: int) -> Array:
    """The asked points as finite real numbers (m, dimension); raises BrokenContractError where they are none."""
    found = points if isinstance(points, np.ndarray) else np.empty(0, dtype=object)
    if found.dtype.kind not in "fiu":
        kind = found.dtype.name if found is points else type(points).__name__
        raise BrokenContractError(f"algorithm {algorithm.name!r} asks for {kind}, not for an array of real numbers")
    if found.ndim != 2 or found.shape[1:] != (dimension,) or not len(found):
        raise BrokenContractError(
            f"algorithm {algorithm.name!r} asks for points of shape {found.shape}, not (points, {dimension})"
        )
    if not isfinite(np.vdot(found, found)) and not np.isfinite(found).all():  # the first is fast, and may overflow
        raise BrokenContractError(f"algorithm {algorithm.name!r} asks for a point with a coordinate that is not finite")
    return np.asarray(found, dtype=np.float64)


def summarise_batches(batches: Sequence[Batch]) -> Result:
    """The Result of one run from its batches, in order (at least one)."""
    losses = as_loss(np.concatenate([batch.fitness for batch in batches]))
    best = np.minimum.accumulate(losses)
    ends = np.array([len(batch.X) for batch in batches]).cumsum()
    best_so_far = best[ends - 1]
    rows = (-best).searchsorted(-best_so_far)  # of the best up to there, the first of equals
    holders = ends.searchsorted(rows, side="right")  # the batches that they are in
    points = [batches[of].X[row] for of, row in zip(holders, rows - ends[holders], strict=True)]  # rows from the end
    used = np.array([batch.cost for batch in batches]).cumsum()
    return Result(
        best_x=points[-1].copy(),
        best_fitness=float(best[-1]),
        evaluations=int(used[-1]),
        history_evaluations=used,
        best_so_far=best_so_far,
        best_x_history=np.array(points),
        present_best=np.array([batch.present_best for batch in batches]),
        final_state=batches[-1].state,
    )


def _evaluate(objective: Objective, X: Array) -> Array:
    fitness = np.asarray(objective(X), dtype=np.float64)
    if fitness.shape != (len(X),):
        raise ValueError(f"the objective returned shape {fitness.shape} for {len(X)} points, not ({len(X)},)")
    return fitness


def _check_problem(box: Box, population: Array, evaluations: int) -> None:
    if evaluations < 1:
        raise ValueError(f"the budget is {evaluations} evaluations: it must be at least 1")
    if population.ndim != 2 or 0 in population.shape:
        raise ValueError(f"the first population has shape {population.shape}, not (points, dimensions)")
    if not box.lower.shape == box.upper.shape == population.shape[1:]:
        raise ValueError(
            f"the box has {box.lower.shape} lower and {box.upper.shape} upper limits for points of "
            f"{population.shape[1]} dimensions"
        )
    check_box(box)


def check_box(box: Box) -> None:
    """Raises ValueError where a lower limit is not below the upper one, or a limit is not finite."""
    for d, (low, high) in enumerate(zip(box.lower, box.upper, strict=True)):
        if not -np.inf < low < high < np.inf:
            raise ValueError(f"box dimension {d}: lower limit {low} must be finite and below upper limit {high}")
