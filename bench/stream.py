"""Batches through an engine with few under way at a time; a trial that kills its worker is found and set aside."""

from collections import deque
from collections.abc import Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field

from bench.engines.contract import Engine
from bench.engines.work import Report, Work
from bench.execute import Failure


@dataclass
class _Trials:
    """What is left to submit: the batches of the plan and, first, those that must run alone.

    alone: keys of the first trials of batches with which a worker died once; shared: of those that were under way
    together with others, so that the worker may have died with another. Settled ones are taken out of both.
    """

    batches: Iterator[Work]
    suspects: deque[Work] = field(default_factory=deque)
    alone: set[str] = field(default_factory=set)
    shared: set[str] = field(default_factory=set)

    def next(self, under_way: Collection[Work]) -> Work | None:
        """None where nothing is left, or where a suspect has or waits for the workers."""
        if any(work[0][0] in self.alone for work in under_way):
            return None
        if self.suspects:
            return None if under_way else self.suspects.popleft()
        work = next(self.batches, None)
        if work and under_way:
            self.shared |= {one[0][0] for one in (work, *under_way)}
        return work

    def suspect(self, work: Work) -> None:
        self.alone.add(work[0][0])
        self.suspects.append(work)

    def settle(self, work: Work) -> None:
        self.alone.discard(work[0][0])
        self.shared.discard(work[0][0])


def stream(batches: Iterator[Work], engine: Engine, timeout_s: float | None = None) -> Iterator[Report]:
    """Reports in the order in which they come; no more than `engine.slots` batches are under way.

    Where a worker dies, all that may be the cause runs once more, one batch at a time; the batch that dies again is
    taken apart; and the trial that dies alone is reported as a failure. An innocent one gets its outcome.
    """
    trials = _Trials(batches)
    under_way: dict[Future[Report], Work] = {}
    while True:
        while len(under_way) < engine.slots and (work := trials.next(under_way.values())) is not None:
            under_way[engine.submit(work)] = work
        if not under_way:
            return
        for future in wait(under_way, return_when=FIRST_COMPLETED).done:
            work = under_way.pop(future)
            try:
                report = future.result()
            except engine.crashes:
                report = _after_crash(work, trials, timeout_s)
            else:
                trials.settle(work)
            yield report


def _after_crash(work: Work, trials: _Trials, timeout_s: float | None) -> Report:
    """What is known now: nothing, unless a trial was alone."""
    first = work[0][0]
    if first not in trials.alone and (first in trials.shared or len(work) == 1):
        trials.suspect(work)
        return Report([], "")
    trials.settle(work)
    if len(work) == 1:
        ((key, trial),) = work
        return Report([(key, Failure(trial, _lost(timeout_s)))], "")
    for one in work:
        trials.suspect([one])
    return Report([], "")


def _lost(timeout_s: float | None) -> str:
    limit = "" if timeout_s is None else f", or it takes longer than trial_timeout_s = {timeout_s:g}"
    return f"WorkerLostError: twice the worker process died with this trial: something kills it{limit}"
