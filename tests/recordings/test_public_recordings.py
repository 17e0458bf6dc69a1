"""Public recordings: the right raw files, and conversions that the equations of motion confirm.

The raw files are looked for in the folder that ARMLAB_RECORDINGS names and in the download cache.
"""

from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from public_copies import needs_copies
from refusals import refusal
from shipped_schemas import check_against_schema

from armlab.cli.recording import PUBLIC_RECORDING_NAMES
from armlab.common.arrays import Array
from armlab.recordings.differentiate import Signals, differentiate
from armlab.recordings.load import load_recording
from armlab.recordings.public import (
    LOCAL_COPIES_VARIABLE,
    PUBLIC_RECORDINGS,
    fetch_recording,
    find_raw_file,
    is_available,
    local_copies,
)
from armlab.recordings.reading.answer import read_rightly
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording
from armlab.recordings.recording_file import FILE_NAME
from problem.arm import Arm, link_poses
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix
from problem.robot_file import load_arm
from problem.urdf import read_urdf

FIGURES = {  # percent of the torque, all joints: first run / the last one, rigid and with friction, rounded up
    "emps": ((71, 70), (4.5, 7.0)),
    "staubli-tx40": ((79, 82), (10.5, 18.0)),
    "unisa-ur10": ((43, 70), (6.0, 10.0)),
    "unisa-panda": ((4.5, 5.5), (3.0, 4.0)),
    "kuka-kr300": ((45, 65), (12.0, 47.0)),
    "friction-damper-20-lb": ((99, 99), (55.0, 66.0)),
    "friction-damper-25-lb": ((99, 99), (55.0, 69.0)),
    "friction-damper-35-lb": ((99, 99), (55.0, 69.0)),
    "friction-damper-80-lb": ((99, 99), (55.0, 69.0)),
}


def robot_of(name: str) -> str:
    """The built-in robot of a public recording: its own, but one for all tensions of the damper."""
    return "friction-damper" if name.startswith("friction-damper") else name


@pytest.fixture(params=[pytest.param(name, marks=needs_copies(name)) for name in PUBLIC_RECORDING_NAMES])
def recording(request: pytest.FixtureRequest, tmp_path: Path) -> Recording:
    return load_recording(fetch_recording(request.param, tmp_path / request.param))


def rows(arm: Arm, signals: Signals, friction: bool) -> tuple[Array, Array]:
    """Filtered columns and torques, all joints below each other."""
    motion = signals.motion
    columns = [observation_matrix(arm, motion)[:, base_parameters(arm).columns]]
    own = (motion.velocity, np.sign(motion.velocity), motion.acceleration, np.ones_like(motion.velocity))
    for signal in own if friction else ():
        columns.append((signal[:, :, None] * np.eye(len(arm))).reshape(-1, len(arm)))
    return signals.columns(np.hstack(columns)), signals.torque.ravel()


