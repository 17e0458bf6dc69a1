"""Drives that take a command over at a rate of their own and hold it: which of the logged commands they take.

The recording states the rate (`rate_hz`), not the phase of the clock that all drives share. So each phase, in samples
of the log, is replayed over whole runs, and the one that explains the motion of all joints best is taken, for each run:
with the least sum of log(mean squared error). What is left is less than a sample, and cannot be told from a delay.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import settle
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.windows import Windows, make_windows, mean_command
from armlab.recordings.recording import MotionRun

MAX_REMAINDER = 0.02  # of a hold: a rate that is no whole part of the log's has no phase in samples


def hold_commands(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    servos: Sequence[Array | None],
    tuning: MotionTuning = DEFAULT,
) -> list[MotionRun]:
    """The runs with the commands that the drives take, in place of those that were logged.

    servos: numbers, (parameters,) of each joint, None for one that stands still.
    """
    assert simulation.rate_hz is not None
    whole = replace(tuning, wanted_windows=1, longest_window_s=np.inf)
    held = []
    for run in runs:
        count = round(run.rate_hz / simulation.rate_hz)
        phases = [_taken(run, count, phase) for phase in range(count)]
        windows = make_windows([run], replace(simulation, rate_hz=None), whole)
        moving = [
            (joint, settle(windows[joint], values), values) for joint, values in enumerate(servos) if values is not None
        ]
        costs = [
            sum(np.log(_square(run, joint, taken, settled, values)) for joint, settled, values in moving)
            for taken in phases
        ]
        held.append(replace(run, reference_position=phases[int(np.argmin(costs))]))
    return held


def holds_samples(runs: Sequence[MotionRun], rate_hz: float | None) -> bool:
    """Whether drives that take commands over at a rate hold each for a whole number of samples, two or more."""
    if rate_hz is None:
        return False
    ratios = np.array([run.rate_hz / rate_hz for run in runs])
    return bool(np.all(ratios > 1.5) and np.all(np.abs(ratios - np.round(ratios)) < MAX_REMAINDER))


def _taken(run: MotionRun, count: int, phase: int) -> Array:
    """Commands (samples, joints) of which every `count`-th sample is taken over from `phase` on; rows may be lost."""
    assert run.reference_position is not None
    sample = _sample_numbers(run)
    tick = (sample - phase) // count * count + phase
    return np.asarray(run.reference_position[np.maximum(np.searchsorted(sample, tick, side="right") - 1, 0)])


def _sample_numbers(run: MotionRun) -> NDArray[np.intp]:
    """The number of each row on the even grid of the log, (samples,): stamps are late, and rows may be lost."""
    steps = np.maximum(np.round(np.diff(run.time) * run.rate_hz), 1)
    slope, first = np.polyfit(np.append(0.0, np.cumsum(steps)), run.time, 1)
    return np.maximum.accumulate(np.round((run.time - first) / slope).astype(np.intp))


def _square(run: MotionRun, joint: int, taken: Array, windows: Windows, values: Array) -> float:
    """Mean squared error of a joint's replay over the whole run with other commands."""
    around = run.time[0] + windows.step_s * np.arange(-windows.history, windows.command.shape[1] - windows.history)
    command = mean_command(replace(run, reference_position=taken), joint, around, windows.step_s, None)
    moved = replace(windows, command=np.ascontiguousarray(command[None]))
    return max(float(np.mean(joint_errors(moved, values) ** 2)), 1e-300)
