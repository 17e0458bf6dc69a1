"""The examination of `armlab doctor`: what is installed, what is missing, what is broken.

Apart from the click commands, since it imports what it examines, and `armlab --help` imports all modules of commands.
"""

import os
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from time import perf_counter
from typing import Literal

from armlab.common.documents import FailedResultError, ResultLines
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import install_line

State = Literal["ok", "missing", "broken"]
KERNELS = {
    "algorithms._flight": "particle swarms",
    "problem._kernel": "observation matrices",
    "problem._spectra": "condition numbers",
    "armlab.common._linear_filter": "filters of torque and columns",
    "armlab.effects._drive_train": "play and springs of drive trains",
    "armlab.diagnosis.motion._joint_replay": "replay of position servos",
    "armlab.proof.blind.servo._servo_arm": "simulated servos of the proof",
}
MAX_ERROR = 1e-9  # relative, of what the self-test computes twice


@dataclass(frozen=True)
class Examined:
    """One thing. state: `missing` is what nobody needs who does not use it, `broken` is what armlab needs."""

    name: str
    state: State
    text: str


def examine_installation() -> ResultLines:
    """A line for each thing; raises FailedResultError at the end where something that is needed is broken."""
    examined = []
    for each in _examine_all():
        examined.append(each)
        yield f"{each.state:<8}{each.name}: {each.text}"
    broken = [each.name for each in examined if each.state == "broken"]
    document = {"healthy": not broken, "examined": examined}
    if broken:
        raise FailedResultError(f"broken: {', '.join(broken)}; the lines above say why", document, status=1)
    return document


def _examine_all() -> Iterator[Examined]:
    yield Examined("Python", "ok", f"{platform.python_version()} at {sys.executable}, {platform.platform()}")
    yield _examine_package("armlab", "", needed=True)
    needed, extras = _requirements()
    for name, wanted in needed.items():
        yield _examine_package(name, wanted, needed=True)
    for extra, packages in extras.items():
        yield _examine_extra(extra, packages)
    for module, purpose in KERNELS.items():
        yield _examine_kernel(module, purpose)
    yield from _examine_folders()
    for title, test in SELF_TESTS.items():
        yield _examine_self_test(title, test)


def _requirements() -> tuple[dict[str, str], dict[str, dict[str, str]]]:
    """Wanted versions by the name of the package: what is always needed, and what each extra needs."""
    needed, extras = dict[str, str](), dict[str, dict[str, str]]()
    for line in requires("armlab") or ():
        requirement, _, marker = line.partition(";")
        name, wanted = re.findall(r"^\s*([\w.-]+)(?:\[.*\])?\s*(.*?)\s*$", requirement)[0]
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", marker)
        if extra is None:
            needed[name] = wanted
        elif name != "armlab" and extra[1] != "dev":
            extras.setdefault(extra[1], {})[name] = wanted
    return needed, extras


def _installed_version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def is_too_old(found: str, wanted: str) -> bool:
    """Whether a version is below the wanted `>=` one; other demands are left to pip."""
    least = re.search(r">=\s*([\d.]+)", wanted)
    own, other = (re.sub(r"(\.0+)+$", "", text) for text in (found, least[1] if least else "0"))
    return [int(part) for part in re.findall(r"\d+", own)] < [int(part) for part in re.findall(r"\d+", other)]


def _examine_package(name: str, wanted: str, needed: bool) -> Examined:
    found = _installed_version(name)
    if found is None:
        return Examined(name, "broken" if needed else "missing", f"not installed, {wanted or 'any version'} is needed")
    if is_too_old(found, wanted):
        return Examined(name, "broken", f"{found} is installed, {wanted} is needed")
    return Examined(name, "ok", found)


