"""The origin of numbers: versions, machine and commit, written beside every outcome, and a hash of the code that
decides a trial.
"""

import hashlib
import inspect
import json
import platform
import subprocess
from collections.abc import Iterator
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from algorithms import registry as algorithm_registry
from algorithms.contract import AnyAlgorithm
from bench import execute, seeds
from problem import registry as problem_registry
from problem.registry import PRESETS, plug_ins

_PACKAGES = ("armlab", "numpy", "scipy", "cmaes", "joblib")


def provenance() -> str:
    """JSON text with the versions, BLAS, processor, operating system and commit of this installation."""
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    facts = {
        "python": platform.python_version(),
        **{package: version(package) for package in _PACKAGES},
        "blas": f"{blas['name']} {blas['version']}",
        "processor": _processor_name(),
        "system": platform.platform(),
        "commit": _git_commit(),
    }
    return json.dumps(facts, sort_keys=True)


def _processor_name() -> str:
    """The processor's name; Linux tells it only in /proc."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _git_commit() -> str | None:
    """`git describe` of the source tree, with -dirty if files were changed; None outside of one."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.strip() or None


_SOURCE_SUFFIXES = {".py", ".c", ".yaml", ".urdf"}


def fingerprint(algorithm: AnyAlgorithm, problem_settings: dict[str, Any]) -> str:
    """SHA-256 over the sources of problems, algorithms and seeds, and the files that only this trial needs.

    Those are the files of a third party's algorithm, the package of a third party's problem, and every file that the
    settings name, e.g. a robot.
    """
    paths = {Path(str(inspect.getsourcefile(code))) for code in (execute, seeds, algorithm)}
    preset = problem_settings.get("preset")
    if preset not in PRESETS:  # to look for plug-ins takes longer than all else here
        for entry in plug_ins():
            paths |= _package_sources(entry.load(), entry.module) if entry.name == preset else set()
    for module in (problem_registry, algorithm_registry):  # a package's own path may be a namespace of other folders
        paths |= _source_files(Path(str(inspect.getsourcefile(module))).parent)
    paths |= {path for path in map(Path, _nested_texts(problem_settings)) if path.is_file()}
    contents = sorted(f"{path.name} {_digest(path, *_file_state(path))}" for path in paths)
    return hashlib.sha256("\n".join(contents).encode()).hexdigest()  # the same wherever the files stand


def _package_sources(code: Any, module: str) -> set[Path]:
    """All sources of the package that the code of a module belongs to; its file alone if it is in none."""
    path = Path(str(inspect.getsourcefile(code)))
    depth = module.count(".")
    return _source_files(path.parents[depth - 1]) if depth else {path}


def _source_files(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.suffix in _SOURCE_SUFFIXES}


def _file_state(path: Path) -> tuple[int, int, int]:
    """What tells that a file was written to."""
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


@lru_cache(maxsize=4096)
def _digest(path: Path, *state: int) -> str:
    """SHA-256 of a file in a state: most files decide all trials, and need to be read once."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _nested_texts(content: Any) -> Iterator[str]:
    """All texts in nested settings."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for item in content.values() if isinstance(content, dict) else content:
            yield from _nested_texts(item)
