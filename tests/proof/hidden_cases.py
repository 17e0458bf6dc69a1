"""Short cases of the three-joint arm with chosen effects, nothing else hidden and hardly any noise."""

from dataclasses import replace
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import make_machine
from armlab.proof.blind.case_files import log_run
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.noise import Noise
from armlab.proof.blind.plan import Plan, RunPlan
from armlab.proof.blind.simulate import rigid_torque
from armlab.proof.blind.sizing import SimulatedCase, simulate_case
from problem.motion import Motion

MACHINE = make_machine("irb120-arm")
RUNS = (RunPlan("multisine", 5.0, "identify"), RunPlan("fourier", 2.5, "validate"))


def plan(level: float = 0.05, rate_hz: int = 500, **others: Any) -> Plan:
    """Nothing hidden: 5 s to learn from, 2.5 s held out."""
    white = np.full(MACHINE.joints, level)
    noise = Noise("white", white, 0.02 * white, 5.0)
    base = Plan(1004, 1, "clean", "single", MACHINE, RUNS, rate_hz, noise, MACHINE.arm, (), ())
    return replace(base, **others)


def case(*hidden: HiddenEffect, **others: Any) -> SimulatedCase:
    return simulate_case(plan(**others), tuple(hidden))


def residual(made: SimulatedCase, run: int = 0) -> tuple[Array, Motion, Array]:
    """Recorded torque less that of the nominal arm on the recorded motion, the motion, and the nominal torque."""
    log = log_run(made, run, noisy=False)
    sampled = made.tracks[run].at(log.time).motion
    motion = Motion(log.position, sampled.velocity, sampled.acceleration)
    nominal = rigid_torque(made.plan.machine.arm, motion)
    return log.torque - nominal, motion, nominal
