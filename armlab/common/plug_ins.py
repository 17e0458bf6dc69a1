"""Imports plug-ins of other packages: each first in a process of its own, so that one that hangs or ends is named.

`python -m armlab.common.plug_ins NAME VALUE` is that process.
"""

import hashlib
import io
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from datetime import date
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError, describe_failure
from armlab.common.files import write_whole

GROUPS = ("armlab.algorithms", "armlab.problems", "armlab.suites", "armlab.effects")
IMPORT_LIMIT_S = 20.0
_OWN_PACKAGES = ("algorithms", "armlab", "bench", "problem")


class BrokenPlugInError(Exception):
    """What an entry point names cannot be imported; the message is the reason, in one line."""


def load_plug_in(entry: EntryPoint) -> Any:
    """What an entry point names.

    A module of another package is imported in a process of its own first, for IMPORT_LIMIT_S at most. Where that works,
    it is not repeated on the same day while the files of its package stay as they are. Its import here prints nothing,
    and leaves the variables of the environment, the working folder, and what numpy does about errors as they were.
    Raises BrokenPlugInError, with the error of the import as its cause if it was raised here.
    """
    if is_own(entry) or entry.module in sys.modules:
        return _load(entry)
    reason = _try_import(entry.name, entry.value, IMPORT_LIMIT_S)
    if reason:
        raise BrokenPlugInError(reason)
    with _without_traces():
        return _load(entry)


def is_own(entry: EntryPoint) -> bool:
    """Whether an entry point names a module of armlab itself."""
    return _top_package(entry.module) in _OWN_PACKAGES


def plug_in_at_fault(error: BaseException) -> str | None:
    """The plug-in whose code raised an error, where it did, and the error, in one line; None if no plug-in did."""
    entries = [entry for group in GROUPS for entry in entry_points(group=group) if not is_own(entry)]
    step, found = error.__traceback__, None
    while step is not None:
        top = _top_package(str(step.tb_frame.f_globals.get("__name__")))
        for entry in (each for each in entries if _top_package(each.module) == top):
            kind = entry.group.rpartition(".")[2].removesuffix("s")
            place = f"{Path(step.tb_frame.f_code.co_filename).name}:{step.tb_lineno}"
            found = f"the plug-in of {kind} {entry.name!r} ({entry.value}) fails in {place}: {describe_failure(error)}"
        step = step.tb_next
    return found


def _top_package(module: str) -> str:
    return module.partition(".")[0]


def _load(entry: EntryPoint) -> Any:
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # whatever a third party's module does when it is imported
        raise BrokenPlugInError(describe_failure(error)) from error


@contextmanager
def _without_traces() -> Iterator[None]:
    """Takes back what an import changes of the process, as far as that is known."""
    variables, folder = dict(os.environ), Path.cwd()
    try:
        with (
            redirect_stdout(io.StringIO()),
            redirect_stderr(io.StringIO()),
            warnings.catch_warnings(action="ignore"),
            np.errstate(),
        ):
            yield
    finally:
        os.chdir(folder)
        if variables != os.environ:
            os.environ.clear()
            os.environ.update(variables)


@cache
def _try_import(name: str, value: str, limit_s: float) -> str:
    """Why the import of VALUE fails; empty where it does not. A failure is tried again: its reason may have gone."""
    key = _key_of(value)
    known = _read_tried()
    if key in known:
        return ""
    command = [sys.executable, "-P", "-m", __spec__.name, name, value]
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    try:
        done = subprocess.run(
            command,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"its import takes longer than {limit_s:g} s"
    try:
        reason = str(json.loads(done.stdout))
    except ValueError:
        end = f"status {done.returncode}" if done.returncode >= 0 else f"signal {-done.returncode}"
        return f"its import ends the process ({end})"
    if key is not None and not reason:
        _write_tried([*known, key])
    return reason


def _key_of(value: str) -> str | None:
    """SHA-256 of the day, of VALUE, and of the names, times and sizes of its package's files; None without files."""
    try:
        spec = find_spec(_top_package(value.partition(":")[0].strip()))
        if spec is None or spec.origin is None:
            return None
        origin = Path(spec.origin)
        files = sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]
        stamps = [(str(file), status.st_mtime_ns, status.st_size) for file in files for status in [file.stat()]]
    except (ImportError, ValueError, OSError):
        return None
    content = [date.today().isoformat(), sys.prefix, value, stamps]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _tried_file() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "armlab" / "plug-ins.json"


def _read_tried() -> list[str]:
    """Keys of this day whose import works."""
    try:
        content = json.loads(_tried_file().read_text(encoding="utf-8"))
        return list(content["keys"]) if content["day"] == date.today().isoformat() else []
    except (OSError, ValueError, KeyError, TypeError):  # none yet, or not written by this version
        return []


def _write_tried(keys: Sequence[str]) -> None:
    content = {"day": date.today().isoformat(), "keys": list(keys)}
    try:
        _tried_file().parent.mkdir(parents=True, exist_ok=True)
        write_whole(_tried_file(), json.dumps(content))
    except (OSError, InputError):
        return  # without it, the next command tries again


def _main(name: str, value: str) -> None:
    """Imports VALUE and prints why that fails, as JSON; ends at once, whatever the import has started."""
    answer = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        EntryPoint(name, value, GROUPS[0]).load()
        reason = ""
    except BaseException as error:  # KeyboardInterrupt too: nobody else can raise it here
        reason = describe_failure(error)
    os.write(answer, json.dumps(reason).encode())
    os._exit(0)


if __name__ == "__main__":
    _main(*sys.argv[1:])
