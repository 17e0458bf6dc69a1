"""The committed check sees real defects, and what it cannot see is known."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from random_arms import random_arm, random_motion

from bench.plan import Entry
from bench.studies.regression.check import CheckVerdict, judge_run
from bench.studies.regression.defects import DEFECTS, matrix_about_own_z, run_with_defect
from bench.studies.regression.sweep import Baseline, Ends, Sweep, group_ends, plan_entries, read_baseline, read_sweep
from problem.arm import Arm, Joint
from problem.registry import parse_problem
from problem.regressor import observation_matrix

ROOT = Path(__file__).parents[2]


@cache
def committed() -> tuple[Sweep, Baseline, list[Entry]]:
    sweep = read_sweep(ROOT / "configs/regression.yaml")
    baseline = read_baseline(ROOT / "results/regression/regression_baseline.json", sweep)
    return sweep, baseline, plan_entries(sweep)


def guarded_problems() -> set[str]:
    return {entry.problem for entry in committed()[2]}


def ends_under(defect: str, repetitions: int) -> Ends:
    """Ends of the first algorithm that the defect concerns: one is enough to find it."""
    concerned = [
        entry
        for entry in committed()[2]
        if entry.trial.algorithm == DEFECTS[defect].algorithms[0] and entry.trial.repetition < repetitions
    ]
    outcomes = run_with_defect(defect, [entry.trial for entry in concerned])
    return group_ends(zip(concerned, outcomes, strict=True))


def verdict_under(defect: str) -> CheckVerdict:
    """All cells, those that the defect does not concern as recorded."""
    sweep, baseline, _ = committed()
    return judge_run(baseline, baseline.fixed_run | ends_under(defect, sweep.repetitions), sweep.false_alarm_rate)


@pytest.mark.parametrize("defect", ["de-without-selection", "spso-frozen-velocity"])
def test_a_defect_of_an_algorithm_is_named_on_every_problem_and_on_no_other_algorithm(defect: str) -> None:
    verdict = verdict_under(defect)
    (algorithm,) = DEFECTS[defect].algorithms
    assert {alarm.cell for alarm in verdict.alarms} == {(problem, algorithm) for problem in guarded_problems()}
    assert all(alarm.worse for alarm in verdict.alarms)
    assert f"{algorithm} on paper is WORSE" in "\n".join(verdict.sentences())


@pytest.mark.parametrize("defect", ["no-coriolis-terms", "wrong-axis"])
def test_a_defect_of_the_observation_matrix_is_found_on_both_problems_of_the_irb_120(defect: str) -> None:
    assert {alarm.cell.problem for alarm in verdict_under(defect).alarms} >= {"paper", "joint-fourier"}


def test_the_sign_of_a_column_cannot_be_seen_since_no_singular_value_depends_on_it() -> None:
    fixed_run = committed()[1].fixed_run
    for cell, ends in ends_under("sign-of-a-column", 3).items():
        assert np.isin(ends, fixed_run[cell]).all()


def test_a_defect_leaves_with_its_context() -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 33))
    values = [parse_problem({"preset": "joint-fourier"}, "here").build().evaluate(points).value]
    for name in ("no-coriolis-terms", "wrong-axis"):
        with DEFECTS[name].inject():
            values.append(parse_problem({"preset": "joint-fourier"}, "here").build().evaluate(points).value)
        assert np.all(np.abs(values[-1] / values[0] - 1) > 1e-3)
    values.append(parse_problem({"preset": "joint-fourier"}, "here").build().evaluate(points).value)
    np.testing.assert_array_equal(values[0], values[-1])


def test_where_the_joints_axis_is_z_of_the_links_own_frame_the_wrong_axis_is_the_right_one() -> None:
    arm, motion = random_arm("RRRR", seed=2), random_motion(4, 9, batch=(2,))
    joints = tuple(Joint(joint.name, joint.kind, joint.before, np.eye(4)) for joint in arm.joints)
    aligned = Arm("aligned", joints, gravity=arm.gravity)
    right = observation_matrix(aligned, motion)
    np.testing.assert_allclose(matrix_about_own_z(aligned, motion), right, rtol=0, atol=1e-12 * np.abs(right).max())
    assert np.abs(matrix_about_own_z(arm, motion) - observation_matrix(arm, motion)).max() > 1
