"""Builds `problem._spectra` from spectra.c; run by setup.py at installation."""

from pathlib import Path

import cffi

ffibuilder = cffi.FFI()
ffibuilder.cdef(
    """
int64_t spectra(int64_t count, int n, const double *grams, double max_condition, double *scratch, double *out);
"""
)
ffibuilder.set_source(
    "problem._spectra",
    Path(__file__).with_name("spectra.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi"],
)
