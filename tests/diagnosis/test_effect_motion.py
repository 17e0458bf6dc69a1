"""Effects of a wrong motion against the nonlinear truth: Pinocchio's inverse dynamics of the motion as it was."""

from dataclasses import replace

import numpy as np
import pytest
from effect_scenes import candidate, moved, scene, scene_of, torque_of, waves
from engines import pinocchio_model
from random_arms import random_arm
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.effects.contract import Scene
from armlab.proof.blind.effects.channels import EncoderOffset as HiddenOffset
from problem.arm import Arm
from problem.motion import Motion

INNER = slice(40, -40)


def true_torque(arm: Arm, motion: Motion) -> Array:
    """Pinocchio's recursive Newton-Euler, (samples, joints)."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    model = pinocchio_model(arm)
    data = model.createData()
    states = zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    return np.array([pin.rnea(model, data, *state) for state in states])


def of_positions(time: Array, position: Array) -> Motion:
    """A motion from positions by a quintic spline."""
    spline = make_interp_spline(time, position, k=5)
    return Motion(position, spline(time, 1), spline(time, 2))


def close(ours: Array, theirs: Array, share: float) -> None:
    """Within a share of the largest torque, away from the ends."""
    np.testing.assert_allclose(ours[INNER], theirs[INNER], atol=share * np.abs(theirs[INNER]).max())


@pytest.mark.parametrize("joint", [1, 2])
def test_elasticity_is_the_torque_of_links_behind_their_motors(joint: int) -> None:
    arm = random_arm("RRR", seed=3)
    time, link = waves(3, 1, 4.0)
    stiffness, load = 1e5, true_torque(arm, link)
    motor = link.position.copy()
    motor[:, joint - 1] += load[:, joint - 1] / stiffness
    where = scene_of(arm, of_positions(time, motor), time)
    missing = load - true_torque(arm, where.motion)
    spring = candidate("joint_elasticity", [where], joint)
    close(torque_of(spring, np.array([1 / stiffness]), where), missing, 0.05)
    assert spring.parameters(np.array([1 / stiffness]))["stiffness"] == pytest.approx(stiffness)


def test_recorded_links_show_the_spring_even_where_the_model_is_wrong() -> None:
    arm = random_arm("RRR", seed=3)
    time, link = waves(3, 1, 4.0)
    stiffness, load = 1e5, true_torque(arm, link)
    motor = link.position.copy()
    motor[:, 1] += load[:, 1] / stiffness
    where = replace(scene_of(arm, of_positions(time, motor), time), link_position=link.position)
    missing = load - true_torque(arm, where.motion)
    spring = candidate("joint_elasticity", [where], 2)
    close(torque_of(spring, np.array([1 / stiffness]), where), missing, 0.02)


@pytest.mark.parametrize("kinds", ["RRR", "PRR"])
def test_encoder_offset_is_what_the_truth_machine_adds_to_positions(kinds: str) -> None:
    hidden = HiddenOffset(1, 1e-3, 1e-2, "constant", {"direction": -1.0})
    where = scene(kinds, seconds=1.0)
    real = Motion(where.motion.position - hidden.shift(3), where.motion.velocity, where.motion.acceleration)
    truth = true_torque(where.arm, real) - true_torque(where.arm, where.motion)
    offset = hidden.parameters()["offset"]
    close(torque_of(candidate("encoder_offset", [where], 2), np.array([offset]), where), truth, 1e-2)


@pytest.mark.parametrize("seconds", [0.004, -0.003, 0.02])
def test_time_delay_is_the_torque_of_an_earlier_instant(seconds: float) -> None:
    time, motion = waves(3, 1, 4.0)
    arm = random_arm("RRR", seed=3)
    where = scene_of(arm, motion, time, friction=0.0)
    spline = make_interp_spline(time, where.torque, k=5)
    truth = spline(np.clip(time - seconds, 0, time[-1])) - where.torque
    late = candidate("time_delay", [where]).with_shape((seconds,))
    close(torque_of(late, np.array([seconds]), where), truth, 2e-3)
    assert late.parameters(np.array([seconds])) == {"seconds": seconds}


def test_a_small_delay_is_told_by_the_column_of_another() -> None:
    where = scene(seconds=4.0)
    first, exact = (candidate("time_delay", [where]).with_shape((shift,)) for shift in (0.004, 0.003))
    smooth = replace(where, torque=where.rigid_torque)
    column = torque_of(first, np.array([1.0]), smooth)[INNER].ravel()
    truth = torque_of(exact, np.array([0.003]), smooth)[INNER].ravel()
    assert column @ truth / (column @ column) == pytest.approx(0.003, rel=0.01)


@pytest.mark.parametrize("form", ["torque", "position"])
def test_skew_of_a_channel_is_that_channel_late(form: str) -> None:
    seconds, joint = 0.002, 2
    arm = random_arm("RRR", seed=3)
    time, motion = waves(3, 1, 4.0)
    where = scene_of(arm, motion, time, friction=0.0)
    skew = candidate("channel_skew", [where], joint, form).with_shape((seconds,) if form == "torque" else ())
    if form == "torque":
        spline = make_interp_spline(time, where.torque[:, joint - 1], k=5)
        truth = np.zeros((len(time), 3))
        truth[:, joint - 1] = spline(np.clip(time - seconds, 0, time[-1])) - where.torque[:, joint - 1]
    else:
        position = motion.position.copy()
        spline = make_interp_spline(time, position[:, joint - 1], k=5)
        position[:, joint - 1] = spline(np.clip(time - seconds, 0, time[-1]))
        truth = true_torque(arm, of_positions(time, position)) - true_torque(arm, motion)
    close(torque_of(skew, np.array([seconds]), where), truth, 0.03)


def test_friction_of_a_late_channel_jumps_late_by_the_same_time() -> None:
    where = scene(seconds=4.0)
    friction_only = replace(where, torque=np.sign(where.motion.velocity))
    late = candidate("time_delay", [friction_only]).with_shape((0.01,))
    change = torque_of(late, np.array([0.01]), friction_only)[:, 0]
    jumps = np.abs(np.diff(np.sign(where.motion.velocity[:, 0]))).sum() / 2
    # between a jump and its late copy the change is two levels
    assert np.abs(change).sum() / 500 == pytest.approx(2 * 0.01 * jumps, rel=0.05)


def test_friction_of_an_early_encoder_jumps_with_it() -> None:
    where = scene(seconds=4.0)
    jumps = np.abs(np.diff(np.sign(where.motion.velocity[:, 1]))).sum() / 2
    with_friction = candidate("channel_skew", [where], 2, "position").columns(where)[:, 1, 0]
    smooth = replace(where, torque=where.rigid_torque)
    without = candidate("channel_skew", [where], 2, "position").columns(smooth)[:, 1, 0]
    change = with_friction - without
    # a level of 0.5 late by a second jumps by 1 less for a second: the area is that of the jumps, the sign against them
    assert np.abs(change).sum() / 500 == pytest.approx(jumps, rel=1e-6)
    up = np.flatnonzero(np.diff(np.sign(where.motion.velocity[:, 1])) > 0)
    assert np.all(change[up + 1] < 0)


def test_columns_that_follow_the_model_say_so() -> None:
    where = scene()
    heavier = replace(where, inertial=1.5 * where.inertial, torque=1.5 * where.torque)
    from effect_scenes import BUILT_IN

    for family in BUILT_IN:
        for place in family.candidates(where.arm, [where]):
            same = np.allclose(place[0].columns(where), place[0].columns(heavier), rtol=1e-6, atol=1e-9)
            assert place[0].follows_model is not same, place[0]


def test_moving_a_scene_recomputes_its_rigid_torque() -> None:
    where = scene()
    still = moved(where, Motion(where.motion.position, *np.zeros((2, *where.motion.position.shape))))
    assert isinstance(still, Scene)
    assert not np.allclose(where.rigid_torque, still.rigid_torque)
