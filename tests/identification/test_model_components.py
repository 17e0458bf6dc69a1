import numpy as np
import pytest
from numpy.testing import assert_allclose
from simulated_arm import arm, motion, structure, truth

from armlab.effects.library import effect_named
from armlab.identification.components import FORMS, Component, every_joint, neighbour_couplings, usual_components
from armlab.identification.identifier import Identifier
from armlab.identification.structure import Structure
from armlab.recordings.recording import Run
from problem.motion import Motion
from problem.regressor import rigid_body_torque


def test_a_rotor_inertia_that_acts_like_the_links_own_is_left_out_and_named() -> None:
    kept, absorbed = Structure(arm(), usual_components(3)).separable()
    assert [part.label for part in absorbed] == ["rotor_inertia, joint 1", "rotor_inertia, joint 2"]
    assert np.linalg.matrix_rank(kept.matrix(motion(0)[1])) == kept.size


def test_viscous_and_coulomb_friction_act_against_the_motion_at_their_own_joint_only() -> None:
    moved = Motion(np.zeros((1, 3)), np.array([[0.5, -2.0, 0.0]]), np.zeros((1, 3)))
    model = Structure(arm(), (Component("viscous_friction", 2), Component("coulomb_friction", 2)))
    columns = model.matrix(moved)[:, model.slices[0].start :]
    assert_allclose(columns, [[0, 0], [-2, -1], [0, 0]])


def test_friction_by_direction_has_a_level_for_each() -> None:
    moved = Motion(np.zeros((2, 1)), np.array([[3.0], [-3.0]]), np.zeros((2, 1)))
    assert_allclose(Component("asymmetric_friction", 1).columns(moved), [[1, 0], [0, -1]])
    assert_allclose(Component("asymmetric_friction", 1, held=1.0).columns(moved), [[3, 0], [0, -3]])
    assert_allclose(Component("nonlinear_viscous_friction", 1, held=2.0).columns(moved), [[9], [-9]])


def test_a_coupled_motor_follows_the_sum_of_both_velocities() -> None:
    moved = Motion(np.zeros((1, 3)), np.array([[0.0, -1.0, 3.0]]), np.array([[0.0, 5.0, 7.0]]))
    assert_allclose(neighbour_couplings(3)[0].columns(moved), [[3, 1, 7]])  # velocity, sign of the sum, acceleration
    assert_allclose(neighbour_couplings(3)[1].columns(moved), [[-1, 1, 5]])


def test_load_dependent_friction_follows_the_rigid_models_torque() -> None:
    moved = motion(1)[1]
    model = Structure(arm(), (Component("load_dependent_friction", 2),), arm().parameters)
    expected = np.abs(rigid_body_torque(arm(), moved)[:, 1]) * np.sign(moved.velocity[:, 1])
    assert_allclose(model.matrix(moved).reshape(-1, 3, model.size)[:, 1, -1], expected)


@pytest.mark.parametrize("effect", FORMS)
def test_every_component_speaks_the_vocabulary(effect: str) -> None:
    for form in FORMS[effect]:
        for name in form.names:
            assert effect_named(effect).parameter(name)


@pytest.mark.parametrize("effect", ["gravity_compensator", "torque_ripple", "cable_stiffness"])
def test_named_parameters_and_coefficients_are_two_ways_to_say_one_thing(effect: str) -> None:
    for form in range(len(FORMS[effect])):
        part = Component(effect, 1, form=form)
        named = dict(zip(part.names, [3.0, 0.4], strict=True))
        assert_allclose(part.parameters(part.coefficients(named)), [3.0, 0.4])


def test_an_effect_that_is_not_linear_is_refused() -> None:
    with pytest.raises(ValueError, match="not linear"):
        Component("stribeck_friction", 1)
    with pytest.raises(ValueError, match="driving joint"):
        Component("coulomb_friction", 1, driver=2)


@pytest.mark.parametrize(
    "extra",
    [
        every_joint("nonlinear_viscous_friction", 3, 0.5),
        (Component("gravity_compensator", 2),),
        (Component("torque_ripple", 1, held=5.0),),
        neighbour_couplings(3),
    ],
)
def test_exact_data_give_back_every_coefficient(extra: tuple[Component, ...]) -> None:
    model = structure((*every_joint("viscous_friction", 3), *every_joint("coulomb_friction", 3), *extra))
    values = truth(model)
    time, moved = motion(2, 20.0)
    torque = (model.matrix(moved) @ values).reshape(-1, 3)
    run = Run("run.csv", "identify", time, moved.position, torque)
    found = Identifier(arm(), model.components, "ordinary", cutoff_hz=20.0).fit([run]).model_
    assert_allclose(found.values, values, rtol=0.02, atol=0.02)
