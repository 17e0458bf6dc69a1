"""What a search with derivatives sees: a smooth criterion, the limits, their slopes, and where there are none."""

from typing import Any

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from problem.contract import Problem, why_not_differentiable
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.gradient import motion_of
from problem.registry import parse_problem
from problem.safe_motion import SafeConstraints
from problem.smooth import LimitRows, smooth_criterion
from problem.spectrum import Spectrum

TINY = {"preset": "joint-fourier", "joints": 2, "harmonics": 2, "samples": 30}
NOTHING = np.zeros(0, dtype=np.intp)


def build(**settings: Any) -> Problem:
    return parse_problem(settings if "preset" in settings else TINY | settings, "test").build()


def tiny() -> ExcitationProblem:
    problem = build()
    assert isinstance(problem, ExcitationProblem)
    return problem


def test_the_smooth_condition_number_of_4_2_1_by_hand_and_its_limit() -> None:
    values = np.array([4.0, 2.0, 1.0])
    value, slope = smooth_criterion(Criterion(), 1.0)(values)
    assert value == pytest.approx(np.log(4 + 2 + 1) + np.log(1 / 4 + 1 / 2 + 1))
    inverse = 1 / 4 + 1 / 2 + 1
    assert slope == pytest.approx([1 / 7 - 1 / 16 / inverse, 1 / 7 - 1 / 4 / inverse, 1 / 7 - 1 / inverse])
    assert smooth_criterion(Criterion(), 1e6)(values)[0] == pytest.approx(np.log(4.0))


@pytest.mark.parametrize(
    "criterion", [Criterion("eq44", 0.2, 0.3), Criterion("d_optimality"), Criterion("e_optimality")]
)
def test_a_sharp_criterion_is_the_criterion_itself_and_its_slopes_are_those_of_differences(
    criterion: Criterion,
) -> None:
    values = np.array([4.0, 2.0, 1.0])
    plain = criterion.value(Spectrum.of(values[None]))[0]
    sharp = smooth_criterion(criterion, 1e5)(values)[0]
    assert (np.exp(sharp) if criterion.kind == "eq44" else sharp) == pytest.approx(plain, rel=1e-4)
    function, step = smooth_criterion(criterion, 5.0), 1e-6
    differences = [(function(values + e)[0] - function(values - e)[0]) / (2 * step) for e in step * np.eye(3)]
    assert function(values)[1] == pytest.approx(differences, rel=1e-6)


def test_a_margin_is_negative_exactly_where_a_limit_is_broken() -> None:
    problem = tiny()
    points = np.random.default_rng(2).uniform(problem.lower, problem.upper, (60, len(problem.lower)))
    nearest = [LimitRows(problem).distances(motion_of(problem, point)).min() for point in points]
    assert np.array_equal(np.array(nearest) < 0, problem.evaluate(points).violation > 0)


@pytest.mark.parametrize("settings", [TINY, {"preset": "paper", "samples": 20}], ids=["joint", "path"])
def test_value_and_margins_have_the_slopes_of_differences(settings: dict[str, Any]) -> None:
    problem = parse_problem(settings, "test").build()
    assert isinstance(problem, ExcitationProblem)
    point = 0.55 * problem.upper + 0.45 * problem.lower
    if problem.name == "paper":
        point[:3] = 0.12  # well within reach, and away from the base's axis

    def at(x: Array) -> Derivatives:
        return problem.differentiate(
            x, Question(20.0, NOTHING, 1e9)
        )  # infinite ones, where there is no limit, left out

    found, step = at(point), 1e-6
    for k, unit in enumerate(step * np.eye(len(point))):
        after, before = at(point + unit), at(point - unit)
        assert found.slope[k] == pytest.approx((after.value - before.value) / (2 * step), rel=1e-5, abs=1e-5)
        moved = (after.margins[found.watched] - before.margins[found.watched]) / (2 * step)
        np.testing.assert_allclose(found.margin_slopes[:, k], moved, atol=1e-6 * max(1.0, np.abs(moved).max()))


def test_distances_of_parts_have_the_slopes_of_differences_and_the_sign_of_the_violation() -> None:
    problem = build(preset="joint-fourier", arm="irb120", harmonics=2, samples=30, collisions={"floor": 0.0})
    assert isinstance(problem, ExcitationProblem)
    limits, rules = 2 * 3 * 30 * 6, problem.constraints
    assert isinstance(rules, SafeConstraints)
    drawn = np.random.default_rng(1).uniform(problem.lower, problem.upper, (20, len(problem.lower)))
    positions = [motion_of(problem, point).position for point in drawn]
    closest = np.array([rules.margins(each).min() for each in positions])
    assert np.array_equal(closest < 0, [rules.rules.shortfall(each) > 0 for each in positions])
    point = drawn[np.argmin(closest)]

    def at(x: Array) -> Derivatives:
        return problem.differentiate(x, Question(20.0, NOTHING, 0.3))

    found, step = at(point), 1e-6
    own = found.watched >= limits
    assert found.margins[limits:].min() == closest.min() < 0
    for k, unit in enumerate(step * np.eye(len(point))):
        moved = (at(point + unit).margins - at(point - unit).margins)[found.watched[own]] / (2 * step)
        np.testing.assert_allclose(found.margin_slopes[own, k], moved, atol=1e-6)


def test_only_the_limits_that_are_asked_for_or_near_come_with_slopes() -> None:
    problem = tiny()
    point = 0.6 * problem.upper + 0.4 * problem.lower
    found = problem.differentiate(point, Question(10.0, np.array([5, 7]), 0.4))
    near = set(np.flatnonzero(found.margins < 0.4).tolist())
    assert 0 < len(near) < len(found.margins)
    assert set(found.watched.tolist()) == near | {5, 7}
    assert found.margin_slopes.shape == (len(found.watched), len(point))


def test_a_shift_of_the_coordinates_changes_no_derivative() -> None:
    shifted, plain = build(frame_seed=3), tiny()
    assert why_not_differentiable(shifted) == ""
    point, question = 0.7 * plain.upper + 0.3 * plain.lower, Question(10.0, NOTHING, 0.3)
    moved = shifted.differentiate(point + (shifted.lower - plain.lower), question)
    for ours, theirs in zip(moved, plain.differentiate(point, question), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"limits": {"torque": 5.0}, "arm": "irb120-arm"}, "derivatives of a torque limit are not known"),
        ({"workspace": {"floor": 0.1}}, "derivatives of a workspace limit are not known"),
        (
            {"preset": "tell-apart", "joints": 2, "limits": {"torque": 5.0}},
            "derivatives of a torque limit are not known",
        ),
    ],
)
def test_a_problem_without_derivatives_says_why(settings: dict[str, Any], reason: str) -> None:
    assert why_not_differentiable(build(**settings)) == reason


def test_a_function_without_derivatives_says_so() -> None:
    sphere = parse_problem({"preset": "sphere"}, "test").build()
    assert why_not_differentiable(sphere) == "its class has no method `differentiate`"
