"""What all adapters share: another package's own loop behind ask and tell.

The first population is the trial's, as for every algorithm, and the peer is started from it; after that it
asks as its own loop does: a population at once or, where the package knows nothing else, a point at a time.
Its points are the package's, which keeps its own way of staying inside the box. A fitness that is not finite
reaches it as +inf.

A State is pickled as the peer's seed and all that it was told. To resume, the peer's loop is run again from
its start with the same answers: cheap, since nothing is evaluated, and exact, since its seed is all its chance.
A peer whose loop has come to its end is finished.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from algorithms.adapters.conversation import Conversation, Evaluate
from algorithms.contract import Array, Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote


class Start(NamedTuple):
    """Where a peer begins: its points (n, d) and their loss (n,), the box, planned iterations and a seed < 2^31."""

    X: Array
    loss: Array
    box: Box
    horizon: int
    seed: int


Search = Callable[[Any, Start, Evaluate], None]


@dataclass
class PeerState:
    """The peer's loop, and the losses that it was told after its first population, in order."""

    search: Search
    params: Any
    start: Start
    leaders: Leaders
    told: list[Array] = field(default_factory=list)
    started: bool = False
    conversation: Conversation | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "conversation": None}  # a running loop cannot be pickled, but run again


class Peer:
    """Base of the adapters, which name themselves and their Params and define `search`.

    search(params, start, evaluate): run the package's loop from `start`; evaluate (m, d) -> (m,).
    rival: name of the algorithm here that it stands beside. fewest: points that the package takes at least.
    """

    name: ClassVar[str]
    rival: ClassVar[str]
    Params: ClassVar[type[Any]]
    fewest: ClassVar[int] = 1

    @staticmethod
    def search(params: Any, start: Start, evaluate: Evaluate) -> None:
        """The package's own loop."""
        raise NotImplementedError

    @classmethod
    def init(cls, params: Any, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> PeerState:
        """Raises ValueError for fewer points than the package takes."""
        if len(population) < cls.fewest:
            raise ValueError(f"{cls.name} takes {cls.fewest} points or more: {len(population)} are too few")
        start = Start(population.copy(), np.full(len(population), np.inf), box, horizon, int(rng.integers(2**31)))
        return PeerState(cls.search, params, start, no_leaders(population, 1))

    @staticmethod
    def ask(state: PeerState) -> tuple[Array, PeerState]:
        if not state.started:
            return state.start.X.copy(), state
        asked = _conversation(state).asked
        if asked is None:
            raise RuntimeError("the peer's own loop has come to its end: `finished` says so")
        return asked.copy(), state

    @staticmethod
    def tell(state: PeerState, X: Array, fitness: Array) -> PeerState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        if state.started:
            _conversation(state).answer(loss.copy())
            state.told.append(loss)
        else:
            state.start = state.start._replace(X=X.copy(), loss=loss)
            state.started = True
        return state

    @staticmethod
    def incumbent(state: PeerState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: PeerState) -> bool:
        return state.started and _conversation(state).asked is None


def known_first(start: Start, evaluate: Evaluate) -> Evaluate:
    """For a loop that evaluates its first population itself: those points are known and not asked again."""
    known = start.loss.tolist()

    def answer(points: Array) -> Array:
        if not known:
            return evaluate(points)
        if len(points) > len(known):
            raise RuntimeError(f"asks for {len(points)} points when {len(known)} of its first population are left")
        answers = np.array(known[: len(points)])
        del known[: len(points)]
        return answers

    return answer


def _conversation(state: PeerState) -> Conversation:
    """The running loop; after a State was read back, one that has been told the same."""
    if state.conversation is None:
        state.conversation = Conversation(partial(state.search, state.params, state.start))
        for loss in state.told:
            state.conversation.answer(loss.copy())
    return state.conversation
