"""Friction and offset of each joint as columns beside those of the rigid links, [W F].

In the row of joint j at one sample (Swevers et al. 1997; with the offset, Janot et al. 2019)

    F phi_f = level sign(qd_j) + coefficient qd_j + offset

and zero in the columns of all other joints.
"""

import numpy as np

from armlab.common.arrays import Array
from problem.motion import MAX_RATE_AT_REST, Motion

FRICTION_NAMES = ("level", "coefficient", "offset")
VISCOUS = FRICTION_NAMES.index("coefficient")


def friction_entries(motion: Motion) -> Array:
    """Sign of the velocity, velocity, and one, (..., samples, joints, 3), of a motion (..., samples, joints).

    The sign is zero for a joint at rest, also where rounding leaves a trace of speed.
    """
    speed = motion.velocity
    sign = np.where(np.abs(speed) > MAX_RATE_AT_REST, np.sign(speed), 0.0)
    return np.stack([sign, speed, np.ones_like(speed)], axis=-1)


def friction_matrix(motion: Motion) -> Array:
    """F, (..., samples * joints, 3 * joints), of a motion (..., samples, joints); rows as the observation matrix."""
    entries = friction_entries(motion)
    joints, kinds = motion.joints, len(FRICTION_NAMES)
    blocks = entries[..., None, :] * np.eye(joints)[:, :, None]
    return np.asarray(blocks.reshape(*motion.batch, motion.samples * joints, joints * kinds))
