"""Friction that no formula fits is named as a curve, and friction that a formula fits never is."""

from collections.abc import Callable
from pathlib import Path

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.predict.found_model import model_found
from armlab.identification.model_file import read_model, write_model
from problem.motion import Motion

Law = Callable[[Array], Array]


def step(speed: Array) -> Array:
    """Two plateaus, 0.6 and 2.4 N m, with a rise at 1.2 rad/s."""
    return np.asarray(0.6 + 0.9 * (1 + np.tanh((speed - 1.2) / 0.2)))


def with_friction(*laws: Law) -> cases.Hidden:
    """Each joint with friction by a law of its speed."""

    def torque(motion: Motion, time: Array) -> Array:
        speed = np.abs(motion.velocity)
        within_sample = np.abs(motion.acceleration) / (2 * cases.RATE_HZ)
        direction = motion.velocity / np.maximum(speed, within_sample)  # its mean over the sample's interval
        return np.asarray(direction * np.stack([law(own) for law, own in zip(laws, speed.T, strict=True)], axis=1))

    return torque


STEP_AT_JOINT_2 = with_friction(lambda speed: 2.0 + 1.5 * speed, step, lambda speed: 1.0 + 0.8 * speed)


@pytest.fixture(scope="module")
def step_found() -> Diagnosis:
    return diagnose(cases.recording(STEP_AT_JOINT_2))


def test_friction_that_steps_between_plateaus_is_a_curve_through_both(step_found: Diagnosis) -> None:
    (claim,) = (each for each in step_found.claims if each.joint == 2)
    assert (claim.effect, claim.rivals) == ("friction_curve", ())
    velocities, torques = (np.array(each.value) for each in claim.parameters)
    slow, fast = (velocities > 0.1) & (velocities < 0.8), velocities > 1.6
    np.testing.assert_allclose(torques[slow], 0.6, atol=0.05)
    np.testing.assert_allclose(torques[fast], 2.4, atol=0.25)


def test_what_is_unknown_and_follows_the_own_velocity_of_a_joint_is_a_friction_curve(step_found: Diagnosis) -> None:
    (claim,) = (each for each in step_found.claims if each.joint == 2)
    assert claim.evidence.rms_after < claim.evidence.rms_before / 3
    assert "what is left at joint 2 is a friction curve" in {each.what for each in step_found.steps}


def test_the_model_of_a_curve_predicts_the_same_after_a_round_trip(step_found: Diagnosis, tmp_path: Path) -> None:
    model = model_found(step_found)
    again = read_model(write_model(model, tmp_path / "model.yaml"))
    (run,) = (run for run in step_found.recording.runs if run.role == "validate")
    np.testing.assert_allclose(again.predict(run), model.predict(run), atol=1e-9)


FORMULAS: dict[str, Law] = {
    "Coulomb and viscous": lambda speed: 1.5 + speed,
    "power": lambda speed: 1 + speed**1.7,
    "root": lambda speed: 1.5 * speed**0.4,
    "Stribeck": lambda speed: 1 + 0.8 * np.exp(-((speed / 0.1) ** 2)) + 0.5 * speed,
    "rational Stribeck": lambda speed: 1 + 0.8 / (1 + (speed / 0.1) ** 2) + 0.5 * speed,
    "Eyring": lambda speed: 0.5 + 0.6 * np.arcsinh(speed / 0.1),
}


@pytest.mark.parametrize(
    "names", [("Stribeck", "Coulomb and viscous", "power"), ("root", "Eyring", "rational Stribeck")], ids=", ".join
)
def test_friction_that_a_formula_fits_is_never_a_curve(names: tuple[str, ...]) -> None:
    """Three joints, each with a formula of its own."""
    found = diagnose(cases.recording(with_friction(*(FORMULAS[name] for name in names))))
    assert [(each.effect, each.joint) for each in found.claims if each.effect == "friction_curve"] == []
    assert {each.joint for each in found.claims} == {1, 2, 3}
