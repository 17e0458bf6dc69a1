"""Does an algorithm keep the promises of `algorithms.contract`? A broken one is named in a sentence.

    from algorithms.check import check_algorithm
    check_algorithm(MyAlgorithm)

It passes in silence, or raises BrokenPromiseError at the first promise that is broken.
"""

import dataclasses
import pickle
import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from algorithms.contract import AnyAlgorithm, Array
from algorithms.rehearsal import Game, Step, bowl, first_population, flat, holed_bowl, moves, play

CRASHES = (
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
    "on a constant objective": Game(flat(7.0), horizon=13, steps=14),
    "when fitness is NaN or infinite at many points": Game(holed_bowl),
    "when fitness is NaN everywhere": Game(flat(np.nan)),
    "when fitness is infinite everywhere": Game(flat(np.inf)),
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
        raise _broken(algorithm, "has no dataclass `Params`")
    missing = [f.name for f in dataclasses.fields(params) if f.default is f.default_factory]  # both are MISSING
    _demand(not missing, algorithm, f"has Params without a default: {', '.join(missing)}")
    _demand(_is_frozen(params()), algorithm, "has Params that are not frozen")


def check_global_randomness(algorithm: AnyAlgorithm) -> None:
    """The random states that belong to the whole program are left as they are."""
    before = _global_randomness()
    with _crashes_named(algorithm, "on a bowl"):
        play(algorithm, Game(bowl))
    _demand(_global_randomness() == before, algorithm, "draws from the global random state of numpy or Python")


def check_occasion(algorithm: AnyAlgorithm, occasion: str) -> None:
    """What it asks for and which best it reports, in one of OCCASIONS."""
    game = OCCASIONS[occasion]
    with _crashes_named(algorithm, occasion):
        steps = play(algorithm, game)
    check_points(algorithm, occasion, game, steps)
    for told in range(1, len(steps) + 1):
        check_incumbent(algorithm, occasion, steps[:told])


def check_points(algorithm: AnyAlgorithm, occasion: str, game: Game, steps: list[Step]) -> None:
    """The first population first, and then one point or more in the same dimensions, all finite."""
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
    """After the last of these steps the incumbent is a told point, and no loss unless all are."""
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
    """Neither side sees what the other does to its arrays after a call."""
    with _crashes_named(algorithm, "when the caller overwrites arrays that are its own"):
        overwritten = play(algorithm, game, between=_overwritten)
    problem = "keeps the caller's arrays or gives away its own: its path changes when they are overwritten"
    _demand(_same(play(algorithm, game), overwritten), algorithm, problem)


def check_randomness(algorithm: AnyAlgorithm, game: Game) -> None:
    """The path follows from the generator that was given, and nothing is shared between two runs."""
    alone = play(algorithm, game)
    _demand(_same(alone, play(algorithm, game)), algorithm, "takes another path when it gets the same generator again")
    pair = (moves(algorithm, game, np.random.default_rng(seed)) for seed in (1, 2))
    together = [step for step, _ in zip(*pair, strict=True)]
    _demand(_same(alone, together), algorithm, "takes another path while a second run goes on beside it")


def check_pickle(algorithm: AnyAlgorithm, game: Game) -> None:
    """A run that is pickled and read back after every call takes the same path."""
    with _crashes_named(algorithm, "when its State is pickled and read back"):
        resumed = play(algorithm, game, between=_pickled)
    problem = "takes another path when its State is pickled and read back: something is left out"
    _demand(_same(play(algorithm, game), resumed), algorithm, problem)


def _is_frozen(params: Any) -> bool:
    try:
        params.anything = None
    except dataclasses.FrozenInstanceError:
        return True
    return False


def _overwritten(state: Any, arrays: list[Array]) -> Any:
    for array in arrays:
        array.fill(12345.0)
    return state


def _pickled(state: Any, arrays: list[Array]) -> Any:
    return pickle.loads(pickle.dumps(state))


def _global_randomness() -> bytes:
    return pickle.dumps((random.getstate(), np.random.get_state()))  # noqa: NPY002


def _same(left: list[Step], right: list[Step]) -> bool:
    return all(np.array_equal(a.asked, b.asked) for a, b in zip(left, right, strict=True))


@contextmanager
def _crashes_named(algorithm: AnyAlgorithm, occasion: str) -> Iterator[None]:
    try:
        yield
    except CRASHES as error:
        raise _broken(algorithm, f"crashes {occasion}: {error!r}") from error


def _demand(kept: object, algorithm: AnyAlgorithm, problem: str) -> None:
    if not kept:
        raise _broken(algorithm, problem)


def _broken(algorithm: AnyAlgorithm, problem: str) -> BrokenPromiseError:
    return BrokenPromiseError(f"Algorithm {algorithm.__name__} {problem}.")
