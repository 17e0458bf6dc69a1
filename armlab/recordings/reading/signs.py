"""Cheap physical signs that a recording or its robot file is read wrongly; each is a warning in one line."""

from collections.abc import Sequence

import numpy as np

from armlab.recordings.recording import Finding, Recording
from problem.arm import Arm
from problem.joint_words import joint_in_words


def compare_joint_names(columns: Sequence[str], arm: Arm, signal: str) -> tuple[Finding, ...]:
    """Warnings where a column bears the name of another joint of the robot than that at its place."""
    names = [joint.name.lower() for joint in arm.joints]
    if len(columns) != len(names):
        return ()
    out = []
    for place, column in enumerate(columns):
        # the longest name counts, as in joint_10 and joint_1
        named = sorted((name for name in names if name in column.lower()), key=len)
        if named and len(set(names)) == len(names) and named[-1] != names[place]:
            text = (
                f"column {column} of {signal} stands for {joint_in_words(arm, place + 1)} and bears the name of "
                f"{joint_in_words(arm, names.index(named[-1]) + 1)}: columns in another order?"
            )
            out.append(Finding("joint_names", "warning", text, place + 1))
    return tuple(out)


def has_no_sign(recording: Recording) -> bool:
    """Whether all torques are sizes without a sign: none is ever negative, and each comes down to zero again and again.

    A joint that only carries a load has torque of one sign; a joint that moves to and fro against friction has not.
    """
    torques = np.concatenate([run.torque for run in recording.runs])
    peak = np.abs(torques).max(axis=0)
    if not peak.all() or torques.min() < 0:
        return False
    low = torques < LOW_SHARE * peak
    touches = np.sum(low[1:] & ~low[:-1], axis=0)
    return bool(np.all(touches >= MIN_TOUCHES))


LOW_SHARE = 0.05  # of the largest torque: what counts as zero
MIN_TOUCHES = 4  # times that a torque comes down to zero
