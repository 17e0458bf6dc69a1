"""Mistakes are put into the files as people make them, whatever the channels of a recording are."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_recordings import ARM, POSITION, frame, recording_in

from armlab.diagnosis.torque.diagnose import diagnose
from armlab.proof.blind.setup.mistakes import Injected, inject
from armlab.recordings.load import load_recording
from armlab.report.account.summary import summary_of
from armlab.report.torque.torque_verdict import verdict_sentences
from problem.motion import Motion
from problem.regressor import rigid_body_torque

GRAVITY_OFF = Injected("gravity_compensated_torque")


@pytest.mark.parametrize("others", [(), (Injected("encoder_offset", 2, size=0.5),)])
def test_gravity_comes_off_at_the_joints_of_motor_channels(tmp_path: Path, others: tuple[Injected, ...]) -> None:
    run = frame(0, 4)
    run[POSITION] = np.rad2deg(run[POSITION])
    geared = {
        "units": {"time": "s", "position": "deg", "torque": "mN.m"},
        "transmission": {
            "position": [[0.1, 0, 0], [0, -0.1, 0], [0, 0.1, 0.1]],
            "offset": [0.0, 0.3, 0.0],
            "torque": [[100, 0, 0], [0, -80, 60], [0, 0, 50]],
        },
    }
    right = load_recording(recording_in(tmp_path / "right", run, **geared)).runs[0]
    folder = recording_in(tmp_path / "wrong", run, **geared)
    inject(folder, (*others, GRAVITY_OFF), ARM)
    still = np.zeros_like(right.position)
    expected = right.torque - rigid_body_torque(ARM, Motion(right.position, still, still))
    np.testing.assert_allclose(load_recording(folder).runs[0].torque, expected, rtol=0, atol=1e-9)


def test_a_sign_beside_exchanged_channels_is_that_of_its_own_joint(tmp_path: Path) -> None:
    right = load_recording(recording_in(tmp_path / "right", frame(0, 4))).runs[0]
    folder = recording_in(tmp_path / "wrong", frame(0, 4))
    inject(folder, (Injected("channel_swap", joints=(1, 2), form="position and torque"), Injected("torque_sign", 2)))
    found = load_recording(folder).runs[0]
    np.testing.assert_allclose(found.torque[:, 0], -right.torque[:, 1])
    np.testing.assert_allclose(found.torque[:, 1], right.torque[:, 0])


def test_a_reading_that_cannot_be_asked_is_not_called_right(tmp_path: Path) -> None:
    found = diagnose(load_recording(recording_in(tmp_path / "rig", frame(0, 1.5), validate=False)), only_setup=True)
    assert found.status == "inconclusive"
    assert "short" in found.reason


def test_a_reading_is_asked_beside_a_joint_without_torque(tmp_path: Path) -> None:
    run = frame(0, 8).assign(tau2=0.0)
    found = diagnose(load_recording(recording_in(tmp_path / "rig", run, validate=False)), only_setup=True)
    assert (found.status, found.setup.sentence) == ("mismatch", "Left out: joint 2 has no torque.")
    assert found.reason == "Nothing else is wrong with the reading; physics was not asked."


def test_a_summary_has_three_sentences_beside_a_mistake_of_the_reading(tmp_path: Path) -> None:
    run = frame(0, 8).assign(tau2=0.0)
    run["tau1"] += 3.0 * np.sign(np.gradient(run["q1"]))
    found = diagnose(load_recording(recording_in(tmp_path / "rig", run, validate=False)))
    sentences = re.split(r"(?<=[.])\s+(?=[A-Z0-9])", summary_of(found))
    assert len(sentences) <= 3
    assert sentences[0] == "Left out: joint 2 has no torque."
    assert "friction" in sentences[1]


def test_a_reading_that_is_right_is_called_right(tmp_path: Path) -> None:
    found = diagnose(load_recording(recording_in(tmp_path / "rig", frame(0, 8), validate=False)), only_setup=True)
    assert (found.status, found.reason) == ("none", "Nothing is wrong with the reading; physics was not asked.")
    assert verdict_sentences(found) == (found.reason, "")
