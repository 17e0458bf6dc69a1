"""Tests whether an algorithm keeps the promises of `algorithms.contract`, and names a broken one in a sentence.

    from algorithms.check import check_algorithm
    check_algorithm(MyAlgorithm)

It returns nothing if all promises are kept, and raises BrokenPromiseError at the first one that is broken. The
algorithm runs on small problems, whose objectives are defined here too.
"""

import dataclasses
import pickle
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from algorithms.contract import AnyAlgorithm, AsksDerivatives, Box, question_of, uniform_points
from algorithms.driver import clip
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question

BetweenCalls = Callable[[Any, list[Array]], Any]


class Game(NamedTuple):
    """A problem and the number of steps that an algorithm runs on it; the first population counts as a step."""

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


def do_nothing(state: Any, arrays: list[Array]) -> Any:
    return state


def play(algorithm: AnyAlgorithm, game: Game, seed: int = 1, between: BetweenCalls = do_nothing) -> list[Step]:
    """All steps of one game."""
    return list(play_steps(algorithm, game, np.random.default_rng(seed), between))


def play_steps(
    algorithm: AnyAlgorithm, game: Game, rng: np.random.Generator, between: BetweenCalls = do_nothing
) -> Iterator[Step]:
    """Step by step; `between` may replace the state and overwrite the caller's arrays after every call."""
    box, population = search_box(game), first_population(game)
    state = algorithm.init(algorithm.Params(), population, box, game.horizon, rng)
    state = between(state, [population])
    for _ in range(game.steps):
        asked, state = algorithm.ask(state)
        question = question_of(algorithm, state)
        seen, X = asked.copy(), clip(asked, box)
        state = between(state, [asked])
        if question is not None and issubclass(algorithm, AsksDerivatives):
            state = algorithm.tell_derivatives(state, derivatives_by_differences(game.objective, X[0], question))
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
    """A box that is not centred and has unequal widths."""
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


def constant_objective(value: float) -> Callable[[Array], Array]:
    """An objective that has one value everywhere."""
    return lambda X: np.full(len(X), value)


_DIFFERENCE_STEP = 1e-5


def derivatives_by_differences(objective: Callable[[Array], Array], point: Array, question: Question) -> Derivatives:
    """Central differences of an objective without limits at a point (d,)."""
    steps = _DIFFERENCE_STEP * np.eye(len(point))
    with np.errstate(invalid="ignore"):  # inf - inf
        slope = (objective(point + steps) - objective(point - steps)) / (2 * _DIFFERENCE_STEP)
    nothing = np.zeros(0, dtype=np.intp)
    return Derivatives(float(objective(point[None])[0]), slope, np.zeros(0), nothing, np.zeros((0, len(point))))


CRASH_ERRORS = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RuntimeError,
    TypeError,
    ValueError,
    pickle.PickleError,
)

OCCASIONS = {
    "on a bowl": Game(bowl),
    "in one dimension": Game(bowl, dimensions=1),
    "on a constant objective": Game(constant_objective(7.0), horizon=13, steps=14),
    "when fitness is NaN or infinite at many points": Game(holed_bowl),
    "when fitness is NaN everywhere": Game(constant_objective(np.nan)),
    "when fitness is infinite everywhere": Game(constant_objective(np.inf)),
    "with a horizon of no iterations": Game(bowl, horizon=0, steps=1),
    "beyond its horizon": Game(bowl, horizon=2),
}


class BrokenPromiseError(AssertionError):
    """The algorithm does not do what its callers rely on."""


def check_algorithm(algorithm: AnyAlgorithm) -> None:
    """Raises BrokenPromiseError, whose message is a sentence about the promise that is broken."""
    check_parameters(algorithm)
    check_global_randomness(algorithm)
    for occasion in OCCASIONS:
        check_occasion(algorithm, occasion)
    for occasion in ("on a bowl", "on a constant objective"):  # with and without progress
        check_randomness(algorithm, OCCASIONS[occasion])
        check_sharing(algorithm, OCCASIONS[occasion])
        check_pickle(algorithm, OCCASIONS[occasion])


def check_parameters(algorithm: AnyAlgorithm) -> None:
    """A name, and hyper-parameters that are frozen and have defaults."""
    name, params = getattr(algorithm, "name", None), getattr(algorithm, "Params", None)
    _demand(isinstance(name, str) and name, algorithm, "has no `name`, a string that is not empty")
    if not (isinstance(params, type) and dataclasses.is_dataclass(params)):
        raise _broken_promise(algorithm, "has no dataclass `Params`")
    missing = [f.name for f in dataclasses.fields(params) if f.default is f.default_factory]  # both are MISSING
    _demand(not missing, algorithm, f"has Params without a default: {', '.join(missing)}")
    _demand(_is_frozen(params()), algorithm, "has Params that are not frozen")


def check_global_randomness(algorithm: AnyAlgorithm) -> None:
    """The random states that belong to the whole program are left as they are."""
    before = _global_random_state()
    with _name_crashes(algorithm, "on a bowl"):
        play(algorithm, Game(bowl))
    _demand(_global_random_state() == before, algorithm, "draws from the global random state of numpy or Python")


