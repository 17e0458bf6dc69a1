"""`armlab paper replication` on a small scale: all files, a verdict for every claim, a page that needs nothing else."""

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml

from bench.run import RunOptions
from bench.studies.paper.claims import VERDICTS
from bench.studies.paper.replication import EXPERIMENTS, make_paper

ROOT = Path(__file__).parents[2]
SMALLER = {
    "table3": {"repetitions": 4, "iterations": 14},
    "figure3": {"repetitions": 4, "iterations": 14},
    "figure2": {"repetitions": 3, "iterations": 2, "swarm_size": [20, 50, 70]},
    "figure2_equal_evaluations": {"repetitions": 3, "evaluations": 150, "swarm_size": [20, 50, 70]},
    "ranking": {"repetitions": 3, "iterations": 3},
    "table4": {"repetitions": 5},
}
EXPECTED = {
    *(f"table{n}.{suffix}" for n in (1, 2, 3, 4) for suffix in ("csv", "md", "settings.yaml")),
    *(f"figure{n}.{suffix}" for n in (2, 3, 4, 5) for suffix in ("svg", "settings.yaml")),
    "figure2_times.png",
    "table3.svg",
    "ranking.svg",
    "ranking_duels.csv",
    "replication.md",
    "replication.html",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the paper's configurations with few repetitions and iterations."""
    home = tmp_path_factory.mktemp("paper")
    configs = home / "configs"
    configs.mkdir()
    for name in (*EXPERIMENTS, "table1", "table2", "figure4", "figure5", "table4"):
        content = yaml.safe_load((ROOT / "configs" / f"{name}.yaml").read_text()) | SMALLER.get(name, {})
        if name == "ranking":
            content["problem"] = [
                p for p in content["problem"] if p["label"] in ("default 10 s SI free", "default 2 s SI free")
            ]
        (configs / f"{name}.yaml").write_text(yaml.safe_dump(content))
    options = RunOptions(home / "runs.sqlite", home / "results", workers=1)
    list(
        make_paper(
            configs,
            options,
            ROOT / "results" / "best_known.json",
            lambda total, done: nullcontext(SimpleNamespace(update=lambda n: None)),
        )
    )
    return home / "results"


def test_every_table_and_figure_of_the_paper_is_written(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} >= EXPECTED


def test_every_claim_has_a_verdict_and_the_counts_add_up(folder: Path) -> None:
    text = (folder / "replication.md").read_text()
    verdicts = re.findall(rf"\| \*\*({'|'.join(VERDICTS)})\*\* [|(]", text)
    total = next(line for line in text.splitlines() if line.startswith("| **all**"))
    counts = [int(cell) for cell in total.split("|")[2:-1]]
    assert counts == [*(verdicts.count(verdict) for verdict in VERDICTS), len(verdicts)]
    assert counts[-1] > 70


def test_what_cannot_be_checked_names_the_missing_datum(folder: Path) -> None:
    lines = (folder / "replication.md").read_text().splitlines()
    unchecked = [line for line in lines if "**cannot be checked**" in line]
    assert unchecked
    assert all(
        "missing: " in line.split("**cannot be checked**")[1] for line in unchecked if not line.startswith("| **")
    )


def test_the_page_shows_its_figures_without_any_file_beside_it(folder: Path) -> None:
    page = (folder / "replication.html").read_text()
    sources = re.findall(r'<img src="([^"]*)"', page)
    assert len(sources) == 8
    assert all(source.startswith(("data:image/svg+xml;base64,", "data:image/png;base64,")) for source in sources)
    assert "<script" not in page
    assert not re.search("https?:", page)


def test_identified_base_parameters_are_exact_without_noise(folder: Path) -> None:
    table = pd.read_csv(folder / "table4.csv")
    assert len(table) == 15
    assert table["relative error"].max() < 1e-6


def test_predicted_standard_deviations_are_of_the_size_of_the_seen_ones(folder: Path) -> None:
    table = pd.read_csv(folder / "table4.csv")
    ratio = table["standard deviation"] / table["predicted"]
    assert 0.5 < ratio.median() < 2.0


def test_the_ranking_leaves_out_the_choice_that_no_algorithm_can_meet(folder: Path) -> None:
    duels = pd.read_csv(folder / "ranking_duels.csv", dtype=str)
    assert duels.groupby("reading")["feasible"].agg(list).map(lambda shares: shares.count("0%")).to_dict() == {
        "ours": 1,
        "text": 1,
        "program": 1,
    }
    assert "rank (1: best) in 3 repetitions" in (folder / "ranking.svg").read_text()


def test_the_page_has_three_readings_and_the_two_programs_alone(folder: Path) -> None:
    text = (folder / "replication.md").read_text().partition("## Three readings")[2].partition("## ")[0]
    lines = [
        line for line in text.splitlines() if line.startswith(("| as here", "| the sources", "| their", "| the au"))
    ]
    assert [line.split("|")[1].strip() for line in lines[:4]] == [
        "as here",
        "the sources' text as printed",
        "their authors' programs",
        "the authors' programs of WOA and GOA alone",
    ]
    counts = [[int(cell) for cell in line.split("|")[2:5]] for line in lines[:4]]
    assert {sum(row) for row in counts} == {5}  # one usable convention, five rivals


def test_the_page_says_which_claims_hold_when_every_algorithm_is_tuned(folder: Path) -> None:
    text = (folder / "replication.md").read_text()
    assert "## Table 3, tuned" in text
    assert re.search(r"Of 7 claims about the comparison, \d hold as published and \d when everybody is tuned", text)
