from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from shipped_schemas import check_against_schema
from simulated_arm import arm, motion, run, structure, truth

from armlab.common.errors import InputError
from armlab.effects.contact import Contact
from armlab.effects.drive import RotorInertia
from armlab.effects.friction import Levels, LoadFriction, PowerFriction, ViscousFriction
from armlab.effects.scene import instants
from armlab.effects.springs import SpringCompensator, TorqueRipple
from armlab.identification.components import every_joint, wrist_couplings
from armlab.identification.identifier import Identifier
from armlab.identification.model import Model

PARTS = (
    *every_joint(arm(), ViscousFriction),
    *every_joint(arm(), Levels),
    *every_joint(arm(), PowerFriction, shape=(0.5,)),
    *wrist_couplings(arm()),
    RotorInertia.at(arm(), 3),
    SpringCompensator.at(arm(), 2),
    TorqueRipple.at(arm(), 1, shape=(7.0,)),
    LoadFriction.at(arm(), 2),
)


@lru_cache
def model(method: str = "weighted") -> Model:
    plain = structure()
    recorded = run(plain, truth(plain), noise=0.05)
    return Identifier(arm(), PARTS, method, robot="irb120-arm").fit([recorded]).model_


@pytest.mark.parametrize("method", ["weighted", "physical"])
def test_a_model_predicts_the_same_after_a_round_trip(tmp_path: Path, method: str) -> None:
    if method == "physical":
        pytest.importorskip("clarabel")
    saved = model(method)
    loaded = Model.load(saved.save(tmp_path / "model.yaml"))
    moved = motion(9)[1]
    assert_allclose(loaded.torque(moved), saved.torque(moved), rtol=1e-6, atol=1e-6)
    assert loaded.cutoff_hz == saved.cutoff_hz
    assert (loaded.inertial is None) == (saved.inertial is None)


def test_a_loaded_model_tells_the_same_intervals_as_the_one_that_was_saved(tmp_path: Path) -> None:
    saved = model()
    loaded = Model.load(saved.save(tmp_path / "model.yaml"))
    assert str(loaded) == str(saved)
    again = Model.load(loaded.save(tmp_path / "again.yaml"))
    assert str(again) == str(saved)


def test_intervals_that_a_file_does_not_give_are_not_told(tmp_path: Path) -> None:
    path = model().save(tmp_path / "model.yaml")
    content = yaml.safe_load(path.read_text())
    content["components"][0]["parameters"]["coefficient"]["ci95"] = None
    del content["base_parameters"]["covariance"]
    path.write_text(yaml.safe_dump(content))
    loaded = Model.load(path)
    assert all(each.interval is None for each in (*loaded.base_parameters, *loaded.component_parameters(0)))
    assert loaded.component_parameters(1)[0].interval is not None


def test_a_covariance_of_the_wrong_size_is_refused(tmp_path: Path) -> None:
    path = model().save(tmp_path / "model.yaml")
    content = yaml.safe_load(path.read_text())
    content["base_parameters"]["covariance"] = [[1.0]]
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match="covariance should be 15 x 15"):
        Model.load(path)


def test_the_filters_of_the_identification_are_kept_in_the_file(tmp_path: Path) -> None:
    plain = structure()
    recorded = run(plain, truth(plain), noise=0.05)
    saved = Identifier(arm(), (), cutoff_hz=8.0, robot="irb120-arm", position_factor=2.0).fit([recorded]).model_
    loaded = Model.load(saved.save(tmp_path / "model.yaml"))
    assert (loaded.cutoff_hz, loaded.position_factor) == (8.0, 2.0)
    assert loaded.signals(recorded).position_cutoff_hz == 16.0


def test_a_model_file_follows_the_schema(tmp_path: Path) -> None:
    content = yaml.safe_load(model().save(tmp_path / "model.yaml").read_text())
    check_against_schema(content, "model")
    viscous = content["components"][0]
    assert viscous["effect"] == "viscous_friction"
    low, high = viscous["parameters"]["coefficient"]["ci95"]
    assert low < viscous["parameters"]["coefficient"]["value"] < high
    assert viscous["parameters"]["coefficient"]["unit"] == "N.m.s/rad"


def test_a_coupling_names_where_the_torque_is_and_where_the_motion_is(tmp_path: Path) -> None:
    content = yaml.safe_load(model().save(tmp_path / "model.yaml").read_text())
    couplings = [entry["joints"] for entry in content["components"] if entry["effect"] == "joint_coupling"]
    assert couplings == [[2, 3], [3, 2]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint": 7, "joints": [7]}, r"joints \[7\] should be from 1 to 3"),
        (
            {"parameters": {"level": {"value": 1.0, "ci95": None, "unit": "N.m"}}},
            "viscous_friction has parameters coefficient, not level",
        ),
        ({"effect": "stribeck_friction"}, "stribeck_friction has parameters level, static_level, velocity, exponent"),
    ],
)
def test_a_wrong_component_is_told_in_one_line(tmp_path: Path, change: dict[str, object], message: str) -> None:
    path = model().save(tmp_path / "model.yaml")
    content = yaml.safe_load(path.read_text())
    content["components"][0] |= change
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=message):
        Model.load(path)


def test_base_parameters_of_another_arm_are_refused(tmp_path: Path) -> None:
    path = model().save(tmp_path / "model.yaml")
    path.write_text(path.read_text().replace("robot: irb120-arm", "robot: irb120"))
    with pytest.raises(InputError, match="base_parameters are not those of irb120"):
        Model.load(path)


def test_links_alone_are_enough_for_a_model(tmp_path: Path) -> None:
    links = [
        {"mass": link.mass, "first_moment": list(link.first_moment), "inertia": list(link.inertia)}
        for link in arm().links or ()
    ]
    content = {"schema": "model/1", "robot": "irb120-arm", "links": links, "components": []}
    path = tmp_path / "model.yaml"
    path.write_text(yaml.safe_dump(content))
    moved = motion(3)[1]
    loaded = Model.load(path)
    expected = structure(()).matrix(instants(arm(), moved)) @ loaded.structure.base.values(arm().parameters)
    assert_allclose(loaded.torque(moved).ravel(), expected)


def test_a_printed_model_tells_intervals_and_units() -> None:
    text = str(model())
    assert "viscous_friction, joint 2: coefficient = " in text
    assert "N.m.s/rad" in text
    assert np.char.count(text, "[") > 10


def test_what_happened_once_is_no_component_of_a_file(tmp_path: Path) -> None:
    """A push belongs to one run: a file with it could not be read."""
    known, push = model(), Contact.at(arm(), 2, shape=(1.0, 2.0))
    pushed = known.structure.with_components((*known.structure.components, push))
    saved = replace(known, structure=pushed, values=np.append(known.values, 0.5), covariance=None, stated=())
    content = yaml.safe_load(saved.save(tmp_path / "model.yaml").read_text())
    parts = [each.effect for each in known.structure.components]
    assert [each["effect"] for each in content["components"]] == parts
    (told,) = content["provenance"]["of_one_run"]
    assert told.startswith("tau_2 += up to 0.5")
    assert [each.effect for each in Model.load(tmp_path / "model.yaml").structure.components] == parts
