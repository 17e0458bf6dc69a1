"""The template of a plug-in, installed as a package of its own and used as its README says."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

TEMPLATE = Path(__file__).parents[2] / "templates" / "plugin"
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the template, with `installed` beside it, where it was installed."""
    folder = tmp_path_factory.mktemp("plugin")
    copy = shutil.copytree(TEMPLATE, folder / "my-plugin")
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    pip = [sys.executable, "-m", "pip", "install", *options, "--target", str(folder / "installed"), str(copy)]
    subprocess.run(pip, check=True, capture_output=True, text=True)
    return copy


@pytest.fixture
def run(plugin: Path) -> Run:
    """Run a Python module in the copy, where the installed package, not the copy, is found."""
    environment = {**os.environ, "PYTHONPATH": str(plugin.parent / "installed"), "PYTHONSAFEPATH": "1"}

    def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", *arguments]
        return subprocess.run(command, cwd=plugin, env=environment, capture_output=True, text=True, check=False)

    return run


def test_its_names_are_listed(run: Run) -> None:
    listed = run("armlab.cli.main", "bench", "list").stdout
    assert "evolution-strategy" in listed
    assert "reaching" in listed


def test_its_algorithm_keeps_its_promises(run: Run) -> None:
    checked = run("armlab.cli.main", "check", "evolution-strategy")
    assert checked.stdout == "evolution-strategy keeps its promises\n", checked.stderr


def test_its_inherited_tests_pass(run: Run) -> None:
    tested = run("pytest", "tests", "-q", "-p", "no:cacheprovider", "-W", "error")
    assert tested.returncode == 0, tested.stdout


def test_its_algorithm_beats_random_search_and_a_change_of_its_problem_is_another_trial(run: Run, plugin: Path) -> None:
    done = run("armlab.cli.main", "run", "comparison.yaml", "--workers", "1")
    assert done.returncode == 0, done.stderr
    table = pd.read_csv(plugin / "results" / "comparison.csv").set_index(["problem", "algorithm"])
    medians = table["median"]
    assert len(table) == 24
    assert medians["reaching", "evolution-strategy"] < medians["reaching", "random-search"]
    assert "240 trials, 240 done" in run("armlab.cli.main", "run", "comparison.yaml", "--dry-run").stdout
    source = plugin.parent / "installed" / "armlab_example" / "reaching.py"
    source.write_text(source.read_text(encoding="utf-8").replace("10.0 *", "20.0 *"), encoding="utf-8")
    assert "240 trials, 80 done" in run("armlab.cli.main", "run", "comparison.yaml", "--dry-run").stdout


def test_a_wrong_key_of_its_problem_is_refused_in_one_line(run: Run, plugin: Path) -> None:
    text = (plugin / "comparison.yaml").read_text(encoding="utf-8")
    (plugin / "wrong.yaml").write_text(text.replace("joints: 12", "joint: 12"), encoding="utf-8")
    refused = run("armlab.cli.main", "run", "wrong.yaml")
    assert refused.returncode == 2
    assert refused.stderr.strip() == ("armlab: unknown key 'joint' in problem of wrong.yaml: did you mean 'joints'?")
