"""What windows in which no torque limit acts say of the numbers of a servo.

A limit that a drive has in another form than the law, because its supply falls or it grows hot, bends the motion only
where the drive pushes fully. Gains, damping and inertia may be fitted to that as well. Where they differ in truth, they
differ in calm windows, too. With d the change of the errors in calm windows by the numbers in doubt, and e the errors
without them,

    share = sum d e / sum d^2

is 1 where they are true, and 0 where they are not. Its standard error is that of correlated errors (estimate.py).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.choose import ChosenServo, choose_limits, choose_servo
from armlab.diagnosis.motion.estimate import correlated_variances, settle
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import LIMITS, place
from armlab.diagnosis.motion.windows import Windows


def find_calm_windows(windows: Windows, servos: Array, tuning: MotionTuning = DEFAULT) -> NDArray[np.intp]:
    """Windows in which no drive of these comes near its torque limit. servos: (sets, parameters).

    By commands and positions as they were recorded: how late a command is does not count.
    """
    first, steps = windows.history, windows.measured.shape[1]
    error = windows.command[:, first : first + steps] - windows.measured
    velocity = np.gradient(windows.measured, windows.step_s, axis=1)
    calm = np.ones(windows.count, dtype=bool)
    for servo in servos:
        pull = np.abs(servo[place("kp")] * (error + servo[place("offset")]) - servo[place("kd")] * velocity)
        if servo[place("ki")] > 0:
            pull = pull + servo[place("integral_limit")]
        least = servo[place("limit")] - servo[place("limit_slope")] * np.abs(velocity)
        calm &= np.all(pull < tuning.calm_share * least, axis=1)
    return np.flatnonzero(calm)


def confirm_in_calm_windows(
    windows: Windows, chosen: ChosenServo, looks: int, tuning: MotionTuning = DEFAULT
) -> ChosenServo:
    """The servo without the findings that calm windows refute, and with the limits that explain the others.

    windows: of the choice. A drive of which the simulation does not state all, and one that is always calm or never,
    stays as it is.
    """
    numbers = [number for number in chosen.gains if number not in LIMITS]
    calm = np.setdiff1d(find_calm_windows(windows, np.stack([chosen.nominal, chosen.fit.values]), tuning), chosen.odd)
    stated = bool(np.isfinite(chosen.nominal).all())
    if not (numbers and stated and tuning.min_calm_windows <= len(calm) < windows.count - len(chosen.odd)):
        return chosen
    still = windows.select(calm)
    alone = choose_servo(still, chosen.nominal, looks, tuning, start=chosen.fit.values)
    if set(numbers) <= set(alone.gains) or not is_refuted(still, chosen.fit.values, alone.named[0], tuning):
        return chosen
    return choose_limits(windows, replace(alone, odd=chosen.odd), looks, tuning)


def is_refuted(calm: Windows, found: Array, fewer: Array, tuning: MotionTuning = DEFAULT) -> bool:
    """Whether numbers, (parameters,), explain less of the motion in calm windows than is possible if they are true.

    Less than half of it, half way from false to true, within as many standard errors as a replay is clearly worse by.

    fewer: those that calm windows confirm, the others as in the simulation.
    """
    with_them, without = (joint_errors(settle(calm, values), values)[0] for values in (found, fewer))
    change = without - with_them
    size = float(change @ change)
    if size == 0:
        return False
    variance = float(correlated_variances(change[:, None], without, calm.window, calm.encoder_noise)[0])
    return bool(float(change @ without) / size + tuning.clearly_worse * variance**0.5 / size < 1 / 2)
