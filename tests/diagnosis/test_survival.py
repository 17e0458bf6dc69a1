"""Names that survive: found again in torque that is simulated from the model found, and not where they are left out."""

import json

import engine_cases as cases
import numpy as np
import pytest
from shipped_schemas import check_against_schema

from armlab.common.arrays import Array
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.diagnose import diagnose, prepare
from armlab.diagnosis.torque.survival import _drawn_anew, _with_target
from armlab.report.torque.torque_verdict import verdict_lines
from armlab.report.verdict_files import make_verdict
from problem.motion import Motion

REPETITIONS = 1


def dry(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 2] = 0.8 * motion.velocity[:, 2] + np.sign(motion.velocity[:, 2])
    return torque


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose(cases.recording(dry, seconds=6.0), repetitions=REPETITIONS, as_read=True)


@pytest.fixture(scope="module")
def design() -> DesignMatrix:
    made = prepare(cases.recording(dry), None, Settings(), lambda message: None)
    assert isinstance(made, DesignMatrix)
    return made


def test_what_is_hidden_returns_and_does_not_appear_where_it_is_left_out(found: Diagnosis) -> None:
    survivals = {each.effect: each.survival for each in found.claims}
    assert survivals.keys() == {"viscous_friction", "coulomb_friction"}
    for each in survivals.values():
        assert each is not None
        assert (each.returned, each.simulated, each.appeared) == (REPETITIONS, REPETITIONS, 0)
    assert sum(each.left_out for each in survivals.values() if each) == REPETITIONS  # one of two findings each time


def test_verdict_and_terminal_tell_it(found: Diagnosis) -> None:
    content = json.loads(make_verdict(found).to_json())
    check_against_schema(content, "verdict")
    assert {each["survival"]["returned"] for each in content["findings"]} == {REPETITIONS}
    whole = f"returns in {REPETITIONS} of {REPETITIONS} simulated recordings"
    for verbose in (False, True):
        assert whole in " ".join(line.strip() for line in verdict_lines(found, verbose))


def test_residuals_are_drawn_from_rows_of_the_same_role_and_joints_stay_together(design: DesignMatrix) -> None:
    observed = design.observed
    left = np.zeros((observed.rows, observed.joints))
    for segment in observed.of_role("validate"):
        left[segment.start : segment.stop] = 1.0
    left *= 1 + np.arange(observed.rows)[:, None]
    drawn = _drawn_anew(left, observed, np.random.default_rng(3))
    held_out = np.any(left > 0, axis=1)
    assert np.array_equal(np.any(drawn > 0, axis=1), held_out)
    assert np.all(drawn == drawn[:, :1])
    assert set(drawn[held_out, 0]) <= set(left[held_out, 0])
    again = _drawn_anew(left, observed, np.random.default_rng(3))
    assert np.array_equal(drawn, again)


def test_another_torque_is_that_of_the_rows_and_of_what_is_explained(design: DesignMatrix) -> None:
    other = _with_target(design, design.target + 1.0)
    assert other.observed.torque == pytest.approx(design.observed.torque + 1.0)
    assert other.target == pytest.approx(design.target + 1.0)
