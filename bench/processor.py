"""What of a processor decides the last digits: the kernels of BLAS, its threads, and the SIMD level of numpy."""

from functools import lru_cache
from typing import Any

import numpy as np
from threadpoolctl import threadpool_info


@lru_cache
def processor_kernels() -> dict[str, str]:
    """blas_kernels: of every BLAS that is loaded, with its version. simd: instructions that numpy found and uses.

    OPENBLAS_CORETYPE and NPY_DISABLE_CPU_FEATURES choose others on the same processor.
    """
    import scipy.linalg  # noqa: F401  # which brings a BLAS of its own

    blas = {f"{pool['internal_api']} {pool['version']} {pool['architecture']}" for pool in _blas_pools()}
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "blas_kernels": ", ".join(sorted(blas)),
        "simd": " ".join((simd.get("baseline") or []) + (simd.get("found") or [])),
    }


def kernels_text() -> str:
    """The kernels of BLAS and the SIMD level, in words."""
    return "{blas_kernels} ({simd})".format(**processor_kernels())


def blas_threads() -> int:
    """Threads of the linear algebra of this process; the most of any library."""
    return max((int(pool["num_threads"]) for pool in _blas_pools()), default=1)


def _blas_pools() -> list[dict[str, Any]]:
    pools: list[dict[str, Any]] = threadpool_info()
    return [pool for pool in pools if pool["user_api"] == "blas" and "architecture" in pool]
