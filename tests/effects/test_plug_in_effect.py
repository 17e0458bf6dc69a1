"""An effect of another package, installed by its entry point, has what a built-in effect has, from search to export."""

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import lip_seal
import numpy as np
import pandas as pd
import pytest
import yaml
from numpy.testing import assert_allclose

from armlab.diagnosis.next.question import Name
from armlab.diagnosis.next.verdict_file import read_verdict, select_rival_groups
from armlab.diagnosis.result import Rival
from armlab.diagnosis.torque.names.claims import next_experiment
from armlab.effects.library import effect_named, library
from armlab.identification.identifier import Identifier
from armlab.identification.model_file import read_model
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from armlab.recordings.load import load_recording
from armlab.report.torque.write import diagnose_recording
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
LEVEL, JOINT = 0.4, 2
LINK_FACTORS = (1.04, 0.97, 1.05)  # real links over those of the robot file
COULOMB, VISCOUS = np.array([1.0, 1.5, 0.7]), np.array([0.8, 1.0, 0.5])
RATE_HZ, SECONDS = 200.0, 10.0
PARTS = 20  # of a sample's interval, over which drives average friction


def seal_torque(velocity: Any, level: float = LEVEL) -> Any:
    """The hidden law, written anew."""
    return level * np.sign(velocity) / (1 + (0.5 / np.where(velocity == 0, 1e-9, velocity)) ** 2)


def motion_at(time: Any, seed: int) -> Motion:
    """Five harmonics of 0.2 Hz with exact derivatives."""
    omega = 2 * np.pi * 0.2 * np.arange(1, 6)
    a, b = np.random.default_rng(seed).normal(0, 0.3, (2, 5, 3)) / np.sqrt(np.arange(1, 6))[:, None]
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    velocity = (cosine * omega) @ a - (sine * omega) @ b
    return Motion(sine @ a + cosine @ b, velocity, -(sine * omega**2) @ a - (cosine * omega**2) @ b)


def run_table(seed: int) -> pd.DataFrame:
    """One run of an arm with other links than its file says, usual friction, the seal's, and noise."""
    time = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    motion = motion_at(time, seed)
    links = (ARM.parameters.reshape(3, 10) * np.array(LINK_FACTORS)[:, None]).ravel()
    shifts = ((np.arange(PARTS) + 0.5) / PARTS - 0.5) / RATE_HZ
    within = [motion_at(time + shift, seed).velocity for shift in shifts]
    torque = rigid_body_torque(ARM, motion, links) + VISCOUS * motion.velocity
    torque += COULOMB * np.mean(np.sign(within), axis=0)
    torque[:, JOINT - 1] += np.mean(seal_torque(np.array(within)[:, :, JOINT - 1]), axis=0)
    torque += np.random.default_rng(seed + 500).normal(0, 0.05, torque.shape)
    names = ["t", *(f"q{joint}" for joint in (1, 2, 3)), *(f"tau{joint}" for joint in (1, 2, 3))]
    return pd.DataFrame(np.column_stack([time, motion.position, torque]), columns=names)


def write_recording(folder: Path) -> Path:
    folder.mkdir()
    for seed in range(3):
        run_table(seed).to_csv(folder / f"run-{seed}.csv", index=False)
    content = {
        "schema": "recording/1",
        "robot": "irb120-arm",
        "columns": {"time": "t", "position": ["q1", "q2", "q3"], "torque": ["tau1", "tau2", "tau3"]},
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": f"run-{seed}.csv", "role": "validate" if seed == 2 else "identify"} for seed in range(3)],
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(content))
    return folder


@dataclass(frozen=True)
class Diagnosed:
    recording: Path
    out: Path
    lines: tuple[str, ...]

    @property
    def finding(self) -> dict[str, Any]:
        verdict = json.loads((self.out / "verdict.json").read_text())
        (finding,) = [each for each in verdict["findings"] if each["effect"] == "lip_seal_friction"]
        return dict(finding)


