"""The records hold what they say, are only ever improved, and every table can ask how far it is from them."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from bench.studies.best_known.descent import SearchEnd, descend, evaluate_point
from bench.studies.best_known.records import (
    RECORDS_FILE,
    Record,
    build_excitation,
    gap_to_best_known,
    is_d_optimal,
    read_records,
    read_search_plan,
    records_by_problem,
    write_records,
)
from bench.studies.best_known.search import SearchStart, improve_best_known, record_point
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.registry import ProblemSettings, parse_problem
from problem.regressor import observation_matrix

ROOT = Path(__file__).parents[2]
RECORDS = read_records(ROOT / "results" / RECORDS_FILE)
TINY = {"preset": "joint-fourier", "joints": 2, "harmonics": 2, "samples": 30}
PLAN = f"name: tiny\nseed: 3\nproblems:\n  tiny: {json.dumps(TINY)}\n"


def settings_of(**settings: object) -> ProblemSettings:
    return parse_problem(settings, "test")


def tiny() -> ExcitationProblem:
    return build_excitation(settings_of(**TINY), "tiny")


@pytest.fixture
def plan(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "plan.yaml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("name", RECORDS)
def test_a_record_is_reproduced_and_breaks_no_limit(name: str) -> None:
    record = RECORDS[name]
    problem = build_excitation(parse_problem(record.settings, name), name)
    end = evaluate_point(problem, record_point(record))
    assert end.value == pytest.approx(record.value, rel=1e-9 if problem.spectral else 1e-6)
    assert end.violation == 0.0
    assert tuple(record.coefficients) == problem.trajectory.names
    assert np.all((problem.lower <= end.point) & (end.point <= problem.upper))


def test_every_problem_of_the_plan_has_a_record_of_its_present_settings() -> None:
    plan = read_search_plan(ROOT / "configs" / "best_known.yaml")
    known = records_by_problem(ROOT / "results" / RECORDS_FILE)
    assert set(RECORDS) == set(plan.problems)
    for name in plan.problems:
        settings = plan.settings(name)
        assert is_d_optimal(settings) == name.endswith("-d")
        if not is_d_optimal(settings):  # a gap is that of a condition number
            assert gap_to_best_known(settings, RECORDS[name].value, known) == 0.0


def test_a_record_of_d_optimality_holds_the_determinant_and_no_condition_number() -> None:
    problem = replace(tiny(), criterion=Criterion("d_optimality"))
    found = descend(problem, (problem.lower + problem.upper) / 2 + 0.1 * (problem.upper - problem.lower))
    motion = problem.trajectory.motions(found.point[None], problem.times).motion
    matrix = observation_matrix(problem.arm, motion.select(np.intp(0)))[:, problem.base.columns]
    determinant = np.linalg.det(matrix.T @ matrix) ** (-1 / matrix.shape[1])
    assert found.value == pytest.approx(determinant, rel=1e-6)


def test_no_start_ended_below_the_record() -> None:
    for record in RECORDS.values():
        ends = [end for values in record.ends.values() for end in values if end is not None]
        assert min(ends) == pytest.approx(record.value, rel=1e-5)


def test_a_problem_without_derivatives_is_searched_in_the_box_and_about_the_best(
    tmp_path: Path, plan: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bench.studies.best_known.search.EVALUATIONS_WITHOUT_DERIVATIVES", 75)
    text = "name: tiny\nseed: 3\nproblems:\n  tiny: {preset: tell-apart, joints: 2, harmonics: 2, duration: 2.0}\n"
    config = plan(text)
    for _ in range(2):
        list(improve_best_known(tmp_path, 0.0, config=config))
    record = read_records(tmp_path / RECORDS_FILE)["tiny"]
    assert set(record.ends) == {"cma-es", "kick"}
    assert (record.evaluations, record.gradients) == (150, 0)


def test_a_search_goes_on_where_it_stopped_and_never_gets_worse(tmp_path: Path, plan: Callable[[str], Path]) -> None:
    config = plan(PLAN)
    values = []
    for starts in (1, 2, 3):
        assert len(list(improve_best_known(tmp_path, 0.0, config=config))) == 1
        record = read_records(tmp_path / RECORDS_FILE)["tiny"]
        assert record.starts == starts
        values.append(record.value)
    assert values == sorted(values, reverse=True)


def test_a_problem_that_starts_from_another_record_goes_back_to_it_every_other_time(
    tmp_path: Path, plan: Callable[[str], Path]
) -> None:
    fine = json.dumps(TINY | {"samples": 90})
    config = plan(PLAN + f"  fine: {fine}\nstart_from: {{fine: tiny}}\n")
    for _ in range(3):
        list(improve_best_known(tmp_path, 0.0, config=config))
    records = read_records(tmp_path / RECORDS_FILE)
    assert {method: len(ends) for method, ends in records["fine"].ends.items()} == {"from tiny": 2, "kick": 1}
    assert records["fine"].value == pytest.approx(records["tiny"].value, rel=0.3)


def test_a_better_record_is_left_alone(tmp_path: Path, plan: Callable[[str], Path]) -> None:
    config = plan(PLAN)
    list(improve_best_known(tmp_path, 0.0, config=config))
    found = read_records(tmp_path / RECORDS_FILE)["tiny"]
    write_records(tmp_path / RECORDS_FILE, {"tiny": found.model_copy(update={"value": 1.0})})
    list(improve_best_known(tmp_path, 0.0, config=config))
    after = read_records(tmp_path / RECORDS_FILE)["tiny"]
    assert (after.value, after.coefficients, after.start) == (1.0, found.coefficients, found.start)
    assert (after.starts, after.count_agreeing(0.01)) == (2, (0, 2))


def test_a_descent_ends_within_all_limits_and_below_its_start() -> None:
    problem = tiny()
    start = (problem.lower + problem.upper) / 2 + 0.1 * (problem.upper - problem.lower)
    before, after = evaluate_point(problem, start), descend(problem, start)
    assert after.feasible
    assert after.value < 0.5 * before.value
    assert evaluate_point(problem, after.point).value == after.value


def test_a_random_step_from_the_end_of_a_descent_is_no_better() -> None:
    problem = tiny()
    end = descend(problem, problem.lower + 0.6 * (problem.upper - problem.lower))
    steps = np.random.default_rng(0).normal(scale=1e-4, size=(300, len(end.point)))
    near = problem.evaluate(np.clip(end.point + steps, problem.lower, problem.upper))
    assert np.all(near.value[near.violation == 0] > end.value * (1 - 1e-6))


def test_the_gap_does_not_depend_on_what_leaves_a_trajectory_as_good_as_it_is(tmp_path: Path) -> None:
    record = Record(
        settings=settings_of(preset="joint-fourier").model_dump(mode="json"),
        value=8.0,
        coefficients={},
        method="",
        seed=0,
        start=0,
        evaluations=0,
        gradients=0,
        versions={},
    )
    write_records(tmp_path / RECORDS_FILE, {"one": record})
    known = records_by_problem(tmp_path / RECORDS_FILE)
    same = [
        settings_of(preset="joint-fourier"),
        settings_of(preset="joint-fourier", penalty={"step": 7.0}, criterion={"kind": "d_optimality"}),
        settings_of(preset="random-frame", frame_seed=5),
    ]
    assert [gap_to_best_known(settings, 10.0, known) for settings in same] == [0.25] * 3
    assert gap_to_best_known(settings_of(preset="joint-fourier", rest=True), 10.0, known) is None
    assert gap_to_best_known(settings_of(preset="sphere"), 10.0, known) is None


def test_a_problem_of_a_suite_has_the_record_of_its_definition() -> None:
    known = records_by_problem(ROOT / "results" / RECORDS_FILE)
    gaps = [
        gap_to_best_known(settings_of(**settings), 100.0, known)
        for settings in ({"preset": "suite-2/irb120-all-si"}, {"preset": "joint-fourier", "arm": "irb120"})
    ]
    assert gaps[0] == gaps[1] is not None


def test_a_problem_with_friction_columns_has_a_record_of_its_own() -> None:
    known = records_by_problem(ROOT / "results" / RECORDS_FILE)
    named, written, without = (
        gap_to_best_known(settings_of(**settings), 100.0, known)
        for settings in (
            {"preset": "suite-3/irb120-all-si-friction"},
            {"preset": "joint-fourier", "arm": "irb120", "friction_columns": True},
            {"preset": "joint-fourier", "arm": "irb120"},
        )
    )
    assert named is not None
    assert without is not None
    assert named == written < without  # more columns, a larger best


def test_each_mistake_is_told_in_one_line(tmp_path: Path, plan: Callable[[str], Path]) -> None:
    def told(text: str, name: str | None = None) -> str:
        path = plan(text)
        return refusal(lambda: list(improve_best_known(tmp_path, 0.0, name, path)))

    assert told(PLAN, "tin") == "no problem 'tin': did you mean 'tiny'?"
    assert "start_from names no problem 'big': known: tiny" in told(PLAN + "start_from: {tiny: big}\n")
    torque = told("name: t\nseed: 0\nproblems: {t: {preset: joint-fourier, limits: {torque: 5.0}}}\n")
    assert torque == "t: a best-known record needs limits of position, velocity and acceleration alone"
    sphere = told("name: t\nseed: 0\nproblems: {t: {preset: sphere}}\n")
    assert sphere == "t: should be a trajectory of an arm in its own coordinates, not 'sphere'"
    assert "t starts from the record of 's', which does not exist yet" in told(
        "name: t\nseed: 0\nproblems: {t: {preset: joint-fourier}, s: {preset: joint-fourier}}\nstart_from: {t: s}\n"
    )


def test_a_record_of_other_settings_is_not_overwritten(tmp_path: Path, plan: Callable[[str], Path]) -> None:
    list(improve_best_known(tmp_path, 0.0, config=plan(PLAN)))
    other = plan(PLAN.replace('"samples": 30', '"samples": 31'))
    told = refusal(lambda: list(improve_best_known(tmp_path, 0.0, config=other)))
    assert (
        told == f"{tmp_path / RECORDS_FILE}: 'tiny' has other settings there: rename the problem or remove its record"
    )


def test_a_file_that_is_no_record_is_told(tmp_path: Path) -> None:
    path = tmp_path / RECORDS_FILE
    path.write_text('{"schema": "other/1", "problems": {}}')
    assert f"'schema' in {path}: should be 'best-known/1', not 'other/1'" == refusal(read_records, path)
    path.write_text("{")
    assert f"{path}: not valid JSON" in refusal(read_records, path)


def test_what_another_search_found_meanwhile_is_kept(
    tmp_path: Path, plan: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = plan(PLAN)
    list(improve_best_known(tmp_path, 0.0, config=config))
    file = tmp_path / RECORDS_FILE
    found = read_records(file)["tiny"]
    better = found.model_copy(update={"value": 1.0, "ends": found.ends | {"kick": (1.0,)}})

    def run(start: SearchStart, *arguments: object) -> tuple[str, SearchEnd]:
        write_records(file, {"tiny": better, "other": found})
        return "gradient", evaluate_point(tiny(), record_point(found))

    monkeypatch.setattr(SearchStart, "run", run)
    list(improve_best_known(tmp_path, 0.0, config=config))
    after = read_records(file)
    assert set(after) == {"tiny", "other"}
    assert (after["tiny"].value, after["tiny"].starts) == (1.0, better.starts + 1)
