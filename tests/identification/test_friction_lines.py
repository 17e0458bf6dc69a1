"""All friction of a joint as one line of Coulomb and viscous friction, as simulators have it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.effects.library import family_named
from armlab.effects.scene import Scene, instants
from armlab.identification.export import build_simulator_model, has_place_in_simulator
from armlab.identification.friction_lines import FrictionLine, friction_lines, line_in_words
from armlab.identification.model import Model
from armlab.identification.model_file import read_model
from armlab.identification.recorded_motion import RecordedMotion
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from problem.motion import Motion
from problem.pseudo_inertia import parameters_of, regular_nominal
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
LINKS = parameters_of(regular_nominal(ARM))
MOTION = RecordedMotion(speeds=np.tile([0.5, 1.0, 1.5, 2.0], (3, 1)), load=np.array([4.0, 5.0, 6.0]), duration=10.0)

COULOMB = ("coulomb_friction", {"level": 2.0})
VISCOUS = ("viscous_friction", {"coefficient": 3.0})
QUADRATIC = {"coefficient": 0.8, "exponent": 2.0}
Law = tuple[str, Mapping[str, Any]]


def model_with(*laws: Law, joint: int = 2, motion: RecordedMotion | None = MOTION) -> Model:
    """A model of an arm with laws at one joint."""
    made = [family_named(name).from_parameters(ARM, (joint,), values) for name, values in laws]
    structure = Structure(ARM, tuple(candidate for candidate, _ in made))
    values = np.concatenate([structure.base.values(LINKS), *(coefficients for _, coefficients in made)])
    return Model("irb120-arm", structure, values, inertial=LINKS, motion=motion)


def line_of(*laws: Law) -> FrictionLine:
    return friction_lines(model_with(*laws))[1]


def test_coulomb_and_viscous_friction_stay_as_they_are_with_or_without_a_recorded_motion() -> None:
    for motion in (MOTION, None):
        lines = friction_lines(model_with(COULOMB, VISCOUS, joint=3, motion=motion))
        assert lines == (FrictionLine(1, 0.0, 0.0), FrictionLine(2, 0.0, 0.0), FrictionLine(3, 2.0, 3.0))


def test_a_law_of_powers_and_the_line_beside_it_become_the_line_of_least_squares() -> None:
    found = line_of(COULOMB, ("viscous_friction", {"coefficient": -0.2}), ("nonlinear_viscous_friction", QUADRATIC))
    speeds = MOTION.speeds[0]
    torque = 2.0 - 0.2 * speeds + 0.8 * speeds**2
    slope, level = np.polyfit(speeds, torque, 1)
    assert (found.level, found.slope) == pytest.approx((level, slope))
    rms = np.sqrt(np.mean((torque - level - slope * speeds) ** 2))
    assert (found.rms, found.share) == pytest.approx((rms, rms / np.sqrt(np.mean(torque**2))))
    assert found.laws == ("Coulomb friction", "viscous friction", "nonlinear viscous friction")


@pytest.mark.parametrize(
    ("laws", "level", "slope"),
    [
        ((COULOMB, ("load_dependent_friction", {"coefficient": 0.1})), 2.5, 0.0),  # 5 N m of load
        ((("asymmetric_friction", {"positive": 3.0, "negative": 1.0, "exponent": 0.0}),), 2.0, 0.0),
        ((("presliding_hysteresis", {"level": 1.5, "stiffness": 300.0}), VISCOUS), 1.5, 3.0),
        ((("friction_drift", {"initial": 4.0, "final": 4.0, "time_constant": 5.0}),), 0.0, 4.0),
        ((("friction_curve", {"velocities": [0.0, 1.0, 2.0], "torques": [1.0, 4.0, 7.0]}),), 1.0, 3.0),
    ],
)
def test_each_kind_of_friction_has_its_part_in_the_line(laws: tuple[Law, ...], level: float, slope: float) -> None:
    found = line_of(*laws)
    assert (found.level, found.slope) == pytest.approx((level, slope), abs=1e-9)


def test_friction_that_drifts_counts_as_its_mean_over_the_run() -> None:
    found = line_of(("friction_drift", {"initial": 6.0, "final": 2.0, "time_constant": 2.0}))
    time = np.linspace(0, MOTION.duration, 10_000)
    assert found.slope == pytest.approx(2.0 + 4.0 * np.exp(-time / 2.0).mean(), rel=0.05)


@settings(max_examples=30, deadline=None)
@given(level=st.floats(-5, 5), slope=st.floats(-5, 5), power=st.floats(-5, 5), exponent=st.floats(0.3, 3))
def test_neither_number_of_a_line_is_negative(level: float, slope: float, power: float, exponent: float) -> None:
    laws: list[Law] = [("coulomb_friction", {"level": level}), ("viscous_friction", {"coefficient": slope})]
    for more in ([], [("nonlinear_viscous_friction", {"coefficient": power, "exponent": exponent})]):
        found = line_of(*laws, *more)
        assert min(found.level, found.slope) >= 0


def test_a_negative_rotor_inertia_is_not_in_the_file_and_that_is_told(tmp_path: Path) -> None:
    model = model_with(("rotor_inertia", {"inertia": -0.01}))
    assert_allclose(build_simulator_model(model).field("armature"), 0.0)
    lines = list(export_model(model.save(tmp_path / "model.yaml"), tmp_path / "arm.xml"))
    assert any(line.startswith("the rotor inertia of joint 2 is negative") for line in lines)
    assert 'armature="-' not in (tmp_path / "arm.xml").read_text()


def test_an_export_says_what_a_line_stands_for_and_how_far_it_is_from_that(tmp_path: Path) -> None:
    model = model_with(COULOMB, ("nonlinear_viscous_friction", QUADRATIC))
    lines = list(export_model(model.save(tmp_path / "model.yaml"), tmp_path / "arm.xml"))
    words = line_in_words(ARM, friction_lines(model)[1])
    assert words in lines
    assert words.startswith("joint 2: friction loss ")
    assert "stand for Coulomb friction and nonlinear viscous friction; at the speeds of the recording" in words
    assert not any("not in the file" in line for line in lines)


def test_friction_that_is_no_line_needs_the_speeds_of_a_recording() -> None:
    model = model_with(COULOMB, ("nonlinear_viscous_friction", QUADRATIC), motion=None)
    with pytest.raises(InputError, match=r"joint 2 .* does not say how fast the joint moved"):
        friction_lines(model)


def test_any_friction_of_a_joint_has_a_place_in_a_simulator() -> None:
    candidate, values = family_named("load_dependent_friction").from_parameters(ARM, (1,), {"coefficient": 0.1})
    assert has_place_in_simulator(candidate, values)


def scene_with(velocity: Array) -> Scene:
    return replace(instants(ARM, Motion(np.zeros_like(velocity), velocity, np.zeros_like(velocity))), run="a")


def test_a_recorded_motion_has_equal_shares_of_the_time_that_a_joint_moves() -> None:
    velocity = np.zeros((400, 3))
    velocity[:200, 0] = np.linspace(-2, 2, 200)
    motion = RecordedMotion.of([scene_with(velocity)], LINKS)
    shares = (np.arange(20) + 0.5) / 20
    assert_allclose(motion.speeds[0], 2 * shares, atol=0.02)
    assert_allclose(motion.speeds[1:], 0.0)
    gravity = np.abs(rigid_body_torque(ARM, Motion(*np.zeros((3, 1, 3))), LINKS)[0])  # it stands in its zero position
    assert_allclose(motion.load[1:], gravity[1:], rtol=0.1)


def test_a_recorded_motion_is_the_same_after_a_round_trip(tmp_path: Path) -> None:
    warm = replace(MOTION, temperature=np.array([31.5]))
    again = read_model(model_with(COULOMB, motion=warm).save(tmp_path / "model.yaml")).motion
    assert again is not None
    assert again.temperature is not None
    assert_allclose(again.speeds, warm.speeds)
    assert_allclose(again.load, warm.load)
    assert (again.duration, again.temperature.tolist()) == (10.0, [31.5])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"load": [1.0]}, "motion.speeds and motion.load should have 3 entries"),
        ({"speeds": [[1.0], [1.0], []]}, "equally many speeds"),
        ({"speeds": [[1.0], [-1.0], [1.0]]}, "greater than or equal to 0"),
    ],
)
def test_a_recorded_motion_that_does_not_fit_is_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = model_with(COULOMB).save(tmp_path / "model.yaml")
    content = yaml.safe_load(path.read_text())
    content["motion"] |= change
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=message):
        read_model(path)
