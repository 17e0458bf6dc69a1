"""MATLAB .mat files (up to version 7): every numeric vector and matrix as columns."""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from problem.errors import InputError
from recordings.run import Array
from recordings.table import Table

BROKEN = (
    MatReadError,
    ValueError,
    TypeError,
    LookupError,
    OSError,
    struct.error,
    zlib.error,
    MemoryError,
    AttributeError,
)
FEWEST = 10  # samples; what is shorter is a setting, not a signal


def read_mat(path: Path) -> Table:
    """Columns named like `rec.act_pos_deg_1`: the variable, its fields, and the number of the channel.

    The signals are those whose length most variables share; a matrix may hold its samples in rows or columns.
    Raises InputError for what is no .mat file, for version 7.3, and for a file without signals.
    """
    found = list(_arrays(_content(path)))
    lengths = [size for _, array in found for size in array.shape if size >= FEWEST]
    if not lengths:
        raise InputError(f"{path} holds no numeric array of at least {FEWEST} samples")
    samples = max(set(lengths), key=lambda size: (lengths.count(size), size))
    columns: dict[str, Array] = {}
    for name, array in found:
        if samples in array.shape:
            columns.update(_columns(name, array, samples))
    values = np.column_stack([values.astype(np.float64) for values in columns.values()])
    return Table(path.name, tuple(columns), values, 1 + np.arange(samples))


def _content(path: Path) -> dict[str, Any]:
    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise InputError(f"{path} is of MATLAB version 7.3: save it with `save(name, '-v7')`") from None
    except BROKEN as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"cannot read {path} as a .mat file: {reason[:200]}") from None
    return {name: value for name, value in content.items() if not name.startswith("__") and isinstance(name, str)}


def _arrays(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Array]]:
    """Numeric arrays with the path of field names that leads to each."""
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _arrays(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
            yield f"{prefix}{name}", value


def _columns(name: str, array: Array, samples: int) -> dict[str, Array]:
    if array.ndim == 1:
        return {name: array}
    rows = array if array.shape[0] == samples else array.T
    if rows.shape[1] == 1:
        return {name: rows[:, 0]}
    return {f"{name}_{channel + 1}": rows[:, channel] for channel in range(rows.shape[1])}
