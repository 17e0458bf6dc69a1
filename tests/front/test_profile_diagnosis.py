"""Where the seconds of a diagnosis go, as `tools/profile_diagnosis.py` counts them."""

import re
from pathlib import Path

from armlab.diagnosis.torque.stages import BY_PROBABILITY, BY_TESTS
from tools.profile_diagnosis import STAGES, FunctionTime, StageClock, function_lines


def test_seconds_belong_to_the_stage_that_runs_and_to_none_twice():
    times = iter([2.0, 3.0, 7.0, 8.0, 18.0])
    clock = StageClock(lambda: next(times))
    clock.begin("loading")
    for message in ("searching, round 1", "fitting nonlinear parameters", "testing claims"):
        clock.tell(message)
    clock.begin("")
    assert clock.seconds == {"imports": 2.0, "loading": 1.0, "search": 5.0, "tests of names": 10.0}
    assert [line.split()[-3:-1] for line in clock.lines()][-1] == ["18.00", "100%"]


def test_every_stage_begins_with_a_message_that_a_diagnosis_tells():
    sources = "".join(path.read_text(encoding="utf-8") for path in Path("armlab").rglob("*.py"))
    told = re.findall(r"progress\(f?\"([^\"]+)\"\)", sources)
    told += [stage.message for stage in (*BY_TESTS, *BY_PROBABILITY)]
    assert [start for start in STAGES if not any(message.startswith(start) for message in told)] == []


def test_functions_are_shown_by_the_order_that_is_asked():
    fast, whole = FunctionTime("fast", 9, 2.0, 2.0), FunctionTime("whole", 1, 0.0, 5.0)
    assert [line.split()[-1] for line in function_lines([whole, fast], "own")][1:] == ["fast", "whole"]
    assert [line.split()[-1] for line in function_lines([fast, whole], "cumulative")][1:] == ["whole", "fast"]
