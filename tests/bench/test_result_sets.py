"""Result sets: collected from the store, written as tidy tables and for IOHprofiler, and read back unchanged."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from refusals import refusal
from small_results import CONFIG, Ran

from bench.config import read_experiment
from bench.files import file_name
from bench.plan import plan_trials
from bench.report.analysis import analyse_cells
from bench.result_sets.formats import NOTHING_KNOWN, read_results, share_results
from bench.result_sets.result_set import ResultSet, runs_by_algorithm
from bench.store import open_store


def test_a_result_set_has_every_trial_and_the_curve_of_each(small_run: Ran, results: ResultSet) -> None:
    entries = plan_trials(read_experiment(small_run.config), "test")
    assert len(results.trials) == len(entries) == 2 * 3 * 7
    with open_store(small_run.store) as store:
        outcome = store.get(entries[-1].key)
    last = results.trials.iloc[-1]
    assert (last["problem"], last["algorithm"], last["repetition"], last["dimension"]) == (
        "rastrigin",
        "random-search",
        6,
        2,
    )
    assert last["value"] == outcome.value
    _, trials, curves = list(results.cells())[-1]
    run = runs_by_algorithm(trials, curves)["random-search"][6]
    np.testing.assert_array_equal(run.evaluations, outcome.curves.evaluations)
    np.testing.assert_array_equal(run.best, outcome.curves.best_value)


def test_a_result_set_says_where_it_was_computed(results: ResultSet) -> None:
    (origin,) = results.origins
    assert {"python", "numpy", "blas", "processor", "commit", "system"} <= set(origin)


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_tidy_tables_bring_back_the_same_result_set_to_the_bit(
    small_run: Ran, results: ResultSet, form: str, tmp_path: Path
) -> None:
    if form == "parquet":
        pytest.importorskip("pyarrow", reason="Parquet needs the package pyarrow")
    written = share_results(*small_run, form, tmp_path / "tables")
    assert {path.name for path in written} == {
        f"trials.{form}",
        f"curves.{form}",
        "settings.yaml",
        "origins.json",
        "README.md",
    }
    back = read_results(tmp_path / "tables", Path("no store is needed"))
    assert (back.name, back.settings, back.origins) == (results.name, results.settings, results.origins)
    pd.testing.assert_frame_equal(back.trials, results.trials, check_exact=True)
    for (_, _, theirs), (_, _, ours) in zip(back.cells(), results.cells(), strict=True):
        pd.testing.assert_frame_equal(theirs.reset_index(drop=True), ours, check_exact=True)


def test_infeasible_ends_are_infinite_in_the_curves() -> None:
    curves = pd.DataFrame(
        {"algorithm": "de", "repetition": 0, "evaluations": [5, 10], "value": [3.0, 4.0], "violation": [0.5, 0.0]}
    )
    trials = pd.DataFrame({"algorithm": ["de"], "repetition": [0], "failure": [""]})
    assert runs_by_algorithm(trials, curves)["de"][0].best.tolist() == [np.inf, 4.0]


def test_results_that_are_not_there_are_told_in_one_line(small_run: Ran, tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere.yaml"
    assert refusal(read_results, nowhere, small_run.store).startswith(f"there is no {nowhere}")
    assert "is no folder of results" in refusal(read_results, tmp_path, small_run.store)
    assert "there is no run store" in refusal(read_results, small_run.config, tmp_path / "none.sqlite")
    assert not (tmp_path / "none.sqlite").exists()
    other = tmp_path / "other.yaml"
    other.write_text(CONFIG.replace("\nseed: ", "\nseed: 9"))
    assert refusal(read_results, other, small_run.store).startswith("none of the trials of ")


def test_tables_without_a_column_or_with_damage_are_told_in_one_line(small_run: Ran, tmp_path: Path) -> None:
    share_results(*small_run, "csv", tmp_path)
    table = pd.read_csv(tmp_path / "trials.csv")
    table.drop(columns="value").to_csv(tmp_path / "trials.csv", index=False)
    assert refusal(read_results, tmp_path, small_run.store) == f"{tmp_path / 'trials.csv'} lacks the columns value"
    (tmp_path / "trials.csv").write_text('a,b\n1,"2\n3,4,5,6\n')
    assert refusal(read_results, tmp_path, small_run.store).startswith(f"cannot read {tmp_path / 'trials.csv'}")
    (tmp_path / "origins.json").write_text("{")
    assert "is no folder of results" in refusal(read_results, tmp_path, small_run.store)


@pytest.mark.parametrize(
    ("file", "row", "column", "cell", "message"),
    [
        ("trials.csv", 3, "value", "-2.0", "row 4: value is '-2.0', should be a number of 0 or more"),
        ("trials.csv", 0, "budget", "1.5", "row 1: budget is '1.5', should be a whole number of 1 or more"),
        ("trials.csv", 1, "algorithm", "", "row 2: algorithm is 'nan', should be a name"),
        ("trials.csv", 2, "repetition", "1", "row 3: the same trial stands above it"),
        ("trials.csv", 6, "repetition", "99", "are not of the same trials: only one of them has"),
        ("curves.csv", 5, "value", "x", "row 6: value is 'x', should be a number of 0 or more"),
        ("curves.csv", 0, "repetition", "99", "are not of the same trials: only one of them has"),
        ("settings.yaml", None, "algorithms", "{}\nname: ../x", "`name` should be 1 to 100 letters"),
        ("settings.yaml", None, "algorithms", "[1]", "settings.yaml should have `algorithms`, a mapping"),
    ],
)
def test_shared_results_that_were_edited_are_refused_in_one_line(
    small_run: Ran, tmp_path: Path, file: str, row: int | None, column: str, cell: str, message: str
) -> None:
    share_results(*small_run, "csv", tmp_path)
    path = tmp_path / file
    if row is None:
        path.write_text("\n".join(["name: n", "seed: 1", "problem: {}", f"{column}: {cell}"]))
    else:
        table = pd.read_csv(path, dtype=str)
        table.loc[row, column] = cell
        table.to_csv(path, index=False)
    assert message in refusal(read_results, tmp_path, small_run.store)


def test_the_iohprofiler_files_hold_every_run_with_its_best(small_run: Ran, results: ResultSet, tmp_path: Path) -> None:
    written = share_results(*small_run, "ioh", tmp_path)
    assert len(written) == 2 * 3
    described = json.loads((tmp_path / "l-shade" / "IOHprofiler_f2_rastrigin.json").read_text())
    (scenario,) = described["scenarios"]
    assert (described["function_name"], scenario["dimension"], len(scenario["runs"])) == ("rastrigin", 2, 7)
    ends = results.trials.query("problem == 'rastrigin' and algorithm == 'l-shade'")["value"]
    assert [run["best"]["y"] for run in scenario["runs"]] == ends.tolist()
    rows = (tmp_path / "l-shade" / scenario["path"]).read_text().splitlines()
    assert rows[0] == "evaluations raw_y"
    assert rows[1] == f"1 {NOTHING_KNOWN!r}"
    assert sum(row.startswith("1 ") for row in rows) == 7


@pytest.mark.filterwarnings("ignore")  # of the packages that the reader brings along
def test_an_independent_reader_finds_the_same_runs_and_expected_running_times(
    small_run: Ran, results: ResultSet, tmp_path: Path
) -> None:
    reader = pytest.importorskip("iohinspector", reason="the independent reader iohinspector is not installed")
    share_results(*small_run, "ioh", tmp_path)
    manager = reader.DataManager()
    manager.add_folder(str(tmp_path))
    overview = manager.overview.to_pandas()
    assert len(overview) == len(results.trials)
    table = manager.load(True, True).to_pandas()
    for cell in analyse_cells(results):
        for name in cell.algorithms:
            theirs = table[(table["function_name"] == cell.label) & (table["algorithm_name"] == name)]
            bests = theirs.groupby("run_id")["raw_y"].min()
            assert sorted(bests) == pytest.approx(sorted(cell.ends(name)))
            for target, expected in zip(cell.targets[::10], cell.progress[name].expected[::10], strict=True):
                assert _ert(theirs, float(target), cell.trials["budget"].iloc[0]) == pytest.approx(expected)


def _ert(table: pd.DataFrame, target: float, budget: int) -> float:
    reached = table[table["raw_y"] <= target].groupby("run_id")["evaluations"].min()
    failed = table["run_id"].nunique() - len(reached)
    return (reached.sum() + failed * budget) / len(reached) if len(reached) else np.inf


def test_a_suite_stands_for_all_its_problems_in_a_configuration(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(CONFIG.replace(CONFIG.splitlines()[1], "problem: suite-1"))
    assert len(read_experiment(path).problem) == 24
    both = "problem: [sphere, held-out-1, {suite: held-out-1, label: rules, penalty: feasibility_rules}]"
    path.write_text(CONFIG.replace(CONFIG.splitlines()[1], both))
    problems = read_experiment(path).problem
    assert len(problems) == 1 + 12 + 12
    assert problems[-1].label == f"{problems[12].label} rules"
    assert problems[-1].settings == {**problems[12].settings, "penalty": "feasibility_rules"}


def test_an_unknown_suite_is_told_with_the_nearest_name(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(CONFIG.replace(CONFIG.splitlines()[1], "problem: {suite: suit-1}"))
    assert "unknown suite 'suit-1': did you mean 'suite-1'?" in refusal(read_experiment, path)


def test_files_of_others_are_not_replaced(small_run: Ran, tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("mine")
    told = refusal(share_results, *small_run, "csv", tmp_path)
    assert told == f"{tmp_path} holds README.md, which is not of these results: choose another folder with --out"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("README.md", "mine")]


def test_a_folder_has_the_tables_of_one_form(small_run: Ran, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="Parquet needs the package pyarrow")
    share_results(*small_run, "csv", tmp_path)
    share_results(*small_run, "parquet", tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*.*") if path.suffix in (".csv", ".parquet")) == [
        "curves.parquet",
        "trials.parquet",
    ]


def test_names_that_look_like_numbers_or_gaps_stay_names(small_run: Ran, tmp_path: Path) -> None:
    share_results(*small_run, "csv", tmp_path)
    for table in ("trials.csv", "curves.csv"):
        text = (tmp_path / table).read_text()
        (tmp_path / table).write_text(text.replace("random-search", "none").replace("l-shade", "1"))
    assert set(read_results(tmp_path, small_run.store).trials["algorithm"]) == {"spso", "1", "none"}


def test_labels_that_differ_have_files_that_differ() -> None:
    labels = ["spso", "Spso", "a b", "a_b", "a/b", "..", "l-shade", ".5-inertia", "CON", "con", "nul.txt", "-x", "算法"]
    labels += ["a" * 300, "a" * 299 + "b", "trailing."]
    names = [file_name(label) for label in labels]
    assert names[0] == "spso"
    assert len({name.lower() for name in names}) == len(labels)
    for name in names:
        assert re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9])?", name)
        assert len(name) <= 80
        assert name.partition(".")[0].lower() not in ("con", "nul")


def test_origins_that_are_no_list_of_machines_are_refused(small_run: Ran, tmp_path: Path) -> None:
    share_results(*small_run, "csv", tmp_path)
    (tmp_path / "origins.json").write_text("3")
    assert "origins.json should be a list" in refusal(read_results, tmp_path, small_run.store)