def _examine_extra(extra: str, packages: dict[str, str]) -> Examined:
    found = [_examine_package(name, wanted, needed=False) for name, wanted in packages.items()]
    wrong = [each for each in found if each.state != "ok"]
    if not wrong:
        return Examined(f"extra {extra}", "ok", ", ".join(f"{each.name} {each.text}" for each in found))
    state: State = "broken" if any(each.state == "broken" for each in wrong) else "missing"
    told = "; ".join(f"{each.name} {each.text}" for each in wrong)
    return Examined(f"extra {extra}", state, f"{told}: {install_line(extra)}")


def _examine_kernel(module: str, purpose: str) -> Examined:
    try:
        found = import_module(module)
    except ImportError as error:
        return Examined(module, "broken", f"{error}; `make install` compiles it ({purpose})")
    return Examined(module, "ok", f"{found.__file__} ({purpose})")


def _examine_folders() -> Iterator[Examined]:
    """Where recordings come from, and where files are written."""
    from armlab.recordings.public import LOCAL_COPIES_VARIABLE, cache_folder, local_copies

    copies, cache = local_copies(), cache_folder()
    if copies is None:
        yield Examined(LOCAL_COPIES_VARIABLE, "ok", "not set: public recordings are downloaded")
    else:
        there = copies.is_dir()
        text = str(copies) if there else f"{copies} is no folder, and public recordings are looked for there alone"
        yield Examined(LOCAL_COPIES_VARIABLE, "ok" if there else "missing", text)
    if cache is None:
        yield Examined("download cache", "missing", f"no downloads without pooch: {install_line('recordings')}")
    else:
        count = sum(path.is_file() for path in cache.rglob("*")) if cache.is_dir() else 0
        yield Examined("download cache", "ok", f"{cache}, {count} files")
    writable = os.access(Path.cwd(), os.W_OK)
    text = f"{Path.cwd()} can be written" if writable else f"{Path.cwd()} is read-only: give --out a folder elsewhere"
    yield Examined("working folder", "ok" if writable else "missing", text)


def _examine_self_test(title: str, test: Callable[[], str]) -> Examined:
    started = perf_counter()
    try:
        text = test()
    except (ImportError, OSError, ArithmeticError, ValueError, InputError) as error:
        return Examined(title, "broken", f"{type(error).__name__}: {in_one_line(error)}")
    return Examined(title, "ok", f"{text}; {perf_counter() - started:.1f} s")


def _test_dynamics() -> str:
    """Joint torques by way of the observation matrix, and directly."""
    import numpy as np

    from problem.motion import Motion
    from problem.regressor import observation_matrix, rigid_body_torque
    from problem.robot_file import load_arm

    arm = load_arm("irb120")
    motion = Motion(*np.random.default_rng(0).normal(size=(3, 50, len(arm))))
    torque = rigid_body_torque(arm, motion)
    error = np.abs(observation_matrix(arm, motion) @ arm.parameters - torque.ravel()).max() / np.abs(torque).max()
    if not error < MAX_ERROR:
        raise ArithmeticError(f"two ways to compute a torque differ by {error:.2g}")
    return "two ways to compute a torque agree"


def _test_search() -> str:
    """One short search, twice with one seed."""
    from algorithms.registry import load
    from bench.execute import Trial, run_trial
    from problem.registry import parse_problem

    settings = parse_problem({"preset": "paper"}, "self-test")
    trial = Trial(settings, "mupso", load("mupso").Params(), 20, 200, "clip", 1, 0)
    first, second = run_trial(trial), run_trial(trial)
    if first.value != second.value:
        raise ArithmeticError("one seed gives two results")
    return f"200 evaluations of the paper's problem end at {first.value:.4g}, twice"


def _test_files() -> str:
    """A file written whole, and a store of trials opened."""
    from armlab.common.files import write_texts
    from bench.store import open_store

    with tempfile.TemporaryDirectory() as folder:
        write_texts({"a/b.txt": "whole"}, Path(folder) / "new")
        with open_store(Path(folder) / "runs.sqlite"):
            pass
    return "files and a run store can be written"


SELF_TESTS: dict[str, Callable[[], str]] = {
    "self-test of dynamics": _test_dynamics,
    "self-test of a search": _test_search,
    "self-test of files": _test_files,
}
