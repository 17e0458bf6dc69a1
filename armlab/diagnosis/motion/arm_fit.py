"""Fits the servos of all joints: their replays make the loads, then each joint chooses its numbers alone.

Numbers and loads depend on each other. So the usual numbers and the loads take turns first, and where a joint has
chosen a number beyond the usual ones, the loads are made and the numbers are chosen again as long as that lowers the
errors.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.choose import ChosenServo, choose_servo
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.estimate import fit_servo, thin_windows
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.servo import LOWEST, OPTIONAL, USUAL, place
from armlab.diagnosis.motion.simulation import ServoSimulation
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows
from armlab.recordings.recording import MotionRun


@dataclass(frozen=True, eq=False)
class ArmFit:
    """The servos of an arm with the inertias of a simulation.

    starts: numbers, (parameters,) of each joint, with which the arm was replayed; windows: of each joint; chosen: its
    servo, None for one that stands still or follows no servo.
    """

    simulation: ServoSimulation
    starts: Sequence[Array | None]
    windows: list[Windows]
    chosen: list[ChosenServo | None]

    @property
    def values(self) -> list[Array | None]:
        """Fitted numbers, (parameters,) of each joint."""
        return [None if each is None else each.fit.values for each in self.chosen]


def fit_arm(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    starts: Sequence[Array | None],
    progress: Callable[[str], None],
    tuning: MotionTuning = DEFAULT,
) -> ArmFit:
    """The servos of all joints.

    starts: numbers, (parameters,) of each joint; None for a joint that stands still.
    """
    progress("replaying the joints together")
    for _ in range(tuning.coupling_rounds):
        windows = coupled_windows(runs, simulation, starts, tuning)
        starts = [
            None if values is None else _refit(own, values, tuning) for own, values in zip(windows, starts, strict=True)
        ]
    fit = _choose_all(runs, simulation, starts, progress, tuning)
    for _ in range(tuning.coupling_choices - 1):
        if not any(each is not None and (each.free & np.array(OPTIONAL)).any() for each in fit.chosen):
            break
        before = fit
        starts = [given if own is None else own for own, given in zip(fit.values, starts, strict=True)]
        fit = _choose_all(runs, simulation, starts, progress, tuning)
        if _log_squares(fit) > _log_squares(before) + np.log(1 - tuning.min_gain):
            break
    return fit


def _log_squares(fit: ArmFit) -> float:
    """Sum of the logarithms of the squared errors of all joints."""
    return float(2 * sum(np.log(max(each.fit.rms, 1e-300)) for each in fit.chosen if each is not None))


def _refit(windows: Windows, values: Array, tuning: MotionTuning) -> Array:
    few = thin_windows(windows, tuning.max_start_windows)
    return fit_servo(few, values, np.array(USUAL), tuning.refit_evaluations).values


def _choose_all(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    starts: Sequence[Array | None],
    progress: Callable[[str], None],
    tuning: MotionTuning,
) -> ArmFit:
    windows = coupled_windows(runs, simulation, starts, tuning)
    looks = number_of_tests(len(windows))

    def choose(number: int) -> ChosenServo | None:
        if starts[number] is None:
            return None
        fitted = choose_servo(windows[number], simulation.nominal.values[number], looks, tuning)
        return fitted if _explains(windows[number], fitted, tuning) else None

    chosen = list[ChosenServo | None]()
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # replays in C leave Python to other threads
        for number, each in enumerate(pool.map(choose, range(len(windows)))):
            chosen.append(each)
            progress(f"fitted joint {number + 1} of {len(windows)}")
    return ArmFit(simulation, starts, windows, chosen)


def number_of_tests(joints: int) -> int:
    """In the diagnosis of an arm, for Bonferroni's correction: each number that is fitted, and one payload."""
    return joints * (sum(USUAL) + sum(OPTIONAL)) + 1


def _explains(windows: Windows, chosen: ChosenServo, tuning: MotionTuning) -> bool:
    """Whether the command explains the motion: a servo without gain, the rest fitted anew, does much worse."""
    few = thin_windows(windows, tuning.max_start_windows)
    free, values = chosen.fit.free.copy(), chosen.fit.values.copy()
    free[place("kp")], values[place("kp")] = False, LOWEST[place("kp")]
    passive = fit_servo(few, values, free, tuning.max_evaluations)
    error = joint_errors(few.with_integral(chosen.fit.integral), chosen.fit.values)[0]
    return float(np.sqrt(np.mean(error**2))) < tuning.max_unexplained * passive.rms
