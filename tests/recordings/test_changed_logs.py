"""Whatever is done to a log, its numbers are those of the clean runs, or it is refused in one line."""

import pytest
from changed_logs import draw_log, judge_seed
from hypothesis import example, given, settings
from hypothesis import strategies as st

pytest.importorskip("pyarrow")


@given(seed=st.integers(0, 2**32))
@example(seed=6026975)  # rows of which no two stay together when they are sorted
@settings(max_examples=50, deadline=None)
def test_a_changed_log_comes_to_the_numbers_of_its_clean_runs_or_is_refused_in_one_line(seed: int) -> None:
    judged = judge_seed(seed)
    assert not judged.is_broken, f"{draw_log(seed)}: {judged.outcome}: {judged.line}"
