"""What is concealed in real recordings, on a recording that stands in for them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from public_copies import needs_copies
from told_recordings import ARM, COULOMB, PAYLOAD, VISCOUS, frame, motion_at, recording_in
from told_reference import reference_in

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.proof.open.real_concealed.cases_of_recording import ConcealedStudy, study_cases, study_recording
from armlab.proof.open.real_concealed.conceal import (
    ReferenceModel,
    add_disturbance,
    identify_reference,
    sought_of_pieces,
    withhold_pieces,
)
from armlab.proof.open.real_concealed.examine import open_outcomes
from armlab.proof.open.real_concealed.fixed_plan import INJECTED, WITHHELD, Case, Disturbance, Piece, cases_of
from armlab.proof.open.real_concealed.report import conceal_in_recordings
from armlab.proof.open.real_identification.identify_recording import RECIPES
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.recording import Run
from problem.regressor import rigid_body_torque

CASES = (
    Case("told"),
    Case("told", (Piece("friction", 2),)),
    Case("told", (), Disturbance("viscous_friction", 3, 0.3, "N m s/rad")),
    Case("told", (), Disturbance("cable_stiffness", 1, 2.0, "N m/rad", rest=0.1)),
)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> ReferenceModel:
    return reference_in(tmp_path_factory.mktemp("recordings") / "told")


@pytest.fixture(scope="module")
def studied(reference: ReferenceModel, tmp_path_factory: pytest.TempPathFactory) -> tuple[ConcealedStudy, Path]:
    folder = tmp_path_factory.mktemp("kept")
    looks = Looks(folder / "looks.jsonl")
    return study_cases(reference, CASES, open_outcomes(folder), looks, lambda message: None), folder


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
    own = numbers["viscous_friction"]["coefficient"][0] * motion.velocity[:, 1]
    own += numbers["coulomb_friction"]["level"][0] * np.sign(motion.velocity[:, 1])
    np.testing.assert_allclose(lost[:, 1], own, atol=1e-9)
    assert not lost[:, [0, 2]].any()
    assert numbers["viscous_friction"]["coefficient"][0] == pytest.approx(VISCOUS[1], abs=0.1)
    assert numbers["coulomb_friction"]["level"][0] == pytest.approx(COULOMB[1], abs=0.1)


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
    assert sought.numbers["payload"]["mass"][0] == pytest.approx(1.5)


def test_a_piece_that_the_reference_does_not_have_is_refused(reference: ReferenceModel) -> None:
    with pytest.raises(ValueError, match="no counterbalance of joint 2"):
        withhold_pieces(reference.model, (Piece("counterbalance", 2),))


def test_what_is_concealed_is_named_with_its_size_and_the_control_names_nothing(
    studied: tuple[ConcealedStudy, Path],
) -> None:
    found, _ = studied
    assert found.control.findings == ()
    friction, wear, spring = found.verdicts
    for verdict in found.verdicts:
        assert verdict.others == ()
        assert verdict.gap == pytest.approx(1, abs=0.1)
        assert verdict.outcome.recovered == pytest.approx(1, abs=0.05)
    assert [each.answer for each in friction.parts + wear.parts] == ["named", "named"]
    assert spring.parts[0].answer in ("named", "identical")
    assert {each.effect for each in friction.parts[0].numbers} == {"coulomb_friction", "viscous_friction"}
    assert all(each.holds for verdict in found.verdicts for one in verdict.parts for each in one.numbers)
    assert (friction.joint_shown, wear.joint_shown, spring.joint_shown) == (2, 3, 1)


def test_kept_outcomes_are_not_looked_at_again_and_every_look_is_logged(
    studied: tuple[ConcealedStudy, Path], reference: ReferenceModel
) -> None:
    found, folder = studied
    log = folder / "looks.jsonl"
    before = log.read_text()
    assert [json.loads(line)["model"] for line in before.splitlines()] == [f"concealed: {each.name}" for each in CASES]
    again = study_cases(reference, CASES, open_outcomes(folder), Looks(log), lambda message: None)
    assert log.read_text() == before
    assert again.verdicts == found.verdicts


def test_outcomes_of_other_code_or_another_recording_are_not_taken(reference: ReferenceModel, tmp_path: Path) -> None:
    kept, recording = open_outcomes(tmp_path), reference.recording
    (run, *rest) = recording.runs
    other = replace(recording, runs=(replace(run, torque=run.torque + 1e-9), *rest))
    places = {kept.place(CASES[0], recording), kept.place(CASES[1], recording), kept.place(CASES[0], other)}
    assert len(places | {replace(kept, code="other").place(CASES[0], recording)}) == 4


def test_the_command_writes_page_table_and_picture_and_refuses_unknown_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording_in(tmp_path / "recordings" / "emps", frame(0, 6), frame(1, 6))
    monkeypatch.setitem(WITHHELD, "emps", ((Piece("friction", 2),),))
    monkeypatch.setitem(INJECTED, "emps", (Disturbance("viscous_friction", 3, 0.5, "N m s/rad"),))
    told: list[str] = []
    lines = list(conceal_in_recordings(tmp_path / "results", tmp_path / "recordings", ("emps",), told.append))
    names = ("concealed.md", "concealed.csv", "concealed.svg")
    assert lines[-3:] == [str(tmp_path / "results" / name) for name in names]
    page, table, picture = ((tmp_path / "results" / name).read_text() for name in names)
    assert "| without friction of joint 2 | friction, joint 2 | named at its place |" in page
    assert "viscous friction of 0.5 N m s/rad at joint 3" in page
    assert table.count("\n") == 3
    assert "viscous friction of 0.5 N m s/rad at joint 3" in picture
    assert "emps, 3 of 3: viscous friction of 0.5 N m s/rad at joint 3" in told
    with pytest.raises(InputError, match="unknown recording 'epms': did you mean 'emps'"):
        list(conceal_in_recordings(tmp_path, tmp_path, ("epms",)))


def test_the_plan_conceals_what_was_promised_in_every_real_arm() -> None:
    names = ("emps", "staubli-tx40", "unisa-ur10", "kuka-kr300")
    assert tuple(INJECTED) == tuple(WITHHELD) == names
    cases = [each for name in names for each in cases_of(name)]
    assert sum(each.control for each in cases) == 4
    injected = [each.injected for each in cases if each.injected is not None]
    assert len(injected) >= 24
    for name in names:
        own = {each.effect for each in INJECTED[name]}
        assert own == {"payload", "cable_stiffness", "time_delay", "viscous_friction"}
    assert len({(each.recording, each.name) for each in cases}) == len(cases)


@needs_copies("emps")
def test_friction_that_is_withheld_from_the_emps_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(INJECTED, "emps", ())
    found = study_recording(
        "emps", tmp_path, open_outcomes(tmp_path), Looks(tmp_path / "looks.jsonl"), lambda message: None
    )
    (verdict,) = found.verdicts
    # its friction differs by direction: that law of friction is an answer, too
    assert [each.answer for each in verdict.parts] in (["named"], ["law"])
    assert verdict.gap == pytest.approx(1, abs=0.1)
    recipe = next(each for each in RECIPES if each.name == "emps")
    assert identify_reference(found.reference.recording, recipe).model.inertial is not None


def test_a_simulation_knows_of_which_joints_it_has_no_friction(reference: ReferenceModel) -> None:
    arm, less = reference.recording.arm, withhold_pieces(reference.model, (Piece("friction", 2),))
    assert Simulation("nominal", arm, None, reference.model).joints_without_friction == frozenset()
    assert Simulation("nominal", arm, None, less).joints_without_friction == {2}
    assert Simulation("refit", arm, None).joints_without_friction == {1, 2, 3}
