"""Fits the servos of all joints: their replays make the loads, then each joint chooses its numbers alone.

Numbers and loads depend on each other. So the usual numbers and the loads take turns first. Where a joint has chosen a
number beyond the usual ones, or the replay needs a shorter step, the loads are made again, and each joint whose fit
they change chooses anew, until all are settled.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.calm_windows import confirm_in_calm_windows
from armlab.diagnosis.motion.choose import ChosenServo, choose_servo, free_at_first
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.estimate import begin_integrals, fit_servo, settle, thin_windows, to_coordinates
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import LOWEST, OPTIONAL, USUAL, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.windows import Windows
from armlab.recordings.recording import MotionRun


@dataclass(frozen=True, eq=False)
class ArmFit:
    """The servos of an arm with the inertias of a simulation.

    runs: with the commands that the drives take; starts: numbers, (parameters,) of each joint, with which the arm was
    replayed; windows: of each joint; chosen: its servo, None for one that stands still or follows no servo. tuning:
    with the step that these servos need.
    """

    runs: Sequence[MotionRun]
    simulation: ServoSimulation
    starts: Sequence[Array | None]
    windows: list[Windows]
    chosen: list[ChosenServo | None]
    tuning: MotionTuning

    @property
    def values(self) -> list[Array | None]:
        """Fitted numbers, (parameters,) of each joint."""
        return [None if each is None else each.fit.values for each in self.chosen]


def fit_arm(
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    simulation: ServoSimulation,
    starts: Sequence[Array | None],
    progress: Callable[[str], None],
    tuning: MotionTuning = DEFAULT,
) -> ArmFit:
    """The servos of all joints.

    taken: the runs with the commands that drives with these numbers take.
    starts: numbers, (parameters,) of each joint; None for a joint that stands still.
    """
    progress("replaying the joints together")
    for _ in range(tuning.coupling_rounds):
        windows = coupled_windows(taken(starts), simulation, starts, tuning)
        starts = [
            None if values is None else _refit(own, values, nominal, tuning)
            for own, values, nominal in zip(windows, starts, simulation.nominal.values, strict=True)
        ]
    runs = taken(starts)
    windows = coupled_windows(runs, simulation, starts, tuning)
    fit = ArmFit(runs, simulation, starts, windows, [None] * len(windows), tuning)
    unsettled = [number for number, start in enumerate(starts) if start is not None]
    for _ in range(tuning.coupling_rounds):
        fit = _choose(fit, unsettled, progress)
        finer = fine_enough(fit)
        grown = any(each is not None and (each.free & np.array(OPTIONAL)).any() for each in fit.chosen)
        if finer == fit.tuning and not grown:
            break
        starts = [given if own is None else own for own, given in zip(fit.values, starts, strict=True)]
        fit, unsettled = _renew_loads(replace(fit, runs=taken(starts), starts=starts, tuning=finer))
        if not unsettled:
            break
    return fit


def _refit(windows: Windows, values: Array, nominal: Array, tuning: MotionTuning) -> Array:
    few = thin_windows(windows, tuning.wanted_windows)
    free = free_at_first(values, nominal)
    return fit_servo(begin_integrals(few, values), values, free, tuning.refit_evaluations).values


def fine_enough(fit: ArmFit) -> MotionTuning:
    """The tuning of a fit, with a shorter step where the integration errs by more than a share of what the fit leaves.

    The error is of first order where a drive saturates or a joint comes to rest within a step.
    """
    tuning, values, step = fit.tuning, fit.values, float(fit.windows[0].step_s)
    half = replace(tuning, longest_step_s=step / 2)
    replayed = [coupled_windows(fit.runs, fit.simulation, values, each) for each in (tuning, half)]
    shares = [0.0]
    for own, finer, servo in zip(*replayed, values, strict=True):
        if servo is not None:
            errors = [joint_errors(settle(windows, servo), servo)[0] for windows in (own, finer)]
            left = float(np.mean(errors[1] ** 2))
            shares.append(2 * float(np.sqrt(np.mean((errors[0] - errors[1]) ** 2) / max(left, 1e-300))))
    if max(shares) <= tuning.max_step_error or step <= tuning.shortest_step_s:
        return tuning
    return replace(tuning, longest_step_s=max(step * tuning.max_step_error / max(shares), tuning.shortest_step_s))


def _renew_loads(fit: ArmFit) -> tuple[ArmFit, list[int]]:
    """The fit with loads that its servos make, and the joints whose fit is another one with them.

    It is the same where no number moves by more than a standard error, and the squared error by less than what a number
    is worth.
    """
    tuning = fit.tuning
    windows = coupled_windows(fit.runs, fit.simulation, fit.starts, tuning)
    chosen, unsettled = list(fit.chosen), list[int]()
    for number, each in enumerate(chosen):
        if each is None:
            continue
        renewed = each.refitted(windows[number], tuning)
        moved = np.abs(to_coordinates(renewed.fit.values) - to_coordinates(each.fit.values))
        change = 2 * abs(np.log(max(renewed.fit.rms, 1e-300) / max(each.fit.rms, 1e-300)))
        if change > -np.log(1 - tuning.min_gain) or np.any(moved > each.fit.standard_errors()):
            unsettled.append(number)
        chosen[number] = renewed
    return replace(fit, windows=windows, chosen=chosen), unsettled


def _choose(fit: ArmFit, joints: Sequence[int], progress: Callable[[str], None]) -> ArmFit:
    """The fit with servos of some joints that are chosen anew, in its windows."""
    windows, nominal, tuning = fit.windows, fit.simulation.nominal.values, fit.tuning
    looks = number_of_tests(len(windows))

    def choose(number: int) -> ChosenServo | None:
        fitted = choose_servo(windows[number], nominal[number], looks, tuning, start=fit.starts[number])
        fitted = confirm_in_calm_windows(windows[number], fitted, looks, tuning)
        return fitted if _explains(windows[number], fitted, tuning) else None

    chosen = list(fit.chosen)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # replays in C leave Python to other threads
        for number, each in zip(joints, pool.map(choose, joints), strict=True):
            chosen[number] = each
            progress(f"fitted joint {number + 1} of {len(windows)}")
    return replace(fit, chosen=chosen)


def number_of_tests(joints: int) -> int:
    """In the diagnosis of an arm, for Bonferroni's correction: each number of a joint, a payload, a common delay."""
    return joints * (sum(USUAL) + sum(OPTIONAL)) + 2


def _explains(windows: Windows, chosen: ChosenServo, tuning: MotionTuning) -> bool:
    """Whether the command explains the motion: a servo without gain, the rest fitted anew, does much worse."""
    few = thin_windows(windows, tuning.wanted_windows)
    free, values = chosen.fit.free.copy(), chosen.fit.values.copy()
    free[place("kp")], values[place("kp")] = False, LOWEST[place("kp")]
    passive = fit_servo(few, values, free, tuning.max_evaluations)
    error = joint_errors(few.with_integral(chosen.fit.integral), chosen.fit.values)[0]
    return float(np.sqrt(np.mean(error**2))) < tuning.max_unexplained * passive.rms
