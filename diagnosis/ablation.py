"""One recording with each guard off in turn; stages that a guard has no part in are done once for all."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from diagnosis.engine.rounds import Round, found
from diagnosis.result import Diagnosis
from diagnosis.run import diagnose
from diagnosis.settings import GUARDS, Settings, guards_without
from diagnosis.stages import prepared
from diagnosis.verdict import verdict
from recordings.load import load_recording
from recordings.recording import Recording

ALL_ON = "all guards on"
AFTER_THE_SEARCH = ("robust_variance", "correction", "heldout_gain", "unknown")
IN_THE_SEARCH = ("prewhitening", "backward_elimination", "background_start")


def verdicts_without_each(folder: Path) -> dict[str, dict[str, Any]]:
    """The verdict on a recording folder with all guards on, and with each off, by its name."""
    return {guard: verdict(told) for guard, told in without_each(load_recording(folder))}


def without_each(recording: Recording) -> Iterator[tuple[str, Diagnosis]]:
    """The diagnosis with all guards on, then with each off."""
    ready = prepared(recording, None, 0, Settings(), _quiet)
    if isinstance(ready, Diagnosis):
        yield from ((guard, ready) for guard in (ALL_ON, *GUARDS))
        return
    first = ready.begun(_quiet)
    searched = found(first, _quiet)
    yield ALL_ON, ready.told(searched, time.perf_counter(), _quiet)
    for guard in GUARDS:
        settings = Settings(guards=guards_without((guard,)))
        if guard in AFTER_THE_SEARCH:
            yield guard, ready.told(_under(searched, settings), time.perf_counter(), _quiet)
        elif guard in IN_THE_SEARCH:
            again = found(_under(first, settings), _quiet)
            yield guard, ready.told(again, time.perf_counter(), _quiet)
        else:
            yield guard, diagnose(recording, settings=settings)


def _under(each: Round, settings: Settings) -> Round:
    """A round under other settings."""
    return replace(each, bench=replace(each.bench, settings=settings))


def _quiet(message: str) -> None:
    """Tells nothing."""
