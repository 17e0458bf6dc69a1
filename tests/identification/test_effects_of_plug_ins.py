"""Models with effects that are more than linear terms: they predict by plug-ins, and keep their numbers in a file."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from refusals import refusal
from simulated_arm import arm, motion, run, structure, truth

from armlab.common.arrays import Array
from armlab.effects import library
from armlab.effects.friction import CoulombFriction
from armlab.effects.scene import Scene
from armlab.identification.components import every_joint
from armlab.identification.model import Model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import Run
from problem.motion import Motion
from problem.regressor import rigid_body_torque

LINEAR = structure(every_joint(arm(), CoulombFriction))


Told = dict[str, Any]


def entry(effect: str, joint: int | None, joints: tuple[int, ...] = (), form: str = "", **parameters: Any) -> Told:
    told = {name: {"value": value, "ci95": None, "unit": "1"} for name, value in parameters.items()}
    return {"effect": effect, "joint": joint, "joints": list(joints), "form": form, "parameters": told}


def plain() -> Model:
    return Model("irb120-arm", LINEAR, truth(LINEAR), inertial=arm().parameters, cutoff_hz=20.0)


def with_effects(folder: Path, *entries: Told) -> Model:
    path = plain().save(folder / "plain.yaml")
    content = yaml.safe_load(path.read_text())
    content["components"] += list(entries)
    changed = folder / "model.yaml"
    changed.write_text(yaml.safe_dump(content))
    return Model.load(changed)


def recorded() -> tuple[Run, Motion]:
    time, moved = motion(1, 4.0)
    return Run("run-1.csv", "validate", time, moved.position, np.zeros(moved.position.shape)), moved


def added(model: TorqueModel) -> Array:
    """What the effects of a model add to the plain one, (samples, joints)."""
    where, moved = recorded()
    return model.torque(moved, where) - plain().torque(moved, where)


EVERY = (
    entry("stribeck_friction", 1, level=1.0, static_level=1.5, velocity=0.1, exponent=2.0),
    entry("presliding_hysteresis", 1, level=1.0, stiffness=200.0),
    entry("friction_drift", 2, form="Coulomb over time", initial=2.0, final=1.0, time_constant=3.0),
    entry("torque_gain_error", 2, gain=1.1),
    entry("joint_elasticity", 2, stiffness=2e4),
    entry("backlash", 2, gap=1e-3),
    entry("joint_coupling", 2, (2, 3), inertia=0.1),
    entry("gravity_compensator", 2, amplitude=3.0, force=2.0, phase=0.3, ratio=0.5),
    entry("cable_stiffness", 3, stiffness=1.0, rest=0.2, cubic=0.3),
    entry("payload", 3, mass=1.0, centre=[0.05, 0.0, 0.1]),
    entry("base_tilt", None, gravity=[0.1, 0.2, -9.807]),
    entry("encoder_offset", 2, offset=0.01),
    entry("geometry_error", 2, form="d", offset=0.005),
    entry("time_delay", None, seconds=0.004),
    entry("channel_skew", 2, form="position", seconds=0.002),
    entry("torque_saturation", 2, limit=5.0),
)


@pytest.mark.parametrize("told", EVERY, ids=lambda told: told["effect"])
def test_a_model_with_any_effect_predicts_the_same_after_a_round_trip(told: Told, tmp_path: Path) -> None:
    model = with_effects(tmp_path, told)
    assert np.abs(added(model)).max() > 1e-4
    again = Model.load(model.save(tmp_path / "again.yaml"))
    np.testing.assert_allclose(added(again), added(model), atol=1e-12)
    written = yaml.safe_load((tmp_path / "again.yaml").read_text())["components"][-1]
    assert [written[key] for key in ("effect", "joint", "parameters")] == [
        told[key] for key in ("effect", "joint", "parameters")
    ]


def test_stribeck_friction_adds_its_law(tmp_path: Path) -> None:
    velocity = recorded()[1].velocity[:, 0]
    law = np.sign(velocity) * (1.0 + 0.5 * np.exp(-((velocity / 0.1) ** 2)))
    found = added(with_effects(tmp_path, EVERY[0]))[:, 0]
    moving = np.abs(velocity) > 0.05  # at a reversal it is a mean over the sample's interval
    np.testing.assert_allclose(found[moving], law[moving], atol=1e-12)


def test_a_model_tells_the_numbers_of_its_effects(tmp_path: Path) -> None:
    assert str(with_effects(tmp_path, EVERY[4])).endswith("joint 2: stiffness = 2e+04 1")


def test_a_form_decides_where_names_do_not(tmp_path: Path) -> None:
    lengths = [added(with_effects(tmp_path, entry("geometry_error", 2, form=form, offset=0.01))) for form in ("a", "d")]
    assert not np.allclose(*lengths, atol=1e-3)


def test_a_gain_acts_on_every_other_effect_and_not_on_itself(tmp_path: Path) -> None:
    spring = entry("cable_stiffness", 2, stiffness=4.0, rest=0.2, cubic=1.0)
    both = added(with_effects(tmp_path, entry("torque_gain_error", 2, gain=1.1), spring))[:, 1]
    alone = added(with_effects(tmp_path, spring))[:, 1]
    where, moved = recorded()
    np.testing.assert_allclose(both, 1.1 * alone + 0.1 * plain().torque(moved, where)[:, 1], atol=1e-9)


def test_prediction_of_a_run_gives_effects_its_times(tmp_path: Path) -> None:
    model = with_effects(tmp_path, EVERY[2])
    predicted = model.predict(run(LINEAR, truth(LINEAR), 1, seconds=8.0))
    assert predicted.shape[1] == 3
    with pytest.raises(ValueError, match=r"friction_drift .* needs the run"):
        model.torque(recorded()[1])


def test_filtered_torque_has_the_effects_in_it(tmp_path: Path) -> None:
    model = with_effects(tmp_path, EVERY[0])
    signals = model.signals(run(LINEAR, truth(LINEAR), 1, seconds=8.0))
    difference = model.filtered_torque(signals) - plain().filtered_torque(signals)
    expected = signals.filter(model.torque(signals.motion, signals.run) - plain().torque(signals.motion, signals.run))
    np.testing.assert_allclose(difference, expected, atol=1e-9)
    assert np.abs(difference[:, 0]).max() > 0.5


@pytest.mark.parametrize(
    ("told", "message"),
    [
        (entry("sticky_seal", 1, level=1.0), "unknown effect 'sticky_seal'"),
        (entry("stribeck_friction", 1, level=1.0), "stribeck_friction has parameters level, static_level"),
        (entry("joint_elasticity", 9, stiffness=1.0), "joints [9] should be from 1 to 3"),
        (entry("geometry_error", 1, form="b", offset=1.0), "has the forms a, d, alpha, y, not b"),
        (entry("external_contact", 1, start=1.0, end=2.0, peak=3.0), "belongs to one run"),
    ],
)
def test_an_effect_that_cannot_be_computed_is_refused_with_its_place(told: Told, message: str, tmp_path: Path) -> None:
    refused = refusal(with_effects, tmp_path, told)
    assert f"components[3] ({told['effect']}): " in refused
    assert message in refused


def test_a_broken_plug_in_is_told_in_one_line_where_its_effect_may_be_meant(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    entries = [EntryPoint("own", "no_such_module:X", "armlab.effects")]
    monkeypatch.setattr(library, "entry_points", lambda group: entries)
    assert "effect 'own' (no_such_module:X) cannot be imported" in refusal(
        with_effects, tmp_path, {**EVERY[0], "effect": "own"}
    )


def test_a_scene_knows_what_its_links_need() -> None:
    where, moved = recorded()
    scene = Scene("run-1.csv", where.time, moved, arm(), arm().parameters, np.zeros(moved.position.shape))
    np.testing.assert_array_equal(scene.rigid_torque, rigid_body_torque(arm(), moved))
    assert scene.step == pytest.approx(1 / 250)
    assert replace(scene, inertial=2 * scene.inertial).rigid_torque == pytest.approx(2 * scene.rigid_torque)
