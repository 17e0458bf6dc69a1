"""The one gate before numbers: can anything be identified from these runs? Each answer says what is needed.

It is asked of the recording as it is read, after all repairs, by all who fit or compare torques.
"""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.possible import (
    OUTLIER_SHARE,
    can_have_position,
    can_have_torque,
    position_range,
    usual_speeds,
)
from armlab.recordings.recording import Recording, Run
from armlab.recordings.repair import duplicated_rows
from problem.arm import Arm
from problem.joint_words import joints_in_words

MIN_DURATION_S = 2.0  # of all runs that identify: too short to tell physics from chance (chosen by eye)
MIN_TRAVEL = 1e-3  # rad or m: a joint that travels less does not move (chosen by eye)
MAX_MULTIPLE_DIFFERENCE = 1e-6  # of the range of a torque: what digits of a file leave between it and its multiple
MAX_COPIED_SHARE = 0.5  # of the rows of a run that validates, found in a run that identifies


def require_identifiable(*recordings: Recording) -> None:
    """Raises InputError, in one line, where one of several recordings, or all together, tell nothing of an arm.

    A joint may be without torque in one of several recordings: that is a change between them.
    """
    for recording in recordings:
        runs = recording.runs_to_identify()
        judge = reason_dead_to_judge(recording) or reason_copied(recording)
        _refuse(recording, reason_short(runs) or reason_still(runs) or judge)
    runs = tuple(run for recording in recordings for run in recording.runs_to_identify())
    reason = reason_dead(runs, recordings[0].arm)
    if reason is not None:
        raise InputError(f"{' and '.join(str(each.folder) for each in recordings)}: {reason}")


def require_possible(*recordings: Recording) -> None:
    """Raises InputError, in one line, for numbers that no arm could show; asked once units are read rightly."""
    for recording in recordings:
        _refuse(recording, reason_impossible(recording.runs, recording.arm))


def require_torque(recording: Recording) -> None:
    """Raises InputError, in one line, for runs with which no torque can be compared; they may be short and stand."""
    _refuse(recording, reason_dead(recording.runs, recording.arm) or reason_dead_to_judge(recording))
    require_possible(recording)


def _refuse(recording: Recording, reason: str | None) -> None:
    if reason is not None:
        raise InputError(f"{recording.folder}: {reason}")


def reason_not_identifiable(recording: Recording) -> str | None:
    """The reason in a sentence; None for a recording that can be used. InputError where no run identifies."""
    runs = recording.runs_to_identify()
    of_runs = reason_short(runs) or reason_still(runs) or reason_dead(runs, recording.arm)
    return of_runs or reason_dead_to_judge(recording) or reason_copied(recording)


def reason_short(runs: Sequence[Run]) -> str | None:
    """Runs that last too short a time in all."""
    seconds = sum(float(run.time[-1] - run.time[0]) for run in runs)
    if seconds >= MIN_DURATION_S:
        return None
    return f"The runs hold {seconds:.2g} s in all: too short to tell physics from chance; record 10 s or more."


def reason_still(runs: Sequence[Run]) -> str | None:
    """An arm that stands."""
    if any(np.any(np.ptp(run.position, axis=0) > MIN_TRAVEL) for run in runs):
        return None
    return "No joint moves in any run that identifies: there is nothing that the torques could be compared with."


def has_no_torque(runs: Sequence[Run]) -> bool:
    """Whether the torque of no joint ever changes."""
    return all(not np.any(np.ptp(run.torque, axis=0)) for run in runs)


def reason_dead(runs: Sequence[Run], arm: Arm) -> str | None:
    """Torques that never change, and columns that are copies of others."""
    dead = [joint for joint in arm.measured if all(np.ptp(run.torque[:, joint]) == 0 for run in runs)]
    if dead:
        zero = all(not np.any(run.torque[:, dead]) for run in runs)
        if zero and len(dead) == len(arm):
            return (
                "The torque of all joints is zero throughout: the driver does not fill it. Name the columns of a "
                "measured torque or current, or those of the commands (reference_position) for a recording of motion."
            )
        said = "is zero throughout" if zero else "never changes"
        words = joints_in_words(arm, [joint + 1 for joint in dead])
        return f"The torque of {words} {said}: is the right column named?"
    for first, second in combinations(arm.measured, 2):
        words = joints_in_words(arm, [first + 1, second + 1])
        for name in ("torque", "position"):
            if all(_is_copy(run.signals[name][:, first], run.signals[name][:, second]) for run in runs):
                return f"The {name} of {words} is the same in every row: one column is a copy of the other."
        factor = _factor_of_multiple([run.torque[:, [first, second]] for run in runs])
        if factor is not None:
            return (
                f"The torque of {words} differs by the factor {factor:.4g} in every row: one column is a multiple of "
                "the other."
            )
    return reason_motion_column(runs, arm)


