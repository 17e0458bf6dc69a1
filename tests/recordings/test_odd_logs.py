"""Each odd or broken log is read rightly or refused in one line, and the page says so."""

from pathlib import Path

import pytest
from odd_logs import BROKEN, FROM_LOGS, MAX_DEVIATION, PAGE, REPORTED, OddLog, run_log

pytest.importorskip("rosbags")
pytest.importorskip("pyarrow")


@pytest.mark.parametrize("case", [*FROM_LOGS, *BROKEN], ids=lambda case: case.what)
def test_an_odd_log_is_read_with_the_right_numbers_or_refused_in_one_line(case: OddLog, tmp_path: Path) -> None:
    outcome = run_log(case, tmp_path)
    assert case.says in outcome.line
    assert "Traceback" not in outcome.line
    if case.is_read:
        assert outcome.exit_status == 0
        assert outcome.deviation is not None
        assert outcome.deviation < MAX_DEVIATION
    else:
        assert outcome.exit_status == 2
        assert outcome.line.startswith("armlab: ")
    assert case.what in PAGE.read_text(encoding="utf-8")


def test_each_log_that_people_report_is_tried() -> None:
    tried = {case.what for case in (*FROM_LOGS, *BROKEN)}
    reported = [what for logs in REPORTED.values() for what in logs]
    assert len(reported) == len(set(reported))
    assert set(reported) <= tried
