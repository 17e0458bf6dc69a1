"""Builds `armlab.diagnosis.motion._joint_replay` from joint_replay.c; run by setup.py at installation."""

from pathlib import Path

import cffi

LANES = 8  # windows that are replayed at once
MOST_JOINTS = 16  # of an arm whose joints are replayed together

DECLARED = """
typedef struct {
    double kp, damping, friction, kd, armature, limit, limit_slope, delay, offset, dead_band, load_friction,
        static_excess, stribeck_speed, ki, ki_speed, integral_limit, payload;
} Servo;
typedef struct {
    int64_t windows, steps, columns, history, path_columns;
    double step, encoder_step, encoder_phase;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const double *unit_inertia, *unit_load, *unit_slope, *path_command, *path_measured, *integral;
    const int64_t *begin, *row, *run, *start;
    const double *fraction;
} Stretch;
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *path,
    double *out);
typedef struct {
    int64_t rows, every;
    const double *mass, *moves;
} MassTable;
void replay_arm(int64_t joints, const Stretch *at, const Servo *servos, const MassTable *table, double *integrals,
    double *position, double *velocity);
"""

DEFINED = f"#define LANES {LANES}\n#define MOST_JOINTS {MOST_JOINTS}\n"
ffibuilder = cffi.FFI()
ffibuilder.cdef(DEFINED + DECLARED)
ffibuilder.set_source(
    "armlab.diagnosis.motion._joint_replay",
    DEFINED + Path(__file__).with_name("joint_replay.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