def percent(recording: Recording, friction: bool) -> list[float]:
    """Error of plain least squares, fitted on the runs that identify, on the first and the last run."""
    signals = [differentiate(run, step=max(run.samples // 4000, 1)) for run in recording.runs]
    pairs = [rows(recording.arm, each, friction) for each in signals]
    matrix, torque = pairs[0]
    lengths = np.linalg.norm(matrix, axis=0)
    fitted = np.linalg.lstsq(matrix / lengths, torque, rcond=1e-9)[0] / lengths
    errors = [100 * np.linalg.norm(y - X @ fitted) / np.linalg.norm(y) for X, y in pairs]
    return [errors[0], errors[-1]]


def test_the_equations_of_motion_explain_the_converted_torques(recording: Recording) -> None:
    """A wrong gear, sign, unit or D-H row doubles these errors."""
    for limits, friction in zip(FIGURES[recording.name], (False, True), strict=True):
        for error, limit in zip(percent(recording, friction), limits, strict=True):
            assert error < limit


def test_runs_that_validate_take_no_part_in_identification(recording: Recording) -> None:
    identify, validate = recording.with_role("identify"), recording.with_role("validate")
    assert len(identify) == 1
    assert len(validate) == len(recording.runs) - 1 >= 1
    assert recording.robot == recording.arm.name == robot_of(recording.name)


def test_fetched_recordings_follow_the_schema(recording: Recording) -> None:
    check_against_schema(yaml.safe_load((recording.folder / FILE_NAME).read_text()), "recording")


@needs_copies("staubli-tx40")
def test_axes_5_and_6_of_the_tx40_are_coupled_as_published(tmp_path: Path) -> None:
    transmission = load_recording(fetch_recording("staubli-tx40", tmp_path / "new")).transmission
    gears = np.diag([32.0, 32, 45, -48, 45, 32])
    gears[5, 4] = 32
    assert_allclose(transmission.position @ gears, np.eye(6), atol=1e-12)
    assert_allclose(transmission.offset, [0, -np.pi / 2, np.pi / 2, 0, 0, 0])
    assert transmission.torque[4, 5] == 32
    assert_allclose(np.diag(transmission.torque), np.diag(gears))


@pytest.mark.skipif(local_copies() is None, reason=f"{LOCAL_COPIES_VARIABLE} names no folder with the URDF of the TX40")
def test_the_tx40_is_that_of_its_urdf() -> None:
    folder = local_copies()
    assert folder is not None
    published = read_urdf(folder / "staubli_tx40" / "tx40_mdh_modified.urdf")
    built_in = load_arm("staubli-tx40")
    for position in np.random.default_rng(0).uniform(-2, 2, (5, 6)):
        for one, other in zip(link_poses(published, position), link_poses(built_in, position), strict=True):
            assert_allclose(one, other, atol=1e-10)
    assert_allclose(built_in.parameters, published.parameters, atol=1e-12)
    assert [joint.limits for joint in built_in.joints] == [joint.limits for joint in published.joints]


@needs_copies("unisa-ur10")
def test_the_ur10_stands_upright_where_its_driver_reads_a_quarter_turn_back(tmp_path: Path) -> None:
    """Shoulder lift and first wrist joint of the driver are zero where the arm is level, of the D-H table upright."""
    recording = load_recording(fetch_recording("unisa-ur10", tmp_path / "new"))
    assert_allclose(recording.transmission.offset, [0, np.pi / 2, 0, np.pi / 2, 0, 0])
    lift, torque = recording.runs[0].position[:, 1], recording.runs[0].torque[:, 1]
    assert np.corrcoef(np.sin(lift), torque)[0, 1] < -0.8  # gravity bends what leans, not what stands


@pytest.mark.parametrize("name", ["emps", "unisa-ur10"])
def test_raw_files_in_the_download_cache_are_at_hand_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    pooch = pytest.importorskip("pooch")
    monkeypatch.delenv(LOCAL_COPIES_VARIABLE, raising=False)
    monkeypatch.setattr(pooch, "os_cache", lambda _: str(tmp_path))
    assert not is_available(PUBLIC_RECORDINGS[name])
    (tmp_path / PUBLIC_RECORDINGS[name].folder).mkdir()
    for file in PUBLIC_RECORDINGS[name].files:
        (tmp_path / PUBLIC_RECORDINGS[name].folder / file.name).touch()
    assert is_available(PUBLIC_RECORDINGS[name])


@needs_copies("emps")
def test_a_raw_file_with_another_content_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path))
    (tmp_path / "emps").mkdir()
    (tmp_path / "emps" / "DATA_EMPS.mat").write_bytes(b"something else")
    assert "is not the registered file" in refusal(
        find_raw_file, PUBLIC_RECORDINGS["emps"], PUBLIC_RECORDINGS["emps"].files[0]
    )


def test_a_missing_local_copy_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path))
    assert "cannot read" in refusal(fetch_recording, "emps", tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("blank", ["", " "])
def test_a_blank_folder_of_local_copies_is_read_as_unset(
    blank: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = PUBLIC_RECORDINGS["emps"]
    copy = tmp_path / recording.folder / recording.files[0].name
    copy.parent.mkdir()
    copy.touch()  # in the current folder, which a blank name would mean
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, blank)
    monkeypatch.setattr("armlab.recordings.public._download", lambda recording, address, file: Path("downloaded"))
    assert local_copies() is None
    assert find_raw_file(recording, recording.files[0]) == Path("downloaded")


def test_a_download_without_connection_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pooch = pytest.importorskip("pooch")
    monkeypatch.delenv(LOCAL_COPIES_VARIABLE, raising=False)

    def no_connection(*_: object) -> None:
        raise OSError("name or service not known")

    monkeypatch.setattr(pooch, "retrieve", no_connection)
    message = refusal(fetch_recording, "emps", tmp_path / "new")
    assert "cannot fetch https://" in message
    assert LOCAL_COPIES_VARIABLE in message


def test_a_download_is_checked_against_the_registered_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pooch = pytest.importorskip("pooch")
    monkeypatch.delenv(LOCAL_COPIES_VARIABLE, raising=False)
    asked = []

    def retrieve(address: str, known_hash: str, name: str, cache: Path) -> str:
        asked.append((address, known_hash))
        raise ValueError(f"SHA256 hash of downloaded file ({name}) does not match the known hash")

    monkeypatch.setattr(pooch, "retrieve", retrieve)
    assert "does not match" in refusal(fetch_recording, "unisa-panda", tmp_path / "new")
    (file,) = PUBLIC_RECORDINGS["unisa-panda"].files
    assert asked == [(file.address, f"sha256:{file.sha256}")]


def test_converted_files_that_are_missing_are_asked_for_with_folder_and_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pooch = pytest.importorskip("pooch")
    monkeypatch.setattr(pooch, "os_cache", lambda _: str(tmp_path / "cache"))
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path / "copies"))
    message = refusal(fetch_recording, "friction-damper-20-lb", tmp_path / "new")
    assert f"no run-1-hz.csv in {tmp_path / 'copies' / 'friction-damper' / 'tension-20-lb'}" in message
    assert "ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash" in message
    assert not (tmp_path / "new").exists()


