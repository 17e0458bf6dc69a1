"""The arms in MuJoCo: the same physics as the regressor, and hidden parts that do what they are called."""

import mujoco
import numpy as np
import pytest

from armlab.proof.blind.arms import Machine, make_machine
from armlab.proof.blind.engine import Parts, Spring, build_plant, inverse_dynamics
from armlab.proof.blind.motions import FAMILIES, make_reference
from armlab.proof.blind.simulate import run_times
from problem.motion import Motion
from problem.regressor import rigid_body_torque

ARMS = ("irb120-arm", "irb120", "panda", "scara")


@pytest.mark.parametrize("name", ARMS)
def test_mujoco_and_the_regressor_agree_on_random_states(name: str) -> None:
    arm = make_machine(name).arm
    motion = Motion(*np.random.default_rng(1).uniform(-2, 2, (3, 40, len(arm))))
    ours = rigid_body_torque(arm, motion) + np.array(arm.rotor_inertia) * motion.acceleration
    np.testing.assert_allclose(inverse_dynamics(arm, motion), ours, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_links_are_bodies_that_could_exist(name: str) -> None:
    for link in make_machine(name).arm.links or ():
        xx, yy, zz, xy, xz, yz = link.inertia
        assert np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).min() > 0


def test_a_horizontal_arm_feels_no_gravity() -> None:
    arm = make_machine("scara").arm
    still = np.zeros((5, 2))
    motion = Motion(np.random.default_rng(0).uniform(-2, 2, (5, 2)), still, still)
    np.testing.assert_allclose(inverse_dynamics(arm, motion), 0, atol=1e-12)


def _deflection(spring: Spring, torque: float) -> float:
    """Where the spring of the second joint of a horizontal arm comes to rest under a torque on its link."""
    made = build_plant(make_machine("scara").arm, Parts((spring,)))
    data = mujoco.MjData(made.model)
    motor, hinge = made.model.joint(f"motor{spring.joint}").dofadr[0], made.model.joint(f"spring{spring.joint}")
    for _ in range(8000):
        data.qfrc_applied[hinge.dofadr[0]] = torque
        data.qfrc_applied[motor] = -400 * data.qpos[motor] - 40 * data.qvel[motor]
        mujoco.mj_step(made.model, data)
    return float(data.qpos[hinge.qposadr[0]])


def test_a_linear_spring_gives_way_in_proportion() -> None:
    assert _deflection(Spring(1, 1000.0, 5.0), 2.0) == pytest.approx(2e-3, rel=1e-3)


def test_a_hardening_spring_follows_its_cubic_law() -> None:
    x = _deflection(Spring(1, 1000.0, 5.0, hardening=1e8), 2.0)
    assert 1000 * x + 1e8 * x**3 == pytest.approx(2.0, rel=1e-2)


@pytest.mark.parametrize("direction", [-1, 1])
def test_play_lets_the_link_move_by_half_the_gap_each_way(direction: int) -> None:
    x = _deflection(Spring(1, 1e5, 50.0, gap=4e-3), direction * 0.5)
    assert direction * x == pytest.approx(2e-3, abs=2e-4)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", ARMS)
def test_references_stay_within_range_speed_and_acceleration(name: str, family: str) -> None:
    made: Machine = make_machine(name)
    time = run_times(8.0, 2000)
    position = make_reference(family, np.random.default_rng(3), time, made)
    velocity = np.diff(position, axis=0) * 2000
    low, high = made.range
    assert np.all((position > low) & (position < high))
    assert np.all(np.abs(velocity) <= made.speed * 1.001)
    assert np.all(np.abs(np.diff(velocity, axis=0) * 2000) <= made.acceleration * 1.001)


def test_identification_and_validation_move_in_different_families() -> None:
    from armlab.proof.blind.plan import draw_plan

    for index in range(40):
        runs = draw_plan(1003, index, "clean", True, True).runs
        learned = {run.family for run in runs if run.role == "identify"}
        assert [run.role for run in runs].count("validate") == 1
        assert runs[-1].family not in learned
