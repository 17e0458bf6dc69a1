"""Builds `armlab.diagnosis.motion._joint_replay` from joint_replay.c; run by setup.py at installation."""

from pathlib import Path

import cffi

LANES = 8  # windows that are replayed at once

DECLARED = """
typedef struct {
    double kp, damping, friction, kd, armature, limit, delay, offset, dead_band, load_friction, ki,
        integral_limit, payload;
} Servo;
typedef struct {
    int64_t windows, steps, columns, history, path_columns;
    double step;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const double *unit_inertia, *unit_load, *unit_slope, *path_command, *path_measured, *integral;
    const int64_t *begin, *row, *run, *start;
    const double *fraction;
} Stretch;
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *path,
    double *out);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(f"#define LANES {LANES}\n{DECLARED}")
ffibuilder.set_source(
    "armlab.diagnosis.motion._joint_replay",
    f"#define LANES {LANES}\n" + Path(__file__).with_name("joint_replay.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
