"""Compiles the C kernel of the observation matrix; everything else stands in pyproject.toml."""

from setuptools import setup

setup(cffi_modules=["problem/kernel_build.py:ffibuilder"])
