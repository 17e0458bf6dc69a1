"""What every reader promises for any bytes: a recording, or a refusal in one line; no number changed in silence."""

import os
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml
from joint_state_bags import write_bag, write_ros1_bag
from recording_folders import POSITION, SETTINGS, TORQUE, frame
from scipy.io import savemat

from armlab.common.errors import InputError
from armlab.recordings.check import check_recording
from armlab.recordings.imports.matlab import read_mat, read_numeric_arrays
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording

SHORT = frame(seconds=0.3)
CSV = SHORT.to_csv(index=False).encode()
YAML = yaml.safe_dump(SETTINGS).encode()


@dataclass(frozen=True)
class Target:
    """file: the name under which the bytes are read. read: from a folder that holds it. seed: sound bytes.

    fuzzed: what a fuzzer calls in place of `read`, where that would be slow.
    """

    file: str
    read: Callable[[Path], object]
    seed: Callable[[Path], bytes]
    fuzzed: Callable[[Path], object] | None = None


def held(target: Target, content: bytes, folder: Path) -> None:
    """Reads the bytes; anything but a result or a refusal in one line passes through, warnings included."""
    (folder / target.file).write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = _read(target, folder)
    if isinstance(found, Recording):
        _unchanged(found, (folder / "run.csv").read_bytes().decode("utf-8-sig"))


def _read(target: Target, folder: Path) -> object:
    """The result, or None for a refusal."""
    try:
        return target.read(folder)
    except InputError as error:
        refusal = str(error)
    assert "\n" not in refusal
    return None


def _unchanged(recording: Recording, text: str) -> None:
    """A run that was read without repairs holds the numbers of its file."""
    runs = [run for run in recording.runs if run.file == "run.csv"]
    if '"' in text or len(runs) != 1 or runs[0].repairs:
        return
    rows = [line.split(",") for line in text.splitlines() if line.strip(", \t\x0b\x0c\x1c\x1d\x1e\x1f\xa0")]
    names = [name.strip() for name in rows[0]]
    wanted = [names.index(name) for name in ("t", *POSITION, *TORQUE)]
    written = np.array([[float(row[column]) for column in wanted] for row in rows[1:]])
    read = np.column_stack([runs[0].time, runs[0].position, runs[0].torque])
    np.testing.assert_array_equal(read, written)


def _folder(folder: Path) -> Recording:
    """A recording folder whose other files are sound."""
    for name, sound in (("recording.yaml", YAML), ("run.csv", CSV), ("check.csv", CSV)):
        if not (folder / name).exists():
            (folder / name).write_bytes(sound)
    return load_recording(folder)


def _checked(folder: Path) -> object:
    _folder(folder)
    return check_recording(folder)


def _in_a_fork(folder: Path) -> None:
    """The reader of .mat files in a process that it may take down, as `read_mat` has it, but without its start."""
    child = os.fork()
    if child == 0:
        try:
            _read(Target("log.mat", lambda place: read_numeric_arrays(place / "log.mat"), _mat_seed), folder)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code <= 0, "an error that is no refusal in one line, see above"


def _mat_seed(folder: Path) -> bytes:
    signals = {"q": SHORT[POSITION].to_numpy().T, "tau": SHORT[TORQUE].to_numpy()}
    savemat(folder / "seed.mat", {"rec": signals, "t": SHORT["t"].to_numpy(), "label": "run A"})
    return (folder / "seed.mat").read_bytes()


TARGETS = {
    "csv": Target("run.csv", _folder, lambda _: CSV),
    "check": Target("run.csv", _checked, lambda _: CSV),
    "yaml": Target("recording.yaml", _folder, lambda _: YAML),
    "text": Target("log.txt", lambda folder: read_odd_csv(folder / "log.txt"), lambda _: CSV.replace(b",", b"; ")),
    "mat": Target("log.mat", lambda folder: read_mat(folder / "log.mat"), _mat_seed, _in_a_fork),
    "mcap": Target(
        "log.mcap",
        lambda folder: read_bag(folder / "log.mcap"),
        lambda folder: write_bag(folder / "seed", "mcap", SHORT[:4]).read_bytes(),
    ),
    "db3": Target(
        "log.db3",
        lambda folder: read_bag(folder / "log.db3"),
        lambda folder: write_bag(folder / "seed", "sqlite3", SHORT[:4]).read_bytes(),
    ),
    "bag": Target(
        "log.bag",
        lambda folder: read_bag(folder / "log.bag"),
        lambda folder: write_ros1_bag(folder / "seed.bag", SHORT[:4]).read_bytes(),
    ),
}


def seed_of(name: str) -> bytes:
    """Sound bytes for a target."""
    with TemporaryDirectory() as folder:
        return TARGETS[name].seed(Path(folder))
