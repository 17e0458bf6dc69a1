"""Tables say what the outcomes are; figures show it, with the same bytes for the same data."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bench.comparison_figures import draw_budgets, draw_ends, draw_ranking
from bench.config import Experiment, read_experiment
from bench.execute import Curves, Outcome
from bench.figures import draw_convergence, draw_cost, draw_times
from bench.plan import plan_trials
from bench.store import open_store
from bench.tables import as_csv, convergence_table, summary_page, summary_table, times_table


def _frame(values: list[float], violations: list[float], **columns: object) -> pd.DataFrame:
    n = len(values)
    facts = {"problem": "paper", "swarm_size": 50, "budget": 1550, "algorithm": "de"} | columns
    return pd.DataFrame(
        {
            **{name: [fact] * n if not isinstance(fact, list) else fact for name, fact in facts.items()},
            "repetition": range(n),
            "value": values,
            "violation": violations,
            "fitness": values,
            "evaluations": 1550,
            "seconds": [1.0] * n,
        }
    )


def test_table_of_two_algorithms_one_with_an_infeasible_end() -> None:
    frame = _frame([2.0, 4.0, 9.0, 3.0], [0.0, 0.0, 0.0, 0.5], algorithm=["mupso", "mupso", "de", "de"])
    assert as_csv(summary_table(frame)) == (
        "algorithm,minimum,average,standard_deviation,median,lower_quartile,upper_quartile,feasible_share,evaluations\n"
        "mupso,2,3,1.41421,3,2.5,3.5,1,1550\n"
        "de,9,9,nan,inf,inf,inf,0.5,1550\n"
    )


def test_times_are_averaged_and_added_up() -> None:
    frame = _frame([1.0, 1.0], [0.0, 0.0])
    frame["seconds"] = [1.0, 3.0]
    assert as_csv(times_table(frame)) == (
        "algorithm,average_seconds,standard_deviation,total_seconds\nde,2,1.41421,4\n"
    )


def test_the_page_shows_the_papers_figures_beside_ours() -> None:
    experiment = Experiment.model_validate(
        {
            "name": "table3",
            "problem": "paper",
            "algorithms": ("mupso",),
            "swarm_size": 50,
            "iterations": 30,
            "repetitions": 2,
            "seed": 1,
            "printed": True,
        }
    )
    page = summary_page(summary_table(_frame([5.0, 7.0], [0.0, 0.0], algorithm="mupso")), experiment)
    assert "| MuPSO | 5 (4.73) | 6 (7.16) | 1.41 (1.17) | 6 | 5.5 | 6.5 | 100% | 1550 | 7150 |" in page
    assert "feasible ends" in page.replace("\n", " ")


def test_convergence_averages_the_feasible_ends_of_each_iteration(small: Path) -> None:
    small.write_text(small.read_text().replace("[spso, de]", "[de]").replace("repetitions: 3", "repetitions: 2"))
    entries = plan_trials(read_experiment(small), "small.yaml")
    curves = [
        Curves(np.array([5.0, 10.0]), *map(np.array, ([9.0, 4.0], [0.0, 0.0], [9.0, 8.0], [0.0, 0.0]))),
        Curves(np.array([5.0, 10.0]), *map(np.array, ([7.0, 2.0], [0.3, 0.0], [7.0, 6.0], [0.3, 0.1]))),
    ]
    with open_store(small.with_name("runs.sqlite")) as store:
        for entry, curve in zip(entries, curves, strict=True):
            store.add([(entry.key, Outcome(1.0, 0.0, 1.0, 10, 0.1, np.zeros(3), curve))], "{}")
        table = convergence_table(entries, store)
    assert as_csv(table) == (
        "algorithm,iteration,evaluations,median_best_so_far,median_present_best,"
        "best_so_far,best_so_far_feasible_share,present_best,present_best_feasible_share\n"
        "de,0,5,inf,inf,9,0.5,9,0.5\n"
        "de,1,10,3,inf,3,1,8,0.5\n"
    )


@pytest.fixture
def sweep() -> pd.DataFrame:
    sizes, names = [10, 10, 20, 20], ["mupso", "spso", "mupso", "spso"]
    frames = [_frame([2.0 + k, 3.0, 4.0], [0.0] * 3, swarm_size=sizes[k], algorithm=names[k]) for k in range(4)]
    return pd.concat(frames, ignore_index=True)


def test_figures_have_the_same_bytes_for_the_same_data(sweep: pd.DataFrame) -> None:
    assert draw_cost(summary_table(sweep), "value") == draw_cost(summary_table(sweep), "value")
    assert draw_times(times_table(sweep)) == draw_times(times_table(sweep))


def test_a_figure_is_one_svg_without_a_date(sweep: pd.DataFrame) -> None:
    (image,) = draw_cost(summary_table(sweep), "value").values()
    assert b"<svg" in image
    assert b"dc:date" not in image


def test_figures_can_be_drawn_where_ends_are_infeasible(sweep: pd.DataFrame) -> None:
    sweep.loc[sweep["swarm_size"] == 10, "violation"] = 1.0
    assert set(draw_cost(summary_table(sweep), "value")) == {"svg"}


def test_convergence_can_be_drawn_where_nothing_is_feasible_at_first() -> None:
    table = pd.DataFrame(
        {
            "algorithm": "de",
            "iteration": [0, 1, 2],
            "median_best_so_far": [np.inf, np.inf, 20.0],
            "median_present_best": [np.inf, np.inf, 20.0],
            "best_so_far": [np.nan, 30.0, 20.0],
            "present_best": [np.nan, 30.0, 20.0],
        }
    )
    assert set(draw_convergence(table)) == {"svg"}


def _comparison(problems: int, algorithms: tuple[str, ...] = ("mupso", "de", "sqp")) -> pd.DataFrame:
    """Ends of seven repetitions: the later the algorithm, the better; the first end of the last is infeasible."""
    rng = np.random.default_rng(1)
    frames = []
    for problem in range(problems):
        for place, algorithm in enumerate(algorithms):
            values = (20.0 - 4 * place + rng.random(7)).tolist()
            broken = [1.0 if algorithm == "sqp" else 0.0, *[0.0] * 6]
            frames.append(_frame(values, broken, algorithm=algorithm, problem=f"problem-{problem}"))
    return pd.concat(frames, ignore_index=True)


def test_the_figure_of_ends_says_what_is_infeasible_and_names_every_algorithm() -> None:
    images = draw_ends(_comparison(2), {"problem-0": 9.0})
    text = images["svg"].decode()
    assert text.count("<!-- 1 of 7 infeasible -->") == 2
    assert [f"<!-- {name} -->" in text for name in ("MuPSO", "DE", "sqp", "best known")] == [True] * 4
    assert images == draw_ends(_comparison(2), {"problem-0": 9.0})


def test_the_figure_of_ranks_orders_by_average_rank_and_says_when_nothing_can_be_told() -> None:
    text = draw_ranking(_comparison(3))["svg"].decode()
    assert text.index("<!-- sqp -->") < text.index("<!-- DE -->") < text.index("<!-- MuPSO -->")
    assert "in 21 repetitions of 3 problems" in text
    many = draw_ranking(_comparison(12))["svg"].decode()
    assert "<!-- rank (1: best) in 12 problems -->" in many
    assert "repetitions" in draw_ranking(_comparison(1))["svg"].decode()
    budgets = pd.concat([_comparison(2).assign(budget=budget) for budget in (100, 200)])
    assert "of 4 cases (problem, swarm size, budget)" in draw_ranking(budgets)["svg"].decode()


def test_the_figure_of_budgets_has_a_tick_for_each_budget() -> None:
    frame = pd.concat([_comparison(1).assign(budget=budget) for budget in (1550, 5000)], ignore_index=True)
    text = draw_budgets(frame, {"problem-0": 9.0})["svg"].decode()
    assert ["<!-- 1,550 -->" in text, "<!-- 5,000 -->" in text, "<!-- best known -->" in text] == [True] * 3
