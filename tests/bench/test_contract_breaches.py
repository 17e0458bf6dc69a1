"""What an algorithm, its settings or a problem cannot be is told in one line, before trials where it can be known."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from algorithms import registry
from algorithms.contract import Box, BrokenContractError, fewest_points
from algorithms.driver import minimise
from algorithms.random_search import RandomSearch
from armlab.common.errors import InputError
from bench.run import RunOptions, describe_run

PlugIn = Callable[[str], Path]
Armlab = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("return X[:, :1]", r"asks for points of shape \(4, 1\), not \(points, 3\)"),
        ("return X[0]", r"asks for points of shape \(3,\), not \(points, 3\)"),
        ("return X + 0j", "asks for complex128, not for an array of real numbers"),
        ("return X.tolist()", "asks for list, not for an array of real numbers"),
        ("return X * np.nan", "asks for a point with a coordinate that is not finite"),
        ("return X[:0]", r"asks for points of shape \(0, 3\), not \(points, 3\)"),
    ],
)
def test_points_that_are_none_break_the_contract(statement: str, reason: str) -> None:
    scope: dict[str, object] = {"np": np}
    exec(f"def change(X):\n    {statement}", scope)

    class Breaking(RandomSearch):
        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return scope["change"](X), state

    box = Box(np.full(3, -1.0), np.ones(3))
    with pytest.raises(BrokenContractError, match=reason):
        minimise(
            Breaking,
            Breaking.Params(),
            lambda X: (X**2).sum(axis=1),
            box,
            np.zeros((4, 3)),
            20,
            np.random.default_rng(0),
        )


def run_with_breach(small: Path, plug_in: PlugIn, armlab: Armlab, change: str) -> "subprocess.CompletedProcess[str]":
    """`armlab run` of a plug-in that asks for something else than points, beside another algorithm."""
    plug_in("pass")
    module = small.parent / "site" / "plug_in.py"
    body = f"X, state = RandomSearch.ask(state)\n        return {change}, state\n"
    module.write_text(f"{module.read_text()}\n    @staticmethod\n    def ask(state):\n        {body}")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    return armlab("run", small.name, "--quiet")


@pytest.mark.parametrize("change", ["X[:, :1]", "X[0]", "X + 0j"])
def test_a_plug_in_that_breaks_the_contract_is_one_line_and_its_trials_are_losses(
    small: Path, plug_in: PlugIn, armlab: Armlab, change: str
) -> None:
    done = run_with_breach(small, plug_in, armlab, change)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("armlab: 3 trials failed, which count as losses and are not kept: plug-in on ")
    assert "repetition 0, 1, 2: algorithm 'plug-in' asks for " in line
    table = (small.parent / "results" / "small.csv").read_text().splitlines()
    assert table[1].startswith("plug-in,nan,nan,nan,inf,inf,inf,0,")
    assert table[2].startswith("de,")
    assert "3 trials of plug-in on sphere failed and count as infeasible" in (
        small.parent / "results" / "small.md"
    ).read_text().replace("\n", " ")


def test_results_with_trials_that_failed_are_reported_drawn_and_shared(
    small: Path, plug_in: PlugIn, armlab: Armlab
) -> None:
    run_with_breach(small, plug_in, armlab, "X[:, :1]")
    for command in (
        ["report", small.name],
        ["bench", "draw", small.name, "--out", "fig"],
        ["bench", "share", small.name, "--out", "t"],
    ):
        assert armlab(*command).returncode == 0, command
    page = (small.parent / "results" / "small_report.html").read_text()
    assert "3 trials of plug-in on sphere failed and count as infeasible" in page
    assert armlab("report", "t").returncode == 0


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ("{name: spso, params: {velocity_limit: -1.0}}", "'velocity_limit' in params of spso in"),
        ("{name: l-shade, params: {history: 0}}", "'history' in params of l-shade in"),
        ("{name: de, params: {crossover_rate: 1.5}}", "'crossover_rate' in params of de in"),
        ("spso, {name: spso, label: 'sp so'}", "holds an entry twice"),
        ('{name: spso, label: "two\\nlines"}', "should be one line of printable characters"),
    ],
)
def test_settings_out_of_their_range_are_refused_before_any_trial(small: Path, choice: str, message: str) -> None:
    small.write_text(small.read_text().replace("[spso, de]", f"[{choice}]"))
    with pytest.raises(InputError, match=message) as caught:
        list(describe_run(small, RunOptions(small.with_name("s.sqlite"), small.parent / "r", 1)))
    assert "\n" not in str(caught.value)


def test_too_few_points_are_refused_before_any_trial_with_all_algorithms_named(small: Path, armlab: Armlab) -> None:
    small.write_text(small.read_text().replace("[spso, de]", "[spso, de, l-shade]").replace("e: 5", "e: [3, 5]"))
    for arguments in (["--dry-run"], []):
        done = armlab("run", small.name, *arguments)
        assert done.returncode == 2
        assert done.stderr == (
            "armlab: 'swarm_size' in small.yaml: de takes 4 points or more, not 3; "
            "l-shade takes 4 points or more, not 3\n"
        )


@pytest.mark.parametrize("name", registry.names() + registry.peer_names())
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")  # of the package cmaes
def test_every_algorithm_runs_with_its_fewest_points(name: str) -> None:
    try:
        algorithm = registry.load(name)
    except registry.BrokenAlgorithmError:
        pytest.skip("its package is not installed")
    n = fewest_points(algorithm)
    box, rng = Box(np.full(2, -1.0), np.ones(2)), np.random.default_rng(1)
    found = minimise(
        algorithm, algorithm.Params(), lambda X: (X**2).sum(axis=1), box, rng.uniform(-1, 1, (n, 2)), 8 * n, rng
    )
    assert np.isfinite(found.best_fitness)
    if n > 1:
        with pytest.raises(ValueError, match=f"takes {n} points or more, not {n - 1}"):
            minimise(algorithm, algorithm.Params(), len, box, np.zeros((n - 1, 2)), 8 * n, rng)


@pytest.mark.parametrize("upper", [[1.0, 0.0, 1.0], [1.0, -1.0, 1.0], [1.0, np.inf, 1.0]])
def test_a_box_without_width_is_refused_before_any_trial(
    small: Path, monkeypatch: pytest.MonkeyPatch, upper: list[float]
) -> None:
    box = SimpleNamespace(name="sphere", lower=np.zeros(3), upper=np.array(upper))
    monkeypatch.setattr("bench.plan.build_problem", lambda settings: box)
    with pytest.raises(InputError, match=r"problem 'sphere' of .*: box dimension 1: lower limit 0.0 must be finite"):
        list(describe_run(small, RunOptions(small.with_name("s.sqlite"), small.parent / "r", 1)))


def test_a_package_that_ends_its_process_does_not_end_the_command(
    small: Path, plug_in: PlugIn, armlab_process: Armlab
) -> None:
    plug_in("import os; os._exit(139)")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    for arguments in (["--workers", 1], ["--dry-run"]):
        done = armlab_process("run", small.name, *arguments)
        assert done.returncode == 1
        assert "WorkerLostError" in done.stderr
