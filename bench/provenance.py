"""The provenance of an outcome: versions, machine and commit, stored beside it."""

import json
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

import numpy as np

from bench.processor import blas_threads, processor_kernels

_PACKAGES = ("armlab", "numpy", "scipy", "cmaes", "joblib")


def provenance() -> str:
    """JSON text with versions, kernels and threads of BLAS, SIMD level, processor, system and commit."""
    blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    facts = {
        "python": platform.python_version(),
        **{package: version(package) for package in _PACKAGES},
        "blas": f"{blas['name']} {blas['version']}",
        **processor_kernels(),
        "blas_threads": blas_threads(),
        "processor": _processor_name(),
        "system": platform.platform(),
        "commit": _git_commit(),
    }
    return json.dumps(facts, sort_keys=True)


def _processor_name() -> str:
    """The processor's name; on Linux only /proc has it."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _git_commit() -> str | None:
    """`git describe` of the source tree, with -dirty if files were changed; None outside of one."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.strip() or None
