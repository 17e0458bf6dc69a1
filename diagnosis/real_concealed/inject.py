"""A known disturbance in a real recording: computed from the measured motion and added to the recorded torque.

The noise, the friction and everything else that nobody models stay as they were recorded.
"""

from dataclasses import replace

import numpy as np
from scipy.interpolate import make_interp_spline

from diagnosis.real_concealed.plan import Disturbance
from diagnosis.real_concealed.withhold import IDENTICAL, Number, Sought
from problem.arm import Arm
from problem.inertia import link_from_centre_of_mass
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.differentiate import differentiate
from recordings.resample import evened
from recordings.run import Array, Run

MAIN = {"payload": "mass", "cable_stiffness": "stiffness", "time_delay": "seconds", "viscous_friction": "coefficient"}


def disturbed(run: Run, arm: Arm, what: Disturbance) -> tuple[Run, Array]:
    """The run, even in time, with the disturbance, and what that adds to its torque, (samples, joints), N m (N).

    The motion is smoothed at the cut-off of least error of the acceleration, which is not that of the diagnosis. A
    delay reads the recorded torque, noise and all, that much earlier by cubic splines; the first samples, before
    which nothing was recorded, are left out.
    """
    even = evened(run)
    if what.effect == "time_delay":
        kept = even.time - what.size >= even.time[0]
        late = np.asarray(make_interp_spline(even.time, even.torque, k=3)(even.time[kept] - what.size))
        return replace(even.rows(kept), torque=late), late - even.torque[kept]
    added = _torque(what, arm, differentiate(even).motion)
    return replace(even, torque=even.torque + added), added


def sought_in(what: Disturbance, joints: int) -> Sought:
    """What should be named. joints: of the arm; a single one cannot tell its own skew from a delay of all, nor a load
    from a rotor.
    """
    size: dict[str, Number] = {MAIN[what.effect]: (what.size, None)}
    numbers: dict[str, dict[str, Number]] = {what.effect: size}
    place = () if what.joint is None else (what.joint,)
    same: tuple[str, ...] = IDENTICAL.get(what.effect, ())
    numbers |= dict.fromkeys(same, size)
    if joints == 1 and what.effect == "time_delay":
        same, numbers["channel_skew"] = ("channel_skew",), size
    if joints == 1 and what.effect == "payload":
        same, numbers["rotor_inertia"] = (*same, "rotor_inertia"), {"inertia": (what.size, None)}
    return Sought(str(what), (what.effect,), place, numbers, same)


def _torque(what: Disturbance, arm: Arm, motion: Motion) -> Array:
    out = np.zeros(motion.position.shape)
    if what.joint is None:
        raise ValueError(f"{what.effect} needs a joint")
    joint = what.joint - 1
    if what.effect == "payload":
        ball = 0.4 * what.size * what.radius**2 * np.eye(3)
        phi = np.zeros(10 * len(arm))
        ten = slice(10 * joint, 10 * joint + 10)
        phi[ten] = link_from_centre_of_mass(what.size, np.array(what.centre), ball).parameters
        return rigid_body_torque(arm, motion, phi)
    if what.effect == "cable_stiffness":
        out[:, joint] = what.size * (motion.position[:, joint] - what.rest)
    else:
        out[:, joint] = what.size * motion.velocity[:, joint]
    return out
