"""What a worker does with a batch of trials, on whatever machine it stands."""

import faulthandler
import os
import platform
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import NamedTuple

from bench.execute import Failure, loaded, run_batch
from bench.fingerprint import fingerprint
from bench.outcome import Outcome
from bench.provenance import provenance
from bench.trial import Trial
from problem.registry import ProblemSettings

Work = Sequence[tuple[str, Trial]]
"""Trials, each with its key in the run store."""


class Report(NamedTuple):
    """What became of a batch, trial by trial, and the provenance of the worker."""

    results: list[tuple[str, Outcome | Failure]]
    origin: str


def do(work: Work, timeout_s: float | None = None) -> Report:
    """Run trials one after the other; the process dies with a trial that takes longer than `timeout_s`."""
    return Report([(key, _limited(key, trial, timeout_s)) for key, trial in work], _origin())


def do_elsewhere(work: Work, timeout_s: float | None = None) -> Report:
    """`do` in a process of its own, after a look whether it holds the code that the keys speak of."""
    strangers = [(key, trial) for key, trial in work if trial.key(_code(trial.algorithm, trial.problem)) != key]
    if strangers:
        return Report([(key, Failure(trial, _other_code())) for key, trial in strangers], _origin())
    return do(work, timeout_s)


def _limited(key: str, trial: Trial, timeout_s: float | None) -> Outcome | Failure:
    with _deadline(timeout_s):
        ((_, result),) = run_batch([(key, trial)])
    return result


@contextmanager
def _deadline(timeout_s: float | None) -> Iterator[None]:
    """End the process if the block takes longer.

    The watchdog is a thread in C with a clock that nobody sets: it needs neither the interpreter's lock nor the main
    thread, so that it ends a loop in compiled code as well.
    """
    if timeout_s is None:
        yield
        return
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(timeout_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


@lru_cache(maxsize=512)
def _code(algorithm: str, problem: ProblemSettings) -> str:
    return fingerprint(loaded(algorithm), problem.model_dump(mode="json"))


def _other_code() -> str:
    return f"OtherCodeError: the worker on {platform.node()} has other code or files than the place of the start"


@lru_cache
def _origin() -> str:
    return provenance()
