"""What is concealed in real recordings, on a recording that stands in for them."""

from dataclasses import replace

import numpy as np
import pytest
from small_recordings import ARM, COULOMB, PAYLOAD, VISCOUS, motion_at
from small_reference import reference_in

from armlab.common.arrays import Array
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.proof.open.real_concealed.conceal import (
    ReferenceModel,
    add_disturbance,
    sought_of_pieces,
    withhold_pieces,
)
from armlab.proof.open.real_concealed.concealed_case import Disturbance, Piece
from armlab.recordings.recording import Run
from problem.regressor import rigid_body_torque


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> ReferenceModel:
    return reference_in(tmp_path_factory.mktemp("recordings") / "told")


def _run(reference: ReferenceModel) -> tuple[Run, Array]:
    run = reference.recording.runs[0]
    return run, np.arange(run.samples) / run.rate_hz


def test_a_payload_adds_its_rigid_torque_and_leaves_the_noise_as_it_was(reference: ReferenceModel) -> None:
    run, time = _run(reference)
    ball = Disturbance("payload", 3, 2.0, "kg", centre=(0.05, 0.03, 0.1), radius=0.0)
    changed, added = add_disturbance(run, ARM, ball)
    x, y, z = 0.05, 0.03, 0.1
    body = [1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    phi = np.zeros(30)
    phi[20:] = 2.0 * np.array(body)
    exact = rigid_body_torque(ARM, motion_at(time, 0), phi)
    inside = slice(100, -100)
    assert np.sqrt(np.mean((added - exact)[inside] ** 2)) < 0.02 * np.sqrt(np.mean(exact[inside] ** 2))
    np.testing.assert_allclose(changed.torque - added, run.torque, atol=1e-12)


def test_springs_and_wear_act_at_their_joint_alone(reference: ReferenceModel) -> None:
    run, time = _run(reference)
    motion = motion_at(time, 0)
    _, spring = add_disturbance(run, ARM, Disturbance("cable_stiffness", 2, 3.0, "N m/rad", rest=0.4))
    _, wear = add_disturbance(run, ARM, Disturbance("viscous_friction", 1, 0.5, "N m s/rad"))
    np.testing.assert_allclose(spring[100:-100, 1], 3.0 * (motion.position[100:-100, 1] - 0.4), atol=1e-3)
    np.testing.assert_allclose(wear[100:-100, 0], 0.5 * motion.velocity[100:-100, 0], atol=0.02)
    assert not spring[:, [0, 2]].any()
    assert not wear[:, 1:].any()


def test_a_late_torque_is_that_of_earlier_samples_and_starts_where_it_was_recorded(reference: ReferenceModel) -> None:
    run, _ = _run(reference)
    late, added = add_disturbance(run, ARM, Disturbance("time_delay", None, 0.01, "s"))  # two samples of 5 ms
    assert late.samples == run.samples - 2
    np.testing.assert_allclose(late.torque, run.torque[:-2], atol=1e-9)
    np.testing.assert_allclose(late.position, run.position[2:], atol=1e-12)
    np.testing.assert_allclose(added, run.torque[:-2] - run.torque[2:], atol=1e-9)


def test_a_model_without_a_piece_lacks_its_torque_and_nothing_else(reference: ReferenceModel) -> None:
    pieces = (Piece("friction", 2),)
    model = reference.model
    motion = motion_at(np.arange(200) / 200, 1)
    lost = model.torque(motion) - withhold_pieces(model, pieces).torque(motion)
    (sought,) = sought_of_pieces(model, pieces)
    numbers = sought.numbers
    own = numbers["viscous_friction"]["coefficient"] * motion.velocity[:, 1]
    own += numbers["coulomb_friction"]["level"] * np.sign(motion.velocity[:, 1])
    np.testing.assert_allclose(lost[:, 1], own, atol=1e-9)
    assert not lost[:, [0, 2]].any()
    assert numbers["viscous_friction"]["coefficient"] == pytest.approx(VISCOUS[1], abs=0.1)
    assert numbers["coulomb_friction"]["level"] == pytest.approx(COULOMB[1], abs=0.1)


def test_a_model_without_its_payload_has_the_last_link_of_its_maker(reference: ReferenceModel) -> None:
    model = reference.model
    assert model.inertial is not None
    loaded = model.inertial.copy()
    loaded[-10:] = ARM.parameters[-10:] + 1.5 * np.array(PAYLOAD)
    values = np.concatenate([model.structure.base.values(loaded), model.values[len(model.structure.base) :]])
    heavy = replace(model, inertial=loaded, values=values)
    less = withhold_pieces(heavy, (Piece("payload", 3),))
    assert less.inertial is not None
    np.testing.assert_allclose(less.inertial[-10:], ARM.parameters[-10:])
    np.testing.assert_allclose(less.base_values, model.structure.base.values(less.inertial))
    (sought,) = sought_of_pieces(heavy, (Piece("payload", 3),))
    assert sought.numbers["payload"]["mass"] == pytest.approx(1.5)


def test_a_piece_that_the_reference_does_not_have_is_refused(reference: ReferenceModel) -> None:
    with pytest.raises(ValueError, match="no counterbalance of joint 2"):
        withhold_pieces(reference.model, (Piece("counterbalance", 2),))


def test_a_simulation_knows_of_which_joints_it_has_no_friction(reference: ReferenceModel) -> None:
    arm, less = reference.recording.arm, withhold_pieces(reference.model, (Piece("friction", 2),))
    assert Simulation("nominal", arm, None, reference.model).joints_without_friction == frozenset()
    assert Simulation("nominal", arm, None, less).joints_without_friction == {2}
    assert Simulation("refit", arm, None).joints_without_friction == {1, 2, 3}
