"""The drive of a log of commands: import, check and diagnosis say alike what they take for it."""

import re
import shutil
from pathlib import Path

import pandas as pd
import pytest
from recording_folders import IMPORT_OPTIONS
from refusals import refusal
from servo_arms import RATE_HZ, arm_text, commands, simulate

from armlab.recordings.check import check_recording
from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.motion import load_motion_recording
from armlab.report.motion.motion_write import diagnose_motion_recording

FILTERED = (
    '<general name="{joint}" joint="{joint}" dyntype="filter" dynprm="0.1" biastype="affine" gainprm="25" '
    'biasprm="0 -25 -5" forcerange="-2.7 2.7"/>'
)
STATED = "kp=25,25 kd=5,5 torque_limit=2.7,2.7 delay=0.1,0.1"


@pytest.fixture
def options(tmp_path: Path) -> dict[str, object]:
    """Of an import of two joints whose actuators filter their commands."""
    drives = "".join(FILTERED.format(joint=joint) for joint in ("shoulder", "elbow"))
    text = re.sub(r"<actuator>.*</actuator>", f"<actuator>{drives}</actuator>", arm_text(), flags=re.DOTALL)
    (tmp_path / "arm.xml").write_text(text)
    command = commands(0, 4.0)
    table = pd.DataFrame(simulate(arm_text(), command), columns=["q1", "q2"]).assign(c1=command[:, 0], c2=command[:, 1])
    table.assign(t=table.index / RATE_HZ).to_csv(tmp_path / "log.csv", index=False)
    return {
        **IMPORT_OPTIONS,
        "robot": str(tmp_path / "arm.xml"),
        "units": ("position=rad", "reference_position=rad"),
        "reference_position": "c1,c2",
        "out": tmp_path / "new",
    }


def test_a_filter_of_commands_is_a_question_with_the_servo_that_is_late_by_its_time_constant(
    options: dict[str, object], tmp_path: Path
) -> None:
    (question,) = plan_import([tmp_path / "log.csv"], options).questions
    assert (question.option, question.proposal) == ("controller", STATED)
    assert "filters its command" in question.missing
    assert f"--controller '{STATED}'" in question.missing


def test_a_drive_that_is_stated_is_written_and_read_by_check_and_diagnosis(
    options: dict[str, object], tmp_path: Path
) -> None:
    folder = import_files([tmp_path / "log.csv"], tmp_path / "new", {**options, "controller": "kp=25 kd=none,5"}).folder
    controller = load_motion_recording(folder).controller
    assert controller is not None
    assert (controller.kp, controller.kd) == ((25.0, 25.0), (None, 5.0))
    assert not [finding for _, finding in check_recording(folder).findings if finding.severity == "warning"]
    list(diagnose_motion_recording(folder, tmp_path / "verdict"))
    assert (tmp_path / "verdict" / "verdict.json").is_file()


def test_check_and_diagnosis_refuse_the_drive_in_the_words_of_the_import(
    options: dict[str, object], tmp_path: Path
) -> None:
    folder = import_files([tmp_path / "log.csv"], tmp_path / "new", {**options, "controller": STATED}).folder
    text = (folder / "recording.yaml").read_text()
    (folder / "recording.yaml").write_text(re.sub(r"controller:\n(  .*\n)+", "", text))
    words = "the actuator of joint 'shoulder' filters its command"
    assert words in refusal(check_recording, folder)
    assert words in refusal(lambda: list(diagnose_motion_recording(folder, tmp_path / "verdict")))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("kq=25", "should be KEY=VALUES: known: kp, kd"),
        ("kp=25,3,4 kd=5", "should hold one number, or 2, one a joint, not 3"),
        ("kp=stiff", "'stiff' is no number"),
        ("kd=5", "missing key 'kp'"),
    ],
)
def test_a_drive_that_cannot_be_read_is_refused(
    options: dict[str, object], tmp_path: Path, given: str, words: str
) -> None:
    assert words in refusal(plan_import, [tmp_path / "log.csv"], {**options, "controller": given})


def test_a_drive_belongs_to_a_log_without_torque(options: dict[str, object], tmp_path: Path) -> None:
    given = {**options, "torque": "c1,c2", "reference_position": None, "units": ("position=rad", "torque=N.m")}
    assert "without --torque" in refusal(plan_import, [tmp_path / "log.csv"], {**given, "controller": STATED})


def test_the_folder_of_an_arm_with_meshes_opens_elsewhere_without_them(
    options: dict[str, object], tmp_path: Path
) -> None:
    (tmp_path / "meshes").mkdir()
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    (tmp_path / "meshes" / "block.obj").write_text(corners)
    text = (tmp_path / "arm.xml").read_text()
    text = text.replace("<worldbody>", '<asset><mesh name="block" file="block.obj"/></asset><worldbody>', 1)
    text = re.sub(r"(<mujoco[^>]*>)", r'\1<compiler meshdir="meshes"/>', text, count=1)
    text = re.sub(r'<inertial pos="0.1[^>]*>', '<geom type="mesh" mesh="block" mass="0.3"/>', text, count=1)
    (tmp_path / "arm.xml").write_text(text)
    folder = import_files([tmp_path / "log.csv"], tmp_path / "new", {**options, "controller": STATED}).folder
    before = load_motion_recording(folder).arm
    elsewhere = tmp_path / "far" / "away" / "copy"
    elsewhere.parent.mkdir(parents=True)
    shutil.move(folder, elsewhere)
    shutil.rmtree(tmp_path / "meshes")
    after = load_motion_recording(elsewhere).arm
    assert before.parameters == pytest.approx(after.parameters, abs=1e-12)
