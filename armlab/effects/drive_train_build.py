"""Builds `armlab.effects._drive_train` from drive_train.c; run by setup.py at installation."""

from pathlib import Path

import cffi

DECLARED = """
typedef struct {
    double stiffness, damping, gap;
} DriveTrain;
void twists_of_drive_trains(int trains, const DriveTrain *train, int64_t samples, double interval, int half_steps,
    const double *load, const double *inertia, const double *by_speed, const double *by_angle, double *out);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(DECLARED)
ffibuilder.set_source(
    "armlab.effects._drive_train",
    Path(__file__).with_name("drive_train.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off", "-Wno-psabi"],
)
