"""`compare`: equal sets are equal, a worse algorithm is found, unlike things are not compared in silence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal
from small_results import CONFIG, Ran, ran

from bench.result_sets.compare import are_paired, compare_results, compare_sets
from bench.result_sets.formats import share_results
from bench.result_sets.result_set import ResultSet


def worse(results: ResultSet, algorithm: str, factor: float, settings: str | None = None) -> ResultSet:
    """The same set with worse ends of one algorithm."""
    trials = results.trials.copy()
    hit = trials["algorithm"] == algorithm
    trials.loc[hit, "value"] *= factor
    return replace(results, trials=trials, settings=settings or results.settings)


def test_a_set_is_equal_to_itself(results: ResultSet) -> None:
    table = compare_sets(results, results)
    assert len(table) == 2 * 3
    assert set(table["change"]) == {"="}
    assert set(table["superiority"]) == {0.5}
    assert set(table["p"]) == {1.0}


def test_an_algorithm_that_became_worse_is_found_and_no_other(results: ResultSet) -> None:
    table = compare_sets(results, worse(results, "spso", 1000.0))
    assert dict(zip(table["algorithm"], table["change"], strict=True)) == {
        "spso": "=",
        "l-shade": "=",
        "random-search": "=",
    }
    # seven pairs cannot give a p-value below 2 / 128, and Holm asks for 0.05 / 6; one problem and algorithm can
    one = replace(results, trials=results.trials.query("problem == 'sphere' and algorithm == 'spso'"))
    row = compare_sets(one, worse(one, "spso", 1000.0)).iloc[0]
    assert (row["change"], row["superiority"]) == ("worse", 0.0)
    assert row["p"] == pytest.approx(2 / 128)
    assert row["second_median"] == pytest.approx(1000 * row["first_median"])


def test_sets_of_other_seeds_are_not_paired(results: ResultSet) -> None:
    other = worse(results, "spso", 1.0, settings=results.settings.replace("seed: 1", "seed: 2"))
    assert are_paired(results, results)
    assert not are_paired(results, other)
    assert np.all(compare_sets(results, other)["p"] == 1.0)


def test_an_infeasible_end_counts_as_the_worst(results: ResultSet) -> None:
    trials = results.trials.assign(violation=1.0)
    table = compare_sets(results, replace(results, trials=trials))
    assert np.all(np.isinf(table["second_median"]))
    assert np.all(table["superiority"] == 0.0)


def test_the_page_tells_the_verdict_and_writes_it_to_a_folder(small_run: Ran, tmp_path: Path) -> None:
    share_results(*small_run, "csv", tmp_path / "theirs")
    (text,) = compare_results(small_run.config, tmp_path / "theirs", small_run.store, tmp_path / "out")
    assert "0 better, 0 worse, 6 not told apart." in text
    assert "| sphere | spso |" in text
    assert (tmp_path / "out" / "comparison.md").read_text() == text + "\n"
    assert len((tmp_path / "out" / "comparison.csv").read_text().splitlines()) == 7


def test_a_problem_with_other_settings_under_the_same_name_is_pointed_out(small_run: Ran, tmp_path: Path) -> None:
    other = ran(tmp_path, CONFIG.replace("dimension: 3, shift_seed: 1", "dimension: 3, shift_seed: 5"))
    share_results(*other, "csv", tmp_path / "theirs")
    (text,) = compare_results(small_run.config, tmp_path / "theirs", small_run.store, None)
    assert "Not the same problem in both sets: sphere." in text


def test_sets_with_nothing_in_common_are_refused(small_run: Ran, tmp_path: Path) -> None:
    other = ran(tmp_path, CONFIG.replace("iterations: 9", "iterations: 3"))
    share_results(*other, "csv", tmp_path / "theirs")
    told = refusal(next, compare_results(small_run.config, tmp_path / "theirs", small_run.store, None))
    assert told.endswith("have no problem, budget and algorithm in common")
