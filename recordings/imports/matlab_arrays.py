"""Numeric arrays of a MATLAB file: `python -m recordings.imports.matlab_arrays FILE OUT.npz`.

A process of its own, because SciPy's compiled reader dies of some broken files instead of raising an error.
"""

import struct
import sys
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from problem.errors import InputError
from recordings.run import Array

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
    Warning,
    NameError,  # a variable that SciPy's reader leaves unbound for an unknown class
)
REFUSED = 2  # exit code; the reason stands in the last line of the standard error


def numeric_arrays(path: Path) -> list[tuple[str, Array]]:
    """Vectors and matrices of numbers, named by the path of field names that leads to each.

    Raises InputError for what is no .mat file, and for version 7.3.
    """
    return list(_arrays(_content(path)))


def _content(path: Path) -> dict[str, Any]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # SciPy warns where numbers may be wrong, and reads on
            content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise InputError(f"{path} is of MATLAB version 7.3: save it with `save(name, '-v7')`") from None
    except BROKEN as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"cannot read {path} as a .mat file: {reason[:200]}") from None
    return {name: value for name, value in content.items() if not name.startswith("__") and isinstance(name, str)}


def _arrays(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Array]]:
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _arrays(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
            yield f"{prefix}{name}", value.astype(np.float64)


def main(file: str, out: str) -> int:
    """Writes names and arrays, in their order."""
    try:
        found = numeric_arrays(Path(file))
    except InputError as error:
        print(error, file=sys.stderr)
        return REFUSED
    content: dict[str, Any] = {f"array{index}": array for index, (_, array) in enumerate(found)}
    np.savez(out, names=np.array([name for name, _ in found], dtype=np.str_), **content)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
