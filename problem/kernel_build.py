"""Builds `problem._kernel` from kernel.c; run by setup.py at installation."""

from pathlib import Path

import cffi

STRUCTS = """
typedef struct {
    int prismatic, shifted_before, shifted_after;
    double before_rotation[9], before_shift[3];
    double after_rotation[9], after_shift[3];
    double axis[3];
} JointData;
"""
FUNCTIONS = """
void observation_matrices(int joints, const JointData *data, const double *gravity, int64_t samples,
    const double *q, const double *qd, const double *qdd, double *out);
void gram_matrices(int joints, const JointData *data, const double *gravity, int64_t trajectories,
    int64_t samples, const double *q, const double *qd, const double *qdd, int chosen, const int *columns,
    const int *first, int owned, const double *own, double *scratch, double *out);
int64_t gram_scratch(int joints, int n);
void torques(int joints, const JointData *data, const double *gravity, int64_t samples, const double *q,
    const double *qd, const double *qdd, const double *parameters, double *out);
void series(int orders, int64_t trajectories, int64_t samples, int joints, int terms, const double *basis,
    const double *coefficients, double *scratch, double *out);
void series_extremes(int64_t trajectories, int64_t samples, int joints, int terms, const double *basis,
    const double *coefficients, double *out);
void peaks(int64_t trajectories, int64_t samples, int joints, const double *q, const double *qd,
    const double *qdd, double *out);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(STRUCTS + FUNCTIONS)
ffibuilder.set_source(
    "problem._kernel",
    Path(__file__).with_name("kernel.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off", "-Wno-psabi"],
)
