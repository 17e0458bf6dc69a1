"""The problems of a suite in the package `ioh`: the same values to the bit, the same boxes, logged by its logger."""

import json
import re
from pathlib import Path

import ioh
import numpy as np
import pytest
from refusals import refusal

import bench.ioh_problems
from bench.ioh_problems import ioh_problem, ioh_problems
from problem.registry import parse_problem
from problem.suite import instances

NAMES = [
    "suite-1/irb120-arm-tool-h5-t10-shifted",
    "suite-1/irb120-rest-h5-t10-origin",
    "suite-2/ur10-first3-unit",
    "suite-3/ur10-first3-unit-friction",
]


@pytest.mark.parametrize("name", NAMES)
def test_values_and_boxes_are_ours_to_the_bit(name: str) -> None:
    theirs, ours = ioh_problem(name), parse_problem({"preset": name}, "test").build()
    assert (theirs.meta_data.name, theirs.meta_data.n_variables) == (name.replace("/", "_"), len(ours.lower))
    assert theirs.bounds.lb.tobytes() == ours.lower.tobytes()
    assert theirs.bounds.ub.tobytes() == ours.upper.tobytes()
    points = np.random.default_rng(1).uniform(ours.lower, ours.upper, (20, len(ours.lower)))
    assert np.array([theirs(point) for point in points]).tobytes() == ours.evaluate(points).fitness.tobytes()
    assert theirs.state.evaluations == 20
    assert theirs.state.current_best.y == ours.evaluate(points).fitness.min()


def test_all_problems_of_a_suite_have_their_place_as_id() -> None:
    found = ioh_problems("suite-2")
    assert [problem.meta_data.name for problem in found] == [name.replace("/", "_") for name in instances("suite-2")]
    assert [problem.meta_data.problem_id for problem in found] == list(range(1, 25))


def test_iohs_own_logger_writes_what_was_evaluated(tmp_path: Path) -> None:
    logger = ioh.logger.Analyzer(root=str(tmp_path), folder_name="run", algorithm_name="three points")
    problem = ioh_problem(NAMES[2])
    problem.attach_logger(logger)
    first, *_ = [problem((1 - at) * problem.bounds.lb + at * problem.bounds.ub) for at in (0.3, 0.4, 0.45)]
    problem.detach_logger()
    logger.close()
    (data,) = tmp_path.rglob("*.dat")
    head, *rows = data.read_text().splitlines()
    assert head.split()[:2] == ["evaluations", "raw_y"]
    assert float(rows[0].split()[1]) == pytest.approx(first, rel=1e-9)
    (header,) = tmp_path.rglob("*.json")  # readers begin there
    assert json.loads(header.read_text())["function_name"] == NAMES[2].replace("/", "_")


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (Path(bench.ioh_problems.__file__).parent / "README.md").read_text()
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(example, {})
    assert any(tmp_path.rglob("*.json"))
    assert test_values_and_boxes_are_ours_to_the_bit.__name__ in text


def test_an_unknown_name_is_told_in_one_line() -> None:
    said = refusal(ioh_problem, "suite-2/panda-al-si")
    assert said.endswith("unknown preset 'suite-2/panda-al-si': did you mean 'suite-2/panda-all-si'?")
    assert refusal(ioh_problems, "suite-9").startswith("unknown suite 'suite-9'")
