"""MATLAB .mat files (up to version 7): every numeric vector and matrix as columns."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from problem.errors import InputError
from recordings.imports.matlab_arrays import REFUSED
from recordings.run import Array
from recordings.table import Table

READER = "recordings.imports.matlab_arrays"
FEWEST = 10  # samples; what is shorter is a setting, not a signal


def read_mat(path: Path) -> Table:
    """Columns named like `rec.act_pos_deg_1`: the variable, its fields, and the number of the channel.

    The signals are those whose length most variables share; a matrix may hold its samples in rows or columns.
    Raises InputError for what is no .mat file, for version 7.3, and for a file without signals.
    """
    found = _arrays(path)
    lengths = [size for _, array in found for size in array.shape if size >= FEWEST]
    if not lengths:
        raise InputError(f"{path} holds no numeric array of at least {FEWEST} samples")
    samples = max(set(lengths), key=lambda size: (lengths.count(size), size))
    columns: dict[str, Array] = {}
    for name, array in found:
        if samples in array.shape:
            columns.update(_columns(name, array, samples))
    return Table(path.name, tuple(columns), np.column_stack(list(columns.values())), 1 + np.arange(samples))


def _arrays(path: Path) -> list[tuple[str, Array]]:
    """Numeric arrays by name, read by a process that a broken file may take down."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "arrays.npz"
        command = [sys.executable, "-m", READER, str(path), str(out)]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        if done.returncode == REFUSED:
            raise InputError(done.stderr.splitlines()[-1])
        if done.returncode:
            raise InputError(f"cannot read {path} as a .mat file: its content takes the reader down; is it damaged?")
        with np.load(out) as content:
            return [(str(name), content[f"array{index}"]) for index, name in enumerate(content["names"])]


def _columns(name: str, array: Array, samples: int) -> dict[str, Array]:
    if array.ndim == 1:
        return {name: array}
    rows = array if array.shape[0] == samples else array.T
    if rows.shape[1] == 1:
        return {name: rows[:, 0]}
    return {f"{name}_{channel + 1}": rows[:, channel] for channel in range(rows.shape[1])}
