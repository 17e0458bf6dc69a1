"""The whole engine on small recordings: what is hidden is named, and nothing else is."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import engine_cases as cases
import numpy as np
import pytest
import yaml
from shipped_schemas import check_against_schema

from armlab.common.arrays import Array
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.diagnose import _only_if_explained, diagnose
from armlab.diagnosis.torque.names.findings import statement_of
from armlab.identification.identifier import Identifier
from armlab.recordings.recording import Role
from armlab.report.account.summary import summary_of
from armlab.report.verdict_files import make_verdict, write_verdict
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

SLIGHT = 0.006  # N m s/rad: some ten standard errors of noise


def viscous(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 2] = 0.8 * motion.velocity[:, 2]
    return torque


def friction_everywhere(motion: Motion, time: Array) -> Array:
    return np.asarray(motion.velocity * [1.5, 1.2, 0.8] + np.sign(motion.velocity) * [2.0, 1.5, 1.0])


def product_of_positions(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 1] = 2.0 * np.sin(4 * motion.position[:, 0]) * motion.position[:, 2]
    return torque


def read_wrongly(reading: Callable[[Array], Array]) -> cases.Hidden:
    """What is read of the torque of joint 2 beside the torque itself."""

    def hidden(motion: Motion, time: Array) -> Array:
        torque = np.zeros(motion.position.shape)
        torque[:, 1] = reading(rigid_body_torque(load_arm("irb120-arm"), motion)[:, 1])
        return torque

    return hidden


@pytest.fixture(scope="module")
def viscous_found() -> Diagnosis:
    return diagnose(cases.recording(viscous))


def test_nothing_is_claimed_where_nothing_is_hidden() -> None:
    found = diagnose(cases.recording())
    assert (found.status, found.claims, found.unexplained) == ("none", (), ())


def test_hidden_viscous_friction_is_the_only_finding_with_an_interval_around_the_truth(
    viscous_found: Diagnosis,
) -> None:
    (claim,) = viscous_found.claims
    (coefficient,) = claim.parameters
    assert (claim.effect, claim.joint) == ("viscous_friction", 3)
    assert np.ptp(coefficient.interval) < 0.02
    assert coefficient.interval[0] < 0.8 < coefficient.interval[1]


def test_a_scale_that_is_not_straight_speaks_against_a_wrong_gain() -> None:
    straight = diagnose(cases.recording(read_wrongly(lambda torque: 0.03 * torque)))
    assert [(each.effect, each.joint) for each in straight.claims] == [("torque_gain_error", 2)]
    bent = diagnose(cases.recording(read_wrongly(lambda torque: 0.001 * torque**2)))
    assert lacking(straight) == 0
    assert lacking(bent) > 10
    assert straight.claims[0].members == ()
    assert "unknown" in [each.effect for each in bent.claims[0].members]


def test_a_scale_that_differs_by_sign_is_a_wrong_gain_and_the_name_of_a_square_that_looks_like_it_is_not_stated() -> (
    None
):
    by_sign = diagnose(cases.recording(read_wrongly(lambda torque: 0.03 * np.abs(torque))))
    assert [(each.effect, each.joint, each.members) for each in by_sign.claims] == [("torque_gain_error", 2, ())]
    assert lacking(by_sign) == 0
    square = diagnose(cases.recording(read_wrongly(lambda torque: 0.001 * torque**2 + 0.01 * torque), seconds=10.0))
    assert "name" not in {statement_of(each).kind for each in square.claims}


def lacking(found: Diagnosis) -> float:
    """By how much the log evidence of a wrong gain, which the search found, is below that of the best law."""
    own = next(each for each in found.weighed[0] if each.effect == "torque_gain_error")
    assert own.numbers["found searched"] == 1
    return float(np.expm1(own.numbers["found deficit"]))


def test_small_torques_that_are_lost_have_no_name_and_depend_on_the_torque() -> None:
    band = 0.5
    lost = diagnose(
        cases.recording(
            read_wrongly(lambda torque: -band * np.tanh(torque / band) * np.exp(-((torque / 2 / band) ** 2)))
        )
    )
    unknown = [each for each in lost.claims if each.effect == "unknown"]
    assert [(each.joint, each.depends_on[0]) for each in unknown] == [(2, "torque_2")]


def test_the_gap_between_refitted_arm_and_noise_is_closed(viscous_found: Diagnosis) -> None:
    gap = viscous_found.fit[2].gap_closed
    assert gap is not None
    assert gap > 0.98


def test_excess_error_is_located_at_the_guilty_joint(viscous_found: Diagnosis) -> None:
    assert viscous_found.located[0].joint == 3
    assert viscous_found.located[0].share > 0.99


def test_verdict_is_valid_json_of_its_schema(viscous_found: Diagnosis) -> None:
    check_against_schema(json.loads(make_verdict(viscous_found).to_json()), "verdict")


def test_files_are_written_whole_and_the_model_follows_its_schema(viscous_found: Diagnosis, tmp_path: Path) -> None:
    write_verdict(viscous_found, tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["model.yaml", "verdict.json"]
    model = yaml.safe_load((tmp_path / "out" / "model.yaml").read_text())
    check_against_schema(model, "model")
    assert [part["effect"] for part in model["components"] if part.get("claimed", True)] == ["viscous_friction"]
    present = [part for part in model["components"] if not part.get("claimed", True)]
    assert {part["effect"] for part in present} >= {"coulomb_friction", "torque_offset"}


def test_the_same_seed_gives_the_same_verdict(viscous_found: Diagnosis) -> None:
    assert make_verdict(diagnose(cases.recording(viscous))) == make_verdict(viscous_found)


def test_friction_on_every_joint_of_an_arm_with_wrong_links_is_named_as_such() -> None:
    real = load_arm("irb120-arm").parameters * np.repeat([1.06, 0.95, 1.05], 10)
    found = diagnose(cases.recording(friction_everywhere, inertial=real))
    friction = {("viscous_friction", joint) for joint in (1, 2, 3)} | {
        ("coulomb_friction", joint) for joint in (1, 2, 3)
    }
    named = {(claim.effect, claim.joint) for claim in found.claims}
    assert friction <= named
    assert {effect for effect, _ in named - friction} <= {"inertial_parameter_error"}


@pytest.mark.parametrize("coefficient", [0.3, 2.0])
def test_one_law_of_velocity_is_not_told_as_coulomb_and_viscous_friction(coefficient: float) -> None:
    def thin_oil(motion: Motion, time: Array) -> Array:
        torque, velocity = np.zeros(motion.position.shape), motion.velocity[:, 1]
        torque[:, 1] = coefficient * np.sign(velocity) * np.abs(velocity) ** 0.4
        return torque

    (claim,) = diagnose(cases.recording(thin_oil)).claims
    assert (claim.effect, claim.joint) == ("nonlinear_viscous_friction", 2)
    assert {each.name: each.value for each in claim.parameters}["exponent"] == pytest.approx(0.4, abs=0.05)


def test_what_is_too_small_for_a_name_is_no_claim_where_links_may_be_off() -> None:
    def slight(motion: Motion, time: Array) -> Array:
        torque = np.zeros(motion.position.shape)
        torque[:, 1] = SLIGHT * motion.velocity[:, 2]
        return torque

    assert not diagnose(cases.recording(slight, seconds=10.0)).claims


def test_structure_outside_the_library_is_called_unknown_with_what_it_depends_on() -> None:
    found = diagnose(cases.recording(product_of_positions, seconds=12.0))
    unknown = [claim for claim in found.claims if claim.effect == "unknown"]
    assert [claim.joint for claim in unknown] == [2]
    assert set(found.unexplained[0].depends_on) & {"position_1", "position_3"}
    assert unknown[0].evidence.rms_after < 0.8 * unknown[0].evidence.rms_before
    assert found.fit[1].after > 0.8 * found.fit[1].before  # the surrogate is no part of the model


def test_torque_of_the_wrong_sign_is_read_rightly_and_its_friction_found() -> None:
    good = cases.recording(friction_everywhere)
    turned = replace(good, runs=tuple(run.with_signals(run.time, {"torque": -run.torque}) for run in good.runs))
    found = diagnose(turned)
    assert summary_of(found).startswith("The recording is read wrongly: the torque of all joints has the other sign.")
    assert {each.joint for each in found.claims if each.effect == "viscous_friction"} == {1, 2, 3}


def test_torque_in_another_unit_is_read_rightly_and_the_factor_told() -> None:
    good = cases.recording(friction_everywhere)
    scaled = replace(good, runs=tuple(run.with_signals(run.time, {"torque": 1000 * run.torque}) for run in good.runs))
    found = diagnose(scaled)
    assert "the torque of all joints is 1000 times the true one: another unit" in summary_of(found)
    assert {each.joint for each in found.claims if each.effect == "viscous_friction"} == {1, 2, 3}


@pytest.mark.parametrize(("fitted", "status"), [(0.1, "mismatch"), (0.9, "inconclusive")])
def test_physics_that_does_not_carry_over_is_told_and_what_nothing_explains_is_not(
    viscous_found: Diagnosis, fitted: float, status: str
) -> None:
    left: dict[Role, float] = {"identify": fitted, "validate": 0.9}
    found = _only_if_explained(replace(viscous_found, left=left), None, Settings().tuning.reading)
    assert found.status == status
    told = summary_of(found).replace("\N{NO-BREAK SPACE}", " ")
    assert ("leaves 10 % where it was fitted, and 90 % where it was not" in told) == (fitted < 0.5)
    assert "viscous friction" in told or fitted > 0.5


def test_an_arm_that_never_moves_is_inconclusive() -> None:
    good = cases.recording()
    still = replace(good, runs=tuple(run.with_signals(run.time, {"position": 0 * run.position}) for run in good.runs))
    assert diagnose(still).status == "inconclusive"


def test_a_recording_of_a_second_is_inconclusive() -> None:
    assert diagnose(cases.recording(seconds=0.9)).status == "inconclusive"


def test_a_model_of_base_parameters_alone_can_be_the_simulation(tmp_path: Path) -> None:
    plain = cases.recording()
    identified = Identifier(plain.arm, (), "weighted", robot="irb120-arm").fit(plain.with_role("identify"))
    path = identified.model_.save(tmp_path / "model.yaml")
    found = diagnose(replace(cases.recording(viscous), simulation=path))
    assert [(each.effect, each.joint) for each in found.claims] == [("viscous_friction", 3)]
