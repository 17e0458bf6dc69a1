"""Compiles what is too slow in Python; all else is in pyproject.toml."""

from setuptools import setup

setup(
    cffi_modules=[
        "algorithms/flight_build.py:ffibuilder",
        "problem/kernel_build.py:ffibuilder",
        "problem/spectra_build.py:ffibuilder",
        "armlab/common/linear_filter_build.py:ffibuilder",
        "armlab/effects/drive_train_build.py:ffibuilder",
        "armlab/diagnosis/motion/joint_replay_build.py:ffibuilder",
        "armlab/proof/blind/servo/servo_arm_build.py:ffibuilder",
    ]
)
