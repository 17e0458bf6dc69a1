"""Friction with memory against its differential equations, and what friction laws report."""

from dataclasses import replace

import numpy as np
import pytest
from effect_scenes import candidate, family, scene, scene_of, torque_of, waves
from random_arms import random_arm
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.effects.coupling import neighbour_pairs
from armlab.effects.friction import direction_of_motion
from armlab.effects.memory import HeatedFriction, ThermometerFriction, ViscousDrift


def integrated(time: Array, position: Array, way: float) -> Array:
    """Dahl's equation by an adaptive solver, from rest."""
    spline = make_interp_spline(time, position, k=5)
    speed = spline.derivative()

    def rate(at: float, z: Array) -> Array:
        velocity = float(speed(at))
        return np.array([(velocity - abs(velocity) * z[0]) / way])

    found = solve_ivp(rate, (time[0], time[-1]), [0.0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=2e-3)
    return np.asarray(found.y[0])


def test_early_friction_is_an_impulse_at_each_reversal_before_the_joint_turns() -> None:
    where = scene("RR")
    law = candidate("early_friction", [where], 1)
    torque, direction = torque_of(law, np.array([0.3]), where)[:, 0], direction_of_motion(where, 0)
    turns = np.flatnonzero(np.sign(direction[1:]) != np.sign(direction[:-1]))
    assert turns.size >= 4
    near = round(0.03 / where.step)
    for turn in turns[(turns > near) & (turns < len(torque) - near)]:
        impulse = np.sum(torque[turn - near : turn + near]) * where.step
        assert impulse == pytest.approx(0.6 * np.sign(direction[turn + 2] - direction[turn - 2]), rel=0.02)
        assert np.abs(torque[turn + 3 : turn + near]).max() < 1e-9
    assert "should be positive" in str(law.objection(np.array([-0.3])))


@pytest.mark.parametrize("way", [0.004, 0.05, 0.4])
def test_presliding_state_is_the_solution_of_dahls_equation(way: float) -> None:
    time, motion = waves(1, 3, 4.0, rate_hz=1000)
    position = motion.position[:, 0]
    # a reversal falls between samples: the way gone there is short by a little
    np.testing.assert_allclose(dahl_state(position, way), integrated(time, position, way), atol=5e-3)


def test_presliding_state_is_friction_in_the_limit_of_a_short_way() -> None:
    _, motion = waves(1, 3, 4.0)
    fast = np.abs(motion.velocity[:, 0]) > 0.1
    state = dahl_state(motion.position[:, 0], 1e-6)
    assert np.array_equal(state[fast][1:], np.sign(motion.velocity[:, 0])[fast][1:])


def test_presliding_is_a_spring_for_small_motions() -> None:
    position = 1e-4 * np.sin(np.linspace(0, 20, 2000))
    np.testing.assert_allclose(dahl_state(position, 0.1), position / 0.1, atol=2e-6)


def test_presliding_state_holds_while_the_joint_rests() -> None:
    position = np.concatenate([np.linspace(0, 1, 50), np.ones(30), np.linspace(1, 0.99, 20)])
    state = dahl_state(position, 0.1)
    assert np.all(state[50:80] == state[49])
    assert state[99] < state[80]
    # a rest on the way is no reversal: the state goes on as if there had been none
    way = np.concatenate([np.linspace(0, 0.1, 50), np.full(30, 0.1), np.linspace(0.1, 0.2, 50)])
    assert dahl_state(way, 0.1)[-1] == pytest.approx(1 - np.exp(-2.0))


def test_lugre_friction_is_that_of_its_bristles() -> None:
    time, motion = waves(1, 3, 4.0, rate_hz=1000)
    where = scene_of(random_arm("R"), motion, time)
    level, static, stiffness, slow = 2.0, 3.0, 300.0, 0.1
    velocity = make_interp_spline(time, motion.velocity[:, 0], k=5)

    def rate(at: float, z: Array) -> Array:
        v = float(velocity(at))
        return np.array([v - stiffness * abs(v) * z[0] / (level + (static - level) * np.exp(-((v / slow) ** 2)))])

    bristles = solve_ivp(rate, (0, time[-1]), [0.0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=2e-3)
    parameters = {"level": level, "static_level": static, "stiffness": stiffness, "velocity": slow}
    friction, coefficients = family("presliding_hysteresis").from_parameters(where.arm, (1,), parameters)
    torque = torque_of(friction, coefficients, where)[1:, 0]  # the first sample stands for half an interval
    np.testing.assert_allclose(torque, stiffness * bristles.y[0, 1:], atol=0.03)


def test_stiffness_of_presliding_is_level_over_way() -> None:
    friction = candidate("presliding_hysteresis", [scene()], 1).with_shape((0.02,))
    assert friction.parameters(np.array([3.0])) == {"level": 3.0, "stiffness": 150.0}


def test_the_direction_of_motion_is_its_mean_over_the_time_of_a_sample() -> None:
    time, motion = waves(2, 3, 4.0, rate_hz=250)
    where = scene_of(random_arm("RR"), motion, time)
    velocity = make_interp_spline(time, motion.velocity, k=5)
    shifts = (np.arange(1000) + 0.5) / 1000 - 0.5
    fine = np.stack([velocity(time + shift * where.step) for shift in shifts])
    assert np.any(np.abs(direction_of_motion(where, 0)) < 1)
    np.testing.assert_allclose(direction_of_motion(where, 0), np.sign(fine[:, :, 0]).mean(axis=0), atol=0.02)
    np.testing.assert_allclose(direction_of_motion(where, 0, 1), np.sign(fine.sum(axis=2)).mean(axis=0), atol=0.02)


def test_stribeck_friction_falls_from_its_static_to_its_sliding_level() -> None:
    where = scene()
    friction = candidate("stribeck_friction", [where], 1).with_shape((0.1, 2.0))
    velocity = where.motion.velocity[:, 0]
    torque = torque_of(friction, np.array([2.0, 1.5]), where)[:, 0] * np.sign(velocity)
    steady = np.abs(direction_of_motion(where, 0)) == 1
    assert friction.parameters(np.array([2.0, 1.5])) == {
        "level": 2.0,
        "static_level": 3.5,
        "velocity": 0.1,
        "exponent": 2.0,
    }
    np.testing.assert_allclose(torque[np.abs(velocity) > 0.4], 2.0, atol=1e-5)
    np.testing.assert_allclose(torque[steady & (np.abs(velocity) < 0.01)], 3.5, rtol=0.01)


@pytest.mark.parametrize(("form", "forwards", "backwards"), [("levels", 2.0, -1.0), ("slopes", 1.0, -0.5)])
def test_asymmetric_friction_brakes_by_direction(form: str, forwards: float, backwards: float) -> None:
    where = scene()
    friction = candidate("asymmetric_friction", [where], 1, form)
    velocity = where.motion.velocity[:, 0] if form == "slopes" else np.sign(where.motion.velocity[:, 0])
    torque = torque_of(friction, np.array([2.0, 1.0]), where)[:, 0]
    steady = np.abs(direction_of_motion(where, 0)) == 1
    expected = np.where(velocity > 0, 2.0, 1.0) * velocity
    np.testing.assert_allclose(torque[steady], expected[steady])
    assert friction.parameters(np.array([2.0, 1.0]))["negative"] == 1.0
    assert friction.unit("positive") == ("N.m.s/rad" if form == "slopes" else "N.m")


def test_levels_and_slopes_by_direction_are_both_asymmetric_forms_together() -> None:
    where = scene()
    levels, slopes, both = (
        candidate("asymmetric_friction", [where], 1, x) for x in ("levels", "slopes", "levels and slopes")
    )
    sum_of_both = torque_of(levels, np.array([2.0, 1.0]), where) + torque_of(slopes, np.array([0.4, 0.3]), where)
    np.testing.assert_allclose(torque_of(both, np.array([2.0, 1.0, 0.4, 0.3]), where), sum_of_both)


def test_load_dependent_friction_follows_the_links_and_not_the_friction_of_the_model() -> None:
    where = scene()
    friction = candidate("load_dependent_friction", [where], 2)
    rougher = replace(where, torque=where.torque + 3 * np.sign(where.motion.velocity))
    assert np.array_equal(friction.columns(where), friction.columns(rougher))
    expected = 0.1 * np.abs(where.rigid_torque[:, 1]) * direction_of_motion(where, 1)
    np.testing.assert_allclose(torque_of(friction, np.array([0.1]), where)[:, 1], expected)


def test_coupled_coulomb_friction_follows_the_motor_that_turns_with_both_joints() -> None:
    where = scene()
    coupling, coefficients = family("joint_coupling").from_parameters(where.arm, (2, 3), {"level": 2.0})
    both = direction_of_motion(where, 1, 2)
    assert coupling.rows == (1,)
    np.testing.assert_allclose(torque_of(coupling, coefficients, where)[:, 1], 2.0 * both)


def test_friction_that_gears_carry_over_has_the_direction_of_the_joint_that_it_comes_from() -> None:
    where = scene()
    parts = {"coefficient": 0.5, "level": 2.0}
    coupling, coefficients = family("joint_coupling").from_parameters(where.arm, (2, 3), parts, "carried")
    expected = 2.0 * direction_of_motion(where, 2) + 0.5 * where.motion.velocity[:, 2]
    np.testing.assert_allclose(torque_of(coupling, coefficients, where)[:, 1], expected)
    assert "sgn(qd_3)" in coupling.equation(coefficients)


def test_couplings_are_tried_between_neighbours_and_within_a_wrist() -> None:
    assert neighbour_pairs(3) == [(1, 2), (2, 1), (2, 3), (3, 2)]
    assert set(neighbour_pairs(6)) - {pair for pair in neighbour_pairs(6) if abs(pair[0] - pair[1]) == 1} == {
        (4, 6),
        (6, 4),
    }


def test_drift_goes_from_its_initial_to_its_final_coefficient() -> None:
    where = scene(seconds=8.0)
    drift = ViscousDrift.at(where.arm, 1, shape=(0.5,), bounds=((0.1, 9.0),))
    ratio = torque_of(drift, np.array([3.0, -1.0]), where)[:, 0] / where.motion.velocity[:, 0]
    assert drift.parameters(np.array([3.0, -1.0])) == {"initial": 3.0, "final": 2.0, "time_constant": 0.5}
    assert ratio[0] == pytest.approx(3.0)
    assert ratio[-1] == pytest.approx(2.0, abs=1e-6)
    assert ratio[250] == pytest.approx(3.0 - (1 - np.exp(-1)), abs=1e-9)


def clocks_of_drift(*starts: float) -> set[tuple[tuple[str, float], ...]]:
    """The clocks of drift over two runs of 8 s that begin at these stamps."""
    scenes = [replace(scene(seed=seed, run=f"run-{seed}.csv"), start=start) for seed, start in enumerate(starts)]
    return {place[0].began for place in family("friction_drift").candidates(scenes[0].arm, scenes)}


def test_drift_goes_on_in_the_run_that_is_stamped_later() -> None:
    clocks = clocks_of_drift(110.0, 100.0)
    assert min(clocks) == ()
    assert max(clocks) == (("run-1.csv", 0.0), ("run-0.csv", 10.0), ("", pytest.approx(18.0, abs=0.01)))
    later = scene(seed=0, run="run-0.csv")
    drift = ViscousDrift.at(later.arm, 1, shape=(10.0,), began=max(clocks))
    assert drift.warmth(later)[0] == pytest.approx(1 - np.exp(-1.0))
    assert drift.warmth(replace(later, run="unheard-of.csv"))[0] == pytest.approx(1 - np.exp(-1.8), abs=1e-3)


def test_runs_whose_stamps_overlap_follow_one_another_in_the_order_of_their_names() -> None:
    assert max(clocks_of_drift(0.0, 0.0)) == (("run-0.csv", 0.0), ("run-1.csv", 8.0), ("", 16.0))
    assert clocks_of_drift(0.0, 0.0) == clocks_of_drift(3.0, 0.0)
    assert clocks_of_drift(0.0) == {()}
    scenes = [scene(seed=seed, run=f"run-{seed}.csv") for seed in (10, 2)]
    (clock,) = {place[0].began for place in family("friction_drift").candidates(scenes[0].arm, scenes)} - {()}
    assert [name for name, _ in clock] == ["run-2.csv", "run-10.csv", ""]


def test_heat_is_the_lagged_power_of_friction() -> None:
    where = scene(seconds=8.0)
    velocity, time = where.motion.velocity[:, 0], where.time
    heated = HeatedFriction.at(where.arm, 1, shape=(2.0,), power=0.7)
    power = make_interp_spline(time, velocity**2 / 0.7, k=3)
    found = solve_ivp(lambda at, w: (power(at) - w) / 2.0, (0, time[-1]), [0.0], t_eval=time, rtol=1e-8, max_step=0.05)
    np.testing.assert_allclose(heated.warmth(where), found.y[0], atol=3e-3)


def test_temperature_gives_a_candidate_only_where_every_run_has_it() -> None:
    warm = replace(scene(), temperature=np.linspace(20, 30, 4000)[:, None])
    forms = {type(place[0]) for place in family("friction_drift").candidates(warm.arm, [warm])}
    assert ThermometerFriction in forms
    forms = {type(place[0]) for place in family("friction_drift").candidates(warm.arm, [warm, scene(seed=2)])}
    assert ThermometerFriction not in forms
    by_sensor = ThermometerFriction.at(warm.arm, 1, sensor=0, span=(20.0, 30.0))
    ratio = torque_of(by_sensor, np.array([3.0, -1.0]), warm)[:, 0] / warm.motion.velocity[:, 0]
    assert ratio[0] == pytest.approx(3.0)
    assert ratio[-1] == pytest.approx(2.0)
