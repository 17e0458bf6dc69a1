"""Forward simulation: the inverse of the inverse dynamics, of fourth order, and true to a model that is right."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from small_recordings import ARM, frame, recording_in

from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from armlab.report.resimulate import WINDOW_SECONDS, MovingArm, NoInertiaError, resimulate, runge_kutta
from problem.arm import Arm, Joint, Link
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm
from problem.transforms import translation


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), name=st.sampled_from(["irb120-arm", "kuka-kr300"]))
def test_acceleration_under_the_inverse_dynamics_torque_is_the_acceleration(seed: int, name: str) -> None:
    arm = load_arm(name)
    rng = np.random.default_rng(seed)
    motion = Motion(*rng.uniform(-2, 2, (3, 5, len(arm))))
    rotors = rng.uniform(0, 1, len(arm))
    torque = rigid_body_torque(arm, motion) + rotors * motion.acceleration
    body = MovingArm(arm, arm.parameters, rotors)
    assert_allclose(body.acceleration(motion.position, motion.velocity, torque), motion.acceleration, atol=1e-8)


def pendulum() -> MovingArm:
    """1 kg at 1 m on a horizontal axis, without its own inertia."""
    still = translation(0, 0, 0)
    arm = Arm("pendulum", (Joint("pivot", "revolute", still, still),), None, (0.0, -9.81, 0.0))
    link = Link(1.0, (1.0, 0.0, 0.0), (0.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    return MovingArm(arm, link.parameters, np.zeros(1))


def swing(step: float) -> float:
    """Energy that a free swing of a second has won or lost, J."""
    torque = np.zeros((1, round(1 / step) + 1, 1))
    position, velocity = runge_kutta(pendulum(), np.array([[0.3]]), np.array([[0.5]]), torque, step)
    energy = 0.5 * velocity**2 + 9.81 * np.sin(position)
    return float(abs(energy[0, -1, 0] - energy[0, 0, 0]))


def test_a_free_pendulum_keeps_its_energy_to_fourth_order_in_the_step() -> None:
    coarse, fine = swing(0.02), swing(0.01)
    assert fine < 1e-6
    assert coarse / fine > 12


def test_a_point_mass_falls_by_half_g_t_squared() -> None:
    still = translation(0, 0, 0)
    arm = Arm("lift", (Joint("slide", "prismatic", still, still),))
    body = MovingArm(arm, Link(2.0, (0.0, 0.0, 0.0), (0.0,) * 6).parameters, np.zeros(1))
    position, _ = runge_kutta(body, np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 11, 1)), 0.1)
    assert position[0, -1, 0] == pytest.approx(-9.81 / 2)


def test_links_without_a_positive_inertia_are_refused() -> None:
    with pytest.raises(NoInertiaError, match="does not determine the mass"):
        MovingArm(ARM, -ARM.parameters, np.zeros(3)).inertia(np.zeros((1, 3)))


def test_the_found_model_follows_the_measured_motion_where_the_given_one_leaves_it(tmp_path: Path) -> None:
    folder = recording_in(tmp_path / "loaded", frame(0, 6, mass=0.5), frame(1, 6, mass=0.5))
    found = resimulate(diagnose(load_recording(folder)))
    assert found.run == "run-1.csv"
    assert found.time[-1] == pytest.approx(WINDOW_SECONDS, abs=0.05)
    assert found.old is not None
    old, new = found.growth(found.old)[-1], found.growth(found.new)[-1]
    assert np.all(new < 0.2)
    assert np.all(old > 5 * new)
    assert_allclose(found.new[:, 0], found.measured[:, 0])
