"""How far rivals are apart on a motion: against least squares on the whole rows, and in cases known beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from next_questions import points, told_apart
from refusals import refusal

from armlab.common.arrays import Array
from armlab.diagnosis.next.decision import (
    decision_chances,
    decision_strength,
    judge_draws,
    log_doubt,
    required_lead,
    usual_friction_gain,
)
from armlab.diagnosis.next.moments import solve_least_squares, unexplained_power
from armlab.diagnosis.next.motion import fourier_within_limits
from armlab.diagnosis.next.problem import RivalSettings, TellApartProblem, TellApartSettings
from armlab.diagnosis.next.question import Law, Name, Question, RivalLaw
from armlab.diagnosis.next.remedies import find_remedies
from armlab.diagnosis.next.sampling import kept_columns, white_noise_sampling
from armlab.diagnosis.tuning import Tuning
from armlab.effects.friction import ViscousFriction
from problem.arm import Limits
from problem.robot_file import load_arm

MAX_DEFICIT = Tuning().claims.max_deficit
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
    columns = kept_columns(prepared.layout.base, prepared.layout.candidates, scene, keep, True)
    return prepared.sampling.whiten(columns, scene.motion.velocity)


def separation(problem: TellApartProblem, point: Array) -> float:
    """Standard errors between the two rivals of a problem."""
    gram = problem.prepared.total_gram(problem.moments(point).gram)
    return problem.prepared.questions[0].separation(gram, 0, 1)


def test_what_an_orthogonal_column_cannot_explain_is_the_whole_signal() -> None:
    gram = np.diag([4.0, 9.0])
    assert unexplained_power(gram, np.array([0]), np.array([3.0]), np.array([1])) == pytest.approx(36.0)


def test_what_an_equal_column_cannot_explain_is_nothing() -> None:
    column = np.array([[1.0, 2.0], [2.0, 4.0], [-1.0, -2.0]])
    assert unexplained_power(column.T @ column, np.array([0]), np.array([1.0]), np.array([1])) < 1e-6


def test_coefficients_from_moments_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(3)
    rows, torque = rng.normal(size=(50, 4)) * [1, 10, 100, 1000], rng.normal(size=50)
    found = solve_least_squares(rows.T @ rows, np.arange(4), rows.T @ torque)
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
    assert separation(problem, point) == pytest.approx(min(ways), rel=1e-4)


def pair_question(*weights: float) -> Question:
    """Rivals that are one column each, of size one, with nothing beside them."""
    viscous = ViscousFriction.at(load_arm("irb120-arm"), 2)
    laws = [Law(viscous, np.array([number]), 1, 1, 1.0) for number in range(len(weights))]
    names = [Name("viscous_friction", number + 1) for number in range(len(weights))]
    rivals = tuple(
        RivalLaw(name, (law,), np.ones(1), weight) for name, law, weight in zip(names, laws, weights, strict=True)
    )
    none = np.empty(0, dtype=np.intp)
    return Question(rivals, none, none, np.zeros((len(weights),) * 2, dtype=bool))


def test_the_doubt_of_a_pair_is_the_chance_that_the_lead_is_too_small() -> None:
    gram = np.diag([25.0, 25.0])  # each explains nothing of the other, five standard errors
    lead = np.random.default_rng(0).normal(12.5, 5.0, 400_000)
    assert np.exp(log_doubt(pair_question(1.0, 1.0), gram, 100)) == pytest.approx(np.mean(lead < MAX_DEFICIT), rel=0.02)


def test_a_rival_that_hardly_fits_hardly_counts() -> None:
    gram = np.diag([100.0, 4.0])
    sure, unsure = pair_question(0.99, 0.01), pair_question(0.01, 0.99)
    assert log_doubt(sure, gram, 100) < log_doubt(unsure, gram, 100) - 3


def test_farther_apart_is_stronger_and_a_pair_that_stays_alike_hides_nothing() -> None:
    question = pair_question(1.0, 1.0, 1.0)
    alike = np.diag([16.0, 16.0, 16.0])
    alike[0, 1] = alike[1, 0] = 15.99
    better = alike.copy()
    better[2, 2] = 36.0
    assert decision_strength((question,), better, 100) > decision_strength((question,), alike, 100) + 0.05
    assert decision_strength((question,), 4 * alike, 100) > decision_strength((question,), alike, 100)


def test_a_special_law_of_friction_has_to_gain_on_held_out_data_too() -> None:
    problem = told_apart(STRIBECK, RivalSettings(effect="coulomb_friction", joint=2))
    special, usual = (rival.laws[0] for rival in problem.prepared.questions[0].rivals)
    assert required_lead(special, usual, 9000) == pytest.approx(0.5 * 0.03 * 3000)
    assert required_lead(usual, special, 9000) < MAX_DEFICIT


def test_one_usual_term_more_explains_at_its_price() -> None:
    left, products = np.eye(3), np.array([[0.0], [5.0], [1.0]])
    assert usual_friction_gain(products, left, np.array([1, 2]), 100) == pytest.approx([12.5 - 0.5 * np.log(100)])
    assert usual_friction_gain(products, left, np.array([2]), 100) == pytest.approx([0.0])


def test_twice_the_effect_is_twice_as_far_apart() -> None:
    double = RivalSettings(effect="viscous_friction", joint=2, parameters=(("coefficient", 0.6),))
    late = RivalSettings(effect="time_delay")
    once, twice = told_apart(links="free"), told_apart(double, late, links="free")
    point = points(once, 1)[0]
    # the late torque of a model with more friction is another torque, so twice only nearly
    assert separation(twice, point) == pytest.approx(2 * separation(once, point), rel=0.1)


def test_half_the_noise_is_twice_as_far_apart() -> None:
    loud, still = told_apart(links="free", noise=0.1), told_apart(links="free", noise=0.05)
    point = points(loud, 1)[0]
    assert separation(still, point) == pytest.approx(2 * separation(loud, point), rel=1e-6)


def test_a_rotor_and_the_inertia_of_link_one_are_separated_by_no_motion() -> None:
    rotor = RivalSettings(effect="rotor_inertia", joint=1, parameters=(("inertia", 0.05),))
    link = RivalSettings(effect="inertial_parameter_error", joint=1)
    message = refusal(TellApartSettings(rivals=(rotor, link)).build)
    assert "no motion separates" in message


def test_the_larger_of_two_nested_laws_is_measured_by_what_the_smaller_cannot_explain() -> None:
    smaller = RivalSettings(effect="coulomb_friction", joint=2)
    problem = told_apart(STRIBECK, smaller)
    question, point = problem.prepared.questions[0], points(problem, 1)[0]
    gram = problem.prepared.total_gram(problem.moments(point).gram)
    assert question.inseparable[1, 0]
    assert not question.inseparable[0, 1]
    assert question.separation(gram, 0, 1) == pytest.approx(np.sqrt(question.noncentrality(gram, 0, 1)))


def test_chances_are_those_of_noisy_rows_that_are_fitted_whole() -> None:
    load = RivalSettings(effect="load_dependent_friction", joint=2)
    level = RivalSettings(effect="coulomb_friction", joint=2, parameters=(("level", 0.6),))
    problem = told_apart(level, load, links="exact")
    question, rng = problem.prepared.questions[0], np.random.default_rng(1)
    rows = rows_of(problem, points(problem, 1)[0])
    found = decision_chances(problem.prepared, question, rows.T @ rows, len(rows), rng)
    shares = []
    for right, rival in enumerate(question.rivals):
        torque = (rows[:, rival.laws[0].columns] @ rival.values)[:, None] + rng.normal(size=(len(rows), 400))
        explained = [np.array([best_fit(question, rows, law, torque) for law in each.laws]) for each in question.rivals]
        ended = judge_draws(question, explained, right, len(rows))
        shares.append([ended.right, ended.wrong, ended.open])
    assert [found.right, found.wrong, found.open] == pytest.approx(np.mean(shares, axis=0).tolist(), abs=0.08)
    assert found.right > 0.05


def best_fit(question: Question, rows: Array, law: Law, torque: Array) -> Array:
    """Half of what a law explains with the best term of usual friction, or without, less the price of that term."""
    plain = np.append(question.found, law.columns)
    fits = [(plain, 0.0)]
    fits += [(np.append(plain, extra), 0.5 * np.log(len(rows))) for extra in question.extras]
    return np.max([0.5 * np.sum((np.linalg.qr(rows[:, at])[0].T @ torque) ** 2, axis=0) - p for at, p in fits], axis=0)


def test_a_law_that_every_arm_has_costs_less_than_one_that_was_looked_for() -> None:
    problem = told_apart()
    viscous, late = (rival.laws[0] for rival in problem.prepared.questions[0].rivals)
    assert viscous.price(1000) < late.price(1000)


def test_motions_keep_position_speed_and_acceleration_between_instants_too() -> None:
    limits = (Limits((-1.0, 0.4), 1.5, 6.0), Limits((-2.0, 2.0), 3.0, 4.0))
    trajectory = fourier_within_limits(limits, 5.0, 6)
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
    trajectory = fourier_within_limits((Limits((-1.0, 1.0), 2.0, 10.0),), 5.0, 3)
    small = 0.01 * trajectory.upper
    times = np.linspace(0, 5.0, 50)
    own = trajectory.series.motions(small[None], times).motion
    assert np.array_equal(trajectory.motions(small[None], times).motion.velocity, own.velocity)


def test_rows_in_which_a_joint_stands_still_tell_nothing() -> None:
    sampling = replace(white_noise_sampling(np.ones(2), 10.0), standing=(0.1, 0.1))
    velocity = np.ones((301, 2))  # 60 samples a second, every other one kept
    velocity[60, 1] = 0.0
    rows = sampling.whiten(np.ones((151, 2, 1)), velocity)
    worth = (rows[151:, 0] / rows[0, 0]) ** 2
    assert np.count_nonzero(worth == 0) == 9  # a period and a half of 10 Hz to both sides
    assert worth[:26] == pytest.approx(0.5)  # fewer rows than a diagnosis asks for
    assert worth[35:] == pytest.approx(1.0)
    free = replace(sampling, standing=(0.1, 0.0)).whiten(np.ones((151, 2, 1)), velocity)
    assert free == pytest.approx(free[0, 0])


def test_a_joint_without_a_limit_of_speed_is_refused() -> None:
    with pytest.raises(ValueError, match="limits of position and speed"):
        fourier_within_limits((Limits((-1.0, 1.0)),), 5.0, 3)


def test_a_law_that_free_links_hold_already_costs_nothing() -> None:
    gain = RivalSettings(effect="torque_gain_error", joint=2, parameters=(("gain", 1.5),))
    problem = told_apart(gain, RivalSettings(effect="inertial_parameter_error", joint=2), links="free")
    question, point = problem.prepared.questions[0], points(problem, 1)[0]
    gain_law, link_law = (rival.laws[0] for rival in question.rivals)
    assert (gain_law.freedom, link_law.freedom) == (1, 0)
    found = decision_chances(problem.prepared, question, problem.moments(point).gram, 1000, np.random.default_rng(0))
    assert found.wrong < 0.05


def test_a_second_encoder_sees_a_spring_by_how_far_it_twists() -> None:
    stiffness = 2e5
    spring = RivalSettings(effect="joint_elasticity", joint=2, parameters=(("stiffness", stiffness),))
    problem = told_apart(spring, RivalSettings(effect="channel_skew", joint=2))
    motion = problem.trajectory.motions(points(problem, 1), problem.times).motion.select(np.intp(0))
    prepared = problem.prepared
    told = find_remedies(prepared, prepared.questions[0], (0, 1), motion, problem.times)
    found = next(each for each in told if each.what.startswith("a second encoder behind the gear of joint 2"))
    twist = prepared.present.scene(motion, problem.times).torque[:, 1] / stiffness
    assert found.separation == pytest.approx(np.std(twist) * np.sqrt(len(twist)) / 2e-5)


def test_a_column_that_a_motion_never_shows_explains_nothing() -> None:
    rows = np.random.default_rng(0).normal(size=(50, 3))
    rows[:, 1] = 0.0
    gram, right = rows.T @ rows, np.array([1.0, 1e-17, 2.0])
    values = solve_least_squares(gram, np.arange(3), right)
    assert values[1] == 0.0
    np.testing.assert_allclose(values[[0, 2]], solve_least_squares(gram, np.array([0, 2]), right), rtol=1e-9)
