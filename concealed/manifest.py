"""The seal: a manifest with the SHA-256 of every file, whose own SHA-256 is printed before the first diagnosis."""

import hashlib
import json
from pathlib import Path
from typing import Any

from problem.errors import InputError

NAME = "manifest.json"


def write_manifest(folder: Path, facts: dict[str, Any]) -> str:
    """Writes the manifest of a concealed set and returns its SHA-256."""
    parts = (path for part in ("observations", "truth") for path in (folder / part).rglob("*") if path.is_file())
    files = {path.relative_to(folder).as_posix(): digest(path) for path in parts}
    content = json.dumps({"schema": "manifest/1", **facts, "files": dict(sorted(files.items()))}, indent=1) + "\n"
    (folder / NAME).write_text(content, encoding="utf-8")
    return digest(folder / NAME)


def checked_manifest(folder: Path, expected: str | None = None) -> tuple[dict[str, Any], str]:
    """The manifest of a concealed set and its SHA-256, after every file was compared with it.

    expected: the SHA-256 that was printed. Raises InputError if anything differs.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(f"no {NAME} in {folder}: it is no finished concealed set")
    found = digest(path)
    if expected is not None and found != expected:
        raise InputError(f"{path} has the SHA-256 {found}, not {expected}: it is not the manifest that was sealed")
    manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    for name, value in manifest["files"].items():
        file = folder / name
        if not file.is_file() or digest(file) != value:
            what = "was changed" if file.is_file() else "is missing"
            raise InputError(f"{file} {what} after {NAME} was sealed: the set cannot be scored")
    return manifest, found


def digest(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
