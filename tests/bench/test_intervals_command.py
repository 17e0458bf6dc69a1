"""`armlab tools intervals`: written intervals of A12 are those of the present method."""

import shutil
from pathlib import Path

import pandas as pd
import pytest
from refusals import refusal

from bench.statistics.superiority import superiority_interval
from bench.studies.intervals import renew_intervals

RESULTS = Path(__file__).parents[2] / "results"


@pytest.fixture
def committed(tmp_path: Path) -> Path:
    """The committed tables, pages and settings of comparisons."""
    left_out = shutil.ignore_patterns("*.png", "*.svg", "*.html", "proof", "real", "field", "relations", "landscape")
    return Path(shutil.copytree(RESULTS, tmp_path / "results", ignore=left_out))


def table_of(results: Path, name: str) -> Path:
    (path,) = results.rglob(name)
    return path


def test_every_committed_interval_and_page_is_of_the_present_method(committed: Path) -> None:
    before = {path: path.read_bytes() for path in committed.rglob("*") if path.suffix in (".csv", ".md")}
    renewed = [path for path in renew_intervals(committed) if path.suffix in (".csv", ".md")]
    names = {path.name for path in renewed}
    assert {"study_budgets_duels.csv", "tune_duels.csv", "peers_rivals.csv", "comparison.csv"} <= names
    assert {"study.md", "tune.md", "peers_rivals.md", "comparison.md", "suite_sqp_duels.md"} <= names
    assert [path.name for path in renewed if path.read_bytes() != before[path]] == []


def test_an_interval_of_another_method_is_replaced_in_table_and_page(committed: Path) -> None:
    path = table_of(committed, "suite_sqp_duels.csv")
    rows = pd.read_csv(path, keep_default_na=False)
    share = rows["superiority"][0]
    page = path.with_suffix(".md").read_text()
    rows.assign(low=0.0, high=1.0).to_csv(path, index=False)
    list(renew_intervals(committed))
    found = pd.read_csv(path)
    assert (found["low"][0], found["high"][0]) == pytest.approx(superiority_interval(share, 12), abs=1e-5)
    assert path.with_suffix(".md").read_text() == page


def test_an_a12_that_the_repetitions_cannot_give_is_refused(committed: Path) -> None:
    path = table_of(committed, "peers_rivals.csv")
    pd.read_csv(path).assign(ours_better=0.5001).to_csv(path, index=False)
    assert refusal(lambda: list(renew_intervals(path.parent))) == f"{path}: has an A12 that 30 repetitions cannot give"


def test_a_page_that_shows_something_else_than_its_table_is_refused(committed: Path) -> None:
    path = table_of(committed, "comparison.md")
    path.write_text(path.read_text().replace("| joint-fourier | MuPSO | 17.8 |", "| joint-fourier | MuPSO | 17.9 |"))
    told = refusal(lambda: list(renew_intervals(path.parent)))
    assert told == f"{path}: shows other intervals than the table beside it; its command writes both anew"