def reason_motion_column(runs: Sequence[Run], arm: Arm) -> str | None:
    """A torque that is a multiple of a position or velocity, which no body needs: another column was named for it."""
    for joint, other, name in product(arm.measured, range(len(arm)), ("position", "velocity")):
        if all(name in run.signals for run in runs):
            pairs = [np.column_stack([run.signals[name][:, other], run.torque[:, joint]]) for run in runs]
            factor = _factor_of_multiple(pairs)
            if factor is not None:
                moved = f"{factor:.4g} times the {name} of {joints_in_words(arm, [other + 1])}"
                return (
                    f"The torque of {joints_in_words(arm, [joint + 1])} is {moved} in every row: is the right column "
                    "named?"
                )
    return None


def _is_copy(first: Array, second: Array) -> bool:
    return bool(np.ptp(first) > 0 and np.array_equal(first, second))


def _factor_of_multiple(pairs: Sequence[Array]) -> float | None:
    """The factor between two torques where one is a multiple of the other in all rows, (rows, 2) each; else None."""
    first, second = np.concatenate(pairs).T
    range_of_second = float(np.ptp(second))
    if not np.ptp(first) > 0 or not range_of_second > 0:
        return None
    factor = float(first @ second / (first @ first))
    is_multiple = np.max(np.abs(second - factor * first)) <= MAX_MULTIPLE_DIFFERENCE * range_of_second
    return factor if is_multiple else None


def reason_impossible(runs: Sequence[Run], arm: Arm) -> str | None:
    """Positions and torques that no arm could show, as the import refuses them."""
    for run in runs:
        low, high = position_range(run.position)
        speeds = usual_speeds(run.position, float(np.median(np.diff(run.time))))
        for place, joint in enumerate(arm.joints):
            words = joints_in_words(arm, [place + 1])
            if not can_have_position(joint, low[place], high[place], speeds[place]):
                reached = f"runs from {low[place]:.4g} to {high[place]:.4g}"
                return f"The position of {words} {reached}: no arm is there. Which unit is it in?"
            torque = float(np.quantile(np.abs(run.torque[:, place]), 1 - OUTLIER_SHARE))
            if not can_have_torque(joint, torque, 0.0, None):
                return f"The torque of {words} reaches {torque:.4g}, more than any drive has. Which unit is it in?"
    return None


def reason_dead_to_judge(recording: Recording) -> str | None:
    """A run that validates and lacks a torque of a joint that moves, which other runs have."""
    for judge in recording.with_role("validate"):
        moves = np.ptp(judge.position, axis=0) > MIN_TRAVEL
        known = np.any([np.ptp(run.torque, axis=0) > 0 for run in recording.runs], axis=0)
        dead = np.flatnonzero(moves & known & (np.ptp(judge.torque, axis=0) == 0))
        if len(dead):
            words = joints_in_words(recording.arm, [int(joint) + 1 for joint in dead])
            return (
                f"The torque of {words} never changes in {judge.name}, which validates, though it moves there: its "
                "error says nothing. Give another run, or none."
            )
    return None


def reason_copied(recording: Recording) -> str | None:
    """A run that validates and holds the rows of one that identifies."""
    for judge in recording.with_role("validate"):
        for run in recording.with_role("identify"):
            both = [np.vstack([run.position, judge.position]), np.vstack([run.torque, judge.torque])]
            copied = duplicated_rows(both)[run.samples :].mean()
            if copied > MAX_COPIED_SHARE:
                return (
                    f"{judge.name} validates and holds rows of {run.name}, which identifies ({copied:.0%} of them): "
                    "its errors say nothing of other motion. Give another run, or none."
                )
    return None
