"""Where trials are run is a setting of its own, checked like all others, and no part of the results."""

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from refusals import refusal

from armlab.cli.main import main
from bench.config import read_experiment
from bench.execute import Failure
from bench.executors.choice import open_executor
from bench.executors.contract import ExecutorSettings, run_in_worker
from bench.run import load_experiment


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("executor: {backend: spark}", "should be 'loky', 'dask' or 'ray', not 'spark'"),
        ("executor: {backend: dask, adress: x}", "did you mean 'address'?"),
        ("executor: {backend: loky, address: x}", "loky works on this machine alone"),
        ("trial_timeout_s: 0", "should be greater than 0"),
    ],
)
def test_a_mistake_is_told_in_one_line(small: Path, setting: str, said: str) -> None:
    small.write_text(f"{small.read_text()}{setting}\n")
    assert said in refusal(read_experiment, small)


def test_the_settings_of_results_are_the_same_wherever_trials_were_run(small: Path) -> None:
    here = load_experiment(small)
    small.write_text(f"{small.read_text()}executor: {{backend: dask, address: 'tcp://far:1'}}\ntrial_timeout_s: 5\n")
    there = load_experiment(small)
    assert there.settings == here.settings
    assert [entry.key for entry in there.entries] == [entry.key for entry in here.entries]


@pytest.mark.parametrize("backend", ["dask", "ray"])
def test_a_missing_package_is_told_with_its_extra(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    package = {"dask": "distributed", "ray": "ray"}[backend]
    ours = f"bench.executors.{backend}_cluster"
    for name in [name for name in sys.modules if name.split(".")[0] == package or name == ours]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)

    def use() -> None:
        with open_executor(ExecutorSettings(backend=backend), 1, None):
            pass

    with pytest.raises(Exception, match=rf"executor '{backend}' needs the package .*armlab\[cluster\]"):
        use()


def test_an_address_without_an_executor_is_refused(small: Path) -> None:
    told = CliRunner().invoke(main, ["run", str(small), "--address", "tcp://far:1"])
    assert told.exit_code == 2
    assert "--address should stand beside --executor" in told.stderr


def test_a_worker_with_other_code_refuses_to_compute(small: Path) -> None:
    entry = load_experiment(small).entries[0]
    ((key, result),) = run_in_worker([("another key", entry.trial)]).results
    assert key == "another key"
    assert isinstance(result, Failure)
    assert "has other code or files" in result.reason
    ((_, result),) = run_in_worker([(entry.key, entry.trial)]).results
    assert not isinstance(result, Failure)
