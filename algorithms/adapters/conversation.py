"""A loop that calls its objective, turned inside out: it asks, and waits to be told.

The loop runs in a thread of its own, and never at the same time as its caller: one of both always waits.
"""

import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue

import numpy as np

from algorithms.contract import Array

Evaluate = Callable[[Array], Array]
Loop = Callable[[Evaluate], None]


class _Dismissed(BaseException):
    """Ends the loop from within its objective when nobody will answer any more; no loop takes it for an error."""


class Conversation:
    """A running loop; `asked` is the population (m, d) that waits for its fitness, None after the loop's end."""

    def __init__(self, loop: Loop) -> None:
        self._questions: SimpleQueue[Array | BaseException | None] = SimpleQueue()
        self._answers: SimpleQueue[Array | None] = SimpleQueue()
        thread = threading.Thread(target=_talk, args=(loop, self._questions, self._answers), daemon=True)
        weakref.finalize(self, _dismiss, self._answers, thread)
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


def _talk(
    loop: Loop, questions: "SimpleQueue[Array | BaseException | None]", answers: "SimpleQueue[Array | None]"
) -> None:
    """Run the loop to its end; it knows the queues but not the Conversation, which else would never be let go."""

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


def _dismiss(answers: "SimpleQueue[Array | None]", thread: threading.Thread) -> None:
    answers.put(None)
    if thread is not threading.current_thread():  # the last reference may be dropped there by the collector
        thread.join()
