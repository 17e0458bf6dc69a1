"""The log of looks at validation data: the more there are, the less a good figure means."""

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from armlab.common.errors import InputError

LOOKS_FILE = "validation_looks.jsonl"


@dataclass(frozen=True)
class Looks:
    """A file with one JSON line a look, to which this only ever appends."""

    path: Path

    def note(self, recording: str, run: str, model: str) -> None:
        """Logs a look before it happens; InputError where that is not possible."""
        entry = {"time": datetime.now(UTC).isoformat(timespec="seconds"), "recording": recording}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry | {"run": run, "model": model}) + "\n")
        except OSError as error:
            raise InputError(f"cannot log the look at {run} in {self.path}: {error.strerror}") from None

    def count(self, recording: str, run: str) -> int:
        """How often a run was looked at."""
        if not self.path.is_file():
            return 0
        entries = (json.loads(line) for line in self.path.read_text(encoding="utf-8").splitlines() if line)
        return sum(entry["recording"] == recording and entry["run"] == run for entry in entries)
