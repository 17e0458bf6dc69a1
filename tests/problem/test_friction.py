"""Friction columns: as defined, against an independent engine, with derivatives, and absent unless asked for."""

from typing import Any

import numpy as np
import pytest
from engines import pinocchio_regressor
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import random_arm, random_motion
from refusals import refusal

from armlab.common.arrays import Array
from armlab.common.derivatives import Question
from problem.excitation import ExcitationProblem
from problem.friction import friction_entries, friction_matrix
from problem.gradient import condition_gradient, motion_of
from problem.motion import MAX_RATE_AT_REST, Motion
from problem.registry import parse_problem
from problem.regressor import extended_gram_matrix, observation_matrix
from problem.spectrum import MAX_GRAM_CONDITION, find_spectrum

SMALL = {"preset": "joint-fourier", "arm": "irb120", "harmonics": 3, "samples": 40, "friction_columns": True}


def build(**changes: Any) -> ExcitationProblem:
    problem = parse_problem(SMALL | changes, "test").build()
    assert isinstance(problem, ExcitationProblem)
    return problem


def random_points(problem: ExcitationProblem, count: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(problem.lower, problem.upper, (count, len(problem.lower)))


def test_two_joints_at_two_samples_by_hand() -> None:
    speed = np.array([[3.0, -0.5], [0.0, 2.0]])
    motion = Motion(np.zeros((2, 2)), speed, np.zeros((2, 2)))
    expected = [
        [1, 3, 1, 0, 0, 0],
        [0, 0, 0, -1, -0.5, 1],
        [0, 0, 1, 0, 0, 0],
        [0, 0, 0, 1, 2, 1],
    ]
    assert friction_matrix(motion).tolist() == expected


def test_a_joint_at_rest_has_no_direction_whatever_rounding_leaves() -> None:
    speed = np.array([[MAX_RATE_AT_REST], [-MAX_RATE_AT_REST], [1e-17], [2 * MAX_RATE_AT_REST]])
    entries = friction_entries(Motion(np.zeros((4, 1)), speed, np.zeros((4, 1))))
    assert entries[:, 0, 0].tolist() == [0, 0, 0, 1]
    ends = friction_entries(motion_of(build(rest=True), random_points(build(rest=True), 1)[0]))[[0, -1], :, 0]
    assert not ends.any()


@settings(max_examples=20, deadline=None)
@given(samples=st.integers(1, 40), kinds=st.text("RP", min_size=1, max_size=5), seed=st.integers(0, 99))
def test_the_gram_matrix_is_that_of_both_matrices_side_by_side(samples: int, kinds: str, seed: int) -> None:
    arm, motions = random_arm(kinds, seed), random_motion(len(kinds), samples, seed, batch=(2,))
    columns = np.flatnonzero(np.random.default_rng(seed).uniform(size=10 * len(arm)) < 0.5)
    grams = extended_gram_matrix(arm, motions, columns, friction_entries(motions))
    for one, gram in enumerate(grams):
        motion = motions.select(np.intp(one))
        both = np.hstack([observation_matrix(arm, motion)[:, columns], friction_matrix(motion)])
        np.testing.assert_allclose(gram, both.T @ both, rtol=0, atol=1e-12 * np.abs(both.T @ both).max())
        alone = extended_gram_matrix(arm, motion, columns, friction_entries(motion))
        assert np.array_equal(alone, gram)


@pytest.mark.parametrize("shape", [(5, 3, 3), (6, 4, 3), (5, 4, 4)])
def test_own_columns_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"own columns should have the shape \(5, 4\) and up to 3 a joint"):
        extended_gram_matrix(random_arm("RRPR"), random_motion(4, 5), np.array([3]), np.ones(shape))


def stacked(problem: ExcitationProblem, motion: Motion) -> Array:
    """The matrix that a problem judges, from Pinocchio's regressor and loops."""
    rigid = pinocchio_regressor(problem.arm, motion)[:, problem.base.columns]
    friction = np.zeros((len(rigid), 3 * motion.joints))
    for sample in range(motion.samples):
        for joint in range(motion.joints):
            speed = motion.velocity[sample, joint]
            friction[sample * motion.joints + joint, 3 * joint : 3 * joint + 3] = np.sign(speed), speed, 1.0
    return np.column_stack([rigid, friction])


