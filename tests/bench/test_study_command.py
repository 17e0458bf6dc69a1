"""`armlab paper study` on a small scale, and what its tables say."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from bench.run import RunOptions
from bench.studies.beyond_paper.beyond_paper_page import effect_table, median_table, variant_duels_table
from bench.studies.beyond_paper.beyond_paper_study import EXPERIMENTS, describe_study, make_study

ROOT = Path(__file__).parents[2]
SMALLER = {
    "study_joint_fourier": {"iterations": 1},
    "study_random_frames": {"iterations": 1},
    "study_equal_evaluations": {"evaluations": 120},
    "study_six_joints": {"evaluations": [50, 100]},
    "study_budgets": {"evaluations": [50, 100]},
    "study_mupso": {"evaluations": [700, 750]},
}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Configurations with two repetitions and next to no evaluations."""
    home = tmp_path_factory.mktemp("study")
    (home / "configs").mkdir()
    for name in EXPERIMENTS:
        content = yaml.safe_load((ROOT / "configs" / f"{name}.yaml").read_text()) | {"repetitions": 2} | SMALLER[name]
        (home / "configs" / f"{name}.yaml").write_text(yaml.safe_dump(content))
    return home


def _options(home: Path) -> RunOptions:
    return RunOptions(home / "runs.sqlite", home / "results", workers=1)


@pytest.fixture(scope="module")
def results(home: Path) -> Path:
    """The results of the small study."""
    bar = nullcontext(SimpleNamespace(update=lambda n: None))
    list(make_study(home / "configs", _options(home), ROOT / "results" / "best_known.json", lambda total, done: bar))
    return home / "results"


def test_every_experiment_leaves_its_table_its_duels_and_a_section(results: Path) -> None:
    page = (results / "study.md").read_text()
    for name in EXPERIMENTS:
        assert (results / f"{name}.csv").exists()
        assert (results / f"{name}_duels.csv").exists()
        assert f"## {name}\n" in page


def test_every_picture_of_the_page_is_there(results: Path) -> None:
    for name in ("study_budgets", "study_equal_evaluations", "study_mupso"):
        assert f"]({name}.svg)" in (results / "study.md").read_text()
        assert "<svg" in (results / f"{name}.svg").read_text()


def test_mutations_are_counted_for_every_variant_of_mupso(results: Path) -> None:
    table = pd.read_csv(results / "study_mupso_mutations.csv")
    assert set(table["problem"]) == {"paper", "joint-fourier"}
    never = table[table["algorithm"] == "no mutation"]
    assert (never["mutations_a_run"] == 0).all()
    eager = table[table["algorithm"] == "Q 3"]
    assert (eager["mutations_a_run"] > 0).any()


def test_a_study_that_is_done_has_nothing_left_to_run(home: Path, results: Path) -> None:
    totals = [line for line in describe_study(home / "configs", _options(home)) if "to do" in line]
    assert len(totals) == len(EXPERIMENTS)
    assert all(line.endswith(" 0 to do") for line in totals)


def _frame(**ends: list[float]) -> pd.DataFrame:
    rows = [
        {
            "problem": "paper",
            "swarm_size": 50,
            "budget": 100,
            "algorithm": name,
            "repetition": k,
            "value": value,
            "violation": 0.0 if np.isfinite(value) else 1.0,
        }
        for name, values in ends.items()
        for k, value in enumerate(values)
    ]
    return pd.DataFrame(rows)


def test_medians_count_infeasible_ends_as_infinite_and_show_the_share_of_the_others() -> None:
    table = median_table(_frame(mupso=[3.0, 4.0, 5.0], de=[1.0, np.inf, np.inf]), {"paper": 2.5})
    assert table.to_dict("records") == [{"MuPSO": "4", "DE": "inf (33%)", "least": "MuPSO", "best known": "2.5"}]


def test_a_variant_that_helps_has_an_effect_above_one_half_and_a_plus() -> None:
    rng = np.random.default_rng(0)
    base = rng.uniform(10, 20, 20)
    table = variant_duels_table(_frame(mupso=list(base), **{"Q 3": list(base * 0.5), "Q 5": list(base)}), "mupso")
    shown = effect_table(table).set_index("variant")["paper, 100"]
    assert shown["Q 3"].startswith("1.00 (")
    assert shown["Q 3"].endswith("+")
    assert shown["Q 5"].startswith("0.50 (")
    assert not shown["Q 5"].endswith(("+", "-"))
