"""Recordings with torque that was simulated elsewhere: what scales, is late or is added is told against that torque."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_recordings import POSITION, TORQUE, frame, recording_in

from armlab.common.errors import InputError
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording

SIMULATED = ["s1", "s2", "s3"]
GAIN = 1.08


def test_a_gain_is_found_against_a_torque_that_no_links_of_the_robot_give(tmp_path: Path) -> None:
    runs = []
    for seed in (1, 2, 3):
        run = frame(seed, mass=3.0)  # a load and friction that the robot file has not
        run[SIMULATED] = run[TORQUE]
        run["tau2"] *= GAIN
        run[TORQUE] += np.random.default_rng(seed).normal(0, 0.05, (len(run), 3))
        runs.append(run)
    columns = {"time": "t", "position": POSITION, "torque": TORQUE, "simulated_torque": SIMULATED}
    found = diagnose(load_recording(recording_in(tmp_path / "made", *runs, columns=columns)))
    (claim,) = found.claims
    assert (claim.effect, claim.joint) == ("torque_gain_error", 2)
    assert abs(claim.parameters[0].value - GAIN) < 0.003
    assert max(each.after for each in found.fit) < 0.1  # of the noise
    assert found.model is not None
    recording = found.recording
    held_out = recording.runs[-1]
    left = held_out.torque - found.model.predict(held_out)
    assert np.std(left, axis=0).max() < 0.1
    with pytest.raises(InputError, match="adds to columns of simulated_torque, which this run has not"):
        found.model.predict(replace(held_out, simulated_torque=None))
