"""Outcomes that are kept, so that an interrupted command goes on where it stopped.

Each is kept under what it follows from: the code, the recording, and the case. (Not under the reference model: its last
digits differ from run to run with where arrays lie in memory.)
"""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError

from diagnosis.real_concealed.outcome import Outcome
from diagnosis.real_concealed.plan import Case
from recordings.recording import Recording

ROOT = Path(__file__).resolve().parents[2]
CODE = (
    "problem", "recordings", "identification", "diagnosis/effects", "diagnosis/engine", "diagnosis/run.py",
    "diagnosis/settings.py", "diagnosis/result.py", "diagnosis/real_concealed/reference.py",
    "diagnosis/real_concealed/withhold.py", "diagnosis/real_concealed/inject.py",
    "diagnosis/real_concealed/outcome.py", "diagnosis/real_concealed/examine.py",
)  # fmt: skip
OUTCOME = TypeAdapter(Outcome)


@dataclass(frozen=True)
class Kept:
    """A folder of outcomes. code: SHA-256 of everything that an outcome follows from but data."""

    folder: Path
    code: str

    def place(self, case: Case, recording: Recording) -> Path:
        """Where an outcome stands."""
        key = hashlib.sha256(f"{self.code} {case!r}".encode())
        for run in recording.runs:
            key.update(f"{run.name} {run.role}".encode())
            for signal in (run.time, run.position, run.torque):
                key.update(np.ascontiguousarray(signal).tobytes())
        return self.folder / f"{case.recording}-{key.hexdigest()[:20]}.json"

    def read(self, case: Case, recording: Recording) -> Outcome | None:
        """The outcome, if it is there and whole."""
        try:
            return OUTCOME.validate_json(self.place(case, recording).read_bytes())
        except (FileNotFoundError, ValidationError):
            return None

    def write(self, case: Case, recording: Recording, outcome: Outcome) -> None:
        """Keeps an outcome."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.place(case, recording).write_bytes(OUTCOME.dump_json(outcome))


def kept_in(folder: Path) -> Kept:
    """Outcomes of the code as it stands."""
    code = hashlib.sha256()
    for path in sorted(_files(CODE)):
        code.update(path.read_bytes())
    return Kept(folder, code.hexdigest())


def _files(names: Iterable[str]) -> Iterable[Path]:
    for name in names:
        place = ROOT / name
        yield from (place,) if place.is_file() else place.rglob("*.py")
