"""Builds `armlab.proof.blind.servo._servo_arm` from servo_arm.c; run by setup.py at installation."""

from pathlib import Path

import cffi

STRUCTS = """
typedef struct {
    double shift[3], axis[3], mass, centre[3], inertia[6];
} BodyData;
typedef struct {
    double kp, kd, ki, integral_limit, position_gain;
    int cascaded;
    double limit, limit_slope, delay, dead_band, offset, count;
    double armature, damping, friction, static_extra, stribeck_velocity, load_friction;
} ServoData;
typedef struct {
    double gravity[3], step, hold, phase, period, sag;
} ArmData;
"""
FUNCTIONS = """
void mass_and_bias(int joints, const BodyData *body, const double *gravity, const double *q, const double *v,
    double *mass, double *bias);
int simulate(int joints, const BodyData *body, const ServoData *servo, const ArmData *arm, int64_t steps,
    int64_t commands, const double *command, const double *first, double *positions);
int follow(int joints, const BodyData *body, const ServoData *servo, const double *gravity, double h, int64_t steps,
    const double *given, const double *position, const double *velocity, double *positions, double *velocities,
    double *torques);
"""

ffibuilder = cffi.FFI()
ffibuilder.cdef(STRUCTS + FUNCTIONS)
ffibuilder.set_source(
    "armlab.proof.blind.servo._servo_arm",
    STRUCTS + Path(__file__).with_name("servo_arm.c").read_text(),
    extra_compile_args=["-O3", "-ffp-contract=off"],
)
