"""Small problems on which `algorithms.check` watches an algorithm play."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from algorithms.bounds import clip
from algorithms.contract import AnyAlgorithm, Array, Box, uniform_points

Between = Callable[[Any, list[Array]], Any]


class Game(NamedTuple):
    """A problem and how long it is played; the first population counts as a step."""

    objective: Callable[[Array], Array]
    points: int = 8
    dimensions: int = 3
    horizon: int = 6
    steps: int = 7


class Step(NamedTuple):
    """One ask and tell, as the caller saw it; changed: whether tell wrote into the caller's arrays."""

    asked: Array
    X: Array
    fitness: Array
    incumbent: Array
    incumbent_fitness: float
    finished: bool
    changed: bool


def leave(state: Any, arrays: list[Array]) -> Any:
    """Do nothing between the calls."""
    return state


def play(algorithm: AnyAlgorithm, game: Game, seed: int = 1, between: Between = leave) -> list[Step]:
    """All steps of one game."""
    return list(moves(algorithm, game, np.random.default_rng(seed), between))


def moves(algorithm: AnyAlgorithm, game: Game, rng: np.random.Generator, between: Between = leave) -> Iterator[Step]:
    """Step by step; `between` may swap the state and spoil the caller's arrays after every call."""
    box, population = search_box(game), first_population(game)
    state = algorithm.init(algorithm.Params(), population, box, game.horizon, rng)
    state = between(state, [population])
    for _ in range(game.steps):
        asked, state = algorithm.ask(state)
        seen, X = asked.copy(), clip(asked, box)
        state = between(state, [asked])
        fitness = game.objective(X)
        told = X.copy(), fitness.copy()
        state = algorithm.tell(state, X, fitness)
        changed = not (np.array_equal(told[0], X) and np.array_equal(told[1], fitness, equal_nan=True))
        state = between(state, [X, fitness])
        best, value = algorithm.incumbent(state)
        step = Step(seen, *told, best.copy(), value, algorithm.finished(state), changed)
        state = between(state, [best])
        yield step


def search_box(game: Game) -> Box:
    """Neither centred nor of equal widths."""
    lower = np.linspace(-1.0, -2.0, game.dimensions)
    return Box(lower, lower + np.linspace(2.5, 4.0, game.dimensions))


def first_population(game: Game) -> Array:
    """The same points (points, dimensions) in every game of that size."""
    return uniform_points(game.points, search_box(game), np.random.default_rng(0))


def bowl(X: Array) -> Array:
    """Sum of squares about 0.3, less 1, so that values of both signs occur."""
    fitness: Array = np.square(X - 0.3).sum(axis=1) - 1.0
    return fitness


def holed_bowl(X: Array) -> Array:
    """The bowl, with NaN, +inf and -inf in turn where the first coordinate is below 0."""
    holes = np.resize([np.nan, np.inf, -np.inf], len(X))
    return np.where(X[:, 0] < 0.0, holes, bowl(X))


def flat(value: float) -> Callable[[Array], Array]:
    """An objective that has one value everywhere."""
    return lambda X: np.full(len(X), value)
