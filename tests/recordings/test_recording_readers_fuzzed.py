"""Readers against anything: one line or a recording, never a traceback, and never a number changed in silence."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recording_folders import POSITION, SETTINGS, TORQUE, folder_with, frame

from armlab.common.errors import InputError
from armlab.recordings.imports.matlab import read_numeric_arrays
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.load import load_recording

ANY = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
SOUND = frame(seconds=1.0).to_csv(index=False)


def one_line_or_result(act: Callable[..., object], *given: object) -> object:
    try:
        return act(*given)
    except InputError as error:
        said = str(error)
    assert "\n" not in said
    return None


@given(content=st.binary(max_size=300) | st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace")))
@ANY
def test_any_bytes_as_a_run_are_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    assert one_line_or_result(load_recording, folder_with(tmp_path, content)) is None


@given(at=st.integers(0, len(SOUND) - 1), put=st.text(max_size=8), cut=st.integers(0, 30))
@ANY
def test_a_damaged_run_is_refused_or_repaired_and_every_number_is_one_of_the_file(
    tmp_path: Path, at: int, put: str, cut: int
) -> None:
    text = SOUND[:at] + put + SOUND[at + cut :]
    recording = one_line_or_result(load_recording, folder_with(tmp_path, text.encode("utf-8", "replace")))
    if recording is None:
        return
    parts = [run for run in recording.runs if run.file == "run.csv"]
    table = pd.DataFrame([line.split(",") for line in SOUND.splitlines()[1:]], dtype=float).to_numpy()
    kept = np.vstack([np.hstack([run.position, run.torque]) for run in parts])
    known = {tuple(row) for row in table[:, 1:]}
    changed = [row for row in kept if tuple(row) not in known]
    assert len(changed) <= 2  # rows that the damage itself touched
    if len(kept) != len(table):
        lines_lost = len(text.splitlines()) != len(SOUND.splitlines())
        assert lines_lost or any(run.repairs for run in parts)


@given(
    data=st.recursive(
        st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=9),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from([*SETTINGS, "gains", "x"]), inner),
        max_leaves=12,
    )
)
@ANY
def test_any_yaml_as_recording_file_is_refused_in_one_line(tmp_path: Path, data: object) -> None:
    folder = folder_with(tmp_path, SOUND)
    (folder / "recording.yaml").write_text(yaml.safe_dump(data))
    assert one_line_or_result(load_recording, folder) is None


@given(key=st.sampled_from(sorted(SETTINGS)), value=st.none() | st.integers() | st.text(max_size=5) | st.just([]))
@ANY
def test_any_wrong_value_in_the_recording_file_is_refused_in_one_line(tmp_path: Path, key: str, value: object) -> None:
    assert one_line_or_result(load_recording, folder_with(tmp_path, SOUND, {key: value})) is None


@given(
    scale=st.lists(st.floats(1e-3, 1e3), min_size=3, max_size=3),
    offset=st.floats(-10, 10),
    samples=st.integers(60, 300),
)
@ANY
def test_a_sound_run_of_any_size_is_never_changed(
    tmp_path: Path, scale: list[float], offset: float, samples: int
) -> None:
    table = frame(seconds=2.0).iloc[:samples].copy()
    table[TORQUE] *= scale
    table["t"] += offset
    run = load_recording(folder_with(tmp_path, table)).runs[0]
    written = pd.read_csv(tmp_path / "run.csv")
    np.testing.assert_array_equal(run.position, written[POSITION])
    np.testing.assert_array_equal(run.torque, written[TORQUE])
    np.testing.assert_array_equal(run.time, written["t"])
    assert run.findings == ()


@pytest.mark.parametrize(
    ("suffix", "reader"), [(".mat", read_numeric_arrays), (".csv", read_odd_csv), (".mcap", read_bag)]
)
@given(content=st.binary(max_size=400))
@ANY
def test_any_bytes_to_import_are_refused_in_one_line_or_read(
    tmp_path: Path, suffix: str, reader: Callable[..., object], content: bytes
) -> None:
    if suffix == ".mcap":
        pytest.importorskip("rosbags")
    path = tmp_path / f"log{suffix}"
    path.write_bytes(content)
    one_line_or_result(reader, path)