def check_occasion(algorithm: AnyAlgorithm, occasion: str) -> None:
    """What it asks for and which best it reports, in one of OCCASIONS."""
    game = OCCASIONS[occasion]
    with _name_crashes(algorithm, occasion):
        steps = play(algorithm, game)
    check_points(algorithm, occasion, game, steps)
    for told in range(1, len(steps) + 1):
        check_incumbent(algorithm, occasion, steps[:told])


def check_points(algorithm: AnyAlgorithm, occasion: str, game: Game, steps: list[Step]) -> None:
    """It asks for the first population first, then for one or more points of the same dimension, all finite."""
    for k, step in enumerate(steps):
        shaped = step.asked.ndim == 2 and step.asked.shape[1] == game.dimensions and len(step.asked) > 0
        found = f"shape {step.asked.shape} and type {step.asked.dtype}"
        wanted = f"(one or more, {game.dimensions}) and float64"
        right = shaped and step.asked.dtype == np.float64
        _demand(right, algorithm, f"asks in step {k} for points of {found}, not {wanted}, {occasion}")
        finite = np.isfinite(step.asked).all()
        _demand(finite, algorithm, f"asks in step {k} for a point that is not finite, {occasion}")
        _demand(not step.changed, algorithm, f"writes into the caller's arrays when told step {k}, {occasion}")
        _demand(isinstance(step.finished, bool), algorithm, "does not answer `finished` with True or False")
    first = np.array_equal(steps[0].asked, first_population(game))
    _demand(first, algorithm, f"does not ask for the first population first, {occasion}")


def check_incumbent(algorithm: AnyAlgorithm, occasion: str, steps: list[Step]) -> None:
    """After the last of these steps the incumbent is a point that was told, with finite fitness if any was finite."""
    X, fitness = np.concatenate([s.X for s in steps]), np.concatenate([s.fitness for s in steps])
    point, value = steps[-1].incumbent, steps[-1].incumbent_fitness
    when = f"after step {len(steps) - 1}, {occasion}"
    if not np.isfinite(fitness).any():
        _demand(value == np.inf, algorithm, f"was told only losses, but its incumbent has fitness {value}, {when}")
        return
    _demand(np.isfinite(value), algorithm, f"has an incumbent of fitness {value}, a loss, {when}")
    told = ((point == X).all(axis=1) & (fitness == value)).any()
    _demand(told, algorithm, f"has an incumbent that it was never told with fitness {value}, {when}")


def check_sharing(algorithm: AnyAlgorithm, game: Game) -> None:
    """A change that one side makes to its arrays after a call does not reach the other side."""
    with _name_crashes(algorithm, "when the caller overwrites arrays that are its own"):
        overwritten = play(algorithm, game, between=_overwrite_arrays)
    problem = "keeps the caller's arrays or gives away its own: its path changes when they are overwritten"
    _demand(_same_path(play(algorithm, game), overwritten), algorithm, problem)


def check_randomness(algorithm: AnyAlgorithm, game: Game) -> None:
    """The path depends on the given generator alone, and two runs share nothing."""
    alone = play(algorithm, game)
    _demand(
        _same_path(alone, play(algorithm, game)), algorithm, "takes another path when it gets the same generator again"
    )
    pair = (play_steps(algorithm, game, np.random.default_rng(seed)) for seed in (1, 2))
    together = [step for step, _ in zip(*pair, strict=True)]
    _demand(_same_path(alone, together), algorithm, "takes another path while a second run goes on beside it")


def check_pickle(algorithm: AnyAlgorithm, game: Game) -> None:
    """A run that is pickled and read back after every call takes the same path."""
    with _name_crashes(algorithm, "when its State is pickled and read back"):
        resumed = play(algorithm, game, between=_pickle_and_read_back)
    problem = "takes another path when its State is pickled and read back: something is left out"
    _demand(_same_path(play(algorithm, game), resumed), algorithm, problem)


def _is_frozen(params: Any) -> bool:
    try:
        params.anything = None
    except dataclasses.FrozenInstanceError:
        return True
    return False


def _overwrite_arrays(state: Any, arrays: list[Array]) -> Any:
    for array in arrays:
        array.fill(12345.0)
    return state


def _pickle_and_read_back(state: Any, arrays: list[Array]) -> Any:
    return pickle.loads(pickle.dumps(state))


def _global_random_state() -> bytes:
    return pickle.dumps((random.getstate(), np.random.get_state()))  # noqa: NPY002


def _same_path(left: list[Step], right: list[Step]) -> bool:
    return all(np.array_equal(a.asked, b.asked) for a, b in zip(left, right, strict=True))


@contextmanager
def _name_crashes(algorithm: AnyAlgorithm, occasion: str) -> Iterator[None]:
    try:
        yield
    except CRASH_ERRORS as error:
        raise _broken_promise(algorithm, f"crashes {occasion}: {error!r}") from error


def _demand(kept: object, algorithm: AnyAlgorithm, problem: str) -> None:
    if not kept:
        raise _broken_promise(algorithm, problem)


def _broken_promise(algorithm: AnyAlgorithm, problem: str) -> BrokenPromiseError:
    return BrokenPromiseError(f"Algorithm {algorithm.__name__} {problem}.")
