"""Loky, a Dask cluster and a Ray cluster, all of separate processes: the same bytes, and nothing finished is lost."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack, closing, contextmanager, nullcontext
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from stored_trials import kept as stored

from armlab.common.errors import InputError

ROOT = Path(__file__).parents[2]
TRIALS = 24
CONFIG = f"""\
name: sweep
problem: {{preset: sphere, dimension: 3}}
algorithms: [slow]
swarm_size: 50
evaluations: 20000
repetitions: {TRIALS}
seed: 1
"""
SLOW = """\
import os, time
from algorithms.random_search import RandomSearch

class Slow(RandomSearch):
    name = "slow"

    @staticmethod
    def init(params, population, box, horizon, rng):
        with open({notes!r}, "a") as file:
            file.write(f"{{os.getpid()}}\\n")
        time.sleep(0.1)
        return RandomSearch.init(params, population, box, horizon, rng)
"""
PACKAGES = {"loky": "joblib", "dask": "distributed", "ray": "ray"}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a third party's algorithm, which notes in `notes.txt` the process of every run that it starts."""
    folder = tmp_path_factory.mktemp("site")
    information = folder / "slow-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: slow\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[armlab.algorithms]\nslow = slow:Slow\n")
    (folder / "slow.py").write_text(SLOW.format(notes=str(folder / "notes.txt")))
    (folder / "notes.txt").touch()
    return folder


@pytest.fixture(scope="module")
def start(site: Path) -> Iterator[Callable[..., "subprocess.Popen[str]"]]:
    """Starts a process that finds the algorithm, and ends it after the tests."""
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{site}", "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0"}
    with ExitStack() as stack:

        def run(*command: object, **options: Any) -> "subprocess.Popen[str]":
            return stack.enter_context(_ended(subprocess.Popen([*map(str, command)], env=environment, **options)))

        yield run


@contextmanager
def _ended(process: Any) -> Iterator[Any]:
    yield process
    process.terminate()
    process.wait(120)


@pytest.fixture(scope="module", params=PACKAGES)
def engine(request: pytest.FixtureRequest, start: Callable[..., Any], site: Path) -> list[str]:
    """The options of `armlab run` for an engine with two workers; its cluster is running."""
    if find_spec(PACKAGES[request.param]) is None:
        pytest.skip(f"the package {PACKAGES[request.param]} is not installed")
    if request.param == "loky":
        return ["--workers", "2"]
    address = {"dask": _dask, "ray": _ray}[request.param](start, site)
    return ["--executor", request.param, "--address", address]


def _dask(start: Callable[..., Any], site: Path) -> str:
    dask, quiet = [sys.executable, "-m", "dask"], {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    port = _free_port()
    start(*dask, "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", **quiet, cwd=site)
    for _ in range(2):
        worker = ("worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-dashboard")
        start(*dask, *worker, **quiet, cwd=site)
    return f"tcp://127.0.0.1:{port}"


def _ray(start: Callable[..., Any], site: Path) -> str:
    port = _free_port()
    head = ("start", "--head", "--block", "--port", port, "--node-ip-address", "127.0.0.1", "--num-cpus", "2")
    ray = [sys.executable, "-c", "from ray.scripts.scripts import main; main()"]
    with (site / "ray.txt").open("w") as said:
        start(*ray, *head, "--include-dashboard=false", "--disable-usage-stats", stdout=said, stderr=said, cwd=site)
    _wait(lambda: "Ray runtime started" in (site / "ray.txt").read_text())  # it listens long before it has a node
    return f"127.0.0.1:{port}"


def _free_port() -> int:
    """Below 10000: Ray gives its workers the ports above."""
    for port in range(6400 + os.getpid() % 1000, 9999):
        if not _listens(port):
            return port
    raise AssertionError("no port is free")


def _listens(port: int) -> bool:
    with closing(socket.socket()) as found:
        return found.connect_ex(("127.0.0.1", port)) == 0


def _wait(for_what: Callable[[], bool], seconds: float = 300) -> None:
    end = time.monotonic() + seconds
    while not for_what():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture(scope="module")
def expected(start: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of one core."""
    folder = tmp_path_factory.mktemp("one-core")
    assert _run(start, folder, ["--workers", "1"]).wait(300) == 0
    return (folder / "results" / "sweep.csv").read_bytes()


def _run(start: Callable[..., Any], folder: Path, options: list[str]) -> "subprocess.Popen[str]":
    (folder / "sweep.yaml").write_text(CONFIG)
    command = [sys.executable, "-m", "armlab.cli.main", "run", "sweep.yaml", *options]
    with (folder / "said.txt").open("w") as said:
        return start(*command, cwd=folder, stdout=said, stderr=said)


def _started(site: Path) -> list[int]:
    """The process of each run that was started."""
    return [int(line) for line in (site / "notes.txt").read_text().split()]


def test_a_worker_killed_in_the_middle_costs_no_trial_and_changes_no_byte(
    engine: list[str], start: Callable[..., Any], site: Path, expected: bytes, tmp_path: Path
) -> None:
    before = len(_started(site))
    run = _run(start, tmp_path, engine)
    _wait(lambda: len(stored(tmp_path)) >= 5)
    victim = _started(site)[-1]
    kept = stored(tmp_path)
    os.kill(victim, signal.SIGKILL)
    assert run.wait(300) == 0, (tmp_path / "said.txt").read_text()
    assert (tmp_path / "results" / "sweep.csv").read_bytes() == expected
    assert kept.items() <= stored(tmp_path).items()  # the same seconds: not run again
    assert TRIALS <= len(_started(site)) - before <= TRIALS + 8  # besides, at most what was under way


def test_a_killed_driver_loses_nothing_finished_and_a_restart_computes_exactly_what_is_missing(
    engine: list[str], start: Callable[..., Any], site: Path, expected: bytes, tmp_path: Path
) -> None:
    run = _run(start, tmp_path, engine)
    _wait(lambda: len(stored(tmp_path)) >= 5)
    run.kill()
    run.wait()
    _wait(lambda: _is_quiet(site))
    kept, before = stored(tmp_path), len(_started(site))
    assert 5 <= len(kept) < TRIALS
    assert _run(start, tmp_path, engine).wait(300) == 0, (tmp_path / "said.txt").read_text()
    assert (tmp_path / "results" / "sweep.csv").read_bytes() == expected
    assert kept.items() <= stored(tmp_path).items()
    assert len(_started(site)) - before == TRIALS - len(kept)


def _is_quiet(site: Path) -> bool:
    """Whether the workers have let go of what a dead driver had asked for."""
    before = _started(site)
    time.sleep(3.0)
    return _started(site) == before


class _Client:
    """A client of a cluster with one worker."""

    def nthreads(self) -> dict[str, int]:
        return {"tcp://worker": 1}

    def get_executor(self, pure: bool) -> Any:
        return nullcontext()


def test_a_scheduler_that_is_lost_ends_the_run_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    module = pytest.importorskip("bench.executors.dask_cluster", exc_type=ImportError)
    monkeypatch.setattr(module, "_connect_client", lambda address, workers: nullcontext(_Client()))
    lost = pytest.raises(InputError, match="the Dask scheduler at tcp://here was lost: start it")
    with lost, module.dask_executor("tcp://here", 1, None):
        raise CancelledError  # of each future, once the client has no connection any more
