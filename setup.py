"""Compiles what is too slow in Python, the observation matrix and drive trains; all else is in pyproject.toml."""

from setuptools import setup

setup(cffi_modules=["problem/kernel_build.py:ffibuilder", "armlab/effects/drive_train_build.py:ffibuilder"])
