"""`armlab paper search-space` on a small scale, and what its tables say."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from armlab.common.errors import InputError
from bench.run import RunOptions
from bench.studies.best_known.records import known_values, read_records
from bench.studies.search_space import loss
from bench.studies.search_space.search_space_study import comparison_table, make_search_space, pair_problems
from problem.registry import parse_problem

ROOT = Path(__file__).parents[2]
RECORDS = ROOT / "results" / "best_known.json"
FEASIBLE = {"search_space": "feasible"}


def settings(**given: Any) -> Any:
    return parse_problem({"preset": "joint-fourier", **given}, "test")


def no_descent(problem: Any, start: Any) -> Any:
    return replace(loss.evaluate_point(problem, start), gradients=1)


def test_problems_that_differ_in_the_search_space_alone_are_pairs() -> None:
    given = {
        "c": settings(),
        "f": settings(**FEASIBLE),
        "rest f": settings(rest=True, **FEASIBLE),
        "rest c": settings(rest=True),
    }
    assert pair_problems(given) == {"c": "f", "rest c": "rest f"}


def test_a_problem_without_its_counterpart_is_refused() -> None:
    with pytest.raises(InputError, match="'alone' should be there in both search spaces"):
        pair_problems({"alone": settings(**FEASIBLE)})


def test_the_duel_says_how_often_the_feasible_space_ends_better() -> None:
    rows = [
        {"problem": problem, "algorithm": "de", "repetition": n, "value": value + n, "violation": violation}
        for problem, value, violation in (("c", 30.0, 0.0), ("f", 10.0, 0.0))
        for n in range(10)
    ]
    row = comparison_table(pd.DataFrame(rows), {"c": "f"}).iloc[0]
    assert (row["median"], row["median_in_space"], row["superiority"]) == (34.5, 14.5, 1.0)
    assert row["better"] == "feasible"
    assert row["p_holm"] < 0.01


def test_the_best_known_moves_into_the_space_and_loses_about_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loss, "descend", no_descent)
    figures = loss.measure_space("joint-fourier", settings(), read_records(RECORDS)["joint-fourier"])
    assert figures.feasible_points < 0.05
    assert figures.feasible_points_of_space == 1.0
    assert abs(figures.moved / figures.best_known - 1) < 0.05
    assert figures.loss == figures.improved / figures.best_known - 1


def test_a_path_of_the_tool_has_no_such_space() -> None:
    with pytest.raises(InputError, match="should be a series in joint space"):
        loss.measure_space("paper", parse_problem({"preset": "paper"}, "test"), read_records(RECORDS)["paper"])


def test_both_search_spaces_share_a_record() -> None:
    known = known_values({"c": settings(), "f": settings(**FEASIBLE)}, RECORDS)
    assert known["c"] == known["f"] > 1


def test_the_command_writes_both_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loss, "descend", no_descent)
    content = yaml.safe_load((ROOT / "configs" / "search_space.yaml").read_text())
    content |= {"problem": content["problem"][:2], "algorithms": ["random-search", "spso"]}
    content |= {"iterations": 1, "swarm_size": 10, "repetitions": 2}
    (tmp_path / "search_space.yaml").write_text(yaml.safe_dump(content))
    bar = nullcontext(SimpleNamespace(update=lambda n: None))
    options = RunOptions(tmp_path / "runs.sqlite", tmp_path / "results", workers=1)
    written = list(make_search_space(tmp_path, options, RECORDS, lambda total, done: bar))
    assert {path.name for path in written} >= {"search_space.csv", "comparison.csv", "given_up.csv", "comparison.md"}
    page = (tmp_path / "results" / "comparison.md").read_text()
    assert "| joint-fourier | SPSO |" in page
    table = pd.read_csv(tmp_path / "results" / "comparison.csv")
    assert np.all(table["feasible_share_in_space"] == 1.0)
