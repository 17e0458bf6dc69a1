"""Reads a LeRobot dataset (versions 2 and 3): a folder with meta/info.json and Parquet files of episodes.

Vectors become a column an entry, `action.NAME` (the command) and `observation.state.NAME` (the position), with the
names of meta/info.json. Videos and tasks are left out.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import MissingPackageError
from armlab.recordings.table import HEADER_LINES, Table

INFO = Path("meta/info.json")
COMMAND, STATE, STAMP, EPISODE = "action", "observation.state", "timestamp", "episode_index"
PERCENT_NAMES = ("gripper",)  # LeRobot normalises a gripper's position to 0 ... 100, all other joints to one unit


def is_lerobot(path: Path) -> bool:
    """Whether a path is the folder of a LeRobot dataset."""
    return path.is_dir() and (path / INFO).is_file()


def dataset_of(file: Path) -> Path | None:
    """The folder of the dataset that a Parquet file of episodes stands in, `data/chunk-000/FILE`; None outside one."""
    return next((folder for folder in file.resolve().parents[:3] if is_lerobot(folder)), None)


def read_lerobot(folder: Path, file: Path | None = None) -> dict[str, Table]:
    """The episodes of a dataset by their names, like `episode-000003`. file: the one whose episodes are wanted.

    Raises InputError, in one line, for a broken dataset.
    """
    names = {vector: _entry_names(_features(folder), vector, folder) for vector in (COMMAND, STATE)}
    files = sorted((folder / "data").rglob("*.parquet")) if file is None else [file]
    if not files:
        raise InputError(f"{folder} has no Parquet file below data/: is the dataset complete?")
    episodes: dict[str, Table] = {}
    for path in files:
        frame = _read_columns(path)
        vectors = [_check_width(frame[key], names[key], key, path) for key in names]
        values = np.column_stack([frame[STAMP][:, None], *vectors])
        columns = (STAMP, *(f"{key}.{name}" for key in names for name in names[key]))
        if not np.isfinite(frame[EPISODE]).all():
            raise InputError(f"{path}: {EPISODE} has rows without a number")
        for episode in np.unique(frame[EPISODE]):
            rows = values[frame[EPISODE] == episode]
            name = f"episode-{int(episode):06d}"
            episodes[name] = Table(name, columns, rows, HEADER_LINES + 1 + np.arange(len(rows)))
    return episodes


def _features(folder: Path) -> dict[str, Any]:
    try:
        content = json.loads((folder / INFO).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {folder / INFO}: {in_one_line(error)}") from None
    features = content.get("features") if isinstance(content, dict) else None
    if not isinstance(features, dict):
        raise InputError(f"{folder / INFO} has no 'features': it is no LeRobot dataset of version 2 or 3")
    return features


def _entry_names(features: dict[str, Any], vector: str, folder: Path) -> tuple[str, ...]:
    """Names of the joints in a vector; some datasets hold them below a word such as `motors`, or in a list more.

    LeRobot writes `shoulder_pan.pos`, in older datasets `main_shoulder_pan`.
    """
    entry = features.get(vector)
    given = entry.get("names") if isinstance(entry, dict) else None
    if isinstance(given, dict):
        given = next(iter(given.values()), None)
    if isinstance(given, list) and len(given) == 1 and isinstance(given[0], list):
        given = given[0]
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        raise InputError(f"{folder / INFO}: features.{vector}.names should be a list of names, one a joint")
    return tuple(name.removeprefix("main_").removesuffix(".pos") for name in given)


def _read_columns(path: Path) -> dict[str, Array]:
    """Command, state, stamp and episode of each row."""
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        raise MissingPackageError("pyarrow", f"{path}: Parquet") from None
    try:
        table = parquet.read_table(path, columns=[COMMAND, STATE, STAMP, EPISODE])
        return {name: np.array(table[name].to_pylist(), dtype=np.float64) for name in table.column_names}
    except (ArrowException, OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"cannot read {path}: {in_one_line(error)[:200]}") from None


def _check_width(values: Array, names: tuple[str, ...], vector: str, path: Path) -> Array:
    if values.ndim != 2 or values.shape[1] != len(names):
        width = values.shape[1] if values.ndim == 2 else 1
        raise InputError(f"{path}: {vector} has {width} entries, meta/info.json names {len(names)}")
    return values
