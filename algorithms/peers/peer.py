"""The base of all adapters: another package's own loop behind ask and tell.

The first population is that of the trial, as for every algorithm, and the peer starts from it. After that the peer
asks as its own loop does: a population at once or, where the package offers nothing else, a point at a time. The
package keeps its own way of staying inside the box. A fitness that is not finite reaches it as +inf. A loop that wants
derivatives asks for one point and says with a Question what it wants to know about it.

A State is pickled as the peer's seed and all answers that it was told. To resume, the peer's loop runs again
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
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np

from algorithms.contract import Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question


class Asked(NamedTuple):
    """What a loop asks: points (m, d), and what it wants to know beside their fitness."""

    points: Array
    question: Question | None


class Answer(NamedTuple):
    """The fitness (m,) of the asked points, and the derivatives if a question was asked."""

    loss: Array
    derivatives: Derivatives | None


class Evaluate(Protocol):
    """The objective that a loop calls."""

    def __call__(self, points: Array) -> Array:
        """The fitness (m,) of points (m, d)."""
        ...


class Inquire(Protocol):
    """The objective of a loop that wants derivatives too."""

    def __call__(self, points: Array) -> Array:
        """The fitness (m,) of points (m, d)."""
        ...

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """The answer to a question about a point (d,)."""
        ...


Loop = Callable[[Inquire], None]


class _Dismissed(BaseException):
    """Ends the loop from within its objective when there is no caller; no Exception, so no loop catches it."""


class Conversation:
    """A running loop; `asked` is what waits for its answer, None after the loop's end."""

    def __init__(self, loop: Loop) -> None:
        self._questions: SimpleQueue[Asked | BaseException | None] = SimpleQueue()
        self._answers: SimpleQueue[Answer | None] = SimpleQueue()
        thread = threading.Thread(target=_run_loop, args=(loop, self._questions, self._answers), daemon=True)
        weakref.finalize(self, _dismiss_loop, self._answers, thread)
        thread.start()
        self.asked = self._next()

    def answer(self, answer: Answer) -> None:
        """Answer what is asked, and wait for the next question.

        Raises what the loop raises.
        """
        self._answers.put(answer)
        self.asked = self._next()

    def _next(self) -> Asked | None:
        question = self._questions.get()
        if isinstance(question, BaseException):
            raise question
        return question


@dataclass(frozen=True)
class _Objective:
    """The loop's end of both queues."""

    questions: "SimpleQueue[Asked | BaseException | None]"
    answers: "SimpleQueue[Answer | None]"

    def __deepcopy__(self, memo: object) -> Self:
        return self  # a package may copy its problem, and asks the same caller all the same

    def __call__(self, points: Array) -> Array:
        return self._ask(Asked(np.array(points, dtype=np.float64), None)).loss

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        derivatives = self._ask(Asked(np.array(point, dtype=np.float64)[None], question)).derivatives
        if derivatives is None:
            raise RuntimeError("a question was answered without derivatives")
        return derivatives

    def _ask(self, asked: Asked) -> Answer:
        self.questions.put(asked)
        answer = self.answers.get()
        if answer is None:
            self.answers.put(None)  # for a loop that goes on asking all the same
            raise _Dismissed
        return answer


def _run_loop(
    loop: Loop, questions: "SimpleQueue[Asked | BaseException | None]", answers: "SimpleQueue[Answer | None]"
) -> None:
    """Run the loop to its end. It holds the queues, not the Conversation, which could else never be collected."""
    try:
        with np.errstate(all="ignore"):  # losses are infinite: inf - inf
            loop(_Objective(questions, answers))
    except _Dismissed:
        return
    except BaseException as error:  # whatever it is, it belongs to the caller, in whose thread it is raised
        questions.put(error)
    else:
        questions.put(None)


def _dismiss_loop(answers: "SimpleQueue[Answer | None]", thread: threading.Thread) -> None:
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


Search = Callable[[Any, Start, Any], None]


@dataclass
class PeerState:
    """The peer's loop, and the answers that it was told after its first population, in order.

    derivatives: told, while the fitness of the same point is still to come.
    """

    search: Search
    params: Any
    start: Start
    leaders: Leaders
    told: list[Answer] = field(default_factory=list)
    derivatives: Derivatives | None = None
    started: bool = False
    conversation: Conversation | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "conversation": None}  # a running loop cannot be pickled, but run again


class Peer:
    """Base of the adapters, which name themselves and their Params and define `search`.

    search(params, start, evaluate): run the package's loop from `start`; evaluate (m, d) -> (m,).
    rival: name of the algorithm here that it stands beside. fewest: points that the package takes at least.
    calls_lapack: see `bench.fingerprint`.
    """

    name: ClassVar[str]
    rival: ClassVar[str]
    Params: ClassVar[type[Any]]
    fewest: ClassVar[int] = 1
    calls_lapack: ClassVar[bool] = False

    @staticmethod
    def search(params: Any, start: Start, evaluate: Any) -> None:
        """The package's own loop."""
        raise NotImplementedError

    @classmethod
    def init(cls, params: Any, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> PeerState:
        start = Start(population.copy(), np.full(len(population), np.inf), box, horizon, int(rng.integers(2**31)))
        return PeerState(cls.search, params, start, no_leaders(population, 1))

    @staticmethod
    def ask(state: PeerState) -> tuple[Array, PeerState]:
        if not state.started:
            return state.start.X.copy(), state
        asked = _running_conversation(state).asked
        if asked is None:
            raise RuntimeError("the peer's own loop has come to its end: `finished` says so")
        return asked.points.copy(), state

    @staticmethod
    def tell(state: PeerState, X: Array, fitness: Array) -> PeerState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        if state.started:
            answer = Answer(loss, state.derivatives)
            _running_conversation(state).answer(_copy_answer(answer))
            state.told.append(answer)
            state.derivatives = None
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


class GradientPeer(Peer):
    """Base of loops that want derivatives too; their `search` calls `evaluate.differentiate` beside `evaluate`."""

    calls_lapack = True  # for the derivatives of singular values

    @staticmethod
    def question(state: PeerState) -> Question | None:
        asked = _running_conversation(state).asked if state.started else None
        return None if asked is None else asked.question

    @staticmethod
    def tell_derivatives(state: PeerState, derivatives: Derivatives) -> PeerState:
        state.derivatives = derivatives
        return state


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
        for answer in state.told:
            state.conversation.answer(_copy_answer(answer))
    return state.conversation


def _copy_answer(answer: Answer) -> Answer:
    """The loop may write into what it is given; the saved answer stays as it was."""
    derivatives = answer.derivatives
    if derivatives is not None:
        derivatives = derivatives._replace(
            slope=derivatives.slope.copy(),
            margins=derivatives.margins.copy(),
            watched=derivatives.watched.copy(),
            margin_slopes=derivatives.margin_slopes.copy(),
        )
    return Answer(answer.loss.copy(), derivatives)
