"""The compiled kernel, and pointers to numpy arrays for it."""

from typing import Any

from numpy.typing import NDArray

from problem._kernel import ffi, lib

__all__ = ["ffi", "lib", "pointer"]


def pointer(array: NDArray[Any], kind: str = "double *") -> Any:
    """The memory of a contiguous array, as a C pointer; the array must outlive its use."""
    return ffi.from_buffer(kind, array)
