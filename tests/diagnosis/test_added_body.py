"""Bodies that are added to a link can exist."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import engine_cases as cases
import numpy as np
import pytest
from effect_scenes import scene_of
from small_recordings import ARM, PAYLOAD, frame, motion_at, recording_in

from armlab.diagnosis.result import Claim
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.diagnose import diagnose, prepare
from armlab.diagnosis.torque.evidence.added_body import (
    _fewer_off,
    _likeliest_body,
    is_possible_body,
    with_possible_bodies,
)
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.evidence.plausibility import _reason_other_mass, reason_link_unknown, reason_no_body
from armlab.diagnosis.torque.search.fitted_model import fit_background
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.effects.library import library
from armlab.effects.links import BODY_SIZE_M, Payload, PointPayload, SolidBody
from armlab.effects.parameters import ParameterValue
from armlab.recordings.load import load_recording
from problem.arm import Link
from problem.pseudo_inertia import link_from_centre_of_mass
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

BODY = np.asarray(link_from_centre_of_mass(120.0, np.array([0.0, 0.1, 0.2]), np.diag([2.0, 2.5, 3.0])).parameters)


def test_a_body_that_the_data_determine_is_found_as_it_is() -> None:
    found, gain = _likeliest_body(1e6 * np.eye(10), 1e6 * BODY)
    np.testing.assert_allclose(found, BODY, rtol=1e-3, atol=1e-2)
    assert gain > 0


def test_data_that_ask_for_a_negative_mass_get_no_body_of_negative_mass() -> None:
    wanted = BODY.copy()
    wanted[0] = -39.0
    found, _ = _likeliest_body(np.eye(10), wanted)
    assert is_possible_body(found, 1e-6)


def test_a_body_without_mass_or_with_an_impossible_spread_of_it_is_none() -> None:
    assert is_possible_body(BODY)
    assert not is_possible_body(-BODY)
    parameters = np.asarray(Link(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 5.0, 0.0, 0.0, 0.0)).parameters)
    assert not is_possible_body(parameters)


def test_a_body_is_small_where_data_do_not_tell_of_its_spread() -> None:
    told = np.diag([1e4] * 4 + [0.0] * 6)
    found, _ = _likeliest_body(told, told @ BODY)
    np.testing.assert_allclose(found[:4], BODY[:4], rtol=1e-3, atol=1e-2)
    assert is_possible_body(found, 0.0)
    assert np.all(found[4:7] < found[0] * (BODY[1:4] @ BODY[1:4] / BODY[0] ** 2 + 20 * BODY_SIZE_M**2))


def test_a_body_of_held_form_adds_the_torque_of_its_parameters_and_keeps_them() -> None:
    ten = 2.0 * np.array(PAYLOAD)
    held = SolidBody.of_body(ARM, 3, ten)
    time = np.arange(0, 2, 0.1)
    scene = scene_of(ARM, motion_at(time, 1), time)
    bare, loaded = np.zeros(30), np.append(np.zeros(20), ten)
    torque = rigid_body_torque(ARM, scene.motion, loaded) - rigid_body_torque(ARM, scene.motion, bare)
    np.testing.assert_allclose(held.columns(scene)[:, :, 0] * 2.0, torque, atol=1e-9)
    np.testing.assert_allclose(held.added_body(np.array([2.0])), ten)
    again, mass = SolidBody.from_parameters(ARM, (3,), held.parameters(np.array([2.0])))
    np.testing.assert_allclose(again.added_body(mass), ten)


def test_a_body_of_held_form_with_a_negative_mass_is_none() -> None:
    held = SolidBody.of_body(ARM, 3, np.array(PAYLOAD))
    assert held.objection(np.array([-1.0])) == "a negative mass"
    assert held.objection(np.array([-1.0]), np.array([[1.0]])) is None


def test_of_a_body_without_mass_nothing_is_known() -> None:
    assert body_at(0.1, 0.01).known(np.zeros(1)) is None


def body_at(x: float, spread: float) -> SolidBody:
    """Two kilograms. spread: second moment in each direction, m2."""
    link = link_from_centre_of_mass(2.0, np.array([x, -0.2, 0.3]), 4 * spread * np.eye(3))
    return SolidBody.of_body(ARM, 3, np.asarray(link.parameters))


@pytest.mark.parametrize("size", [0.1, 0.01])
def test_what_physics_tells_of_a_body_is_its_spread_and_not_its_place(size: float) -> None:
    body = body_at(0.1, size**2)
    information = body.known(np.array([2.0]))
    assert information is not None
    grown, moved = (
        np.append(0.0, np.subtract(other.shape, body.shape))
        for other in (body_at(0.1, 1.01 * size**2), body_at(0.1 + 0.01 * size, size**2))
    )
    assert float(grown @ information @ grown) == pytest.approx(3 * 0.01**2)
    assert float(moved @ information @ moved) < 1e-6


def test_fewer_links_are_off_one_by_one_and_all() -> None:
    assert _fewer_off((0.5, 0.0, 0.1)) == [(0.0, 0.0, 0.1), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0)]
    assert _fewer_off((0.0, 0.0)) == []
    assert _fewer_off(None) == []


def test_what_no_body_can_be_is_an_error_of_the_link_and_no_payload(tmp_path: Path) -> None:
    assert not is_possible_body(np.array(PAYLOAD))
    folder = recording_in(tmp_path / "loaded", frame(21, mass=2.0), frame(22, mass=2.0))
    found = diagnose(load_recording(folder), "nominal")
    assert "payload" not in {each.effect for each in found.claims}
    (link,) = [each for each in found.claims if each.in_links]
    (mass,) = [each for each in link.parameters if each.name == "mass"]
    low, high = np.asarray(mass.interval)
    assert link.joint == 3
    assert low < 2.0 < high


def reason_beside(joint: int, size: float, depends_on: tuple[str, ...], link: int = 3) -> str | None:
    """Why a body at a link is not told, that joint 2 shows best and joint 1 does not feel. joint: of structure, from 1.

    size: of the structure, N m; that of the body is 10 at joint 2 and 5 at joint 3, each with a noise of 1 N m.
    """
    torque = np.sin(np.linspace(0, 20, 500))[:, None] * [1e-14, 10.0, 5.0]
    evidence = Evidence(1, 0.0, 0.0, 0.9, 0.0, 0.9, 9.0, 1.0, 500.0)
    load = Claim("payload", link, (link,), (), "", evidence, torque, candidate=SolidBody.of_body(ARM, link, BODY))
    left = Structure(joint - 1, 0.9, 1e-9, 0.9, 0.9, size * np.cos(np.linspace(0, 20, 500)), depends_on)
    return reason_link_unknown(load, [left], np.ones(3))


def test_a_link_whose_moment_of_inertia_would_surely_be_negative_is_not_told() -> None:
    nothing: Any = None
    given = np.zeros(30)
    given[16] = 0.024  # Izz of link 2, kg m2

    def reason(half: float) -> str | None:
        change = ParameterValue("Izz", -0.029, (-0.029 - half, -0.029 + half), "kg.m2")
        return reason_no_body(given, Claim("inertial_parameter_error", 2, (), (change,), "", nothing, nothing))

    assert reason(0.001) == "Izz of the link would be -0.004 kg.m2 at most"
    assert reason(0.006) is None
    assert reason_no_body(None, Claim("inertial_parameter_error", 2, (), (), "", nothing, nothing)) is None


def test_a_load_is_not_told_beside_structure_that_could_be_half_of_it() -> None:
    """Joint 2 tells four fifths of the load and joint 3 a fifth."""
    assert reason_beside(2, 5.0, ("position_2",)) is None
    assert "joint 2" in str(reason_beside(2, 7.0, ("position_2",)))
    assert reason_beside(3, 5.0, ("position_3",)) is None
    assert "joint 3" in str(reason_beside(3, 13.0, ("acceleration_3", "velocity_3")))
    assert "joint 3" in str(reason_beside(3, 13.0, ()))
    assert reason_beside(1, 6.0, ("position_1",)) is None


def test_friction_of_a_joint_that_a_load_hardly_moves_says_nothing_of_the_load() -> None:
    """At the joint that shows the load best it does, whatever it depends on."""
    assert reason_beside(3, 13.0, ("velocity_3", "torque_3")) is None
    assert reason_beside(3, 13.0, ("velocity_2",)) is not None
    assert reason_beside(2, 7.0, ("velocity_2",)) is not None


def test_structure_beyond_a_link_may_be_of_a_body_that_a_later_link_carries() -> None:
    assert "a later link" in str(reason_beside(3, 0.1, ("position_3",), link=2))
    assert reason_beside(3, 0.1, ("velocity_3",), link=2) is None
    assert reason_beside(3, 0.1, ("position_3",), link=3) is None


def test_a_prediction_has_no_body_of_negative_mass_whatever_its_form() -> None:
    """A last link that is lighter than its simulation asks for such a body."""
    arm = load_arm("irb120-arm")
    lighter = np.concatenate([each.parameters for each in arm.links])
    lighter[-10:] *= 0.7
    recording = cases.recording(inertial=lighter)
    model = fit_background(prepare(recording, None, Settings(), lambda message: None), library(), 0, lambda _: None)
    forms = set()
    for number, group in enumerate(model.solver.groups):
        if group.candidate.effect == "payload" and group.candidate.joint == len(arm):
            loaded: Any = SimpleNamespace(model=replace(model, state=State((number,), (0.0,) * len(arm))))
            before = group.candidate.added_body(model.solver.values(loaded.model.fit, number))
            with_possible_bodies(loaded)
            after = group.candidate.added_body(model.solver.values(loaded.model.fit, number))
            assert before is not None
            assert before[0] < 0 <= after[0]
            forms.add(type(group.candidate))
    assert forms == {Payload, PointPayload}


@pytest.mark.parametrize(("anew", "told"), [(2.05, True), (2.5, False), (None, True)])
def test_a_load_that_weighs_otherwise_when_found_anew_is_not_told(
    anew: float | None, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armlab.diagnosis.torque.evidence.plausibility.mass_found_anew", lambda model, link: anew)
    evidence = Evidence(1, 0.0, 0.0, 0.9, 0.0, 0.9, 9.0, 1.0, 500.0)
    mass = ParameterValue("mass", 2.0, (1.9, 2.1), "kg")
    body = SolidBody.of_body(ARM, 3, BODY)
    load = Claim("payload", 3, (3,), (mass,), "", evidence, np.zeros((5, 3)), candidate=body)
    model: Any = SimpleNamespace()
    assert (_reason_other_mass(model, load) is None) == told
