"""The same recording with each guard off in turn, and with other tuning numbers."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import GUARDS, Settings, guards_without, vary
from armlab.diagnosis.torque.diagnose import conclude_search, diagnose, prepare
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background, search_effects
from armlab.diagnosis.tuning import parse_change
from armlab.effects.library import library
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from armlab.report.verdict_files import make_verdict

ALL_ON = "all guards on"
GUARDS_AFTER_SEARCH = ("robust_variance", "correction", "heldout_gain", "unknown")
GUARDS_IN_SEARCH = ("prewhitening", "backward_elimination", "background_start")
STAGES_AFTER_SEARCH = ("evidence", "pruning", "location", "unknown", "claims", "intervals")  # of tuning numbers


def verdicts_without_each(folder: Path, changes: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Verdicts on a recording folder: with all guards on, without each by its name, and with each change by its text.

    changes: other tuning numbers, one at a time, like `noise.max_order=8`. Raises InputError for one that there is not.
    """
    recording = load_recording(folder)
    return {name: make_verdict(found).content() for name, found in diagnose_without_each(recording, changes)}


def diagnose_without_each(recording: Recording, changes: Sequence[str] = ()) -> Iterator[tuple[str, Diagnosis]]:
    """The diagnosis with all guards on, then with each off, then with each change of a tuning number."""
    changed = {change: vary(Settings(), *parse_change(change)) for change in changes}
    design = prepare(recording, None, Settings(), _no_progress)
    if isinstance(design, Diagnosis):
        yield from ((guard, design) for guard in (ALL_ON, *GUARDS))
        yield from ((change, diagnose(recording, settings=settings)) for change, settings in changed.items())
        return
    background = fit_background(design, library(), 0, _no_progress)
    searched = search_effects(background, _no_progress)
    yield ALL_ON, conclude_search(recording, searched, _no_progress)
    for guard in GUARDS:
        settings = Settings(guards=guards_without((guard,)))
        if guard in GUARDS_AFTER_SEARCH:
            yield guard, conclude_search(recording, _with_settings(searched, settings), _no_progress)
        elif guard in GUARDS_IN_SEARCH:
            again = search_effects(_with_settings(background, settings), _no_progress)
            yield guard, conclude_search(recording, again, _no_progress)
        else:
            yield guard, diagnose(recording, settings=settings)
    for change, settings in changed.items():
        if change.startswith(tuple(f"{stage}." for stage in STAGES_AFTER_SEARCH)):
            yield change, conclude_search(recording, _with_settings(searched, settings), _no_progress)
        else:
            yield change, diagnose(recording, settings=settings)


def _with_settings(each: FittedModel, settings: Settings) -> FittedModel:
    """A round under other settings."""
    return replace(each, design=replace(each.design, settings=settings))


def _no_progress(message: str) -> None:
    """Tells nothing."""