def test_converted_files_in_the_cache_are_taken_where_the_local_copies_have_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pooch = pytest.importorskip("pooch")
    monkeypatch.setattr(pooch, "os_cache", lambda _: str(tmp_path / "cache"))
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path / "copies"))
    recording = PUBLIC_RECORDINGS["friction-damper-20-lb"]
    copy = tmp_path / "cache" / recording.folder / recording.files[0].name
    copy.parent.mkdir(parents=True)
    copy.write_bytes(b"something else")
    assert f"{copy} is not the registered file" in refusal(find_raw_file, recording, recording.files[0])


@needs_copies("friction-damper-20-lb")
def test_the_damper_is_read_in_si_units_and_says_that_its_licence_is_share_alike(tmp_path: Path) -> None:
    recording = load_recording(fetch_recording("friction-damper-20-lb", tmp_path / "new"))
    identify, validate = recording.runs
    assert (identify.rate_hz, validate.rate_hz) == (512.0, 512.0)
    assert 0.025 < np.abs(identify.position).max() < 0.03  # m
    assert 4e3 < np.abs(identify.torque).max() < 12e3  # N
    assert "CC-BY-SA-4.0" in (recording.folder / FILE_NAME).read_text()


def test_every_public_recording_has_a_built_in_robot_and_a_command() -> None:
    assert tuple(PUBLIC_RECORDINGS) == PUBLIC_RECORDING_NAMES
    for name in PUBLIC_RECORDINGS:
        assert load_arm(robot_of(name)).name == robot_of(name)


def test_an_unknown_public_recording_names_the_nearest(tmp_path: Path) -> None:
    assert "did you mean 'kuka-kr300'?" in refusal(fetch_recording, "kuka-kr30", tmp_path)


@needs_copies("unisa-ur10")
def test_the_ur10_with_the_zeros_of_its_driver_is_read_a_quarter_turn_off(tmp_path: Path) -> None:
    """Joint 2 is told; the multiples of 90 degrees of joint 4 are not, and no single value is given for them."""
    folder = fetch_recording("unisa-ur10", tmp_path / "as-driven")
    settings = yaml.safe_load((folder / FILE_NAME).read_text())
    del settings["transmission"]
    (folder / FILE_NAME).write_text(yaml.safe_dump(settings))
    answer = read_rightly(load_recording(folder), None, ReadingTuning())
    found = [(each.mistake.effect, each.mistake.joint, each.mistake.value("offset")) for each in answer.findings]
    assert found == [("encoder_offset", 2, pytest.approx(np.pi / 2))]
    assert 4 in answer.undecided
