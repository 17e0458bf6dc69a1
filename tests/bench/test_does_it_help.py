"""The study of criteria against identification errors: its statistics, its simulated experiment, its page."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from refusals import refusal
from scipy.stats import spearmanr

import bench.studies.does_it_help.help_study as study
import bench.studies.does_it_help.judgement as judgement
import bench.studies.does_it_help.trajectories as trajectories
from armlab.common.arrays import Array
from armlab.common.statistics import spearman_correlations
from bench.studies.best_known.records import RECORDS_FILE, read_records
from bench.studies.does_it_help.judgement import (
    CRITERIA,
    ERRORS,
    JURY_SIZE,
    Jury,
    choose_jury,
    correlation_ceiling,
    criterion_values,
    group_resample,
)
from bench.studies.does_it_help.noisy_identification import NOISE_KINDS, MeasurementNoise, identification_errors
from bench.studies.does_it_help.trajectories import PROBLEM_SETTINGS, make_specimens, random_feasible
from problem.excitation import ExcitationProblem
from problem.registry import parse_problem
from problem.regressor import rigid_body_torque

RESULTS = Path(__file__).parents[2] / "results"


def streams(repetition: int) -> np.random.Generator:
    return np.random.default_rng(repetition)


@pytest.fixture(scope="module")
def arm_problem() -> ExcitationProblem:
    problem = parse_problem(PROBLEM_SETTINGS, "test").build()
    assert isinstance(problem, ExcitationProblem)
    return problem


@pytest.fixture(scope="module")
def point(arm_problem: ExcitationProblem) -> Array:
    return random_feasible(arm_problem, np.random.default_rng(4))


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A study of seconds: few trajectories, few repetitions."""
    for name, value in {"RANDOM": 6, "PATHS": 2, "BUDGETS": (100, 300), "ALGORITHMS": ("de",)}.items():
        monkeypatch.setattr(trajectories, name, value)
    monkeypatch.setattr(study, "REPETITIONS", 2)
    monkeypatch.setattr(judgement, "RESAMPLES", 50)


def test_correlations_are_those_of_scipy_with_ties() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=(30, 2)), rng.integers(0, 5, size=(30, 3)).astype(float)
    expected = [[spearmanr(one[:, c], other[:, e]).statistic for e in range(3)] for c in range(2)]
    np.testing.assert_allclose(spearman_correlations(one, other), expected, atol=1e-12)


def test_a_resample_holds_whole_groups_only() -> None:
    groups = ["a", "a", "b", "c", "c", "c"]
    for seed in range(30):
        picked = np.bincount(group_resample(groups, np.random.default_rng(seed)), minlength=6)
        assert picked[0] == picked[1]
        assert picked[3] == picked[4] == picked[5]
        assert picked[0] + picked[2] + picked[3] == 3


def test_without_noise_the_true_parameters_are_identified(arm_problem: ExcitationProblem, point: Array) -> None:
    errors = identification_errors(arm_problem, point, MeasurementNoise(), streams, 1)
    assert np.abs(errors).max() < 1e-5


def test_twice_the_torque_noise_is_twice_the_error(arm_problem: ExcitationProblem, point: Array) -> None:
    one, two = (
        identification_errors(arm_problem, point, MeasurementNoise(torque=size), streams, 2) for size in (0.5, 1.0)
    )
    np.testing.assert_allclose(two, 2 * one, rtol=0.01, atol=1e-4)


def test_encoder_positions_lie_within_half_a_count_and_on_a_grid() -> None:
    exact = np.random.default_rng(1).uniform(-3, 3, (200, 3))
    measured = MeasurementNoise(counts=4096).positions(exact, np.random.default_rng(2))
    count = 2 * np.pi / 4096
    assert np.abs(measured - exact).max() <= count / 2 * (1 + 1e-9)
    steps = (measured - measured[0]) / count
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_torque_noise_has_the_stated_sizes() -> None:
    exact, velocity = np.full((20000, 3), 8.0), np.ones((20000, 3))
    rng = np.random.default_rng(3)
    assert MeasurementNoise(torque=0.5).torques(exact, velocity, rng).std() == pytest.approx(0.5, rel=0.02)
    assert MeasurementNoise(share=0.05).torques(exact, velocity, rng).std() == pytest.approx(0.4, rel=0.02)
    assert np.all(MeasurementNoise(friction=2.0).torques(exact, -velocity, rng) == 6.0)


