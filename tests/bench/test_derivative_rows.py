"""Algorithms that ask for derivatives in an experiment: what they pay, and problems that offer none."""

from dataclasses import replace
from pathlib import Path

import pytest
from refusals import refusal

from bench.config import read_experiment
from bench.execute import run_trial
from bench.plan import plan_trials

TINY = "{preset: joint-fourier, joints: 2, harmonics: 2, samples: 30}"
CONFIG = f"""\
name: tiny
problem: {TINY}
algorithms: [spso, sqp]
swarm_size: 8
evaluations: 80
repetitions: 2
seed: 1
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(CONFIG)
    return path


def test_a_point_with_derivatives_costs_what_forward_differences_take_unless_a_price_is_stated(config: Path) -> None:
    plan = plan_trials(read_experiment(config), "tiny")
    swarm, sqp = plan[0].trial, plan[2].trial
    curve = run_trial(sqp).curves.evaluations
    assert curve[:4].tolist() == [8, 19, 30, 41]  # ten numbers and the point itself
    cheap = run_trial(replace(sqp, derivative_price=5)).curves.evaluations
    assert cheap[:4].tolist() == [8, 13, 18, 23]
    assert swarm.derivative_price is None


def test_a_price_concerns_only_algorithms_that_ask_for_derivatives(config: Path) -> None:
    config.write_text(CONFIG + "derivative_price: 5\n")
    plan = plan_trials(read_experiment(config), "tiny")
    assert [entry.trial.derivative_price for entry in plan] == [None, None, 5, 5]


def test_all_rows_share_their_first_points(config: Path) -> None:
    plan = plan_trials(read_experiment(config), "tiny")
    firsts = [run_trial(plan[place].trial).curves.best_value[0] for place in (0, 2)]
    assert firsts[0] == firsts[1]


def test_the_outcome_of_a_trial_is_the_same_to_the_bit_each_time(config: Path) -> None:
    trial = plan_trials(read_experiment(config), "tiny")[2].trial
    first, second = run_trial(trial), run_trial(trial)
    assert first.best_x.tobytes() == second.best_x.tobytes()


def test_a_problem_without_derivatives_is_refused_in_one_line(config: Path) -> None:
    config.write_text(CONFIG.replace(TINY, "sphere"))
    said = refusal(plan_trials, read_experiment(config), "tiny.yaml")
    assert said == (
        "'sqp' in tiny.yaml asks for derivatives, and problem 'sphere' offers none: "
        "its class has no method `differentiate`"
    )
