"""Builds `armlab.common._linear_filter` from linear_filter.c; run by setup.py at installation."""

from pathlib import Path

import cffi

DECLARED = """
#define MAX_SECTIONS ...
#define MAX_LANES ...
typedef struct {
    double b0, b1, b2, a1, a2;
} Section;
void filter_both_ways(int sections, const Section *section, const double *settled, int64_t samples, int64_t columns,
    int64_t padding, const double *signal, int64_t first, int64_t step, int64_t kept, double *scratch, double *out);
void filter_forwards(int sections, const Section *section, const double *start, int64_t samples, const double *signal,
    double *out);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(DECLARED)
ffibuilder.set_source(
    "armlab.common._linear_filter",
    Path(__file__).with_name("linear_filter.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