def test_the_jury_predicts_the_torque_of_its_own_trajectories(arm_problem: ExcitationProblem) -> None:
    panel = choose_jury(arm_problem, seed=5)
    wrong = arm_problem.arm.parameters * np.linspace(0.9, 1.1, 30)
    deviation = arm_problem.base.values(wrong - arm_problem.arm.parameters)
    squares = []
    for number in range(JURY_SIZE):
        rng = command_stream(5, number)
        motion = arm_problem.trajectory.motions(random_feasible(arm_problem, rng)[None], arm_problem.times).motion
        difference = rigid_body_torque(arm_problem.arm, motion, wrong) - rigid_body_torque(arm_problem.arm, motion)
        squares.append((difference**2).mean())
    assert panel.errors(deviation[None])["prediction"] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-9)


def command_stream(seed: int, number: int) -> np.random.Generator:
    from armlab.common.streams import named_generator

    return named_generator("does it help", "independent", seed, number)


def test_errors_of_two_deviations_by_hand() -> None:
    panel = Jury(np.array([[4.0, 0.0], [0.0, 1.0]]))
    told = panel.errors(np.array([[1.0, 0.0], [0.0, 2.0]]))
    assert told == pytest.approx({"prediction": 2.0, "parameters": np.sqrt(2.0), "parameters_si": np.sqrt(2.5)})


def test_criteria_agree_with_the_problem(arm_problem: ExcitationProblem, point: Array) -> None:
    told, judged = criterion_values(arm_problem, point), arm_problem.evaluate(point[None])
    assert told["cond"] == judged.value[0]
    assert told["eq44"] == judged.fitness[0]
    assert tuple(told) == CRITERIA


@pytest.mark.usefixtures("small")
def test_every_specimen_is_feasible_and_none_is_there_twice() -> None:
    chosen = make_specimens(7, read_records(RESULTS / RECORDS_FILE))
    assert {"best known", "random", "between", "de"} == {specimen.source for specimen in chosen}
    assert len({specimen.point.tobytes() for specimen in chosen}) == len(chosen)
    assert all(specimen.problem.evaluate(specimen.point[None]).violation[0] == 0 for specimen in chosen)


@pytest.mark.usefixtures("small")
def test_the_table_is_the_same_for_any_number_of_workers(arm_problem: ExcitationProblem) -> None:
    chosen, panel = make_specimens(7, read_records(RESULTS / RECORDS_FILE))[:6], choose_jury(arm_problem, 7)
    one, two = (study.judge_all(chosen, panel, workers) for workers in (1, 2))
    pd.testing.assert_frame_equal(one, two, check_exact=True)


@pytest.mark.usefixtures("small")
def test_tables_figures_and_page_are_written(tmp_path: Path) -> None:
    (tmp_path / RECORDS_FILE).write_bytes((RESULTS / RECORDS_FILE).read_bytes())
    written = {path.name: path.read_bytes() for path in study.make_does_it_help(tmp_path, 1)}
    table = pd.read_csv(tmp_path / "paper" / "does_it_help_correlations.csv")
    assert len(table) == 2 * len(NOISE_KINDS) * len(ERRORS) * len(CRITERIA)
    assert np.all((table["low"] <= table["high"]) & table["correlation"].between(-1, 1))
    page = written["does_it_help.md"].decode()
    assert page.startswith("# Does a small condition number help?")
    assert "nan" not in page
    assert b"PNG" in written["does_it_help.png"][:8]


def test_the_ceiling_is_one_for_equal_halves_and_zero_for_reversed_ones() -> None:
    frame = pd.DataFrame({"both_prediction_first": [1.0, 2.0, 3.0], "both_prediction_second": [10.0, 20.0, 30.0]})
    assert correlation_ceiling(frame, "both", "prediction") == pytest.approx(1.0)
    frame["both_prediction_second"] = [10.0, 30.0, 20.0]  # ranks 1 3 2 against 1 2 3: r = 0.5
    assert correlation_ceiling(frame, "both", "prediction") == pytest.approx(np.sqrt(2 / 3))
    frame["both_prediction_second"] = [3.0, 2.0, 1.0]
    assert correlation_ceiling(frame, "both", "prediction") == 0.0


def test_without_a_record_the_way_to_one_is_told(tmp_path: Path) -> None:
    told = refusal(study.make_does_it_help, tmp_path, 1)
    assert told == "there is no best-known record of 'joint-fourier': make one with `armlab bench best-known`"
