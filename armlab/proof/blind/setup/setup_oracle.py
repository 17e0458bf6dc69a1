"""Which mistakes can be seen at all: an oracle that knows the right reading.

It fits rigid links and dissipative friction to the recording as it stands and as it is right, with links that may be as
far off as links of a simulation are. A mistake can be seen where some joint's residual is much larger as it stands. A
zero of joint 1 under vertical gravity, for instance, cannot.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.recordings.differentiate import differentiate
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from problem.motion import Motion
from problem.pseudo_inertia import entropic_information, regular_nominal
from problem.regressor import observation_matrix


@dataclass(frozen=True)
class SightSettings:
    """What counts as seen; chosen before any reading was judged.

    rows: instants of the runs that identify. link_error: relative, of the links of a simulation. free_error: of an arm
    without one, about a body of 1 kg and 0.3 m. torque_error: of the torque's scatter, of a good model. independent:
    rows that tell something new. ratio: of a joint's residual as it stands to that read rightly. least: residual that
    counts as none, of the torque's scatter.
    """

    rows: int = 500
    link_error: float = 0.15
    free_error: float = 10.0
    torque_error: float = 0.05
    independent: float = 100.0
    ratio: float = 1.5
    least: float = 0.05


SIGHT = SightSettings()


def is_seen(right: Path, wrong: Path) -> bool:
    """Whether a recording as it stands can be told from itself read rightly; two mistakes may cancel each other."""
    try:
        return can_be_seen(load_recording(right), load_recording(wrong))
    except (InputError, DataError):
        return True  # a recording that cannot even be read is seen to be wrong


def can_be_seen(right: Recording, wrong: Recording) -> bool:
    """Whether some joint's residual tells the wrong reading from the right one."""
    before, after = (np.maximum(residual_shares(each), SIGHT.least) for each in (wrong, right))
    return bool(np.max(before / after) >= SIGHT.ratio)


def residual_shares(recording: Recording) -> Array:
    """RMS residual of each joint over its torque's scatter, (joints,), after the best fit of links and friction."""
    joints = len(recording.arm)
    motions, torques = [], []
    runs = recording.with_role("identify") or recording.runs
    for run in runs:
        signals = differentiate(run, step=max(len(runs) * run.samples // SIGHT.rows, 1))
        rows, motion = signals.filter.rows, signals.motion
        motions.append([each[rows] for each in (motion.position, motion.velocity, motion.acceleration)])
        torques.append(signals.torque)
    motion = Motion(*(np.concatenate(parts) for parts in zip(*motions, strict=True)))
    torque = np.concatenate(torques)
    columns = _columns(recording, motion)
    scatter = np.maximum(np.std(torque, axis=0), 1e-12)
    weight = np.sqrt(SIGHT.independent / len(torque)) / (SIGHT.torque_error * scatter)
    matrix = (columns * weight[:, None]).reshape(-1, columns.shape[2])
    target = (torque * weight).ravel()
    centre, pull = _prior(recording)
    size = columns.shape[2]
    rows_of_prior = np.zeros((10 * joints, size))
    rows_of_prior[:, : 10 * joints] = pull
    low = np.concatenate([np.full(10 * joints, -np.inf), np.zeros(3 * joints), np.full(joints, -np.inf)])
    lengths = np.maximum(np.linalg.norm(np.vstack([matrix, rows_of_prior]), axis=0), 1e-12)
    stacked = np.vstack([matrix, rows_of_prior]) / lengths
    outcome = lsq_linear(stacked, np.concatenate([target, pull @ centre]), bounds=(low * lengths, np.inf), max_iter=60)
    residual = torque - columns @ (outcome.x / lengths)
    return np.asarray(np.sqrt(np.mean(residual**2, axis=0)) / scatter)


def _columns(recording: Recording, motion: Motion) -> Array:
    """Links, viscous friction, Coulomb friction, rotors and offsets: (rows, joints, columns)."""
    joints = len(recording.arm)
    rigid = observation_matrix(recording.arm, motion).reshape(motion.samples, joints, -1)
    own = (motion.velocity, np.sign(motion.velocity), motion.acceleration, np.ones_like(motion.velocity))
    return np.concatenate([rigid, *(signal[:, :, None] * np.eye(joints) for signal in own)], axis=2)


def _prior(recording: Recording) -> tuple[Array, Array]:
    """Links (10 * joints,) that are expected, and the root of the information about them."""
    arm, joints = recording.arm, len(recording.arm)
    if arm.links is None:
        body = np.array([1.0, 0, 0, 0, 0.1, 0.1, 0.1, 0, 0, 0])
        spread = np.array([1.0, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]) * SIGHT.free_error
        return np.tile(body, joints), np.diag(1 / np.tile(spread, joints))
    root = np.linalg.cholesky(entropic_information(regular_nominal(arm))).T
    return arm.parameters, np.asarray(root / SIGHT.link_error)
