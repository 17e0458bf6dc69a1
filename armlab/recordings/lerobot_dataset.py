"""Writes a recording of motion only as a LeRobot dataset, version 3.0: an episode a run, `action` is the command.

Layout as in lerobot, `src/lerobot/datasets/utils.py` and `dataset_metadata.py`: meta/info.json, meta/stats.json,
meta/tasks.parquet, and Parquet files of episodes below meta/episodes and of frames below data. Stamps are
frame_index / fps, angles in degrees, as robots with `use_degrees` have them.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from armlab.common.errors import InputError
from armlab.common.files import all_or_none
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.recording import MotionRun
from armlab.recordings.recording_file import check_new_folder
from problem.arm import Arm

VERSION = "v3.0"
COMMAND, STATE = "action", "observation.state"
SCALARS = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64"}
PIECE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
MAX_MB = {"data_files_size_in_mb": 100, "video_files_size_in_mb": 200}  # lerobot's own defaults


def write_lerobot(folder: Path, out: Path, task: str, fps: int | None = None) -> Path:
    """Writes the recording of a folder into a new folder, and returns its path.

    task: a sentence on what the arm does. fps: frames a second, of all episodes; by default the rate of the first run.
    Raises InputError for a recording that cannot be read or has torque, and for a folder that holds something.
    """
    recording = load_motion_recording(folder)
    check_new_folder(out)
    if not recording.runs:
        raise InputError(f"{folder} has no run that could be an episode")
    rate = fps or max(round(recording.runs[0].rate_hz), 1)
    arm = recording.recorded_arm
    episodes = [_episode(run, arm, rate).assign(episode_index=number) for number, run in enumerate(recording.runs)]
    frames = pd.concat(episodes, ignore_index=True)
    frames = frames.assign(index=np.arange(len(frames)), task_index=0)
    lengths = frames.groupby("episode_index").size().to_numpy()
    info = _info(recording.robot, arm, rate, lengths)
    with all_or_none(out.absolute()) as place:
        for part in (f"data/{_piece()}", f"meta/episodes/{_piece()}"):
            (place / part).parent.mkdir(parents=True)
        frames.to_parquet(place / "data" / _piece(), index=False)
        _episodes(lengths, task).to_parquet(place / "meta/episodes" / _piece(), index=False)
        tasks = pd.DataFrame({"task_index": [0]}, index=pd.Index([task], name="task"))
        tasks.to_parquet(place / "meta/tasks.parquet")
        (place / "meta/info.json").write_text(json.dumps(info, indent=4))
        (place / "meta/stats.json").write_text(json.dumps(_stats(frames), indent=4))
    return out


def _piece() -> str:
    return PIECE.format(chunk_index=0, file_index=0)


def _episode(run: MotionRun, arm: Arm, fps: int) -> pd.DataFrame:
    """A run at even stamps: positions by cubic splines, the command held from one sample to the next."""
    assert run.reference_position is not None
    factors = np.array([180 / np.pi if joint.kind == "revolute" else 1.0 for joint in arm.joints])
    count = int((run.time[-1] - run.time[0]) * fps + 1e-6) + 1
    time = run.time[0] + np.arange(count) / fps
    position = CubicSpline(run.time, run.position)(time) * factors
    held = np.searchsorted(run.time, time + 1e-3 / fps, side="right") - 1
    command = run.reference_position[held] * factors
    columns = {COMMAND: list(command.astype(np.float32)), STATE: list(position.astype(np.float32))}
    stamps = {"timestamp": (np.arange(count) / fps).astype(np.float32), "frame_index": np.arange(count)}
    return pd.DataFrame({**columns, **stamps})


def _episodes(lengths: NDArray[np.integer], task: str) -> pd.DataFrame:
    ends = np.cumsum(lengths)
    places = dict.fromkeys(
        ("data/chunk_index", "data/file_index", "meta/episodes/chunk_index", "meta/episodes/file_index"), 0
    )
    table = pd.DataFrame({"episode_index": np.arange(len(lengths)), "tasks": [[task]] * len(lengths)})
    return table.assign(length=lengths, dataset_from_index=ends - lengths, dataset_to_index=ends, **places)


def _info(robot: str, arm: Arm, fps: int, lengths: NDArray[np.integer]) -> dict[str, Any]:
    vector = {"dtype": "float32", "shape": [len(arm)], "names": [f"{joint.name}.pos" for joint in arm.joints]}
    scalars = {**SCALARS, "task_index": "int64"}
    return {
        "codebase_version": VERSION,
        "robot_type": Path(robot).stem,
        "total_episodes": len(lengths),
        "total_frames": int(lengths.sum()),
        "total_tasks": 1,
        "chunks_size": 1000,
        **MAX_MB,
        "fps": fps,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": f"data/{PIECE}",
        "video_path": None,
        "features": {
            **dict.fromkeys((COMMAND, STATE), vector),
            **{name: {"dtype": kind, "shape": [1], "names": None} for name, kind in scalars.items()},
        },
    }


def _stats(frames: pd.DataFrame) -> dict[str, dict[str, list[float]]]:
    """Least, largest, mean, standard deviation and number of each feature, entry by entry."""
    found = {}
    for name in frames:
        values = np.stack(frames[name].tolist()).reshape(len(frames), -1).astype(float)
        numbers = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}
        found[str(name)] = {key: each.tolist() for key, each in numbers.items()} | {"count": [len(values)]}
    return found
