"""What decides a trial's outcome beside its settings, as one hash: outcomes of other code are never reused."""

import hashlib
import inspect
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from algorithms import registry as algorithm_registry
from algorithms.contract import AnyAlgorithm
from bench import execute, seeds
from problem import registry as problem_registry
from problem.registry import PRESETS, plug_ins

_SUFFIXES = {".py", ".c", ".yaml", ".urdf"}


def fingerprint(algorithm: AnyAlgorithm, problem_settings: dict[str, Any]) -> str:
    """SHA-256 over the sources of problems, algorithms and seeds, and the files that only this trial needs.

    Those are the files of a third party's algorithm, the package of a third party's problem, and every file that the
    settings name, e.g. a robot.
    """
    paths = {Path(str(inspect.getsourcefile(code))) for code in (execute, seeds, algorithm)}
    preset = problem_settings.get("preset")
    if preset not in PRESETS:  # to look for plug-ins takes longer than all else here
        for entry in plug_ins():
            paths |= _package(entry.load(), entry.module) if entry.name == preset else set()
    for module in (problem_registry, algorithm_registry):  # a package's own path may be a namespace of other folders
        paths |= _sources(Path(str(inspect.getsourcefile(module))).parent)
    paths |= {path for path in map(Path, _texts(problem_settings)) if path.is_file()}
    contents = sorted(f"{path.name} {_digest(path, *_state(path))}" for path in paths)
    return hashlib.sha256("\n".join(contents).encode()).hexdigest()  # the same wherever the files stand


def _package(code: Any, module: str) -> set[Path]:
    """All sources of the package that the code of a module belongs to; its file alone if it is in none."""
    path = Path(str(inspect.getsourcefile(code)))
    depth = module.count(".")
    return _sources(path.parents[depth - 1]) if depth else {path}


def _sources(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.suffix in _SUFFIXES}


def _state(path: Path) -> tuple[int, int, int]:
    """What tells that a file was written to."""
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


@lru_cache(maxsize=4096)
def _digest(path: Path, *state: int) -> str:
    """SHA-256 of a file in a state: most files decide all trials, and need to be read once."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _texts(content: Any) -> Iterator[str]:
    """All texts in nested settings."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for item in content.values() if isinstance(content, dict) else content:
            yield from _texts(item)
