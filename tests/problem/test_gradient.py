"""Exact derivatives: against high-order differences, against the polynomials they rest on, and in known cases."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from random_arms import random_arm, random_motion

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.excitation import ExcitationProblem
from problem.gradient import (
    condition_gradient,
    condition_with_derivatives,
    motion_gradient,
    spectral_gradient,
    tangents,
)
from problem.motion import Motion
from problem.registry import parse_problem
from problem.regressor import observation_matrix

EIGHTH_ORDER = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SETTINGS: list[dict[str, Any]] = [
    {"preset": "joint-fourier"},
    {"preset": "joint-fourier", "rest": True, "unit_columns": True},
    {"preset": "joint-fourier", "arm": "irb120", "harmonics": 3, "samples": 40},
    {"preset": "paper"},
    {"preset": "paper", "one_c": False, "elbow": "down", "rest": False, "unit_columns": True},
    {"preset": "paper", "columns": "earlier_columns", "duration": 5.0},
]


def build(settings: dict[str, Any]) -> ExcitationProblem:
    problem = parse_problem(settings, "test").build()
    assert isinstance(problem, ExcitationProblem)
    return problem


def within_reach(problem: ExcitationProblem) -> Array:
    """A point whose tool stays well within reach and away from the base's axis, where differences are of use."""
    point = np.random.default_rng(1).uniform(-0.3, 0.3, len(problem.lower)) * (problem.upper - problem.lower) / 2
    point += (problem.lower + problem.upper) / 2
    if problem.name == "paper":
        point[:3] = 0.12
        point[3:] *= 0.4
    assert np.isfinite(problem.evaluate(point[None]).value[0])
    return np.asarray(point)


def differences(function: Callable[[Array], Array], point: Array, step: float) -> Array:
    """Central differences of eighth order, derivatives along the first axis."""
    slopes = []
    for unit in np.eye(len(point)) * step:
        moves = (
            weight * (function(point + k * unit) - function(point - k * unit))
            for k, weight in enumerate(EIGHTH_ORDER, start=1)
        )
        slopes.append(sum(moves) / step)
    return np.array(slopes)


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda settings: "-".join(map(str, settings.values())))
def test_the_gradient_of_the_condition_number_is_that_of_high_order_differences(settings: dict[str, Any]) -> None:
    problem = build(settings)
    point = within_reach(problem)
    value, gradient = condition_gradient(problem, point)
    assert value == pytest.approx(problem.evaluate(point[None]).value[0], rel=1e-7)
    expected = differences(lambda x: np.array(condition_gradient(problem, x)[0]), point, 3e-4)
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-8 * np.abs(gradient).max())


@pytest.mark.parametrize("settings", [SETTINGS[1], SETTINGS[3], SETTINGS[4]], ids=["joint", "path", "literal path"])
def test_tangents_are_those_of_high_order_differences(settings: dict[str, Any]) -> None:
    problem = build(settings)
    point = within_reach(problem)

    def motion_at(x: Array) -> Motion:
        return problem.trajectory.motions(x[None], problem.times).motion.select(np.intp(0))

    def stacked(x: Array) -> Array:
        motion, at = motion_at(x), motion_at(point).position
        turns = np.round((motion.position - at) / (2 * np.pi))  # inverse kinematics may give a turn more or less
        return np.stack([motion.position - 2 * np.pi * turns, motion.velocity, motion.acceleration])

    found = tangents(problem.trajectory, motion_at(point), point, problem.times)
    expected = np.moveaxis(differences(stacked, point, 3e-4), 0, 1)
    scale = np.abs(expected).max(axis=(1, 2, 3))
    for ours, theirs, size in zip(found, expected, scale, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * size)


@pytest.mark.parametrize("kinds", ["R", "P", "RPR", "RRRP", "PRRRRR"])
def test_shifted_matrices_give_the_derivatives_to_rounding_for_any_arm(kinds: str) -> None:
    arm, motion = random_arm(kinds, seed=3), random_motion(len(kinds), samples=3, seed=4)
    weights = np.random.default_rng(5).normal(size=(3 * len(kinds), 10 * len(kinds)))
    states = np.stack([motion.position, motion.velocity, motion.acceleration])

    def total(flat: Array) -> Array:
        return np.asarray(np.sum(weights * observation_matrix(arm, Motion(*flat.reshape(states.shape)))))

    expected = differences(total, states.ravel(), 1e-2).reshape(states.shape)
    found = motion_gradient(arm, motion, weights)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def share_of_higher_harmonics(arm: Arm, joint: int) -> float:
    """Largest share, in the matrix's entries, of harmonics above the second over a turn of one joint."""
    still = random_motion(len(arm), samples=1, seed=6)
    turn = np.arange(16) * 2 * np.pi / 16
    states = [np.repeat(part, len(turn), axis=0) for part in (still.position, still.velocity, still.acceleration)]
    states[0][:, joint] += turn
    matrices = observation_matrix(arm, Motion(*(state[:, None] for state in states)))
    harmonics = np.abs(np.fft.rfft(matrices, axis=0))
    return float(harmonics[3:].max() / harmonics[:3].max())


@pytest.mark.parametrize("joint", range(4))
def test_the_observation_matrix_has_two_harmonics_in_each_turning_joint_and_no_more(joint: int) -> None:
    assert share_of_higher_harmonics(random_arm("RRRR", seed=7), joint) < 1e-14


def test_a_spectral_function_without_slope_has_no_gradient() -> None:
    problem = build({"preset": "joint-fourier"})
    value, gradient = spectral_gradient(problem, within_reach(problem), lambda values: (7.0, np.zeros(len(values))))
    assert value == 7.0
    assert not gradient.any()


def test_condition_of_8_4_2_and_its_slopes_by_hand() -> None:
    value, slopes = condition_with_derivatives(np.array([8.0, 4.0, 2.0]))
    assert value == 4.0
    assert slopes.tolist() == [0.5, 0.0, -2.0]


@pytest.mark.parametrize("unit_columns", [False, True])
def test_where_joint_1_starts_changes_nothing_since_its_axis_is_vertical(unit_columns: bool) -> None:
    problem = build({"preset": "joint-fourier", "unit_columns": unit_columns})
    names = list(problem.trajectory.names)
    gradient = condition_gradient(problem, within_reach(problem))[1]
    assert abs(gradient[names.index("q0_1")]) < 1e-10 * np.abs(gradient).max()


def test_another_family_of_trajectories_is_refused() -> None:
    problem = build({"preset": "paper"})
    motion = problem.trajectory.motions(within_reach(problem)[None], problem.times).motion.select(np.intp(0))
    with pytest.raises(ValueError, match="no derivatives are known for object"):
        tangents(object(), motion, np.zeros(7), problem.times)
