"""Joints whose column of torque holds none: zero or constant throughout, or the copy of another column.

Such a joint is left out: its torque is zero, and so is what the dynamics of the arm say of it (`Arm.unmeasured`). Its
motion still moves the other joints.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from armlab.recordings.recording import Finding, Recording, Run
from problem.arm import Arm
from problem.joint_words import joint_in_words
from problem.regressor import measured_rows

NO_TORQUE = "no_torque"  # an id of the setup effects


@dataclass(frozen=True)
class DeadJoint:
    """A joint, from 0, without torque. form: what its column holds."""

    joint: int
    form: str


def dead_joints(runs: Sequence[Run], arm: Arm) -> tuple[DeadJoint, ...]:
    """The joints without torque among those that the arm does not leave out yet; runs: one at least."""
    still = [joint for joint in arm.measured if all(np.ptp(run.torque[:, joint]) == 0 for run in runs)]
    found = [DeadJoint(joint, _constant_in_words(joint, runs)) for joint in still]
    found += _copies([joint for joint in arm.measured if joint not in still], runs, arm)
    return tuple({each.joint: each for each in reversed(found)}.values())


def _constant_in_words(joint: int, runs: Sequence[Run]) -> str:
    return "never changes" if any(np.any(run.torque[:, joint]) for run in runs) else "is zero throughout"


def _copies(joints: Sequence[int], runs: Sequence[Run], arm: Arm) -> Iterator[DeadJoint]:
    """Both joints of each pair of equal columns: which of them is the copy, no column says."""
    for pair in combinations(joints, 2):
        if all(np.array_equal(*run.torque[:, pair].T) for run in runs):
            for joint, other in (pair, pair[::-1]):
                yield DeadJoint(joint, f"is that of {joint_in_words(arm, other + 1)} in every row")


def leave_dead_joints_out(recording: Recording) -> Recording:
    """The recording without the torque of joints that have none, each with a warning.

    As it is where no joint is left then: nothing can be said of such a recording.
    """
    arm = recording.arm
    identify = recording.with_role("identify") or recording.runs
    dead = dead_joints(identify, arm) if identify else ()
    left_out = arm.unmeasured | {each.joint for each in dead}
    if not left_out or len(left_out) == len(arm):
        return recording
    found = tuple(
        Finding(
            NO_TORQUE,
            "warning",
            f"torque of {joint_in_words(arm, each.joint + 1)} {each.form}: left out",
            each.joint + 1,
        )
        for each in dead
    )
    return replace(_without_torque(recording, left_out), findings=(*recording.findings, *found))


def leave_out_together(*recordings: Recording) -> tuple[Recording, ...]:
    """Recordings of one arm, each without the joints that any of them has no torque of."""
    joints = frozenset[int]().union(*(each.arm.unmeasured for each in recordings))
    return tuple(_without_torque(each, joints) for each in recordings)


def _without_torque(recording: Recording, joints: frozenset[int]) -> Recording:
    arm = replace(recording.arm, unmeasured=joints)
    runs = tuple(run.with_signals(run.time, {"torque": measured_rows(arm, run.torque)}) for run in recording.runs)
    return replace(recording, arm=arm, runs=runs)
