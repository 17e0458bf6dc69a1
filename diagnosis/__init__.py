"""Diagnosis: from a mismatch between simulation and recording to named physics, with numbers and doubts.

`diagnosis.diagnose(recording)` does it all; it is loaded when it is asked for, so that the command line stays quick.
"""

from typing import Any


def __getattr__(name: str) -> Any:
    """`diagnose`, from its module."""
    if name != "diagnose":
        raise AttributeError(f"module 'diagnosis' has no attribute '{name}'")
    from armlab.diagnosis.diagnose import diagnose

    return diagnose