@pytest.mark.parametrize("unit_columns", [False, True])
@pytest.mark.parametrize("space", ["coefficients", "feasible"])
@pytest.mark.parametrize("arm", ["irb120-arm", "irb120", "unisa-panda"])
def test_every_criterion_is_that_of_pinocchios_regressor_with_friction_columns(
    arm: str, space: str, unit_columns: bool
) -> None:
    settings = {"arm": arm, "search_space": space, "unit_columns": unit_columns, "limits": {"torque": "none"}}
    plain = build(**settings)
    point = random_points(plain, 1)
    matrix = stacked(plain, motion_of(plain, point[0]))
    if unit_columns:
        matrix = matrix / np.linalg.norm(matrix, axis=0)
    values = np.linalg.svd(matrix, compute_uv=False)
    assert len(values) == len(plain.base) + 3 * len(plain.arm)
    expected = {
        "eq44": np.linalg.cond(matrix) + 0.01 / values[-1] + 0.01 * values[0],
        "d_optimality": -2 * np.log(values).mean(),
        "e_optimality": -values[-1],
    }
    for kind, criterion in expected.items():
        problem = build(**settings, criterion={"kind": kind}, penalty={"step": 0.0, "weight": 1e-12})
        found = problem.evaluate(point)
        assert found.value[0] == pytest.approx(np.linalg.cond(matrix), rel=1e-7)
        assert found.fitness[0] == pytest.approx(criterion, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("unit_columns", [False, True])
def test_a_nearly_singular_motion_is_judged_by_the_matrix_itself(unit_columns: bool) -> None:
    problem, motion = build(arm="irb120-arm"), random_motion(3, 60, batch=(1,))
    speeds = (
        np.sign(motion.velocity) + 1e-5 * motion.velocity
    )  # nearly one speed, so viscous friction is nearly Coulomb's
    steady = Motion(motion.position, speeds, motion.acceleration)
    matrix = stacked(problem, steady.select(np.intp(0)))
    if unit_columns:
        matrix = matrix / np.linalg.norm(matrix, axis=0)
    condition = find_spectrum(problem.arm, steady, problem.base.columns, unit_columns, True).condition_number[0]
    assert condition > MAX_GRAM_CONDITION
    assert condition == pytest.approx(np.linalg.cond(matrix), rel=1e-6)


def test_a_joint_that_never_turns_back_does_not_tell_coulomb_friction_from_an_offset() -> None:
    problem, motion = build(arm="irb120-arm"), random_motion(3, 60, batch=(1,))
    forward = Motion(motion.position, np.abs(motion.velocity), motion.acceleration)
    assert find_spectrum(problem.arm, forward, problem.base.columns, True, True).condition_number[0] > 1e12
    assert find_spectrum(problem.arm, motion, problem.base.columns, True, True).condition_number[0] < 1e3


STEP = 1e-7  # of the differences; the signs of all speeds are the same on both sides


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"unit_columns": True},
        {"rest": True, "arm": "irb120-arm"},
        {"search_space": "feasible", "arm": "irb120-arm", "unit_columns": True},
        {"preset": "paper", "arm": "irb120-arm", "unit_columns": True},
    ],
    ids=lambda changes: "-".join(changes) or "plain",
)
def test_away_from_sign_changes_the_gradient_is_that_of_central_differences(changes: dict[str, Any]) -> None:
    problem = build(**changes)
    point = random_points(problem, 1, seed=3)[0]
    if problem.name == "paper":
        point = np.array([0.12, 0.12, 0.12, 0.03, 0.02, 0.01, 0.02])  # well within reach

    def directions(x: Array) -> list[float]:
        return friction_entries(motion_of(problem, x))[..., 0].ravel().tolist()

    steps = STEP * np.eye(len(point))
    assert all(directions(point + step) == directions(point - step) for step in steps)
    value, gradient = condition_gradient(problem, point)
    assert value == pytest.approx(problem.evaluate(point[None]).value[0], rel=1e-7)
    ends = [[condition_gradient(problem, x)[0] for x in (point + step, point - step)] for step in steps]
    differences = np.array([(after - before) / (2 * STEP) for after, before in ends])
    np.testing.assert_allclose(gradient, differences, rtol=0, atol=1e-6 * np.abs(gradient).max())


@pytest.mark.parametrize("kind", ["eq44", "d_optimality", "e_optimality"])
def test_what_a_search_with_derivatives_sees_has_the_slopes_of_differences(kind: str) -> None:
    problem = build(arm="irb120-arm", criterion={"kind": kind})
    point, question = random_points(problem, 1, seed=3)[0], Question(20.0, np.zeros(0, dtype=np.intp), -np.inf)
    found = problem.differentiate(point, question)
    steps = STEP * np.eye(len(point))
    ends = [[problem.differentiate(x, question).value for x in (point + step, point - step)] for step in steps]
    differences = np.array([(after - before) / (2 * STEP) for after, before in ends])
    np.testing.assert_allclose(found.slope, differences, rtol=0, atol=1e-6 * np.abs(found.slope).max())


def test_where_a_speed_changes_its_sign_at_a_sample_the_condition_number_jumps() -> None:
    problem = build(arm="irb120-arm", samples=20)
    start, end = random_points(problem, 2)
    shares = np.linspace(0.0, 1.0, 20_001)[:, None]
    points = (1 - shares) * start + shares * end
    values, motions = problem.evaluate(points).value, problem.trajectory.motions(points, problem.times).motion
    turned = np.any(np.diff(friction_entries(motions)[..., 0], axis=0) != 0, axis=(1, 2))
    steps = np.abs(np.diff(np.log(values)))
    assert 5 < turned.sum() < 500
    assert np.median(steps[turned]) > 10 * np.median(steps[~turned])


def test_settings_without_friction_columns_are_written_as_they_always_were() -> None:
    without, with_them = (parse_problem(SMALL | {"friction_columns": asked}, "test") for asked in (False, True))
    assert "friction_columns" not in without.model_dump(mode="json")
    assert with_them.model_dump(mode="json") == without.model_dump(mode="json") | {"friction_columns": True}
    for written in (without, with_them):
        assert parse_problem(written.model_dump(mode="json"), "test") == written


def test_too_few_samples_for_all_columns_are_told() -> None:
    said = refusal(build, arm="irb120-arm", samples=7)
    assert said == "samples: 7 of 3 joints cannot show 15 base parameters and 9 of friction; take 8 or more"
    assert build(arm="irb120-arm", samples=8)
