"""The result of a command in two forms: lines for people, and one JSON document for programs."""

import json
import math
from collections.abc import Generator, Iterable, Mapping
from dataclasses import asdict, is_dataclass
from datetime import date
from pathlib import Path
from typing import Any

Document = dict[str, Any]
ResultLines = Generator[str, None, Document]
"""Lines as they come; the value that the generator returns is the whole result as a document."""


class FailedResultError(Exception):
    """A result that is itself a failure, such as a recording with runs that cannot be used. status: exit status."""

    def __init__(self, message: str, document: Document, status: int) -> None:
        super().__init__(message)
        self.document = document
        self.status = status


def json_text(content: object) -> str:
    """JSON text of plain data, arrays, paths, days and dataclasses; null stands for a number that is not finite."""
    return json.dumps(_plain(content), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _plain(value: Any) -> Any:
    """The value as JSON can hold it."""
    if hasattr(value, "tolist"):  # an array or a number of numpy
        value = value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value.isoformat() if isinstance(value, date) else str(value) if isinstance(value, Path) else value


def written_files(paths: Iterable[Path]) -> ResultLines:
    """The lines and the document of a command whose result is files; each path is told once it is written."""
    written = []
    for path in paths:
        written.append(path)
        yield str(path)
    return {"files": written}
