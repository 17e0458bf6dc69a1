"""Fits the servos of all joints: the arm is replayed for the loads, then each joint chooses its numbers alone."""

from collections.abc import Callable, Sequence
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

    starts: numbers, (parameters,) of each joint, with which the arm is replayed; None for a joint that stands still.
    """
    windows, chosen = coupled_windows(runs, simulation, starts, tuning), list[ChosenServo | None]()
    for number, joint in enumerate(windows):
        progress(f"fitting joint {number + 1} of {len(windows)}")
        moves = starts[number] is not None
        nominal = simulation.nominal.values[number]
        fitted = choose_servo(joint, nominal, number_of_tests(len(windows)), tuning) if moves else None
        chosen.append(fitted if fitted is not None and _explains(joint, fitted, tuning) else None)
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
