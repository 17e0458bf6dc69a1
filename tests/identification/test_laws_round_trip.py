"""A model that is exported into its own file and read again has the same torque: nothing is missing or doubled."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from robot_file_table import FILES

from armlab.effects.friction import CoulombFriction, ViscousFriction
from armlab.effects.scene import instants
from armlab.effects.springs import LinearSpring
from armlab.identification.model_file import write_model
from armlab.identification.nominal import nominal_model
from armlab.identification.torque_model import TorqueModel
from armlab.identification.write_simulator import export_model
from problem.arm import Arm
from problem.robot_file import load_arm
from problem.simulator_check import random_states

MJCF = (
    *("childclass_arm.xml", "ref_and_springref.xml", "gravity_partly_compensated.xml", "geared_actuators.xml"),
    *("three_joints_on_a_body.xml", "coupled_wrist.xml", "telescope_backwards.xml"),
)
URDF = ("damping_of_every_joint.urdf", "friction_alone.urdf", "lift_and_arm.urdf", "telescope_that_mimics.urdf")


def copied(name: str, folder: Path) -> Path:
    path = folder / name
    path.write_text((FILES / name).read_text())
    return path


def export(model: TorqueModel, folder: Path, suffix: str) -> Path:
    write_model(model, folder / "model.yaml")
    out = folder / f"exported{suffix}"
    for _ in export_model(folder / "model.yaml", out):
        pass
    return out


def torque_of(arm: Arm, model: TorqueModel | None) -> np.ndarray:
    assert model is not None
    return model.torque_in(instants(arm, random_states(arm, np.random.default_rng(2))))


@pytest.mark.parametrize("name", [*MJCF, *URDF])
def test_what_is_unchanged_stays_as_it_was_written(name: str, tmp_path: Path) -> None:
    path = copied(name, tmp_path)
    model = nominal_model(load_arm(str(path)), str(path))
    assert model is not None
    before, after = path.read_text(), export(model, tmp_path, path.suffix).read_text()
    assert after.replace(' solimpfriction="0.9999 0.9999 0.001 0.5 2.0"', "") == before


@pytest.mark.parametrize("name", [*MJCF, *URDF])
def test_an_exported_difference_is_there_once_when_it_is_read_again(name: str, tmp_path: Path) -> None:
    path = copied(name, tmp_path)
    arm = load_arm(str(path))
    model = nominal_model(arm, str(path))
    assert model is not None
    laws = [(CoulombFriction.at(arm, 1), [0.7]), (ViscousFriction.at(arm, 2), [0.4])]
    if path.suffix == ".xml":
        laws.append((LinearSpring.at(arm, 2), [2.0, -0.3]))
    parts = (*model.structure.components, *(law for law, _ in laws))
    values = np.concatenate([model.values, *(np.array(numbers) for _, numbers in laws)])
    found = replace(model, structure=model.structure.with_components(parts), values=values)
    read = load_arm(str(export(found, tmp_path, path.suffix)))
    expected = torque_of(arm, found)
    torque = torque_of(read, nominal_model(read, "exported"))
    np.testing.assert_allclose(torque, expected, atol=1e-6 * np.abs(expected).max())
