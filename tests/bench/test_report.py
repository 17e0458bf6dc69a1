"""The report: one file without any reference to the outside, whose figures are those of the results."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_results import CONFIG, Ran, ran

from armlab.common.report.palette import series_style
from bench.report.analysis import ProblemAnalysis, analyse_cell, analyse_cells, losses_by_problem
from bench.report.page import page_data, report_page, write_report
from bench.report.ranking_chart import draw_critical_difference
from bench.report.sections import ends_table, format_number, headline, rating_part, tally_table
from bench.result_sets.formats import read_results, share_results
from bench.result_sets.result_set import ResultSet, TableOfCurves
from bench.statistics.critical_difference import block_losses, critical_difference, paired_ranking
from bench.statistics.performance import Run


@pytest.fixture
def cell() -> ProblemAnalysis:
    """Two repetitions of two algorithms, one of which finds nothing feasible once."""
    trials = pd.DataFrame(
        {
            "algorithm": ["a", "a", "b", "b"],
            "repetition": [0, 1, 0, 1],
            "value": [10.0, 20.0, 5.0, 1.0],
            "violation": [0.0, 0.0, 0.0, 2.0],
            "budget": 20,
        }
    )
    moments = np.array([10.0, 20.0])
    runs = {
        "a": {0: Run(moments, np.array([100.0, 10.0])), 1: Run(moments, np.array([40.0, 20.0]))},
        "b": {0: Run(moments, np.array([50.0, 5.0])), 1: Run(moments, np.array([np.inf, np.inf]))},
    }
    return analyse_cell("small", trials, runs)


def test_the_page_refers_to_nothing_outside_of_itself(small_run: Ran, tmp_path: Path) -> None:
    list(write_report(*small_run, tmp_path / "page.html"))
    text = (tmp_path / "page.html").read_text()
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:,|#)""", text)
    assert not re.findall(r"@import|url\(|fetch\(|XMLHttpRequest|import\s", text)
    addresses = set(re.findall(r"https?://[^\"'\s<]+", text))
    assert addresses <= {"http://www.w3.org/2000/svg"}  # the name of a vocabulary, which nothing fetches
    assert len(text) < 300_000


def test_a_report_of_shared_tables_is_that_of_the_store(small_run: Ran, results: ResultSet, tmp_path: Path) -> None:
    share_results(*small_run, "csv", tmp_path / "tables")
    shared = read_results(tmp_path / "tables", Path("none"))
    assert report_page(shared, analyse_cells(shared), []) == report_page(results, analyse_cells(results), [])


def test_the_page_tells_settings_origin_and_how_to_repeat_it(results: ResultSet) -> None:
    text = report_page(results, analyse_cells(results), [])
    assert "armlab run small.yaml" in text
    assert results.origins[0]["blas"] in text
    assert "swarm_size:" in text
    assert "Seed 1." in text


def test_labels_of_a_third_party_cannot_break_out_of_the_page(small_run: Ran, tmp_path: Path) -> None:
    text = CONFIG.replace("[spso, l-shade, random-search]", "[{name: spso, label: '</script><b>x'}, l-shade]")
    other = ran(tmp_path, text)
    results = read_results(*other)
    page = report_page(results, analyse_cells(results), [])
    assert "<b>x" not in page
    assert page.count("</script>") == 2


def test_quartiles_of_convergence_count_an_infeasible_value_as_infinite(cell: ProblemAnalysis) -> None:
    assert cell.moments.tolist()[0] == 10
    lower, middle, upper = cell.progress["b"].quartiles
    assert (middle[0], upper[-1]) == (np.inf, np.inf)
    lower, middle, upper = cell.progress["a"].quartiles
    assert (lower[-1], middle[-1], upper[-1]) == (12.5, 15.0, 17.5)


def test_targets_go_from_the_worst_first_feasible_value_to_the_best_of_all(cell: ProblemAnalysis) -> None:
    assert cell.targets[[0, -1]].tolist() == pytest.approx([100.0, 5.0])
    assert cell.progress["a"].expected[[0, -1]].tolist() == [10.0, np.inf]
    assert cell.progress["b"].expected[[0, -1]].tolist() == [30.0, 40.0]


def test_runs_are_compared_at_shares_of_the_budget_and_by_their_times_to_targets(cell: ProblemAnalysis) -> None:
    tenth, third, whole = cell.fixed_budget
    assert tenth.to_numpy().tolist() == third.to_numpy().tolist() == [[np.inf, np.inf]] * 2  # before the first value
    assert whole.to_dict("list") == {"a": [10.0, 20.0], "b": [5.0, np.inf]}
    assert cell.fixed_target[0].to_dict("list") == {
        "a": [20.0, 10.0],
        "b": [20.0, np.inf],
    }  # 47.3, a quarter of the way


