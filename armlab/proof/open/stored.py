"""Digests under which outcomes of diagnoses are stored: of the code and of a recording, so that neither goes stale."""

import hashlib
from pathlib import Path

import numpy as np

from armlab.recordings.recording import Recording

REPOSITORY = Path(__file__).resolve().parents[3]
CODE_FOLDERS = (
    "problem",
    "armlab/common",
    "armlab/recordings",
    "armlab/effects",
    "armlab/identification",
    "armlab/diagnosis",
)
CODE_SUFFIXES = (".py", ".c", ".yaml", ".json")  # robots are YAML, learnt weights and bounds JSON


def code_digest(*own: Path) -> str:
    """SHA-256 of everything that an outcome follows from but data. own: the files of the study itself."""
    below = [path for folder in CODE_FOLDERS for path in (REPOSITORY / folder).rglob("*")]
    sources = [path for path in below if path.suffix in CODE_SUFFIXES]
    code = hashlib.sha256()
    for path in sorted({*sources, *own}):
        code.update(path.read_bytes())
    return code.hexdigest()


def recording_digest(recording: Recording) -> str:
    """SHA-256 of the runs of a recording, their names and their roles."""
    data = hashlib.sha256()
    for run in recording.runs:
        data.update(f"{run.name} {run.role}".encode())
        for signal in (run.time, run.position, run.torque):
            data.update(np.ascontiguousarray(signal).tobytes())
    return data.hexdigest()
