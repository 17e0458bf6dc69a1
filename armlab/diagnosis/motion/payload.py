"""A mass at the tool that the simulation does not have: one number for all joints, with the usual ones of each free.

At one joint a mass looks like another gain, damping and friction. It loads all joints that carry the tool, in shares of
gravity and inertia that follow from its place. With m_j and its variance from the fit of joint j,

    mass = sum_j (m_j / var_j) / sum_j (1 / var_j)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.choose import Gain, find_odd_windows, gain_over_windows, is_finding
from armlab.diagnosis.motion.estimate import ServoFit, fit_servo, thin_windows
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows

MIN_WORK = 1e-9  # N m per kg, or kg m2 per kg: below it a joint does not carry the tool


@dataclass(frozen=True)
class PayloadFit:
    """A mass at the tool, kg. error: its standard error. windows: number of blocks. gain: on windows that took no part,
    of errors over the noise of each joint."""

    mass: float
    error: float
    windows: int
    gain: Gain


def find_payload(
    windows: Sequence[Windows], fits: Sequence[ServoFit | None], looks: int, tuning: MotionTuning = DEFAULT
) -> PayloadFit | None:
    """The mass that explains the motion of all joints better, None without one.

    fits: of each joint, None for one that stands still. looks: number of tests in the diagnosis.
    """
    carried = [
        (joint, fit) for joint, fit in zip(windows, fits, strict=True) if fit is not None and _carries_tool(joint)
    ]
    if not carried:
        return None
    odd = np.unique(np.concatenate([find_odd_windows(joint, fit.values, tuning) for joint, fit in carried]))
    sound = np.setdiff1d(np.arange(windows[0].count), odd)
    few = [
        (thin_windows(joint.select(sound), tuning.max_judged_windows).with_integral(fit.integral), fit)
        for joint, fit in carried
    ]
    without, with_it = (_errors_on_other_half(few, loaded, tuning) for loaded in (False, True))
    gain = gain_over_windows(len(few[0][0].position), without.sum(axis=0), with_it.sum(axis=0))
    share = float(np.max(1 - with_it.sum(axis=1) / without.sum(axis=1)))
    gain = Gain(share, gain.p_value, gain.rms_without, gain.rms_with)
    if not is_finding(gain, looks, tuning):
        return None
    mass, error = estimate_mass(few, tuning)
    return PayloadFit(mass, error, few[0][0].count, gain)


def estimate_mass(joints: Sequence[tuple[Windows, ServoFit]], tuning: MotionTuning = DEFAULT) -> tuple[float, float]:
    """A mass at the tool and its standard error, kg, beside the free parameters of each joint's fit."""
    weights, masses = [], []
    for windows, fit in joints:
        free = fit.free.copy()
        free[place("payload")] = True
        found = fit_servo(windows, fit.values, free, tuning.refit_evaluations)
        weights.append(1 / max(float(found.standard_errors()[place("payload")]) ** 2, 1e-300))
        masses.append(float(found.values[place("payload")]))
    return float(np.average(masses, weights=weights)), float(1 / np.sqrt(np.sum(weights)))


def _carries_tool(windows: Windows) -> bool:
    return max(float(np.abs(windows.unit_load).max()), float(np.abs(windows.unit_inertia).max())) > MIN_WORK


def _errors_on_other_half(joints: Sequence[tuple[Windows, ServoFit]], loaded: bool, tuning: MotionTuning) -> Array:
    """Squared errors over the joint's variance, (joints, windows), by numbers that were learned on the other half."""
    count = joints[0][0].count
    squares = np.zeros((len(joints), count))
    for first in (0, 1):
        train, test = np.arange(first, count, 2), np.arange(1 - first, count, 2)
        learned = [(windows.select(train), fit) for windows, fit in joints]
        mass = estimate_mass(learned, tuning)[0] if loaded else 0.0
        for row, (windows, fit) in enumerate(joints):
            squares[row, test] = _judge(windows, (train, test), fit, mass, tuning) / fit.rms**2
    return squares


def _judge(
    windows: Windows,
    halves: tuple[NDArray[np.intp], NDArray[np.intp]],
    fit: ServoFit,
    mass: float,
    tuning: MotionTuning,
) -> Array:
    """Squared error of each window of the second half, with a mass and numbers that were fitted on the first."""
    train, test = halves
    values = fit.values.copy()
    values[place("payload")] = mass
    learned = fit_servo(windows.select(train), values, fit.free, tuning.refit_evaluations)
    judged = windows.select(test).with_integral(learned.integral)
    return np.asarray(np.bincount(judged.window, joint_errors(judged, learned.values)[0] ** 2, len(test)), dtype=float)
