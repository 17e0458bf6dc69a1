"""The recording of `armlab recording example`, for tests."""

from pathlib import Path

import pandas as pd

from armlab.effects.example import write_example
from armlab.recordings.recording_file import Draft, DraftRun, write_recording

CSV_NAMES = ("t", "q1", "q2", "q3", "tau1", "tau2", "tau3")


def record_example(folder: Path) -> Path:
    """The two runs of the example as a recording in a folder, the second held out."""
    write_example(folder / "log")
    runs = []
    for number, role in ((1, "identify"), (2, "validate")):
        table = pd.read_csv(folder / "log" / f"run-{number}.csv").to_numpy(dtype=float)
        table[:, 0] = (table[:, 0] - table[0, 0]) * 1e-9
        runs.append(DraftRun(f"run-{number}.csv", role, CSV_NAMES, table))
    columns = {"time": "t", "position": CSV_NAMES[1:4], "torque": CSV_NAMES[4:]}
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    return write_recording(Draft("irb120-arm", columns, units, tuple(runs)), folder / "recording")
