"""The table of ours against theirs: who stands beside whom, with result and time of both."""

from pathlib import Path

import pandas as pd
import pytest
from small_results import ran

from armlab.common.errors import InputError
from bench.plan import rival_pairs
from bench.rivals import rivals_table
from bench.run import load_experiment

CONFIG = """\
name: peers
problem: [{preset: sphere, dimension: 3, shift_seed: 1}, {preset: rastrigin, dimension: 2, shift_seed: 2}]
algorithms: [spso, scipy-de, {name: de, label: our DE}, {name: de, label: other, params: {crossover_rate: 0.5}}]
swarm_size: 6
iterations: 9
repetitions: 6
seed: 1
output: rivals
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rivals")
    ran(folder, CONFIG)
    return folder


def test_a_peer_stands_beside_its_rival_under_their_labels(folder: Path) -> None:
    assert rival_pairs(load_experiment(folder / "peers.yaml").entries) == [("our DE", "scipy-de")]


def test_the_table_has_a_row_a_problem_and_the_medians_of_the_summary(folder: Path) -> None:
    rivals = pd.read_csv(folder / "results" / "peers_rivals.csv")
    summary = pd.read_csv(folder / "results" / "peers.csv").set_index(["problem", "algorithm"])["median"]
    assert rivals["problem"].tolist() == ["sphere", "rastrigin"]
    for row in rivals.to_dict("records"):
        assert row["our_median"] == summary[row["problem"], "our DE"]
        assert row["their_median"] == summary[row["problem"], "scipy-de"]
        assert 0 <= row["low"] <= row["ours_better"] <= row["high"] <= 1
        assert row["our_microseconds"] > 0
        assert row["their_microseconds"] > 0


def test_time_is_that_of_an_evaluation_in_microseconds_and_a_better_end_is_a_win() -> None:
    place = {"problem": "p", "swarm_size": 5, "budget": 100, "violation": 0.0, "evaluations": 100}
    frame = pd.DataFrame(
        [
            {**place, "algorithm": name, "repetition": k, "value": value + k, "seconds": seconds}
            for name, value, seconds in [("de", 1.0, 0.002), ("scipy-de", 100.0, 0.005)]
            for k in range(5)
        ]
    )
    row = rivals_table(frame, [("de", "scipy-de")]).iloc[0]
    assert row["our_microseconds"] == pytest.approx(20.0)
    assert row["their_microseconds"] == pytest.approx(50.0)
    assert (row["our_median"], row["their_median"]) == (3.0, 102.0)
    assert row["ours_better"] == 1.0


def test_a_comparison_without_pairs_is_refused_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"output 'rivals' of .*peers.yaml should have a peer and, in 'algorithms'"):
        ran(tmp_path, CONFIG.replace("scipy-de, ", ""))
    assert [path.name for path in tmp_path.iterdir()] == ["peers.yaml"]


def test_the_page_says_the_same_to_a_reader(folder: Path) -> None:
    page = (folder / "results" / "peers_rivals.md").read_text()
    assert "| sphere | our DE |" in page
    assert page.count("| scipy-de |") == 2
