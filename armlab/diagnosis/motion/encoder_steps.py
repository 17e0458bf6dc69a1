"""Whether the steps of the encoder alone make a difference from the simulation.

A drive reads its position in steps. At each step its torque jumps, which shakes a joint loose or holds it, and a replay
whose drive knows the true position fits another friction, gain or rotor inertia to that. How much it fits follows from
a recording that is simulated (a parametric bootstrap, Efron 1979): the servo with the simulation's number is replayed
with a drive that reads in steps, its motion is read in steps, and the number is fitted to it. What such a fit gains is
no evidence.
"""

from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import ServoFit, fit_servo, to_coordinates, with_nominal
from armlab.diagnosis.motion.joint_replay import joint_errors, replay_joint
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows, read_in_steps


def is_made_by_encoder_steps(
    windows: Windows, fit: ServoFit, number: int, base: Array, tuning: MotionTuning = DEFAULT
) -> bool:
    """Whether a drive that has the simulation's number, and reads its encoder in steps, looks as if it had another one.

    fit: in these windows. number: place of one of its free parameters. base: numbers of the simulation, (parameters,),
    NaN where it has none.
    """
    if windows.encoder_step == 0 or np.isnan(base[number]):
        return False
    windows = windows.with_integral(fit.integral)
    values, fixed = with_nominal(fit, base, number)
    without = fit_servo(windows, values, fixed, tuning.refit_evaluations)
    taken = without.rms**2 - float(np.mean(joint_errors(windows, fit.values)[0] ** 2))
    counted = replay_in_steps(windows.with_integral(without.integral), without.values)
    enough = tuning.max_share_of_encoder_steps * taken
    if float(np.mean(joint_errors(counted, without.values)[0] ** 2)) <= enough:
        return False  # whatever is fitted, it cannot take more than there is
    held = fit_servo(counted, without.values, fixed, tuning.max_evaluations)
    if held.rms**2 <= enough:
        return False
    starts = (without.values, fit.values)
    fits = [fit_servo(counted, start, fit.free, tuning.max_evaluations) for start in starts]
    best = min(fits, key=lambda each: each.rms)
    found, made = (to_coordinates(each.values)[number] - to_coordinates(base)[number] for each in (fit, best))
    return bool(found * made > 0 and held.rms**2 - best.rms**2 > enough)


def replay_in_steps(windows: Windows, values: Array) -> Windows:
    """The windows as a servo with these numbers, (parameters,), makes them where its drive reads its encoder in steps.

    A window begins anywhere within the step of the encoder that was read there.
    """
    start = windows.measured.copy()
    within = np.random.default_rng(0).uniform(-0.5, 0.5, len(start))
    start[:, 0] = read_in_steps(start[:, 0], windows) + within * windows.encoder_step
    path = replay_joint(replace(windows, measured=start), values, reads_steps=True)[0]
    return replace(windows, position=read_in_steps(path, windows))
