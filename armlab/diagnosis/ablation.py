"""The same recording with each guard off in turn."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from armlab.diagnosis.diagnose import conclude, diagnose, prepare
from armlab.diagnosis.fitted_model import FittedModel, fit_background, search_effects
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import GUARDS, Settings, guards_without
from armlab.diagnosis.verdict_files import make_verdict
from armlab.effects.library import library
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording

ALL_ON = "all guards on"
GUARDS_AFTER_SEARCH = ("robust_variance", "correction", "heldout_gain", "unknown")
GUARDS_IN_SEARCH = ("prewhitening", "backward_elimination", "background_start")


def verdicts_without_each(folder: Path) -> dict[str, dict[str, Any]]:
    """The verdict on a recording folder with all guards on, and with each off, by its name."""
    return {guard: make_verdict(told).content() for guard, told in diagnose_without_each(load_recording(folder))}


def diagnose_without_each(recording: Recording) -> Iterator[tuple[str, Diagnosis]]:
    """The diagnosis with all guards on, then with each off."""
    design = prepare(recording, None, Settings(), _no_progress)
    if isinstance(design, Diagnosis):
        yield from ((guard, design) for guard in (ALL_ON, *GUARDS))
        return
    background = fit_background(design, library(), 0, _no_progress)
    searched = search_effects(background, _no_progress)
    yield ALL_ON, conclude(recording, searched, _no_progress)
    for guard in GUARDS:
        settings = Settings(guards=guards_without((guard,)))
        if guard in GUARDS_AFTER_SEARCH:
            yield guard, conclude(recording, _with_settings(searched, settings), _no_progress)
        elif guard in GUARDS_IN_SEARCH:
            again = search_effects(_with_settings(background, settings), _no_progress)
            yield guard, conclude(recording, again, _no_progress)
        else:
            yield guard, diagnose(recording, settings=settings)


def _with_settings(each: FittedModel, settings: Settings) -> FittedModel:
    """A round under other settings."""
    return replace(each, design=replace(each.design, settings=settings))


def _no_progress(message: str) -> None:
    """Tells nothing."""
