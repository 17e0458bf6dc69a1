"""Zeros of joints that stand a quarter or half a turn from where the robot file has them.

Drivers and D-H tables often count from different poses. The torques of such a recording can still be fitted, only
badly: gravity then follows the wrong axis. The zero of a last joint cannot be seen: its link takes the turn in.
"""

from dataclasses import replace

import numpy as np

from problem.arm import Arm
from problem.base_parameters import base_parameters
from recordings.checks.fit import Thinned, fit_columns, held_out_errors
from recordings.run import Array, Finding

TURNS_DEG = (90, -90, 180)
CLEARLY = 0.8  # times the error: a turned zero has to be so much better to be named


def turned_zero(arm: Arm, thinned: Thinned) -> Finding | None:
    """A warning where a joint's turned zero explains the torques much better."""
    own = _errors(arm, thinned, np.zeros(len(arm)))
    size = np.std(thinned.torque, axis=0)
    trials = {
        (joint, turn): _share(_errors(arm, thinned, np.deg2rad(turn) * np.eye(len(arm))[joint]), own, size)
        for joint in range(len(arm))
        if arm.joints[joint].kind == "revolute"
        for turn in TURNS_DEG
    }
    best = min(trials, key=lambda trial: trials[trial], default=None)
    if best is None or trials[best] > CLEARLY:
        return None
    joint, turn = best
    text = (
        f"with its zero turned by {turn:+d} deg, joint {joint + 1} explains the torques much better "
        f"(error x {trials[best]:.2f}): see transmission.offset, or theta_offset of the robot file"
    )
    return Finding("turned_zero", "warning", text, joint + 1)


def _errors(arm: Arm, thinned: Thinned, offset: Array) -> Array:
    motion = replace(thinned.motion, position=thinned.motion.position + offset)
    return held_out_errors(fit_columns(arm, base_parameters(arm), motion), thinned, np.arange(len(arm)))


def _share(errors: Array, own: Array, size: Array) -> float:
    """The error of all joints in N m, as a share of that without a turn."""
    return float(np.linalg.norm(errors * size) / max(float(np.linalg.norm(own * size)), 1e-300))
