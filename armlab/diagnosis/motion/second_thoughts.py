"""Numbers of servos that held-out runs or the scale of the torques do not bear out leave, or move, after the choice."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armlab.diagnosis.motion.arm_fit import ArmFit, number_of_tests
from armlab.diagnosis.motion.choose import ChosenServo, judge_again
from armlab.diagnosis.motion.estimate import rms_of, thin_windows
from armlab.diagnosis.motion.held_out import rise_of, settled_errors, stretch_squares
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import MotionTuning
from armlab.diagnosis.motion.separate import TORQUE_SCALED, has_weak_load
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, KEYS, OPTIONAL, place
from armlab.diagnosis.motion.windows import Windows


def with_stated_scale(fit: ArmFit, tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos with the kp of the simulation where nothing else tells the scale of their torques.

    What scales kp, damping, friction and rotor inertia alike changes no motion, but for gravity and the links' inertia.
    Where gravity is weak, and the inertia of the links is a smaller part of the whole than kp is uncertain, neither
    tells the scale, nor where kp is as uncertain as it is large: then kp is as stated, and the others are fitted anew.
    """
    out: list[ChosenServo | None] = []
    looks, kp = number_of_tests(len(fit.chosen)), place("kp")
    for each, learned in zip(fit.chosen, fit.windows, strict=True):
        if each is not None and kp in each.gains and np.isfinite(each.nominal[kp]) and _is_scale_open(each, learned):
            few = thin_windows(
                learned.select(np.setdiff1d(np.arange(learned.count), each.odd)), tuning.max_judged_windows
            )
            each = judge_again(learned, _in_scale_of(each, each.nominal[kp]).without(kp, few, tuning), looks, tuning)
        out.append(each)
    return out


def _in_scale_of(chosen: ChosenServo, gain: float) -> ChosenServo:
    """The servo with all its torques in another scale, in which kp is this."""
    values, places = chosen.fit.values.copy(), [KEYS.index(key) for key in TORQUE_SCALED]
    finite = [at for at in places if values[at] < INFINITE_LIMIT]
    values[finite] *= gain / values[place("kp")]
    return replace(chosen, fit=replace(chosen.fit, values=values))


def _is_scale_open(chosen: ChosenServo, learned: Windows) -> bool:
    """Whether neither gravity nor the inertia of the links tells the scale of a joint's torques."""
    kp, values, (low, high) = place("kp"), chosen.fit.values, chosen.fit.interval()
    uncertain = float(high[kp] - low[kp]) / (2 * values[kp])
    links = float(np.median(learned.inertia))
    is_open = links < uncertain * (links + float(values[place("armature")]))
    return uncertain > 1 or (is_open and has_weak_load(learned, values))


def without_worse(fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos without the numbers that make held-out runs clearly worse than a fit of the others does.

    judged: whole runs, because a joint that sticks at another place stays there. Optional numbers leave first.
    """
    out: list[ChosenServo | None] = []
    looks = number_of_tests(len(fit.chosen))
    for each, learned, held in zip(fit.chosen, fit.windows, judged, strict=True):
        while each is not None:
            sound = learned.select(np.setdiff1d(np.arange(learned.count), each.odd))
            numbers = np.flatnonzero(each.fit.free & np.isfinite(each.nominal)).tolist()
            few = thin_windows(sound, tuning.max_judged_windows)
            others = [each.without(number, few, tuning) for number in numbers]
            own, *without = (stretch_squares(held, one.fit.values, tuning) for one in (each, *others))
            rises = [rise_of(other, own, tuning) for other in without]
            worse = [row for row, rise in enumerate(rises) if rise > tuning.clearly_worse]
            if not worse:
                break
            worst = max(worse, key=lambda row: (OPTIONAL[numbers[row]], rises[row]))
            each = judge_again(learned, others[worst], looks, tuning)
        out.append(each)
    return out


def place_damping(fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos with a change of damping in joint or drive, whichever the held-out windows tell.

    The torque limit acts on that of the drive alone. The windows that identify have to allow both.
    """
    out: list[ChosenServo | None] = []
    for each, learned, held in zip(fit.chosen, fit.windows, judged, strict=True):
        inside = None if each is None else each.with_damping_inside()
        if each is not None and inside is not None:
            sound = learned.select(np.setdiff1d(np.arange(learned.count), each.odd)).with_integral(each.fit.integral)
            own, other = (rms_of(joint_errors(sound, one.fit.values)[0]) for one in (each, inside))
            allowed = other**2 * (1 - tuning.min_gain) <= own**2
            if allowed and rms_of(settled_errors(held, inside.fit.values)) < rms_of(
                settled_errors(held, each.fit.values)
            ):
                each = inside
        out.append(each)
    return out
