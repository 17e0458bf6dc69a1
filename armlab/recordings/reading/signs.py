"""Cheap physical signs that a recording or its robot file is read wrongly; each is a warning in one line."""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Finding, Recording, Run
from problem.arm import Arm
from problem.drive_torque import position_torque
from problem.joint_words import joint_in_words
from problem.motion import Motion
from problem.regressor import rigid_body_torque


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


def compare_standstill(recording: Recording, inertial: Array | None, tuning: ReadingTuning) -> tuple[Finding, ...]:
    """Warnings where the torque at standstill is not that which the links of the simulation need against gravity."""
    if inertial is None:
        return ()
    poses = [part for run in recording.runs for part in _standstills(run, tuning)]
    if not poses:
        return ()
    position, torque = (np.array(parts) for parts in zip(*poses, strict=True))
    still = np.zeros_like(position)
    at_rest = Motion(position, still, still)
    gravity = rigid_body_torque(recording.arm, at_rest, inertial) + position_torque(recording.arm, at_rest)
    scatter = np.max([np.std(run.torque, axis=0) for run in recording.runs], axis=0)
    out = []
    for joint in range(len(recording.arm)):
        needed, held = gravity[:, joint], torque[:, joint]
        loaded = np.abs(needed) > tuning.min_standstill_load * scatter[joint]
        if not loaded.any():
            continue
        share = float(np.median(held[loaded] / needed[loaded]))
        if share < tuning.least_standstill_share:
            own = joint_in_words(recording.arm, joint + 1)
            text = (
                f"at standstill {own} holds {np.median(held[loaded]):.3g}, gravity on the links asks for "
                f"{np.median(needed[loaded]):.3g}: another sign, zero or mounting, or torque without gravity?"
            )
            out.append(Finding("standstill", "warning", text, joint + 1))
    return tuple(out)


def _standstills(run: Run, tuning: ReadingTuning) -> list[tuple[Array, Array]]:
    """Mean position and torque of each stretch in which no joint moves."""
    width = max(round(tuning.standstill_s * run.rate_hz), 2)
    count = run.samples // width
    if count == 0:
        return []
    position = run.position[: count * width].reshape(count, width, -1)
    moved = np.ptp(position, axis=1)
    still = np.all(moved <= tuning.still_travel * np.maximum(np.ptp(run.position, axis=0), 1e-9), axis=1)
    torque = run.torque[: count * width].reshape(count, width, -1).mean(axis=1)
    return [(position[place].mean(axis=0), torque[place]) for place in np.flatnonzero(still)]
