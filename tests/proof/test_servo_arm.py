"""The engine of arms with servos: against MuJoCo, against the regressor, and joints that stick."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from armlab.proof.blind.plan import random_stream
from armlab.proof.blind.servo.servo_arms import draw_arm, write_mjcf
from armlab.proof.blind.servo.servo_commands import draw_command
from armlab.proof.blind.servo.servo_engine import STEP_S, Body, Servo, ServoArm, mass_and_bias, simulate

RATE_HZ = 100.0


def frictionless(seed):
    """An arm without friction and limits that bind, its home, and a command."""
    rng = random_stream("test servo arm", seed)
    arm, home = draw_arm(rng, "pd")
    servos = tuple(replace(servo, friction=0.0, count=0.0, limit=1e6) for servo in arm.servos)
    return replace(arm, servos=servos), home, draw_command(rng, "multisine", home, RATE_HZ, 2.0)


def simulate_in_mujoco(arm, command, first, step=0.00005):
    """Positions (samples, joints) at RATE_HZ, by Runge and Kutta's fourth order."""
    model = mujoco.MjModel.from_xml_string(write_mjcf(arm, actuators=True))
    model.opt.timestep, model.opt.integrator = step, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    data.qpos[:] = first
    out = []
    for row in command:
        out.append(data.qpos.copy())
        data.ctrl[:] = row
        mujoco.mj_step(model, data, nstep=round(1 / RATE_HZ / step))
    return np.array(out)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_mass_matrix_and_bias_are_those_of_mujoco(seed):
    arm, home, _ = frictionless(seed)
    model = mujoco.MjModel.from_xml_string(write_mjcf(arm, actuators=False))
    data, velocity = mujoco.MjData(model), np.linspace(-2, 3, arm.joints)
    data.qpos[:], data.qvel[:] = home, velocity
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    mass, bias = mass_and_bias(arm, home, velocity)
    rotors = np.diag([servo.armature for servo in arm.servos])
    np.testing.assert_allclose(mass + rotors, full, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(bias, data.qfrc_bias, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_motion_without_friction_is_that_of_mujoco_within_two_microradians(seed):
    arm, home, command = frictionless(seed)
    own = simulate(arm, command, 1 / RATE_HZ, home)[:: round(1 / RATE_HZ / STEP_S)][: len(command)]
    assert np.max(np.abs(own - simulate_in_mujoco(arm, command, home))) < 2e-6


def turntable(**drive):
    """One joint about the vertical with 0.05 kg m2 behind it."""
    body = Body((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, (0.0, 0.0, 0.0), (0.02, 0.02, 0.02, 0.0, 0.0, 0.0))
    return ServoArm((body,), (Servo(kp=10.0, kd=0.0, limit=2.0, armature=0.03, **drive),))


def test_a_saturated_joint_with_friction_moves_as_newton_says():
    command = np.full((50, 1), 5.0)  # 50 N m wanted, 2 N m given
    own = simulate(turntable(friction=0.5), command, 0.01, np.zeros(1))[:, 0]
    time = np.arange(len(own)) * STEP_S
    np.testing.assert_allclose(own, (2.0 - 0.5) / 0.05 * time**2 / 2, atol=1e-6)


def test_a_joint_holds_still_while_its_drive_pulls_less_than_the_friction():
    pull = np.linspace(0, 0.0499, 50)[:, None]  # 0.499 N m at most
    assert np.all(simulate(turntable(friction=0.5), pull, 0.01, np.zeros(1)) == 0)
    assert simulate(turntable(friction=0.5), 1.05 * pull, 0.01, np.zeros(1))[-1, 0] > 0


def test_static_friction_holds_what_sliding_friction_does_not():
    pull = np.full((20, 1), 0.06)
    stuck = simulate(turntable(friction=0.5, static_extra=0.2, stribeck_velocity=0.1), pull, 0.01, np.zeros(1))
    assert np.all(stuck == 0)
    assert simulate(turntable(friction=0.5), pull, 0.01, np.zeros(1))[-1, 0] > 0


def test_a_command_is_late_by_the_delay_and_held_for_its_interval():
    arm = replace(turntable(delay=0.013), hold_s=0.02)
    command = np.concatenate([np.zeros((11, 1)), np.ones((20, 1))])  # asked for at 0.11 s, taken over at 0.12 s
    own = simulate(arm, command, 0.01, np.zeros(1))[:, 0]
    first = np.flatnonzero(own)[0] * STEP_S
    assert first == pytest.approx(0.12 + 0.013, abs=1.01 * STEP_S)


def test_a_cascade_without_an_integral_gain_is_a_pd():
    rng = random_stream("test cascade")
    arm, home = draw_arm(rng, "cascade")
    command = draw_command(rng, "multisine", home, RATE_HZ, 3.0)
    pd = replace(arm, servos=tuple(replace(servo, cascaded=False) for servo in arm.servos))
    both = [simulate(each, command, 1 / RATE_HZ, home) for each in (arm, pd)]
    np.testing.assert_allclose(*both, atol=1e-9)


@pytest.mark.parametrize(("limit", "error"), [(2.0, 0.0), (0.3, 0.02)])
def test_an_integral_gain_takes_away_a_standing_error_up_to_its_limit(limit, error):
    body = Body((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.5, (0.1, 0.0, 0.0), (0.001, 0.001, 0.001, 0.0, 0.0, 0.0))
    servo = Servo(kp=9.5, kd=0.6, limit=5.0, ki=20.0, integral_limit=limit, armature=0.01)
    last = simulate(ServoArm((body,), (servo,)), np.zeros((500, 1)), 0.01, np.zeros(1))[-1, 0]
    assert last == pytest.approx(error, abs=5e-4)  # 0.49 N m of gravity turn it down
