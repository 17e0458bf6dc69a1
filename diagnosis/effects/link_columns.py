"""What a link's ten inertial parameters do to the torque, and which of them an arm feels."""

from functools import lru_cache

import numpy as np

from diagnosis.effects.contract import Scene
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque
from recordings.run import Array

PROBES = 100  # random states that show which parameters an arm feels
INDEPENDENT = 1e-8  # of a column's length: below is rounding; its root for a smallest singular value


def torque_of_parameters(scene: Scene, link: int, sets: Array) -> Array:
    """Torque at the joints up to a link (from 1) for sets (sets, 10) of its parameters: (samples, link, sets)."""
    motion = scene.motion
    arm = scene.arm.first(link)  # joints behind the link do not feel it
    part = Motion(*(each[:, :link] for each in (motion.position, motion.velocity, motion.acceleration)))
    out = np.empty((len(scene.time), link, len(sets)))
    for index, ten in enumerate(sets):
        out[:, :, index] = rigid_body_torque(arm, part, np.append(np.zeros(10 * (link - 1)), ten))
    return out


@lru_cache(maxsize=64)
def felt_parameters(arm: Arm, link: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Which of a link's ten parameters an arm feels: an independent set, and those that stand for themselves.

    The others of the set stand for sums with parameters of the same link that are not in it.
    """
    matrix = _columns(arm, link)
    lengths = np.linalg.norm(matrix, axis=0)
    felt: list[int] = []
    for index in np.flatnonzero(lengths > INDEPENDENT * lengths.max()).tolist():
        trial = matrix[:, [*felt, index]] / lengths[[*felt, index]]
        if np.linalg.svd(trial, compute_uv=False)[-1] > INDEPENDENT**0.5:
            felt.append(index)
    if not felt:
        return (), ()
    others = [index for index in range(10) if index not in felt]
    sums = np.abs(np.linalg.lstsq(matrix[:, felt], matrix[:, others])[0]).max(axis=1, initial=0.0)
    clear = tuple(index for index, share in zip(felt, sums, strict=True) if share < INDEPENDENT**0.5)
    return tuple(felt), clear


def felt_values(arm: Arm, link: int, ten: Array) -> Array:
    """Values of the felt parameters that act like all ten (10,)."""
    matrix, (felt, _) = _columns(arm, link), felt_parameters(arm, link)
    return np.asarray(np.linalg.lstsq(matrix[:, list(felt)], matrix @ ten)[0])


def _columns(arm: Arm, link: int) -> Array:
    probe = Motion(*np.random.default_rng(1).uniform(-2, 2, (3, PROBES, len(arm))))
    return observation_matrix(arm, probe)[:, 10 * (link - 1) : 10 * link]
