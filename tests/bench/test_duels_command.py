"""`armlab bench duels`: one algorithm of a result set against every other."""

from pathlib import Path

import pandas as pd
import pytest
from refusals import refusal
from small_results import Ran, ran

from bench.result_sets.duels import write_duels
from bench.result_sets.formats import read_results, share_results
from bench.statistics.pairwise import duels_against_all


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    return ran(tmp_path_factory.mktemp("duels"))


def test_every_rival_is_met_on_every_problem_with_effect_interval_and_power(small: Ran, tmp_path: Path) -> None:
    table, page = write_duels(small.config, small.store, "l-shade", tmp_path)
    rows = pd.read_csv(table, keep_default_na=False)
    assert list(zip(rows["problem"], rows["rival"], strict=True)) == [
        *(("sphere", "spso"), ("sphere", "random-search")),
        *(("rastrigin", "spso"), ("rastrigin", "random-search")),
    ]
    trials = read_results(small.config, small.store).trials
    expected = duels_against_all(trials[trials["problem"] == "sphere"], "l-shade")
    assert rows["superiority"][:2].to_list() == pytest.approx([duel.superiority for duel in expected], abs=1e-5)
    text = page.read_text()
    assert "Power with 7 repetitions and Holm over 2: " in text
    (line,) = [line for line in text.splitlines() if line.startswith("| sphere |")]
    assert line.count("(") == 2


def test_the_counts_of_the_page_are_those_of_the_table(small: Ran, tmp_path: Path) -> None:
    table, page = write_duels(small.config, small.store, "random-search", tmp_path)
    rows = pd.read_csv(table, keep_default_na=False).query("rival == 'l-shade'")
    lost = int((rows["winner"] == "l-shade").sum())
    (line,) = [line for line in page.read_text().splitlines() if line.startswith("| l-shade |")]
    assert [cell.strip() for cell in line.split("|")[2:5]] == ["0", str(lost), str(2 - lost)]


def test_an_algorithm_that_took_no_part_is_refused_with_the_nearest_name(small: Ran, tmp_path: Path) -> None:
    told = refusal(lambda: write_duels(small.config, small.store, "l-shad", tmp_path))
    assert told.startswith("small has no algorithm 'l-shad': did you mean 'l-shade'?")


def test_an_algorithm_alone_is_refused(small: Ran, tmp_path: Path) -> None:
    share_results(small.config, small.store, "csv", tmp_path)
    for table in ("trials.csv", "curves.csv"):
        rows = pd.read_csv(tmp_path / table)
        rows[rows["algorithm"] == "spso"].to_csv(tmp_path / table, index=False)
    told = refusal(lambda: write_duels(tmp_path, small.store, "spso", tmp_path / "out"))
    assert told == "small has no algorithm beside 'spso': a duel needs two"
