"""Builds `armlab.diagnosis.motion._joint_replay` from joint_replay.c; run by setup.py at installation."""

from pathlib import Path

import cffi

DECLARED = """
typedef struct {
    double kp, damping, friction, kd, armature, limit, delay, offset, dead_band, load_friction;
} Servo;
typedef struct {
    int64_t windows, steps, columns, history;
    double step;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const int64_t *begin, *row;
    const double *fraction;
} Stretch;
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *out);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(DECLARED)
ffibuilder.set_source(
    "armlab.diagnosis.motion._joint_replay",
    Path(__file__).with_name("joint_replay.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
