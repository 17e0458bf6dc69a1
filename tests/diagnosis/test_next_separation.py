"""How far rivals are apart on a motion: against least squares on the whole rows, and in cases known beforehand."""

import numpy as np
import pytest
from next_questions import points, told_apart
from refusals import refusal

from diagnosis.next.chances import _decided, chances
from diagnosis.next.moments import left_over, solved
from diagnosis.next.preset import RivalSettings, TellApartSettings
from diagnosis.next.problem import TellApartProblem
from diagnosis.next.question import soft_smallest
from diagnosis.next.sampling import kept_columns
from diagnosis.next.within import fourier_within
from problem.arm import Limits
from recordings.run import Array

COULOMB = RivalSettings(effect="coulomb_friction", joint=2, parameters=(("level", 0.3),))
STRIBECK = RivalSettings(
    effect="stribeck_friction",
    joint=2,
    parameters=(("level", 0.3), ("static_level", 0.5), ("velocity", 0.05), ("exponent", 2.0)),
)


def rows_of(problem: TellApartProblem, point: Array) -> Array:
    """Whitened rows of all columns on the motion of a point."""
    prepared = problem.prepared
    motion = problem.trajectory.motions(point[None], problem.times).motion.select(np.intp(0))
    scene = prepared.present.scene(motion, problem.times)
    keep = prepared.sampling.filter(len(problem.times))
    return prepared.sampling.whitened(kept_columns(prepared.layout.base, prepared.layout.candidates, scene, keep, True))


def test_what_an_orthogonal_column_cannot_explain_is_the_whole_signal() -> None:
    gram = np.diag([4.0, 9.0])
    assert left_over(gram, np.array([0]), np.array([3.0]), np.array([1])) == pytest.approx(36.0)


def test_what_an_equal_column_cannot_explain_is_nothing() -> None:
    column = np.array([[1.0, 2.0], [2.0, 4.0], [-1.0, -2.0]])
    assert left_over(column.T @ column, np.array([0]), np.array([1.0]), np.array([1])) < 1e-6


