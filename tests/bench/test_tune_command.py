"""Tuning: the same budget for each, judged on what took no part, and repeatable from what is stored."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from refusals import refusal

from bench.studies.tuning import parameter_search
from bench.studies.tuning.parameter_search import INFEASIBLE_LOSS, relative_loss
from bench.studies.tuning.tuning_settings import read_tuning
from bench.studies.tuning.tuning_study import TuningOptions, tune_algorithms

ROOT = Path(__file__).parents[2]
SMALL: dict[str, Any] = {
    "name": "small",
    "train": ["sphere"],
    "judge": ["ackley", "rastrigin"],
    "algorithms": {
        "mupso": {
            "velocity_limit": {"low": 0.01, "high": 1.0, "log": True},
            "abandonment_limit": {"low": 3, "high": 30},
        },
        "de": {"scaling_factor": {"low": 0.2, "high": 1.0}},
    },
    "configurations": 5,
    "train_repetitions": 2,
    "judge_repetitions": 3,
    "swarm_size": 8,
    "evaluations": 80,
    "train_seed": 1,
    "judge_seed": 2,
    "sweep": {"algorithm": "mupso", "parameter": "velocity_limit", "values": [0.1, 0.5]},
}


def no_bar(total: int, done: int) -> Any:
    return nullcontext(SimpleNamespace(update=lambda n: None))


@pytest.fixture
def config(tmp_path: Path) -> Callable[..., Path]:
    def write(**changes: Any) -> Path:
        path = tmp_path / "small.yaml"
        path.write_text(yaml.safe_dump(SMALL | changes, sort_keys=False))
        return path

    return write


def options(folder: Path, results: str = "results", **changes: Any) -> TuningOptions:
    facts = {"algorithms": (), "configurations": None, "workers": 1} | changes
    return TuningOptions(store=folder / "runs.sqlite", results=folder / results, records=folder / "none.json", **facts)


def test_a_loss_is_the_average_of_log_ratios_and_what_is_not_solved_counts_as_ten_times() -> None:
    assert relative_loss({"a": 1.0, "b": 100.0}, {"a": 10.0, "b": 100.0}) == pytest.approx(-0.5)
    assert relative_loss({"a": np.inf}, {"a": 10.0}) == INFEASIBLE_LOSS
    assert relative_loss({"a": 1e6}, {"a": 10.0}) == INFEASIBLE_LOSS
    assert relative_loss({"a": 10.0}, {"a": np.inf}) == -INFEASIBLE_LOSS
    assert relative_loss({"a": np.inf}, {"a": np.inf}) == 0.0


def test_a_tuning_is_the_same_when_it_is_repeated_and_runs_nothing_twice(
    config: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = config()
    written = list(tune_algorithms(path, options(tmp_path), no_bar))
    first = {file.name: file.read_bytes() for file in written}

    def refuse(*arguments: Any, **others: Any) -> None:
        raise AssertionError("a stored trial is run again")

    monkeypatch.setattr("bench.execute.run_trial", refuse)
    again = list(tune_algorithms(path, options(tmp_path, "again"), no_bar))
    assert {file.name: file.read_bytes() for file in again} == first


def test_the_first_configurations_do_not_depend_on_how_many_follow_and_the_first_is_the_published_one(
    config: Callable[..., Path], tmp_path: Path
) -> None:
    path = config(sweep=None)
    lines = []
    for budget in (3, 5):
        list(
            tune_algorithms(path, options(tmp_path, configurations=budget, algorithms=("de",), overwrite=True), no_bar)
        )
        lines.append((tmp_path / "results" / "small_configurations.csv").read_text().splitlines())
    assert lines[1][:4] == lines[0]
    assert len(lines[1]) == 6
    assert lines[0][1] == 'de,0,0,"{""scaling_factor"": 0.85}"'


def test_the_page_says_which_place_mupso_has_and_what_its_speed_limit_does(
    config: Callable[..., Path], tmp_path: Path
) -> None:
    list(tune_algorithms(config(), options(tmp_path), no_bar))
    text = (tmp_path / "results" / "small.md").read_text()
    assert "Does the paper's ranking hold when everybody is tuned?" in text
    assert "of 2; it is better in" in text
    assert "## MuPSO against its `velocity_limit`" in text
    assert text.count("| best other, ") == 2
    judged = (tmp_path / "results" / "small_judged.csv").read_text().splitlines()
    assert judged[0] == "algorithm,ackley,rastrigin"
    assert [line.split(",")[0] for line in judged[1:]] == [
        *("mupso", "de", "mupso tuned", "de tuned"),
        *("mupso velocity_limit=0.1", "mupso velocity_limit=0.5"),
    ]


def test_each_mistake_is_told_in_one_line(config: Callable[..., Path], tmp_path: Path) -> None:
    def told(**changes: Any) -> str:
        return refusal(lambda: list(tune_algorithms(config(**changes), options(tmp_path), no_bar)))

    assert "'judge' should hold no problem of 'train': 'random-frame' is 'joint-fourier'" in told(
        train=["joint-fourier"], judge=["random-frame"]
    )
    assert "no hyper-parameter 'speed': known: scaling_factor, crossover_rate" in told(
        algorithms={"de": {"speed": {"low": 0.0, "high": 1.0}}}, sweep=None
    )
    assert "the range of 'scaling_factor', 0.1 to 0.5, should hold the published value 0.85" in told(
        algorithms={"de": {"scaling_factor": {"low": 0.1, "high": 0.5}}}, sweep=None
    )
    assert "'low' should be below 'high', not 2 and 1" in told(
        algorithms={"de": {"scaling_factor": {"low": 2, "high": 1}}}, sweep=None
    )
    assert "'sweep' names no algorithm 'mupso'" in told(algorithms={"de": SMALL["algorithms"]["de"]})


def test_the_projects_own_configuration_is_right_and_every_range_holds_the_published_value() -> None:
    settings = read_tuning(ROOT / "configs" / "tune.yaml")
    for name, ranges in settings.algorithms.items():
        assert set(parameter_search._published_params(name, ranges)) == set(ranges)


def test_results_of_other_settings_stay(config: Callable[..., Path], tmp_path: Path) -> None:
    list(tune_algorithms(config(), options(tmp_path, configurations=3), no_bar))
    told = refusal(lambda: list(tune_algorithms(config(), options(tmp_path, configurations=2), no_bar)))
    assert "holds results of another configuration ('configurations: 3' there, 'configurations: 2' here)" in told
    list(tune_algorithms(config(), options(tmp_path, configurations=2, overwrite=True), no_bar))


def test_a_mistake_in_what_judges_is_told_before_anything_runs(config: Callable[..., Path], tmp_path: Path) -> None:
    wrong = config(sweep={"algorithm": "mupso", "parameter": "inertai", "values": [0.1]})
    assert "'inertai'" in refusal(lambda: list(tune_algorithms(wrong, options(tmp_path), no_bar)))
    assert not (tmp_path / "runs.sqlite").exists()
