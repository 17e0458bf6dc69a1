"""The compiled kernel, and pointers to numpy arrays for it."""

from typing import Any

from armlab.common.arrays import Array
from problem._kernel import ffi, lib

__all__ = ["ffi", "lib", "pointer"]

_NUMBERS = ffi.typeof("double *")  # found once: a look-up by name takes a third of the time of a pointer


def pointer(array: Array) -> Any:
    """The memory of a contiguous array, as a C pointer; the array must outlive its use."""
    return ffi.from_buffer(_NUMBERS, array)
