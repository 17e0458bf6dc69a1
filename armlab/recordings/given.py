"""Recordings as functions for users take them: an object, or the path of its folder."""

from os import PathLike
from pathlib import Path

from armlab.common.errors import InputError
from armlab.recordings.load import load_recording
from armlab.recordings.motion import MotionRecording, is_motion_only, load_motion_recording
from armlab.recordings.recording import Recording

GivenRecording = Recording | MotionRecording | str | Path


def read_recording(folder: str | Path) -> Recording | MotionRecording:
    """The recording in a folder, in SI units on the joint side; each run holds findings about its repairs.

    A recording of motion only, without torque, is a `MotionRecording`. Raises InputError, in one line, for what is
    missing, wrong, or not safe to repair.
    """
    if not isinstance(folder, str | PathLike):
        raise InputError(
            f"read_recording takes the path of a recording's folder, not {type(folder).__name__}: "
            "armlab.Recording.from_dataframe makes a recording of DataFrames"
        )
    return load_motion_recording(folder) if is_motion_only(Path(folder)) else load_recording(folder)


def recording_of(given: GivenRecording) -> Recording | MotionRecording:
    """The recording itself, or the one at a path; InputError for anything else."""
    if isinstance(given, Recording | MotionRecording):
        return given
    if isinstance(given, str | Path):
        return read_recording(given)
    raise InputError(
        f"a recording should be the path of its folder, or what read_recording, import_recording or "
        f"Recording.from_dataframe returns, not {type(given).__name__}"
    )


def torque_recording_of(given: GivenRecording) -> Recording:
    """The same with torque; InputError for a recording of motion only."""
    known = recording_of(given)
    if isinstance(known, MotionRecording):
        raise InputError(f"{known.folder} is of motion only, without torque: only `armlab.diagnose` takes it")
    return known
