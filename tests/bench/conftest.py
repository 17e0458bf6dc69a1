"""A small experiment, the command here and in a process of its own, and an algorithm of a third party."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_results import Ran, ran

from armlab.cli.main import main
from bench.execute import load_algorithm
from bench.result_sets.formats import read_results
from bench.result_sets.result_set import ResultSet

SMALL = """\
name: small
problem: {preset: sphere, dimension: 3}
algorithms: [spso, de]
swarm_size: 5
iterations: 4
repetitions: 3
seed: 1
"""
PLUG_IN = """\
import time
from algorithms.random_search import RandomSearch

class PlugIn(RandomSearch):
    name = "plug-in"

    @staticmethod
    def init(params, population, box, horizon, rng):
        with open({notes!r}, "a") as file:
            file.write("x")
        {statement}
        return RandomSearch.init(params, population, box, horizon, rng)
"""
ROOT = Path(__file__).parents[2]
Armlab = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    """The small experiment, run."""
    return ran(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def results(small_run: Ran) -> ResultSet:
    """What the small experiment gave."""
    return read_results(*small_run)


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """The configuration file of a small experiment: 2 algorithms x 3 repetitions."""
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture(autouse=True)
def _found_from_any_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


@pytest.fixture
def armlab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Armlab:
    """Runs `armlab` with arguments in an empty folder, in this process: a start takes longer than the experiment."""

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        words = [str(word) for word in arguments]
        with monkeypatch.context() as patched:
            patched.chdir(tmp_path)
            done = CliRunner().invoke(main, words)
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return subprocess.CompletedProcess(words, done.exit_code, done.stdout, done.stderr)

    return run


@pytest.fixture
def armlab_process(tmp_path: Path) -> Armlab:
    """The same in a process of its own, for what a plug-in does to its process and for all that it prints."""

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "armlab.cli.main", *map(str, arguments)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)

    return run


@pytest.fixture
def plug_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """Installs a third party's algorithm `plug-in`: random search that first does what it is given.

    Returns the file that has one letter a started run.
    """
    site, notes = tmp_path / "site", tmp_path / "notes.txt"

    def install(statement: str) -> Path:
        information = site / "plug_in-1.0.dist-info"
        information.mkdir(parents=True)
        (information / "METADATA").write_text("Metadata-Version: 2.1\nName: plug-in\nVersion: 1.0\n")
        (information / "entry_points.txt").write_text("[armlab.algorithms]\nplug-in = plug_in:PlugIn\n")
        (site / "plug_in.py").write_text(PLUG_IN.format(notes=str(notes), statement=statement))
        notes.touch()
        monkeypatch.syspath_prepend(str(site))
        monkeypatch.delitem(sys.modules, "plug_in", raising=False)  # that of another test
        load_algorithm.cache_clear()
        monkeypatch.setenv("PYTHONPATH", f"{ROOT}{os.pathsep}{site}")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        return notes

    return install
