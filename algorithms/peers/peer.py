"""The base of all adapters: another package's own loop behind ask and tell.

The first population is that of the trial, as for every algorithm, and the peer starts from it. After that the peer
asks as its own loop does: a population at once or, where the package offers nothing else, a point at a time. The
package keeps its own way of staying inside the box. A fitness that is not finite reaches it as +inf.

A State is pickled as the peer's seed and all fitness values that it was told. To resume, the peer's loop runs again
from its start with the same answers. This is cheap, since nothing is evaluated, and exact, since the seed determines
all random numbers. A peer whose loop has ended is finished.

A package's loop calls its objective and expects an answer. Here the loop runs in a thread of its own; its objective
hands the points to the caller and waits for the fitness. Loop and caller never run at the same time.
"""

import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from queue import SimpleQueue
from typing import Any, ClassVar, NamedTuple

import numpy as np

from algorithms.contract import Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote
from armlab.common.arrays import Array

Evaluate = Callable[[Array], Array]
Loop = Callable[[Evaluate], None]


class _Dismissed(BaseException):
    """Ends the loop from within its objective when there is no caller; no Exception, so no loop catches it."""


class Conversation:
    """A running loop; `asked` is the population (m, d) that waits for its fitness, None after the loop's end."""

    def __init__(self, loop: Loop) -> None:
        self._questions: SimpleQueue[Array | BaseException | None] = SimpleQueue()
        self._answers: SimpleQueue[Array | None] = SimpleQueue()
        thread = threading.Thread(target=_run_loop, args=(loop, self._questions, self._answers), daemon=True)
        weakref.finalize(self, _dismiss_loop, self._answers, thread)
        thread.start()
        self.asked = self._next()

    def answer(self, loss: Array) -> None:
        """Give the fitness (m,) of what is asked, and wait for the next question.

        Raises what the loop raises.
        """
        self._answers.put(loss)
        self.asked = self._next()

    def _next(self) -> Array | None:
        question = self._questions.get()
        if isinstance(question, BaseException):
            raise question
        return question


def _run_loop(
    loop: Loop, questions: "SimpleQueue[Array | BaseException | None]", answers: "SimpleQueue[Array | None]"
) -> None:
    """Run the loop to its end. It holds the queues, not the Conversation, which could else never be collected."""

    def evaluate(points: Array) -> Array:
        questions.put(np.array(points, dtype=np.float64))
        loss = answers.get()
        if loss is None:
            answers.put(None)  # for a loop that goes on asking all the same
            raise _Dismissed
        return loss

    try:
        with np.errstate(all="ignore"):  # losses are infinite: inf - inf
            loop(evaluate)
    except _Dismissed:
        return
    except BaseException as error:  # whatever it is, it belongs to the caller, in whose thread it is raised
        questions.put(error)
    else:
        questions.put(None)


def _dismiss_loop(answers: "SimpleQueue[Array | None]", thread: threading.Thread) -> None:
    answers.put(None)
    if thread is not threading.current_thread():  # the last reference may be dropped there by the collector
        thread.join()


class Start(NamedTuple):
    """The start of a peer: points (n, d) and their loss (n,), the box, planned iterations and a seed < 2^31."""

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
        asked = _running_conversation(state).asked
        if asked is None:
            raise RuntimeError("the peer's own loop has come to its end: `finished` says so")
        return asked.copy(), state

    @staticmethod
    def tell(state: PeerState, X: Array, fitness: Array) -> PeerState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        if state.started:
            _running_conversation(state).answer(loss.copy())
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
        return state.started and _running_conversation(state).asked is None


def answer_first_population(start: Start, evaluate: Evaluate) -> Evaluate:
    """For a loop that evaluates its first population itself: answer those points from the known losses."""
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


def _running_conversation(state: PeerState) -> Conversation:
    """The running loop; after a State was read back, one that has been told the same."""
    if state.conversation is None:
        state.conversation = Conversation(partial(state.search, state.params, state.start))
        for loss in state.told:
            state.conversation.answer(loss.copy())
    return state.conversation
