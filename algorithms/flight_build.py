"""Builds `algorithms._flight` from flight.c; run by setup.py at installation."""

from pathlib import Path

import cffi

ffibuilder = cffi.FFI()
ffibuilder.cdef(
    """
typedef struct {
    int64_t n, d;
    double *x, *v, *p, *best, *limit;
} Particles;
void fly(const Particles *all, int64_t leader, double w, double c1, double c2, const double *r);
int64_t land(const Particles *all, const double *told, const double *fitness);
"""
)
ffibuilder.set_source(
    "algorithms._flight",
    Path(__file__).with_name("flight.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