def test_the_page_rates_every_algorithm_for_each_budget_and_each_target(results: ResultSet) -> None:
    table = rating_part(analyse_cells(results)).table
    assert len(table.rows) == 3
    assert len(table.headings) == 1 + 3 + 3
    assert "<h3>Budgets and targets</h3>" in report_page(results, analyse_cells(results), [])


def test_a_problem_on_which_nothing_feasible_was_found_has_no_targets_and_still_a_page(results: ResultSet) -> None:
    curves = pd.concat([curves for _, _, curves in results.cells()]).assign(violation=1.0)
    lost = replace(results, trials=results.trials.assign(violation=1.0), curves=TableOfCurves(curves))
    cells = analyse_cells(lost)
    assert all(len(cell.targets) == 0 for cell in cells)
    text = report_page(lost, cells, [])
    assert "∞" in text
    assert json.loads(page_data(cells, lost.algorithms))["problems"][0]["ends"]["spso"] == [None] * 7


def test_the_data_of_the_charts_are_those_of_the_results(results: ResultSet) -> None:
    cells = analyse_cells(results)
    data = json.loads(page_data(cells, results.algorithms))
    assert [problem["name"] for problem in data["problems"]] == ["sphere", "rastrigin"]
    problem, cell = data["problems"][0], cells[0]
    assert problem["ends"]["spso"] == pytest.approx(cell.ends("spso").tolist(), rel=1e-3)
    assert problem["convergence"]["spso"][1][-1] == pytest.approx(np.median(cell.ends("spso")), rel=1e-3)
    assert problem["reached"]["l-shade"] == sorted(problem["reached"]["l-shade"])
    assert data["overall"]["profile"]["spso"][-1] <= 1.0
    assert sum(shares[0] for shares in data["overall"]["profile"].values()) == pytest.approx(1.0)


def test_a_page_of_two_problems_names_the_winners_on_each_and_says_that_two_stand_for_no_others(
    results: ResultSet,
) -> None:
    page = report_page(results, analyse_cells(results), [])
    assert re.search(r"On sphere: [a-z-]+ beats [a-z -]+ \(p (=|at most) 0\.0\d+\)", page)
    assert "On rastrigin: " in page
    assert "Nothing follows for other problems like them: 2 are too few." in page


def test_runs_too_few_for_a_test_over_all_problems_leave_what_each_problem_says() -> None:
    """Six runs: with two algorithms p = 0.03 on one problem, and above 0.05 after a correction for six of them."""
    trials = pd.DataFrame({"repetition": range(6), "value": np.arange(1.0, 7.0), "violation": 0.0, "seconds": 1.0})
    one = pd.concat([trials.assign(algorithm="a"), trials.assign(algorithm="b", value=trials["value"] + 10)])
    cells = [
        ProblemAnalysis(
            f"p{k}",
            one.assign(problem=f"p{k}", swarm_size=5, budget=50),
            np.zeros(1),
            np.zeros(1),
            {"a": 0, "b": 0},
            (),
            (),
        )
        for k in range(6)
    ]
    within = paired_ranking([cell.losses for cell in cells])
    assert within.has_too_few_blocks
    first, second = headline(cells, within, critical_difference(losses_by_problem(cells)))
    assert first == "a has the best average rank, 1.00 of 2; tested one by one, it beats b on 6 of 6."
    assert second.startswith("On p0: a beats b (p = 0.03).")


def test_swarm_sizes_of_one_problem_are_settings_and_no_problems(tmp_path: Path) -> None:
    text = CONFIG.replace("swarm_size: 6", "swarm_size: [6, 12]")
    swept = read_results(*ran(tmp_path, text))
    cells = analyse_cells(swept)
    assert losses_by_problem(cells).shape == (2, 3)
    page = report_page(swept, cells, [])
    assert "2 problems, 2 swarm sizes, 3 algorithms, 7 repetitions, 84 runs." in page
    assert "<h3>Setting by setting</h3>" in page
    assert "Average ranks of the medians of 2 problems" in page


def test_two_algorithms_on_one_problem_have_a_winner(cell: ProblemAnalysis) -> None:
    base = np.random.default_rng(0).normal(size=30)
    found = paired_ranking([pd.DataFrame({"a": base, "b": base + 0.1})])
    first, second = headline([cell], found, found)
    assert first == "a has the best average rank, 1.00 of 2: it beats b."
    assert second == ""


