"""MATLAB .mat files (up to version 7): every numeric vector and matrix as columns.

The arrays are read by a process of its own (`python -m armlab.recordings.imports.matlab FILE OUT.npz`), because the
compiled reader of SciPy crashes on some broken files instead of raising an error.
"""

import struct
import subprocess
import sys
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from armlab.recordings.table import Table

READER_MODULE = "armlab.recordings.imports.matlab"
MIN_SIGNAL_SAMPLES = 10  # samples; a shorter array is a setting, not a signal


def read_mat(path: Path) -> Table:
    """Columns named like `rec.act_pos_deg_1`: the variable, its fields, and the number of the channel.

    The signals are those whose length most variables share; a matrix may hold its samples in rows or columns.
    Raises InputError for a file that is not a .mat file, for version 7.3, and for a file without signals.
    """
    return table_of_arrays(_read_arrays_in_process(path), path)


def table_of_arrays(found: list[tuple[str, Array]], path: Path) -> Table:
    """The arrays that share the most frequent length as columns; InputError where none is long enough."""
    lengths = [size for _, array in found for size in array.shape if size >= MIN_SIGNAL_SAMPLES]
    if not lengths:
        raise InputError(f"{path} holds no numeric array of at least {MIN_SIGNAL_SAMPLES} samples")
    samples = max(set(lengths), key=lambda size: (lengths.count(size), size))
    columns: dict[str, Array] = {}
    for name, array in found:
        if samples in array.shape:
            columns.update(_split_columns(name, array, samples))
    return Table(path.name, tuple(columns), np.column_stack(list(columns.values())), 1 + np.arange(samples))


def _read_arrays_in_process(path: Path) -> list[tuple[str, Array]]:
    """Numeric arrays by name, read by a process of its own, which a broken file may crash."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "arrays.npz"
        command = [sys.executable, "-P", "-m", READER_MODULE, str(path), str(out)]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        if done.returncode == REFUSED_EXIT_CODE:
            raise InputError(done.stderr.splitlines()[-1])
        if done.returncode:
            raise InputError(f"cannot read {path} as a .mat file: its content crashes the reader; is the file damaged?")
        with np.load(out) as content:
            return [(str(name), content[f"array{index}"]) for index, name in enumerate(content["names"])]


def _split_columns(name: str, array: Array, samples: int) -> dict[str, Array]:
    if array.ndim == 1:
        return {name: array}
    rows = array if array.shape[0] == samples else array.T
    if rows.shape[1] == 1:
        return {name: rows[:, 0]}
    return {f"{name}_{channel + 1}": rows[:, channel] for channel in range(rows.shape[1])}


MAT_READ_ERRORS = (
    MatReadError,
    ValueError,
    TypeError,
    LookupError,
    OSError,
    struct.error,
    zlib.error,
    MemoryError,
    AttributeError,
    Warning,
    NameError,  # a variable that SciPy's reader leaves unbound for an unknown class
)
REFUSED_EXIT_CODE = 2  # exit code; the reason stands in the last line of the standard error


def read_numeric_arrays(path: Path) -> list[tuple[str, Array]]:
    """Vectors and matrices of numbers, named by the path of field names that leads to each.

    Raises InputError for a file that is not a .mat file, and for version 7.3.
    """
    return list(_iterate_arrays(_load_content(path)))


def _load_content(path: Path) -> dict[str, Any]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # SciPy warns where numbers may be wrong, and reads on
            content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise InputError(f"{path} is of MATLAB version 7.3: save it with `save(name, '-v7')`") from None
    except MAT_READ_ERRORS as error:
        reason = in_one_line(error) or type(error).__name__
        raise InputError(f"cannot read {path} as a .mat file: {reason[:200]}") from None
    return {name: value for name, value in content.items() if not name.startswith("__") and isinstance(name, str)}


def _iterate_arrays(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Array]]:
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _iterate_arrays(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
            yield f"{prefix}{name}", value.astype(np.float64)


def write_arrays(file: str, out: str) -> int:
    """Writes names and arrays, in their order."""
    try:
        found = read_numeric_arrays(Path(file))
    except InputError as error:
        print(error, file=sys.stderr)
        return REFUSED_EXIT_CODE
    content: dict[str, Any] = {f"array{index}": array for index, (_, array) in enumerate(found)}
    np.savez(out, names=np.array([name for name, _ in found], dtype=np.str_), **content)
    return 0


if __name__ == "__main__":
    sys.exit(write_arrays(*sys.argv[1:]))
