"""What decides a trial's outcome beside its settings, as one hash: outcomes of other code are never reused."""

import hashlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import algorithms
import problem
from algorithms.contract import AnyAlgorithm
from bench import execute, seeds
from problem.registry import plug_ins

_SUFFIXES = {".py", ".c", ".yaml", ".urdf"}


def fingerprint(algorithm: AnyAlgorithm, problem_settings: dict[str, Any]) -> str:
    """SHA-256 over the sources of problems, algorithms and seeds, and the files that only this trial needs.

    Those are the files of a third party's algorithm and problem, and every file that the settings name, e.g. a
    robot.
    """
    paths = {Path(str(inspect.getsourcefile(code))) for code in (execute, seeds, algorithm)}
    preset = problem_settings.get("preset")
    paths |= {Path(str(inspect.getsourcefile(entry.load()))) for entry in plug_ins() if entry.name == preset}
    for package in (problem, algorithms):
        paths |= {path for path in Path(package.__path__[0]).rglob("*") if path.suffix in _SUFFIXES}
    paths |= {path for path in map(Path, _texts(problem_settings)) if path.is_file()}
    contents = sorted(f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}" for path in paths)
    return hashlib.sha256("\n".join(contents).encode()).hexdigest()  # the same wherever the files stand


def _texts(content: Any) -> Iterator[str]:
    """All texts in nested settings."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for item in content.values() if isinstance(content, dict) else content:
            yield from _texts(item)
