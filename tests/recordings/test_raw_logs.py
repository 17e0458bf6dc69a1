"""Logs as their makers left them, below the folder that ARMLAB_RECORDINGS names: what their import says."""

import shutil
from pathlib import Path
from typing import Any

import pytest
from recording_folders import IMPORT_OPTIONS

from armlab.recordings.check import check_recording
from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.public import local_copies

COPIES = local_copies()
MOTOR, SERVO = "raw-logs/hej90", "raw-logs/miuzei-servo"


def needs_log(name: str) -> pytest.MarkDecorator:
    is_there = COPIES is not None and (COPIES / name).is_dir()
    return pytest.mark.skipif(not is_there, reason=f"no {name} below ARMLAB_RECORDINGS")


def options_of(folder: Path, robot: str, **given: Any) -> dict[str, Any]:
    return {**IMPORT_OPTIONS, "robot": str(folder / robot), **given}


@needs_log(MOTOR)
@pytest.mark.parametrize("rows", [1000, 2000, 4000])
def test_a_stamp_that_comes_twice_is_spread_and_said_in_short_and_long_parts_of_a_log(
    tmp_path: Path, rows: int
) -> None:
    assert COPIES is not None
    (log,) = (COPIES / MOTOR).glob("*.csv")
    with log.open() as stream:
        (tmp_path / "log.csv").write_text("".join(line for _, line in zip(range(rows + 1), stream, strict=False)))
    given = options_of(COPIES / MOTOR, "joint.urdf", units=("position=rad", "torque=N.m"))
    plan = plan_import([tmp_path / "log.csv"], {**given, "out": tmp_path / "new"})
    assert [question.proposal for question in plan.questions] == ["posAct", "torAct"]
    imported = import_files(
        [tmp_path / "log.csv"], tmp_path / "new", {**given, "position": "posAct", "torque": "torAct"}
    )
    assert any(
        "have the stamp of a row beside them where the clock lost a tick; spread" in line for line in imported.lines
    )
    assert {"torDes", "torEst", "velAct"} <= set(imported.document["unused_columns"])
    assert not any("another robot" in doubt for doubt in imported.plan.doubts)


@needs_log(SERVO)
def test_a_filtered_servo_goes_in_with_its_drive_and_its_folder_opens_elsewhere(tmp_path: Path) -> None:
    assert COPIES is not None
    given = options_of(
        COPIES / SERVO,
        "robot.xml",
        position="q",
        reference_position="cmd",
        units=("position=rad", "reference_position=rad"),
    )
    (question,) = plan_import([COPIES / SERVO / "chirp1.csv"], {**given, "out": tmp_path / "new"}).questions
    assert question.proposal == "kp=25 kd=5 torque_limit=2.7 delay=0.1"
    stated = question.with_answer(given, question.proposal)
    folder = import_files([COPIES / SERVO / "chirp1.csv"], tmp_path / "new", stated).folder
    before = load_motion_recording(folder).arm.parameters
    elsewhere = tmp_path / "one" / "two" / "three" / "copy"
    elsewhere.parent.mkdir(parents=True)
    shutil.move(folder, elsewhere)
    assert load_motion_recording(elsewhere).arm.parameters == pytest.approx(before, abs=1e-12)
    assert not [each for _, each in check_recording(elsewhere).findings if each.severity == "warning"]
