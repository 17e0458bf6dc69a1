"""The files of an observation: a recording with something concealed in it, and nothing that tells what.

`recording.yaml` and the robot are copied from the public recording. The runs are arrays in SI units on the joint side,
because a concealed torque acts there and some of the recordings have raw channels (`run-<number>.npz`, remarks about
them in `runs.json`). `reference.yaml` is the simulation that is handed over.
"""

import json
import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from armlab.proof.open.real_concealed.conceal import ReferenceModel
from armlab.proof.open.real_concealed.concealed_case import Case
from armlab.proof.open.real_concealed.examine import conceal_case
from armlab.recordings.load import open_recording
from armlab.recordings.recording import Finding, Recording, Role, Run
from armlab.recordings.recording_file import read_recording_file

RUNS_FILE, REFERENCE_FILE = "runs.json", "reference.yaml"


@dataclass(frozen=True)
class _RunNote:
    """What a run is beside its signals."""

    file: str
    role: Role
    part: int
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class _Notes:
    """What is said of a recording beside its signals. source: its public name. findings: about more than one run."""

    source: str
    findings: tuple[Finding, ...]
    runs: tuple[_RunNote, ...]


def write_observation(reference: ReferenceModel, case: Case, folder: Path) -> None:
    """Writes the observation of a case into a new folder; one that is there is replaced."""
    public = reference.recording.folder
    answers = [entry.file for entry in read_recording_file(public).runs]
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(public, folder, ignore=shutil.ignore_patterns(*answers))
    seen = conceal_case(reference, case, folder / REFERENCE_FILE)
    for number, run in enumerate(seen.runs, 1):
        np.savez(_run_file(folder, number), allow_pickle=False, time=run.time, **run.signals)
    notes = tuple(_RunNote(run.file, run.role, run.part, run.findings) for run in seen.runs)
    content = json.dumps(asdict(_Notes(case.recording, seen.findings, notes)), indent=1)
    (folder / RUNS_FILE).write_text(content + "\n", encoding="utf-8")


def read_observation(folder: Path) -> tuple[Recording, str]:
    """The recording of an observation with its simulation, and the name of the public recording."""
    notes = TypeAdapter(_Notes).validate_json((folder / RUNS_FILE).read_bytes())
    runs = []
    for number, note in enumerate(notes.runs, 1):
        with np.load(_run_file(folder, number), allow_pickle=False) as signals:
            arrays = {name: signals[name] for name in signals.files}
        runs.append(Run(file=note.file, role=note.role, part=note.part, findings=note.findings, **arrays))
    seen, simulation = open_recording(folder)[0], folder / REFERENCE_FILE
    return replace(seen, runs=tuple(runs), findings=notes.findings, simulation=simulation), notes.source


def _run_file(folder: Path, number: int) -> Path:
    return folder / f"run-{number}.npz"