def test_coefficients_from_moments_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(3)
    rows, torque = rng.normal(size=(50, 4)) * [1, 10, 100, 1000], rng.normal(size=50)
    found = solved(rows.T @ rows, np.arange(4), rows.T @ torque)
    assert found == pytest.approx(np.linalg.lstsq(rows, torque)[0], rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_separation_is_the_error_that_the_best_fit_of_the_other_rival_leaves(seed: int) -> None:
    problem = told_apart(links="free")
    point, question = points(problem, 1, seed)[0], problem.prepared.questions[0]
    rows = rows_of(problem, point)
    ways = []
    for right, other in ((0, 1), (1, 0)):
        rival = question.rivals[right]
        signal = rows[:, rival.laws[0].columns] @ rival.values
        fits = [rows[:, np.append(question.free, law.columns)] for law in question.rivals[other].laws]
        scaled = [fit / np.linalg.norm(fit, axis=0) for fit in fits]
        ways.append(min(np.linalg.norm(signal - fit @ np.linalg.lstsq(fit, signal)[0]) for fit in scaled))
    assert problem.separation(point) == pytest.approx(min(ways), rel=1e-4)


def test_one_pair_is_as_far_apart_as_it_is() -> None:
    assert soft_smallest([3.0]) == pytest.approx(3.0)
    assert soft_smallest([100.0]) == pytest.approx(100.0)


def test_a_pair_that_stays_alike_does_not_hide_what_a_motion_does_for_others() -> None:
    assert soft_smallest([0.1, 3.0]) > 1.2 * soft_smallest([0.1, 1.0]) > soft_smallest([0.1, 0.1])


def test_the_smallest_of_clear_separations_decides() -> None:
    assert soft_smallest([8.0, 20.0]) == pytest.approx(8.0, rel=0.05)


def test_twice_the_effect_is_twice_as_far_apart() -> None:
    double = RivalSettings(effect="viscous_friction", joint=2, parameters=(("coefficient", 0.6),))
    late = RivalSettings(effect="time_delay")
    once, twice = told_apart(links="free"), told_apart(double, late, links="free")
    point = points(once, 1)[0]
    # the late torque of a model with more friction is another torque, so twice only nearly
    assert twice.separation(point) == pytest.approx(2 * once.separation(point), rel=0.1)


def test_half_the_noise_is_twice_as_far_apart() -> None:
    loud, still = told_apart(links="free", noise=0.1), told_apart(links="free", noise=0.05)
    point = points(loud, 1)[0]
    assert still.separation(point) == pytest.approx(2 * loud.separation(point), rel=1e-6)


def test_a_rotor_and_the_inertia_of_link_one_are_separated_by_no_motion() -> None:
    rotor = RivalSettings(effect="rotor_inertia", joint=1, parameters=(("inertia", 0.05),))
    link = RivalSettings(effect="inertial_parameter_error", joint=1)
    message = refusal(TellApartSettings(rivals=(rotor, link)).build)
    assert "no motion separates" in message


def test_the_larger_of_two_nested_laws_is_measured_by_what_the_smaller_cannot_explain() -> None:
    smaller = RivalSettings(effect="coulomb_friction", joint=2)
    problem = told_apart(STRIBECK, smaller)
    question, point = problem.prepared.questions[0], points(problem, 1)[0]
    gram = problem.prepared.together(problem.moments(point).gram)
    assert question.blind[1, 0]
    assert not question.blind[0, 1]
    assert question.separation(gram, 0, 1) == pytest.approx(np.sqrt(question.noncentrality(gram, 0, 1)))


def test_chances_are_those_of_noisy_rows_that_are_fitted_whole() -> None:
    load = RivalSettings(effect="load_dependent_friction", joint=2)
    level = RivalSettings(effect="coulomb_friction", joint=2, parameters=(("level", 0.6),))
    problem = told_apart(level, load, links="exact")
    question, rng = problem.prepared.questions[0], np.random.default_rng(1)
    rows = rows_of(problem, points(problem, 1)[0])
    found = chances(problem.prepared, question, rows.T @ rows, len(rows), rng)
    counts = np.zeros(3)
    for right in range(2):
        rival, scores = question.rivals[right], []
        torque = (rows[:, rival.laws[0].columns] @ rival.values)[:, None] + rng.normal(size=(len(rows), 400))
        for each in question.rivals:
            fits = [rows[:, np.append(question.free, law.columns)] for law in each.laws]
            prices = [law.price(len(rows)) for law in each.laws]
            explained = [np.sum((np.linalg.qr(fit)[0].T @ torque) ** 2, axis=0) for fit in fits]
            scores.append(np.max([0.5 * a - b for a, b in zip(explained, prices, strict=True)], axis=0))
        counts += _decided(np.array(scores), right)
    assert [found.right, found.wrong, found.open] == pytest.approx((counts / counts.sum()).tolist(), abs=0.08)
    assert min(found.right, found.wrong, found.open) > 0.05


def test_a_law_that_every_arm_has_costs_less_than_one_that_was_looked_for() -> None:
    problem = told_apart()
    viscous, late = (rival.laws[0] for rival in problem.prepared.questions[0].rivals)
    assert viscous.price(1000) < late.price(1000)


def test_motions_keep_position_speed_and_acceleration_between_instants_too() -> None:
    limits = (Limits((-1.0, 0.4), 1.5, 6.0), Limits((-2.0, 2.0), 3.0, 4.0))
    trajectory = fourier_within(limits, 5.0, 6)
    rng = np.random.default_rng(0)
    drawn = rng.uniform(trajectory.lower, trajectory.upper, (200, len(trajectory.lower)))
    motion = trajectory.motions(drawn, np.linspace(0, 5.0, 5001)).motion
    for joint, each in enumerate(limits):
        assert motion.position[..., joint].min() >= each.position[0]
        assert motion.position[..., joint].max() <= each.position[1]
        assert np.abs(motion.velocity[..., joint]).max() <= each.velocity
        assert np.abs(motion.acceleration[..., joint]).max() <= each.acceleration
    assert np.abs(motion.velocity[:, [0, -1]]).max() < 1e-9


def test_a_small_swing_stays_as_it_is() -> None:
    trajectory = fourier_within((Limits((-1.0, 1.0), 2.0, 10.0),), 5.0, 3)
    small = 0.01 * trajectory.upper
    times = np.linspace(0, 5.0, 50)
    own = trajectory.series.motions(small[None], times).motion
    assert np.array_equal(trajectory.motions(small[None], times).motion.velocity, own.velocity)


def test_a_joint_without_a_limit_of_speed_is_refused() -> None:
    with pytest.raises(ValueError, match="limits of position and speed"):
        fourier_within((Limits((-1.0, 1.0)),), 5.0, 3)


def test_a_law_that_free_links_hold_already_costs_nothing() -> None:
    gain = RivalSettings(effect="torque_gain_error", joint=2, parameters=(("gain", 1.5),))
    problem = told_apart(gain, RivalSettings(effect="inertial_parameter_error", joint=2), links="free")
    question, point = problem.prepared.questions[0], points(problem, 1)[0]
    gain_law, link_law = (rival.laws[0] for rival in question.rivals)
    assert (gain_law.freedom, link_law.freedom) == (1, 0)
    found = chances(problem.prepared, question, problem.moments(point).gram, 1000, np.random.default_rng(0))
    assert found.wrong < 0.05
