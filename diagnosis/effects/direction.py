"""The direction of motion as a recording shows it: averaged over the time that one sample stands for.

A drive reports torque as the mean over its interval of sampling; what jumps within it has to be averaged too.
"""

import numpy as np

from diagnosis.effects.contract import Scene
from recordings.run import Array

PARTS = 4  # of a sample's interval, for friction with memory


def direction(scene: Scene, *joints: int) -> Array:
    """Mean of sgn(qd) over the interval from half a sample before to half a sample after, (samples,).

    joints: from 0; of several, the sign of the sum of their velocities. The velocity is taken as a straight line
    within the interval. The sign at the sample itself is off by up to one at each reversal, and by as much as the
    sampling is slow.
    """
    velocity = scene.motion.velocity[:, list(joints)].sum(axis=1)
    change = np.abs(scene.motion.acceleration[:, list(joints)].sum(axis=1)) * scene.step / 2
    steady = change <= np.abs(velocity)
    return np.asarray(np.where(steady, np.sign(velocity), velocity / np.where(steady, 1.0, change)))


def sides(scene: Scene, joint: int) -> tuple[Array, Array]:
    """Shares of that interval that a joint, from 0, moves forwards, and (negative) backwards: (samples,) each."""
    side = direction(scene, joint)
    return (1 + side) / 2, (side - 1) / 2


def within(scene: Scene, joint: int) -> Array:
    """Positions of a joint, from 0, at the middles of four parts of each sample's interval: (4 * samples,)."""
    motion = scene.motion
    shift = ((np.arange(PARTS) + 0.5) / PARTS - 0.5) * scene.step
    way = motion.velocity[:, joint, None] * shift + motion.acceleration[:, joint, None] * shift**2 / 2
    way[0] = np.where(shift > 0, way[0], 0.0)  # at rest before the run
    return np.asarray((motion.position[:, joint, None] + way).ravel())


def mean_within(fine: Array) -> Array:
    """Means over the parts of each sample's interval, (samples,)."""
    return np.asarray(fine.reshape(-1, PARTS).mean(axis=1))
