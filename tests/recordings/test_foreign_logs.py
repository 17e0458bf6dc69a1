"""Logs that other drivers write come to the right verdict in two commands, as the documentation shows."""

from pathlib import Path

import pytest
from foreign_logs import LOGS
from foreign_trial import MAX_ERROR, run_trial, shown_rows

pytest.importorskip("rosbags")
pytest.importorskip("pyarrow")


@pytest.mark.parametrize("name", LOGS)
def test_a_foreign_log_comes_to_the_right_verdict_in_two_commands(name: str, tmp_path: Path) -> None:
    outcome = run_trial(name, tmp_path)
    assert outcome.commands == 2
    assert max(outcome.errors) < MAX_ERROR
    shown = next(row for row in shown_rows() if row[0] == name)
    assert shown[:-1] == list(outcome.cells[:-1])  # what is named beside hangs on the version of MuJoCo


def test_the_page_shows_every_log() -> None:
    assert [row[0] for row in shown_rows()] == list(LOGS)
