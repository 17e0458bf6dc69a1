"""What an excitation is worth: eq. 44, D- and E-optimality."""

import numpy as np
import pytest

from problem.excitation import ExcitationProblem, FeasibilityRules, Penalty
from problem.fitness import Criterion
from problem.registry import parse_problem
from problem.regressor import observation_matrix
from problem.spectrum import Spectrum

SPECTRUM = Spectrum.of(np.array([[8.0, 4.0, 2.0], [6.0, 5.0, 0.0]]))


def test_eq_44_adds_the_weighted_singular_values_to_the_condition_number() -> None:
    criterion = Criterion("eq44", weight_smallest=3.0, weight_largest=0.25)
    assert criterion.value(SPECTRUM).tolist() == [8 / 2 + 3 / 2 + 0.25 * 8, np.inf]


@pytest.mark.parametrize(
    ("criterion", "expected"),
    [
        (Criterion("eq44"), [4.0, np.inf]),
        (Criterion("d_optimality"), [-2 * np.log(64) / 3, np.inf]),  # det(W'W) = (8 * 4 * 2)^2
        (Criterion("e_optimality"), [-2.0, 0.0]),
    ],
)
def test_each_criterion_is_as_defined_and_infinite_or_worst_at_rank_loss(
    criterion: Criterion, expected: list[float]
) -> None:
    np.testing.assert_allclose(criterion.value(SPECTRUM), expected)


def test_a_penalty_is_a_step_once_and_a_weight_times_the_violation() -> None:
    fitness = Penalty(step=5.0, weight=10.0).fitness(np.ones(3), np.array([0.0, 0.2, 3.0]))
    assert fitness.tolist() == [1.0, 8.0, 36.0]


def problem(**settings: object) -> ExcitationProblem:
    built = parse_problem({"preset": "paper", **settings}, "test").build()
    assert isinstance(built, ExcitationProblem)
    return built


def circles(*radii: float) -> np.ndarray:
    """Points of the paper's problem that are plain circles about the shoulder with a slow wave."""
    return np.array([[radius, 0.0, 0.0, 0.03, 0.02, 0.01, 0.02] for radius in radii])


def test_out_of_reach_has_no_condition_number_but_a_finite_fitness_that_grows_with_the_overreach() -> None:
    result = problem().evaluate(circles(0.35, 0.7, 0.8, 1.5))
    assert np.isfinite(result.value).tolist() == [True, False, False, False]
    assert np.all(result.value[1:] == np.inf)
    assert np.all(np.isfinite(result.fitness))
    assert np.all(np.diff(result.fitness) > 0)


def test_within_limits_fitness_is_the_criterion_and_value_the_condition_number() -> None:
    plain = problem(criterion={"weight_smallest": 0.0, "weight_largest": 0.0})
    result = plain.evaluate(circles(0.35))
    motion = plain.trajectory.motions(circles(0.35), plain.times).motion.select(np.intp(0))
    exact = np.linalg.cond(observation_matrix(plain.arm, motion)[:, plain.base.columns])
    assert result.violation.tolist() == [0.0]
    assert result.value == pytest.approx([exact])
    assert result.fitness == pytest.approx([exact])


def test_beyond_limits_fitness_has_the_penalty_and_value_has_not() -> None:
    free, slow = problem(limits={}), problem(limits={"velocity": 0.5}, penalty={"step": 7.0, "weight": 10.0})
    point = circles(0.35)
    unlimited, limited = free.evaluate(point), slow.evaluate(point)
    assert limited.violation[0] > 0
    assert limited.value == unlimited.value
    wide = problem(limits={"velocity": 1e9, "acceleration": 1e9, "position": [None, None, None]}).evaluate(point)
    assert limited.fitness[0] == pytest.approx(wide.fitness[0] + 7.0 + 10.0 * limited.violation[0])


def test_each_point_has_the_same_bits_in_any_batch() -> None:
    for preset in ("paper", "joint-fourier"):
        built = parse_problem({"preset": preset}, "test").build()
        points = np.random.default_rng(0).uniform(built.lower, built.upper, (9, len(built.lower)))
        whole = built.evaluate(points)
        for count in (1, 4):
            for part, all_of_it in zip(built.evaluate(points[:count]), whole, strict=True):
                assert np.array_equal(part, all_of_it[:count])


@pytest.mark.parametrize("preset", ["paper", "joint-fourier"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_a_point_that_is_not_finite_loses_and_spoils_no_other(preset: str, bad: float) -> None:
    built = parse_problem({"preset": preset}, "test").build()
    points = np.random.default_rng(0).uniform(built.lower, built.upper, (3, len(built.lower)))
    good = built.evaluate(points)
    points[1, 3] = bad
    spoilt = built.evaluate(points)
    assert spoilt.fitness[1] > 1e5
    assert spoilt.value[1] == np.inf
    assert spoilt.violation[1] > 0
    assert np.array_equal(spoilt.fitness[[0, 2]], good.fitness[[0, 2]])


@pytest.mark.parametrize("weight", [0.0, 0.01])
def test_a_motionless_arm_has_an_infinite_condition_number_and_no_crash(weight: float) -> None:
    settings = {"preset": "joint-fourier", "criterion": {"weight_smallest": weight}}
    built = parse_problem(settings, "test").build()
    result = built.evaluate((built.lower + built.upper)[None] / 2)
    assert result.value[0] == result.fitness[0] == np.inf


@pytest.mark.parametrize("preset", ["paper", "joint-fourier"])
def test_an_empty_population_has_an_empty_result(preset: str) -> None:
    built = parse_problem({"preset": preset}, "test").build()
    assert [len(part) for part in built.evaluate(np.empty((0, len(built.lower))))] == [0, 0, 0]


def test_feasibility_rules_put_every_feasible_point_first_and_order_the_others_by_violation_alone() -> None:
    merit = np.array([1e12, 3.0, 1.0, 2.0, np.inf, 9.0])
    violation = np.array([0.0, 0.0, 1e-9, 1e-12, 2.0, 1.5])
    fitness = FeasibilityRules().fitness(merit, violation)
    assert np.argsort(fitness).tolist() == [1, 0, 3, 2, 5, 4]
    assert np.all(np.isfinite(fitness))


def test_a_problem_with_feasibility_rules_judges_feasible_points_by_the_criterion() -> None:
    ruled, penalised = problem(penalty="feasibility_rules"), problem()
    for point in (circles(0.35), circles(0.7)):
        with_rules, with_penalty = ruled.evaluate(point), penalised.evaluate(point)
        assert with_rules.violation == with_penalty.violation
        if with_rules.violation[0] == 0:
            assert with_rules.fitness == with_penalty.fitness
        else:
            assert with_rules.fitness[0] == 1e30 * (1 + with_rules.violation[0])