@pytest.fixture(scope="module", autouse=True)
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The package of the effect on the path, with the metadata that an installation writes."""
    site = tmp_path_factory.mktemp("site")
    information = site / "lip_seal-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: lip-seal\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[armlab.effects]\nlip-seal = lip_seal:LIP_SEAL\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(site))
        patch.setitem(sys.modules, "lip_seal", lip_seal)
        yield


@pytest.fixture(scope="module")
def diagnosed(installed: None, tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    folder = tmp_path_factory.mktemp("diagnosed")
    recording = write_recording(folder / "recording")
    return Diagnosed(
        recording, folder / "out", tuple(diagnose_recording(recording, folder / "out", None, 0, verbose=True))
    )


def test_the_library_lists_an_installed_effect_after_its_own() -> None:
    assert library()[-1] is lip_seal.LIP_SEAL
    assert effect_named("lip_seal_friction") is lip_seal.LIP_SEAL_FACTS


def test_a_diagnosis_finds_an_installed_effect_at_its_joint_and_its_interval_holds_the_truth(
    diagnosed: Diagnosed,
) -> None:
    level = diagnosed.finding["parameters"]["level"]
    assert (diagnosed.finding["joint"], level["unit"]) == (JOINT, "N.m")
    assert level["ci95"][0] < LEVEL < level["ci95"][1]
    assert level["ci95"][1] - level["ci95"][0] < 0.2 * LEVEL
    assert any("lip-seal friction at joint 2" in line for line in diagnosed.lines)


def test_nothing_else_is_named_beside_an_installed_effect_but_what_is_there(diagnosed: Diagnosed) -> None:
    verdict = json.loads((diagnosed.out / "verdict.json").read_text())
    named = {each["effect"] for each in verdict["findings"]}
    assert named == {"coulomb_friction", "viscous_friction", "inertial_parameter_error", "lip_seal_friction"}


def test_the_model_file_holds_an_installed_effect_and_predicts_with_it(diagnosed: Diagnosed, tmp_path: Path) -> None:
    content = yaml.safe_load((diagnosed.out / "model.yaml").read_text())
    (component,) = [each for each in content["components"] if each["effect"] == "lip_seal_friction"]
    content["components"].remove(component)
    (tmp_path / "without.yaml").write_text(yaml.safe_dump(content))
    motion = Motion(*np.random.default_rng(3).uniform(-1, 1, (3, 20, 3)))
    with_seal, without = (read_model(path) for path in (diagnosed.out / "model.yaml", tmp_path / "without.yaml"))
    added = with_seal.torque(motion) - without.torque(motion)
    found = component["parameters"]["level"]["value"]
    assert_allclose(added[:, JOINT - 1], seal_torque(motion.velocity[:, JOINT - 1], found), atol=1e-12)
    assert_allclose(np.delete(added, JOINT - 1, axis=1), 0.0, atol=1e-12)


def test_the_report_shows_an_installed_effect_by_its_title_and_meaning_against_its_axis(diagnosed: Diagnosed) -> None:
    page = (diagnosed.out / "report.html").read_text()
    begin = r'<details class="finding">\s*<summary>Lip-seal friction at joint 2 '
    article = re.search(rf"{begin}.*?</details>", page, re.DOTALL)
    assert article is not None
    assert lip_seal.LIP_SEAL_FACTS.meaning in article[0]
    assert "Lip-seal friction, joint 2: torque left without it against velocity of joint 2, rad/s" in article[0]


def test_the_line_of_friction_in_an_mjcf_stands_for_an_installed_law_of_friction(
    diagnosed: Diagnosed, tmp_path: Path
) -> None:
    lines = list(export_model(diagnosed.out / "model.yaml", tmp_path / "arm.xml"))
    (told,) = [line for line in lines if "lip-seal friction" in line]
    assert told.startswith("joint 2: friction loss ")
    assert "rms" in told
    content = yaml.safe_load((diagnosed.out / "model.yaml").read_text())
    levels = [
        each["parameters"]["level"]["value"]
        for each in content["components"]
        if each["effect"].endswith("friction") and each["joint"] == JOINT and "level" in each["parameters"]
    ]
    joint = list(ElementTree.parse(tmp_path / "arm.xml").getroot().iter("joint"))[JOINT - 1]
    assert 0 <= float(joint.attrib["frictionloss"]) < sum(levels)


def test_the_next_experiment_of_an_installed_effect_is_its_own_and_is_told_where_it_has_rivals() -> None:
    rivals = (Rival("nonlinear_viscous_friction", JOINT, (JOINT,), False),)
    wanted = "record slow motion with the seal in place and without it"
    assert next_experiment(lip_seal.LIP_SEAL_FACTS, rivals) == wanted
    assert next_experiment(lip_seal.LIP_SEAL_FACTS, ()) is None


def test_a_second_motion_can_be_asked_for_between_an_installed_effect_and_another(diagnosed: Diagnosed) -> None:
    verdict = read_verdict(diagnosed.out)
    (group,) = select_rival_groups(verdict, "lip_seal_friction,nonlinear_viscous_friction")
    assert group == (Name("lip_seal_friction", JOINT), Name("nonlinear_viscous_friction", JOINT))


def test_identification_fits_an_installed_effect_as_a_component(diagnosed: Diagnosed) -> None:
    recording = load_recording(diagnosed.recording)
    usual = [effect_named_at(name, joint) for name in ("coulomb_friction", "viscous_friction") for joint in (1, 2, 3)]
    seal = lip_seal.LipSealFriction.at(ARM, JOINT)
    structure = Structure(ARM, (*usual, seal))
    assert structure.names[-1] == "lip_seal_friction, joint 2: level"
    model = Identifier(ARM, structure.components).fit(recording.with_role("identify")).model_
    assert model.values[-1] == pytest.approx(LEVEL, abs=0.05)


def effect_named_at(name: str, joint: int) -> Any:
    """The candidate of a built-in effect at a joint, by the facts that stand in the library."""
    family = next(each for each in library() if each.effect == name)
    return family.from_parameters(
        ARM, (joint,), {each.name: 1.0 for each in family.facts.parameters if not each.detail}
    )[0]
