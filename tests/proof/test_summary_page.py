"""The page about the last judged run of every tier, made from what the tiers have written."""

import json
import shutil
from pathlib import Path

import pytest

from armlab.common.errors import InputError
from armlab.proof.blind.score.distance import ORACLE_TABLE
from armlab.proof.tiers.summary_page import SUMMARY_PAGE, write_summary

RESULTS = Path(__file__).parents[2] / "results" / "proof"


def _cells(page: str, start: str) -> list[str]:
    line = next(line for line in page.splitlines() if line.startswith(f"| {start} |"))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_page_in_the_results_is_what_they_give(tmp_path: Path) -> None:
    shutil.copytree(RESULTS, tmp_path / "proof")
    page = write_summary(tmp_path / "proof").read_text(encoding="utf-8")
    assert page == (RESULTS / SUMMARY_PAGE).read_text(encoding="utf-8")


def test_what_is_missed_is_bold_and_a_tier_that_is_not_there_has_no_column(tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    shutil.copytree(RESULTS / "mixed", folder)
    (folder / ORACLE_TABLE).unlink(missing_ok=True)
    score = json.loads((folder / "score.json").read_text(encoding="utf-8"))
    for tier, value in (("clean", 0.98), ("realistic", 0.97)):
        for each in score["tiers"][tier]:
            if each["id"] == "right_joint":
                each |= {"value": value, "low": 0.9, "high": 1.0, "number": 50}
    (folder / "score.json").write_text(json.dumps(score), encoding="utf-8")
    shutil.copy(RESULTS / "log.jsonl", tmp_path)
    page = write_summary(tmp_path).read_text(encoding="utf-8")
    assert _cells(page, "measure") == ["measure", "wanted", "clean", "realistic"]
    assert _cells(page, "right joint, given a right name")[2:] == ["98 % (90 to 100), 50", "**97 % (90 to 100), 50**"]
    assert "the oracle |" not in page


def test_a_folder_without_a_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"log\.jsonl"):
        write_summary(tmp_path)


def test_tiers_that_count_shares_have_tables_of_their_own(tmp_path: Path) -> None:
    figures = {"nulls_a_false_reading_mistake": [0.02, 0.01, 0.07, 100], "nulls_a_false_name": [None, None, None, 0]}
    entry = {"set": "field", "commit": "0123456789", "cases": 100, "score": {"field": figures}}
    (tmp_path / "log.jsonl").write_text(json.dumps(entry), encoding="utf-8")
    page = write_summary(tmp_path).read_text(encoding="utf-8")
    assert "Commit 0123456, 100 cases" in page
    assert _cells(page, "nulls a false reading mistake")[1:] == ["at most 1%", "2 % (1 to 7), 100"]
    assert _cells(page, "nulls a false name")[1:] == ["-", "-"]
