"""An arm whose third joint follows its second one: what its file says is the simulation, a finding is a difference."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from passive_parts_study import Sines
from refusals import refusal
from robot_file_table import FILES

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.identification.model_file import write_model
from armlab.identification.write_simulator import export_model
from armlab.recordings.check import check_recording
from armlab.recordings.load import load_recording
from armlab.recordings.motion import load_motion_recording
from problem.drive_torque import drive_torque
from problem.robot_file import load_arm

HIDDEN = 0.3  # N m, of the elbow beyond its file and that of the joint that it leads


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the arm with more friction at its elbow."""
    folder, rng = tmp_path_factory.mktemp("coupled"), np.random.default_rng(5)
    (folder / "arm.xml").write_text((FILES / "coupled_wrist.xml").read_text())
    arm = load_arm(str(folder / "arm.xml"))
    laws = [replace(law, friction=law.friction + HIDDEN * (joint == 1)) for joint, law in enumerate(arm.joint_laws)]
    for number in (1, 2):
        motion = Sines.draw(len(arm), rng).motion()
        torque = drive_torque(replace(arm, joint_laws=tuple(laws)), motion)
        torque += 0.003 * np.abs(torque).max(axis=0) * rng.standard_normal(torque.shape)
        table = np.column_stack([np.arange(len(torque)) / 250, motion.position, torque])
        pd.DataFrame(table, columns=["t", *"abcdef"]).to_csv(folder / f"run-{number}.csv", index=False)
    content = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {"time": "t", "position": list("abc"), "torque": list("def")},
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": "run-1.csv", "role": "identify"}, {"file": "run-2.csv", "role": "validate"}],
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(content))
    return folder


@pytest.fixture(scope="module")
def found(folder: Path) -> Diagnosis:
    return diagnose(load_recording(folder))


def test_friction_beyond_that_of_a_leader_and_its_follower_is_found_as_a_difference(found: Diagnosis) -> None:
    assert found.setup is None or not found.setup.findings
    assert [(claim.effect, claim.joint) for claim in found.claims] == [("coulomb_friction", 2)]
    level = found.claims[0].parameters[0]
    assert level.value == pytest.approx(HIDDEN, abs=0.02)


def test_nothing_is_missing_in_the_exported_file(folder: Path, found: Diagnosis, tmp_path: Path) -> None:
    assert found.model is not None
    write_model(found.model, folder / "model.yaml")
    shutil.copytree(folder, tmp_path / "again", ignore=shutil.ignore_patterns("arm.xml"))
    for _ in export_model(folder / "model.yaml", tmp_path / "again" / "arm.xml"):
        pass
    assert diagnose(load_recording(tmp_path / "again")).status == "none"


def test_the_check_says_which_joint_follows_which(folder: Path) -> None:
    said = [finding.text for _, finding in check_recording(folder).findings]
    assert any("level = -1.3 elbow - 0.05 (a coupled joint" in text for text in said)
    assert any("is that of MuJoCo to" in text for text in said)


def test_motion_only_of_a_coupled_arm_is_refused_by_name(folder: Path, tmp_path: Path) -> None:
    content = yaml.safe_load((folder / "recording.yaml").read_text())
    content["columns"]["reference_position"] = content["columns"].pop("torque")
    content["units"].pop("torque")
    (tmp_path / "recording.yaml").write_text(yaml.safe_dump(content))
    for name in ("arm.xml", "run-1.csv", "run-2.csv"):
        (tmp_path / name).write_text((folder / name).read_text())
    assert "joint 'level' follows 'elbow', which a recording of motion only cannot have" in refusal(
        load_motion_recording, tmp_path
    )
