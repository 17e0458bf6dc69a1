import numpy as np
import pytest
from numpy.testing import assert_allclose
from simulated_arm import arm, motion, scene, structure, truth

from armlab.effects.contract import Candidate
from armlab.effects.drive import RotorInertia
from armlab.effects.friction import (
    COULOMB_FRICTION,
    CoulombFriction,
    Levels,
    LoadFriction,
    PowerFriction,
    Slopes,
    ViscousFriction,
)
from armlab.effects.scene import instants
from armlab.effects.springs import SpringCompensator, TorqueRipple
from armlab.identification.components import every_joint, usual_components, wrist_couplings
from armlab.identification.identifier import Identifier
from armlab.identification.structure import Structure
from armlab.recordings.recording import Run
from problem.motion import Motion
from problem.regressor import rigid_body_torque


def columns(part: Candidate, moved: Motion) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return part.columns(instants(arm(), moved))[:, 0]


def test_a_rotor_inertia_that_acts_like_the_links_own_is_left_out_and_named() -> None:
    kept, absorbed = Structure(arm(), usual_components(arm())).separable()
    assert [part.label for part in absorbed] == ["rotor_inertia, joint 1", "rotor_inertia, joint 2"]
    assert np.linalg.matrix_rank(kept.matrix(instants(arm(), motion(0)[1]))) == kept.size


def test_viscous_and_coulomb_friction_act_against_the_motion_at_their_own_joint_only() -> None:
    moved = Motion(np.zeros((1, 3)), np.array([[0.5, -2.0, 0.0]]), np.zeros((1, 3)))
    model = Structure(arm(), (ViscousFriction.at(arm(), 2), CoulombFriction.at(arm(), 2)))
    found = model.matrix(instants(arm(), moved))[:, model.slices[0].start :]
    assert_allclose(found, [[0, 0], [-2, -1], [0, 0]])


def test_coulomb_friction_is_averaged_over_the_interval_that_a_sample_stands_for() -> None:
    time = np.array([0.0, 0.1])
    moved = Motion(np.zeros((2, 3)), np.array([[0.1, 1.0, -0.2], [0.0, 1.0, -1.0]]), np.full((2, 3), 4.0))
    where = scene(time, moved)
    found = [CoulombFriction.at(arm(), joint).columns(where)[:, 0, 0] for joint in (1, 2, 3)]
    # half an interval is 0.05 s and changes the velocity by 0.2: the sign is 0.1 / 0.2, and 1 or -1 beyond
    assert_allclose(found, [[0.5, 0.0], [1.0, 1.0], [-1.0, -1.0]])


def test_smooth_coulomb_friction_is_small_where_a_joint_rests_and_whole_where_it_moves() -> None:
    top_speed = np.array([2.0, 0.0, 1.0])
    parts = [part for part in usual_components(arm(), top_speed) if part.effect == "coulomb_friction"]
    assert [part.turning for part in parts] == [0.02, 0.01, 0.01]
    moved = Motion(np.zeros((3, 3)), np.array([[2.0, 0, 0], [1e-4, 0, 0], [-1e-4, 0, 0]]), np.zeros((3, 3)))
    assert_allclose(columns(parts[0], moved).ravel(), [1.0, 0.005, -0.005], atol=1e-4)
    stated = parts[0].parameters(np.array([3.0]))
    read, coefficients = COULOMB_FRICTION.from_parameters(arm(), (1,), stated)
    assert (read.parameters(coefficients), read.joint_fields(coefficients)) == (stated, {"frictionloss": 3.0})


def test_friction_by_direction_has_a_level_for_each() -> None:
    moved = Motion(np.zeros((2, 3)), np.array([[3.0] * 3, [-3.0] * 3]), np.zeros((2, 3)))
    assert_allclose(columns(Levels.at(arm(), 1), moved), [[1, 0], [0, -1]])
    assert_allclose(columns(Slopes.at(arm(), 1), moved), [[3, 0], [0, -3]])
    assert_allclose(columns(PowerFriction.at(arm(), 1, shape=(2.0,)), moved), [[9], [-9]])


def test_a_coupled_motor_follows_the_sum_of_both_velocities() -> None:
    moved = Motion(np.zeros((1, 3)), np.array([[0.0, -1.0, 3.0]]), np.array([[0.0, 5.0, 7.0]]))
    first, second = wrist_couplings(arm())
    assert_allclose(columns(first, moved), [[3, 1, 7]])  # velocity, sign of the sum, acceleration
    assert_allclose(columns(second, moved), [[-1, 1, 5]])


def test_load_dependent_friction_follows_the_rigid_models_torque() -> None:
    moved = motion(1)[1]
    model = Structure(arm(), (LoadFriction.at(arm(), 2),), arm().parameters)
    expected = np.abs(rigid_body_torque(arm(), moved)[:, 1]) * np.sign(moved.velocity[:, 1])
    assert_allclose(model.matrix(instants(arm(), moved)).reshape(-1, 3, model.size)[:, 1, -1], expected)


def test_a_component_that_follows_a_load_needs_one() -> None:
    with pytest.raises(ValueError, match="load_dependent_friction, joint 2: needs inertial parameters"):
        Structure(arm(), (LoadFriction.at(arm(), 2),)).matrix(instants(arm(), motion(1)[1]))


@pytest.mark.parametrize(
    "extra",
    [
        every_joint(arm(), PowerFriction, shape=(0.5,)),
        (SpringCompensator.at(arm(), 2),),
        (TorqueRipple.at(arm(), 1, shape=(5.0,)),),
        (RotorInertia.at(arm(), 3),),
        wrist_couplings(arm()),
    ],
)
def test_exact_data_give_back_every_coefficient(extra: tuple[Candidate, ...]) -> None:
    model = structure((*every_joint(arm(), ViscousFriction), *every_joint(arm(), CoulombFriction), *extra))
    values = truth(model)
    time, moved = motion(2, 20.0)
    torque = (model.matrix(scene(time, moved)) @ values).reshape(-1, 3)
    run = Run("run.csv", "identify", time, moved.position, torque)
    found = Identifier(arm(), model.components, "ordinary", cutoff_hz=20.0).fit([run]).model_
    assert_allclose(found.values, values, rtol=0.02, atol=0.02)