def test_algorithms_that_win_on_different_problems_are_not_told_apart_over_both() -> None:
    base = np.random.default_rng(0).normal(size=20)
    here, there = pd.DataFrame({"a": base, "b": base + 1}), pd.DataFrame({"a": base + 1, "b": base})
    assert paired_ranking([here, there]).p["a", "b"] == 1.0
    assert paired_ranking([here, here]).p["a", "b"] < 1e-4
    assert paired_ranking([here, here]).tests == 2


def test_one_problem_alone_is_ranked_by_its_repetitions(results: ResultSet) -> None:
    losses = [cell.losses for cell in analyse_cells(results)]
    assert block_losses(losses).shape == (2, 3)
    assert block_losses(losses[:1]).shape == (7, 3)


def test_the_picture_has_a_dot_an_algorithm_and_a_bar_a_group_and_says_so_in_words() -> None:
    rng = np.random.default_rng(0)
    base = rng.normal(size=20)
    losses = pd.DataFrame({"b": base + 5, "a": base, "c": base + 5 + rng.normal(scale=0.1, size=20)})
    found = critical_difference(losses)
    picture = draw_critical_difference(found, {name: series_style(k) for k, name in enumerate("abc")})
    assert picture.count("<circle") == 3
    assert picture.count('stroke-width="4"') == len(found.groups) == 1
    assert "Average ranks: a 1.00, " in picture
    assert "Not told apart: b and c" in picture or "Not told apart: c and b" in picture


def test_the_headline_says_who_beats_whom_and_who_ties(cell: ProblemAnalysis) -> None:
    rng = np.random.default_rng(0)
    base = rng.normal(size=20)
    losses = pd.DataFrame({"b": base + 5, "a": base, "c": base + 5 + rng.normal(scale=0.1, size=20)})
    found = paired_ranking([losses])
    first, second = headline([cell], found, found)
    assert re.fullmatch(r"a has the best average rank, 1\.00 of 3: it beats (b and c|c and b)\.", first)
    assert second == "1 of 3 pairs tie: no difference was shown."


def test_the_headline_names_all_that_share_the_best_rank(cell: ProblemAnalysis) -> None:
    base = np.arange(20.0)
    turns = np.where(np.arange(20) % 2, 0.5, -0.5)
    found = paired_ranking([pd.DataFrame({"a": base, "b": base + turns, "c": base + 5})])
    first, second = headline([cell], found, found)
    assert first == "a and b share the best average rank, 1.50 of 3: a beats c and ties with b."
    assert second == "b beats c. 1 of 3 pairs tie: no difference was shown."
    few_runs = paired_ranking([pd.DataFrame({"a": [1.0, 2.0], "b": [2.0, 1.0]})])
    few, _ = headline([cell], few_runs, few_runs)
    assert few.startswith("a and b share the best average rank, 1.50 of 2; 2 ")


def test_the_axis_of_many_ranks_numbers_as_many_as_there_is_room_for() -> None:
    names = [f"a{k}" for k in range(22)]
    found = critical_difference(pd.DataFrame(np.random.default_rng(0).normal(size=(3, 22)), columns=names))
    picture = draw_critical_difference(found, {name: series_style(k) for k, name in enumerate(names)})
    axis = r'<text x="([\d.]+)" y="20" [^>]*text-anchor="middle"[^>]*>\d+</text>'
    numbers = [float(x) for x in re.findall(axis, picture)]
    assert len(numbers) > 5
    assert min(np.diff(numbers)) >= 20


def test_no_two_of_many_algorithms_look_the_same() -> None:
    assert len({series_style(index) for index in range(40)}) == 40


def test_the_tally_counts_problems_won_and_lost_on_both_sides(results: ResultSet) -> None:
    cells = analyse_cells(results)
    text = " ".join(cell for row in tally_table(cells, results.algorithms).rows for cell in row)
    scores = re.findall(r"(\d) – (\d)", text)
    assert len(scores) == 6
    assert sorted(scores) == sorted((lost, won) for won, lost in scores)


def test_the_table_of_ends_has_medians_intervals_and_expected_running_times(cell: ProblemAnalysis) -> None:
    table = ends_table(cell)
    assert table.rows[0][1] == "15 (10 – 20)"
    assert table.rows[1][4] == "50%"
    assert sum(heading.startswith("ERT to ") for heading in table.headings) == 3


@pytest.mark.parametrize(
    ("value", "text"), [(np.inf, "∞"), (np.nan, "–"), (3.14159, "3.14"), (1550.4, "1550"), (2.5e-9, "2.5e-09")]
)
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert format_number(value) == text
