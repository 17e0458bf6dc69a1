"""What an effect adds to the recorded torque, and the columns that it is measured beside."""

from collections.abc import Sequence

import numpy as np

from concealed.effects.hidden import Hidden, sign
from concealed.simulate import rigid_torque
from concealed.track import Track
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix
from recordings.run import Array


def share_of(
    effect: Hidden, others: Sequence[Hidden], arms: tuple[Arm, Arm], track: Track, run: int, grid: Array
) -> Array:
    """Recorded torque with the effect less what would be recorded without it on the same motion.

    arms: with and without the effect. grid: (samples,), s. Returns (samples, joints), N m.
    """
    joints, width = track.joints, float(grid[1] - grid[0])
    centre = np.repeat(grid[:, None], joints, axis=1)
    motor = track.load + taken(others, track, run)
    added = np.zeros_like(track.load)
    law = effect.torque(track, run)
    if law is not None:
        added[:, effect.joint] += law
    if effect.has_parts:
        added += track.load - rigid_torque(arms[0], track.motion)
    share = track.means(added, centre, width)
    sampled = track.at(grid).motion
    if arms[0] is not arms[1]:
        share += rigid_torque(arms[0], sampled) - rigid_torque(arms[1], sampled)
    shift, lag = effect.shift(joints), effect.lag(joints)
    if shift.any():
        shifted = Motion(sampled.position + shift, sampled.velocity, sampled.acceleration)
        share += rigid_torque(arms[0], sampled) - rigid_torque(arms[0], shifted)
    plain = track.means(motor, centre, width)
    if lag.any():
        share += track.means(motor, centre - lag, width) - plain
    return np.asarray(share + effect.read(plain) - plain)


def free_columns(arm: Arm, track: Track, grid: Array, friction_only: bool = False) -> Array:
    """Columns of Coulomb friction, viscous friction and offset of every joint, then of the base parameters.

    grid: (samples,), s; the sign of velocity is a mean over each interval, as the torque is. Returns (samples, joints,
    columns), N m per unit.
    """
    joints, samples = len(arm), len(grid)
    sampled, centre = track.at(grid), np.repeat(grid[:, None], len(arm), axis=1)
    signs = track.means(sign(track.velocity), centre, float(grid[1] - grid[0]))
    columns = np.zeros((samples, joints, 3 * joints))
    for joint in range(joints):
        columns[:, joint, joint] = signs[:, joint]
        columns[:, joint, joints + joint] = sampled.velocity[:, joint]
        columns[:, joint, 2 * joints + joint] = 1.0
    if friction_only:
        return columns
    rigid = observation_matrix(arm, sampled.motion)[:, base_parameters(arm).columns]
    return np.concatenate([columns, rigid.reshape(samples, joints, -1)], axis=2)


def absorbed_rotors(arm: Arm) -> list[int]:
    """Joints (from 0) whose rotor no motion tells from the links."""
    states = np.random.default_rng(0).uniform(-2, 2, (3, 200, len(arm)))
    motion = Motion(*states)
    rigid = observation_matrix(arm, motion)[:, base_parameters(arm).columns]
    out = []
    for joint in range(len(arm)):
        column = np.zeros((200, len(arm)))
        column[:, joint] = motion.acceleration[:, joint]
        rest = column.ravel() - rigid @ np.linalg.lstsq(rigid, column.ravel(), rcond=None)[0]
        if np.linalg.norm(rest) < 1e-6 * np.linalg.norm(column):
            out.append(joint)
    return out


def taken(effects: Sequence[Hidden], track: Track, run: int) -> Array:
    """Torque that laws take from the motors, (steps, joints), N m."""
    out = np.zeros_like(track.load)
    for effect in effects:
        law = effect.torque(track, run)
        if law is not None:
            out[:, effect.joint] += law
    return out
