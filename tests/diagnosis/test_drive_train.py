"""Twists of drive trains against the whole nonlinear arm: Pinocchio's dynamics in scipy's integrator."""

from dataclasses import replace

import numpy as np
import pytest
from effect_scenes import scene_of, waves
from engines import pinocchio_model
from random_arms import random_arm
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.effects.contract import Scene
from armlab.effects.transmission import (
    WALL_HZ,
    Backlash,
    JointElasticity,
    Twist,
    felt_inertia,
    integrate_twist,
    integrate_twists,
    load_at,
)
from problem.motion import Motion

JOINT = 1
FINER = 8  # instants a sample: an impact is shorter than one
WALL = 2 * np.pi * WALL_HZ


def force_of(law: Twist, inertia: float, twist: float, speed: float) -> float:
    """The law as a person would write it down."""
    if law.gap == 0:
        return law.stiffness * (twist + law.damping_time * speed)
    beyond = np.sign(twist) * max(abs(twist) - law.gap / 2, 0.0)
    push = inertia * (WALL**2 * beyond + 2 * WALL * speed)
    return push if push * beyond > 0 else 0.0


def torque_behind(where: Scene, law: Twist) -> Array:
    """What the motors give beyond the rigid torque, (samples, joints): no derivative of a model, no small angles."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    model = pinocchio_model(where.arm)
    data, time = model.createData(), where.time
    path = make_interp_spline(time, where.motion.position, k=5)
    speeds, pushes = path.derivative(1), path.derivative(2)
    unit = np.eye(len(where.arm))[JOINT]

    def torques(now: float, twist: float, speed: float, push: float) -> Array:
        state = path(now) + twist * unit, speeds(now) + speed * unit, pushes(now) + push * unit
        return np.array(pin.rnea(model, data, *state))

    def motion(now: float, state: Array) -> list[float]:
        still = torques(now, *state, 0.0)[JOINT]
        inertia = torques(now, *state, 1.0)[JOINT] - still
        return [state[1], (-still - force_of(law, inertia, *state)) / inertia]

    begin = integrate_twist(load_at(where, JOINT), law)[0, 0]
    fine = np.linspace(time[0], time[-1], FINER * (len(time) - 1) + 1)
    found = solve_ivp(motion, (time[0], time[-1]), [begin, 0.0], t_eval=fine, max_step=5e-4, rtol=1e-7, atol=1e-10)
    pairs = zip(fine, found.y.T, strict=True)
    gone = [torques(now, *state, motion(now, state)[1]) - torques(now, 0.0, 0.0, 0.0) for now, state in pairs]
    return np.array([np.convolve(row, np.full(FINER, 1 / FINER), "same")[::FINER] for row in np.array(gone).T]).T


def blurred(torque: Array) -> Array:
    """Means over 20 ms, away from the ends."""
    width = 10
    return np.array([np.convolve(column, np.full(width, 1 / width), "valid") for column in torque.T]).T[50:-50]


LAWS = {
    "rings": Twist(stiffness=3000.0, damping_time=2e-3),
    "has play": Twist(gap=1e-3),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_twist_to_first_order_is_the_torque_of_the_whole_arm(law: Twist) -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 2.0)
    where = scene_of(arm, motor, time)
    twist = integrate_twist(load_at(where, JOINT), law)
    ours, theirs = blurred(where.torque_along(JOINT, twist)), blurred(torque_behind(where, law))
    for own, truth in zip(ours.T, theirs.T, strict=True):
        assert np.std(own - truth) < 0.15 * max(np.std(truth), 0.1 * np.std(theirs[:, JOINT]))


def test_the_inertia_of_a_joint_is_positive_and_left_to_its_links() -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 1.0)
    inertia = felt_inertia(scene_of(arm, motor, time), JOINT)
    assert inertia.shape == time.shape
    assert inertia.min() > 0


def test_gaps_side_by_side_are_each_alone_to_the_bit() -> None:
    time, motor = waves(3, 2, 1.0)
    where = scene_of(random_arm("RRR", seed=3), motor, time)
    laws = [Twist(gap=gap) for gap in np.geomspace(1e-5, 1e-2, 11)]
    together = integrate_twists(load_at(where, JOINT), laws)
    np.testing.assert_array_equal(together, [integrate_twist(load_at(where, JOINT), law) for law in laws])


def test_a_scan_finds_the_gap_that_left_its_torque() -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 4.0)
    where = scene_of(arm, motor, time)
    play = Backlash.at(arm, JOINT + 1, shape=(1.1e-3,))
    left = play.columns(where)[:, :, 0] * 1.1e-3
    left[1::2] = np.nan  # rows that no filter kept
    found = Backlash.from_scan(arm, JOINT + 1, [where], [left])
    assert found[0].shape[0] == pytest.approx(1.1e-3, rel=0.3)
    assert found[0].looks > 2


def test_a_gap_in_which_a_train_rattles_is_not_decided_by_the_recording() -> None:
    time, smooth = waves(3, 2, 20.0)
    shaken = Motion(*(each.copy() for each in (smooth.position, smooth.velocity, smooth.acceleration)))
    for hertz, size in ((7.1, 60.0), (11.3, 45.0)):  # rad/s2, that turn the load over at each swing
        shaken.acceleration[:, JOINT] += size * np.sin(2 * np.pi * hertz * time)
    arm = random_arm("RRR", seed=3)
    gaps = [Backlash.at(arm, JOINT + 1, shape=(gap,)) for gap in (2e-5, 5e-2)]
    assert list(Backlash.decided_by(gaps, [scene_of(arm, smooth, time)])) == gaps
    assert list(Backlash.decided_by(gaps, [scene_of(arm, shaken, time)])) == gaps[:1]


def test_first_looks_at_a_spring_follow_the_load_at_once_or_ring() -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 4.0)
    where = scene_of(arm, motor, time)
    rigid, ringing = JointElasticity.initial_shapes(arm, JOINT + 1, [where])
    load = where.rigid_torque[:, JOINT]
    np.testing.assert_allclose(rigid.twist(where)[0], -load, atol=0.1 * np.abs(load).max())
    assert ringing.shape[0] < rigid.shape[0]


def test_links_that_no_arm_can_have_do_not_stop_the_integration() -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 1.0)
    where = scene_of(arm, motor, time)
    wrong = replace(where, inertial=-1e-3 * where.inertial)
    assert felt_inertia(wrong, JOINT).min() > 0
    for law in (Twist(stiffness=1e6, damping_time=3e-4), Twist(gap=1e-3)):
        assert np.isfinite(integrate_twist(load_at(wrong, JOINT), law)).all()


def test_a_spring_stiffer_than_any_resonance_follows_its_load_at_once() -> None:
    arm = random_arm("RRR", seed=3)
    time, motor = waves(3, 2, 1.0)
    where = scene_of(arm, motor, time)
    load = where.rigid_torque[:, JOINT]
    twist = integrate_twist(load_at(where, JOINT), Twist(stiffness=1e9, damping_time=3e-4))[0] * 1e9
    np.testing.assert_allclose(twist, -load, atol=0.05 * np.abs(load).max())
