"""The feasible search space: every point keeps all limits at every instant, and nothing but the bound is lost."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.common.derivatives import Question
from armlab.common.errors import InputError
from problem.arm import Limits
from problem.contract import DifferentiableProblem
from problem.excitation import ExcitationProblem, ShiftedProblem
from problem.feasible import PEAK_FACTOR, FeasibleFourier
from problem.gradient import condition_gradient
from problem.registry import parse_problem
from problem.trajectories import JointFourier, sample_instants

LIMITS = (Limits((-1.0, 2.0), 1.5, 4.0), Limits((-np.inf, np.inf), 1.0, 2.0), Limits((-0.1, 0.1), 3.0, np.inf))
FINE = 100_001  # instants: peaks between them are lower than the true ones by less than 1e-6


def space(rest: bool = True, harmonics: int = 4, limits: tuple[Limits, ...] = LIMITS) -> FeasibleFourier:
    centre, reach = np.array([0.5, 0.0, 0.0]), np.array([1.5, np.pi, 0.1])
    return FeasibleFourier(JointFourier(5.0, harmonics, centre, reach, np.array([1.0, 0.5, 2.0]), rest), limits)


def random_points(trajectory: FeasibleFourier, count: int = 40, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(trajectory.lower, trajectory.upper, (count, len(trajectory.lower)))


def corners(trajectory: FeasibleFourier, count: int = 40) -> Array:
    signs = np.random.default_rng(1).integers(0, 2, (count, len(trajectory.lower))).astype(bool)
    return np.where(signs, trajectory.upper, trajectory.lower)


def build(**settings: Any) -> ExcitationProblem:
    problem = parse_problem({"search_space": "feasible", **settings}, "test").build()
    assert isinstance(problem, ExcitationProblem)
    return problem


@pytest.mark.parametrize("rest", [False, True])
@pytest.mark.parametrize("draw", [random_points, corners])
def test_every_point_of_the_box_keeps_every_limit_between_samples_too(rest: bool, draw: Any) -> None:
    trajectory = space(rest)
    motion = trajectory.motions(draw(trajectory), sample_instants(5.0, FINE // 10)).motion
    for joint, limit in enumerate(LIMITS):
        assert motion.position[..., joint].min() >= limit.position[0]
        assert motion.position[..., joint].max() <= limit.position[1]
        assert np.abs(motion.velocity[..., joint]).max() <= limit.velocity
        assert np.abs(motion.acceleration[..., joint]).max() <= limit.acceleration


@pytest.mark.parametrize("problem", ["suite-1/irb120-rest-h5-t20-shifted", "suite-2/panda-all-si", "random-frame"])
def test_no_point_of_a_problem_breaks_a_limit(problem: str) -> None:
    built = parse_problem({"preset": problem, "search_space": "feasible"}, "test").build()
    points = np.random.default_rng(0).uniform(built.lower, built.upper, (60, len(built.lower)))
    told = built.evaluate(points)
    assert np.all(told.violation == 0)
    assert np.all(np.isfinite(told.value))


def test_the_largest_scale_comes_as_near_to_a_limit_as_the_bound_allows() -> None:
    trajectory = space(limits=(replace(LIMITS[0], position=(-9.0, 9.0)), *LIMITS[1:]))
    points = random_points(trajectory).reshape(40, 3, -1)
    u = points[..., :-1]
    points[..., :-1] = u / np.abs(u).max(axis=-1, keepdims=True) * trajectory.series.coefficient_limit[:, None]
    motion = trajectory.motions(points.reshape(40, -1), sample_instants(5.0, FINE // 10)).motion
    used = [
        np.ptp(motion.position, axis=1) / [18.0, np.inf, 0.2],
        np.abs(motion.velocity).max(axis=1) / [1.5, 1.0, 3.0],
        np.abs(motion.acceleration).max(axis=1) / [4.0, 2.0, np.inf],
        np.abs(trajectory.numbers(points.reshape(40, -1)).reshape(40, 3, -1)[..., :-1]).max(axis=-1) / [1.0, 0.5, 2.0],
    ]
    worst = np.max(used, axis=0)
    assert worst.max() <= 1.0
    assert worst.min() >= 1 / PEAK_FACTOR - 1e-6


def test_a_single_wave_meets_its_speed_limit_to_the_bound() -> None:
    trajectory = space(rest=False, limits=(Limits((-9.0, 9.0), 0.5),) * 3)
    point = np.zeros((1, len(trajectory.lower)))
    point[0, 3] = 1.0  # a_4 of joint 1 asks twice the limit
    peak = np.abs(trajectory.motions(point, sample_instants(5.0, FINE)).motion.velocity).max()
    assert 0.5 / PEAK_FACTOR - 1e-9 <= peak <= 0.5


def test_a_direction_that_breaks_no_limit_stays_as_it_is() -> None:
    trajectory = space(limits=(Limits((-100.0, 100.0)), Limits(), Limits((-100.0, 100.0))))
    points = random_points(trajectory).reshape(40, 3, -1)
    mapped = trajectory.numbers(points.reshape(40, -1)).reshape(40, 3, -1)
    np.testing.assert_array_equal(mapped[..., :-1], points[..., :-1])
    np.testing.assert_allclose(mapped[:, 1, -1], points[:, 1, -1], rtol=1e-14)  # no range: q0 as it is


@pytest.mark.parametrize("rest", [False, True])
def test_points_is_the_inverse_of_numbers(rest: bool) -> None:
    trajectory = space(rest)
    points = random_points(trajectory)
    np.testing.assert_allclose(trajectory.points(trajectory.numbers(points)), points, atol=1e-9)


def test_numbers_that_break_limits_are_shrunk_along_themselves_onto_them() -> None:
    trajectory = space()
    wild = 50.0 * random_points(trajectory)
    inside = trajectory.numbers(trajectory.points(wild)).reshape(40, 3, -1)[..., :-1]
    ratio = inside / wild.reshape(40, 3, -1)[..., :-1]
    np.testing.assert_allclose(ratio, np.broadcast_to(ratio[..., :1], ratio.shape), rtol=1e-9)
    assert np.all((ratio > 0) & (ratio < 1))


def test_a_point_gives_the_same_to_the_bit_in_any_batch() -> None:
    problem = build(preset="joint-fourier", arm="irb120")
    points = np.random.default_rng(2).uniform(problem.lower, problem.upper, (9, len(problem.lower)))
    together = problem.evaluate(points).value
    assert together.tolist() == [problem.evaluate(point[None]).value[0] for point in points]


def test_points_at_the_middle_and_points_that_are_not_finite_are_told_apart() -> None:
    problem = build(preset="joint-fourier")
    middle = (problem.lower + problem.upper) / 2
    assert problem.evaluate(middle[None]).violation == 0
    assert problem.evaluate(np.full((1, len(middle)), np.nan)).fitness == np.inf


@pytest.mark.parametrize("rest", [False, True])
def test_the_gradient_through_the_map_is_that_of_differences(rest: bool) -> None:
    problem = build(preset="joint-fourier", rest=rest, harmonics=3, samples=40)
    assert isinstance(problem.trajectory, FeasibleFourier)
    for seed in range(3):
        point = np.random.default_rng(seed).uniform(problem.lower, problem.upper)
        assert not np.allclose(problem.trajectory.numbers(point[None])[0], point)  # the map is at work here
        value, gradient = condition_gradient(problem, point)
        assert value == pytest.approx(problem.evaluate(point[None]).value[0], rel=1e-7)
        steps = 1e-6 * np.eye(len(point))
        ends = np.array([condition_gradient(problem, point + step)[0] for step in (*steps, *-steps)])
        differences = (ends[: len(point)] - ends[len(point) :]) / 2e-6
        np.testing.assert_allclose(gradient, differences, rtol=0, atol=2e-6 * np.abs(gradient).max())


def test_a_search_with_derivatives_has_no_limit_left_to_watch() -> None:
    problem = build(preset="joint-fourier")
    point = np.random.default_rng(0).uniform(problem.lower, problem.upper)
    told = problem.differentiate(point, Question(10.0, np.zeros(0, dtype=np.intp), 0.3))
    assert len(told.watched) == 0
    assert np.all(told.margins > 0)


def test_shifted_coordinates_have_the_same_derivatives() -> None:
    plain, shifted = (
        build(preset="joint-fourier"),
        parse_problem({"preset": "random-frame", "search_space": "feasible"}, "test").build(),
    )
    assert isinstance(shifted, ShiftedProblem)
    assert isinstance(shifted, DifferentiableProblem)
    point = np.random.default_rng(3).uniform(plain.lower, plain.upper)
    question = Question(10.0, np.zeros(0, dtype=np.intp), 0.3)
    there = shifted.differentiate(point + shifted.shift, question)
    np.testing.assert_allclose(there.slope, plain.differentiate(point, question).slope, rtol=1e-6, atol=1e-9)


def test_torque_stays_with_the_penalty() -> None:
    problem = build(preset="joint-fourier", limits={"torque": 1e-3})
    assert np.all(problem.evaluate(problem.lower[None]).violation > 0)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "suite-1/irb120-arm-tool-h3-t10-origin"}, "is no series in joint space"),
        ({"preset": "paper"}, "unknown key 'search_space'"),
        ({"preset": "joint-fourier", "search_space": "feasibel"}, "should be 'coefficients' or 'feasible'"),
    ],
)
def test_a_search_space_that_does_not_fit_is_refused_in_one_line(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        build(**settings)
    assert "\n" not in str(refusal.value)


def test_a_range_with_one_end_is_refused() -> None:
    with pytest.raises(InputError, match=r"joint 2 has \[-inf, 1.0\]"):
        space(limits=(LIMITS[0], Limits((-np.inf, 1.0)), LIMITS[2]))
