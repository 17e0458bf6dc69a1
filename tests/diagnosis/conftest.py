"""Diagnoses that several tests need, each made once in a process."""

import hashlib
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.recording import Recording

_KNOWN: dict[str, Diagnosis] = {}


def diagnose_once(
    recording: Recording, *settings: object, progress: Callable[[str], None] = lambda message: None, **options: Any
) -> Diagnosis:
    """`diagnose`, which answers the same question with the same diagnosis: a test of its own checks that it is so.

    The folder of a recording is no part of the question, unless a simulation is read from it.
    """
    asked = recording if recording.simulation is not None else replace(recording, folder=Path("known"))
    key = hashlib.sha256(pickle.dumps((asked, settings, sorted(options.items())))).hexdigest()
    if key not in _KNOWN:
        _KNOWN[key] = diagnose(recording, *settings, progress=progress, **options)
    found = _KNOWN[key]
    return replace(found, recording=replace(found.recording, folder=recording.folder))


@pytest.fixture
def each_diagnosed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of comparisons, which begin with a diagnosis of every recording."""
    monkeypatch.setattr("armlab.diagnosis.changes.comparison.diagnose", diagnose_once)
