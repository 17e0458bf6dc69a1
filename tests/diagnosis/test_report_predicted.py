"""Predicted torque of validation runs beside a verdict."""

from pathlib import Path

import numpy as np
import pandas as pd
from small_recordings import frame, recording_in

from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from armlab.report.verdict_files import predicted_texts


def test_the_prediction_of_a_held_out_run_is_as_far_from_the_measurement_as_the_verdict_says(tmp_path: Path) -> None:
    recording_in(tmp_path, frame(0, 6), frame(1, 6))
    found = diagnose(load_recording(tmp_path))
    texts = predicted_texts(found)
    (run,) = found.recording.with_role("validate")
    assert list(texts) == [f"predicted/{Path(run.file).stem}.csv"]
    (tmp_path / "predicted.csv").write_text(next(iter(texts.values())))
    table = pd.read_csv(tmp_path / "predicted.csv")
    for joint in range(run.joints):
        measured = np.interp(table["t"], run.time, run.torque[:, joint])
        error = np.sqrt(np.mean((measured - table[f"tau{joint + 1}"]) ** 2))
        assert found.fit[joint].after < error < 0.1 * np.std(run.torque[:, joint])
