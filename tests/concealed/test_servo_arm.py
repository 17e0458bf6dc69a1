"""The engine of arms with servos: against MuJoCo, against the regressor, and joints that stick."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from armlab.concealed.plan import random_stream
from armlab.concealed.servo.arms import draw_arm, write_mjcf
from armlab.concealed.servo.engine import STEP_S, mass_and_bias, simulate
from armlab.concealed.servo.motions import draw_command

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
def test_motion_without_friction_is_that_of_mujoco_within_a_tenth_of_a_milliradian(seed):
    arm, home, command = frictionless(seed)
    own = simulate(arm, command, 1 / RATE_HZ, home)[:: round(1 / RATE_HZ / STEP_S)][: len(command)]
    assert np.max(np.abs(own - simulate_in_mujoco(arm, command, home))) < 1e-4
