"""The contract of algorithms: ask and tell, one population at a time.

    state = algorithm.init(params, population, box, horizon, rng)
    while not algorithm.finished(state):
        X, state = algorithm.ask(state)          # the first ask gives the first population itself
        state = algorithm.tell(state, X, objective(X))

An algorithm knows no budget, bound policy, log, file or seed. `algorithms.check` tests the promises.

An algorithm that also wants derivatives has two functions more, `question` and `tell_derivatives`:

        X, state = algorithm.ask(state)
        question = algorithm.question(state)     # None: nothing is asked this time; else X is one point
        if question is not None:
            state = algorithm.tell_derivatives(state, derivatives(X[0], question))
        state = algorithm.tell(state, X, objective(X))
"""

from typing import Any, ClassVar, NamedTuple, Protocol, TypeAlias, TypeVar, runtime_checkable

import numpy as np

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question

ParamsT = TypeVar("ParamsT", contravariant=True)
StateT = TypeVar("StateT")


class Box(NamedTuple):
    """The search box: lower and upper limits, each (d,), lower < upper."""

    lower: Array
    upper: Array


class Algorithm(Protocol[ParamsT, StateT]):
    """A metaheuristic: a class that holds functions, never data; everything that changes is in its State.

    Params: a frozen dataclass of hyper-parameters, all with defaults; a range stands in the type of a field,
    `Annotated[float, Ge(0)]`. A class that needs more than one point says so in `fewest` (see `fewest_points`).
    A State can be pickled and resumed; `ask` and `tell` use up the State that they are given (it may be
    changed in place, as its random generator always is): go on with the one they return.
    """

    name: ClassVar[str]
    Params: ClassVar[type[Any]]

    @staticmethod
    def init(params: ParamsT, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> StateT:
        """State before the first population (n, d) is evaluated; horizon = planned iterations after it."""
        ...

    @staticmethod
    def ask(state: StateT) -> tuple[Array, StateT]:
        """The next population (m, d), possibly outside the box; the caller owns the array.

        The first one is the given population; later ones may have any other number of points, at least one.
        """
        ...

    @staticmethod
    def tell(state: StateT, X: Array, fitness: Array) -> StateT:
        """Learn the fitness (m,) of X (m, d), the asked points as the bound policy moved them.

        Neither array is kept or changed. A fitness that is not finite is a loss.
        """
        ...

    @staticmethod
    def incumbent(state: StateT) -> tuple[Array, float]:
        """The algorithm's own present best (d,) and its fitness; a mutation may forget a better one.

        The caller owns the array. Before anything finite was told the fitness is +inf.
        """
        ...

    @staticmethod
    def finished(state: StateT) -> bool:
        """Whether the algorithm has nothing left to try."""
        ...


AnyAlgorithm: TypeAlias = type[Algorithm[Any, Any]]


class BrokenContractError(ValueError):
    """An algorithm broke its contract; the message says in one line what it did and what would be right."""


def fewest_points(algorithm: AnyAlgorithm) -> int:
    """Points that the first population must have at least: the class attribute `fewest`, 1 without one."""
    return int(getattr(algorithm, "fewest", 1))


@runtime_checkable
class AsksDerivatives(Protocol):
    """What an algorithm has beside the contract if it asks for derivatives."""

    @staticmethod
    def question(state: Any) -> Question | None:
        """What is asked of the one point of the last `ask` beside its fitness; None: nothing."""
        ...

    @staticmethod
    def tell_derivatives(state: Any, derivatives: Derivatives) -> Any:
        """Learn the answer, before `tell` gives the fitness of the same point."""
        ...


def question_of(algorithm: AnyAlgorithm, state: Any) -> Question | None:
    """What an algorithm asks beside the fitness, after it was asked for points; None where it never asks."""
    return algorithm.question(state) if issubclass(algorithm, AsksDerivatives) else None


def as_loss(fitness: Array) -> Array:
    """A copy in which everything that is not finite, minus infinity too, counts as +infinity."""
    return np.where(np.isfinite(fitness), fitness, np.inf)


def uniform_points(n: int, box: Box, rng: np.random.Generator) -> Array:
    """n points drawn uniformly in the box, (n, d)."""
    return box.lower + (box.upper - box.lower) * rng.random((n, len(box.lower)))
