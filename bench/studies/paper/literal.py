"""The paper's dynamics as printed, to see which reading gives its counts of identifiable parameters.

This is a transcription of eq. 9-39, not the dynamics of this project (`problem.regressor`). The readings differ where
the equations are open or contradict each other: whose motion and which frame of P eq. 11 means, the order of the
inertia's columns (eq. 26 against eq. 28), which rows of the wrench count as measured, and gravity.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from bench.printed import Printed, times_pi
from problem.arm import PARAMETER_NAMES
from problem.transforms import rotation_x, rotation_z, translation

PRINTED_GRAVITY = 9.8  # section 3
RANDOM_STATES = 200
RANK_TOLERANCE = 1e-9
Z_AXIS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Reading:
    """One way to read eq. 9-39.

    parent_motion: eq. 11 as printed, with the parent's angular motion; else with the link's own, as standard D-H frames
    need it. parent_frame: P as it stands in the parent's frame, in eq. 11, 30 and 33; else turned into the link's own.
    rows: which of the six rows of each joint's wrench are taken; eq. 39 takes the third moment.
    inertia: the columns as eq. 28 has them, or as eq. 26 has them; both are named by eq. 31.
    """

    parent_motion: bool
    parent_frame: bool
    rows: Literal["third moment", "moments", "wrench"]
    gravity: bool
    inertia: Literal["eq. 28", "eq. 26"] = "eq. 28"

    def __str__(self) -> str:
        motion = "eq. 11 as printed" if self.parent_motion else "eq. 11 with the link's own motion"
        frame = "parent's" if self.parent_frame else "link's own"
        gravity = "with" if self.gravity else "without"
        return f"{motion}; P in the {frame} frame; {self.rows}; {gravity} gravity; inertia columns of {self.inertia}"


LITERAL_READINGS = (
    Reading(False, False, "third moment", True),
    Reading(False, False, "moments", True),
    Reading(False, False, "wrench", True),
    Reading(True, True, "third moment", True),
    Reading(True, True, "third moment", False),
    Reading(True, True, "third moment", False, "eq. 26"),
    Reading(False, True, "third moment", False, "eq. 26"),
)


@dataclass(frozen=True)
class Identifiability:
    """Parameters that are identifiable alone, only in combinations, and not at all; `rank` of the matrix."""

    alone: tuple[str, ...]
    combined: tuple[str, ...]
    without_effect: tuple[str, ...]
    rank: int


def identifiability(matrix: Array) -> Identifiability:
    """Which parameters an observation matrix (rows, 10 * links) at many random states identifies."""
    links = range(1, matrix.shape[1] // 10 + 1)
    names = np.array([f"{name}{link}" for link in links for name in PARAMETER_NAMES])
    lengths = np.linalg.norm(matrix, axis=0)
    effective = lengths > RANK_TOLERANCE * lengths.max()
    unit = matrix / np.where(effective, lengths, 1.0)
    _, values, directions = np.linalg.svd(unit)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    alone = np.linalg.norm(directions[rank:], axis=0) < np.sqrt(RANK_TOLERANCE)  # no unseen direction changes it
    return Identifiability(
        tuple(names[alone].tolist()),
        tuple(names[effective & ~alone].tolist()),
        tuple(names[~effective].tolist()),
        rank,
    )


def literal_matrix(paper: Printed, reading: Reading) -> Array:
    """The observation matrix of eq. 39 of the first three joints at random states, (rows, 30), SI."""
    rng = np.random.default_rng(0)
    rows = {"third moment": [5], "moments": [3, 4, 5], "wrench": list(range(6))}[reading.rows]
    states = rng.uniform(-2, 2, (RANDOM_STATES, 3, 3))
    return np.concatenate([_wrenches(paper, reading, *state)[:, rows].reshape(-1, 30) for state in states])


def _wrenches(paper: Printed, reading: Reading, q: Array, qd: Array, qdd: Array) -> Array:
    """U of eq. 38 at one state, (joint, 6, 30)."""
    turns, shifts = zip(*(_link_pose(paper, joint, q[joint]) for joint in range(3)), strict=True)
    arms = shifts if reading.parent_frame else [turn.T @ shift for turn, shift in zip(turns, shifts, strict=True)]
    omega, alpha, rise = np.zeros(3), np.zeros(3), PRINTED_GRAVITY * reading.gravity * Z_AXIS
    zeta = []
    for turn, arm, rate, bend in zip(turns, arms, qd, qdd, strict=True):
        back = turn.T  # R_i^(i+1)
        before = omega, alpha
        alpha = back @ (alpha + Z_AXIS * bend + np.cross(omega, Z_AXIS * rate))  # eq. 10
        omega = back @ (omega + Z_AXIS * rate)  # eq. 9
        if reading.parent_motion:
            rise = back @ (_rotational_acceleration(*before, arm) + rise)  # eq. 11
        else:
            rise = back @ rise + _rotational_acceleration(omega, alpha, arm)
        zeta.append(_link_wrench(omega, alpha, rise, arm, reading.inertia))
    return _carry_wrenches(zeta, turns, arms)


def _link_pose(paper: Printed, joint: int, angle: float) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) of a link in its parent's frame, standard D-H, Table 1."""
    row = paper.table1[joint]
    link = translation(0, 0, row.d_mm / 1e3) @ translation(row.a_mm / 1e3, 0, 0) @ rotation_x(times_pi(row.alpha))
    pose = rotation_z(float(angle)) @ link
    return pose[:3, :3], pose[:3, 3]


def _rotational_acceleration(omega: Array, alpha: Array, arm: Array) -> Array:
    return np.asarray(np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm)))


def _link_wrench(omega: Array, alpha: Array, rise: Array, arm: Array, inertia: str) -> Array:
    """Eq. 30, (6, 10)."""
    swing = cross_matrix(alpha) + cross_matrix(omega) @ cross_matrix(omega)
    force = np.hstack([rise[:, None], swing, np.zeros((3, 6))])
    moment = np.hstack(
        [
            np.zeros((3, 1)),
            -cross_matrix(rise),
            inertia_matrix(alpha, inertia) + cross_matrix(omega) @ inertia_matrix(omega, inertia),
        ]
    )
    return np.vstack([force, cross_matrix(arm) @ force + moment])


def _carry_wrenches(zeta: list[Array], turns: tuple[Array, ...], arms: tuple[Array, ...] | list[Array]) -> Array:
    """Eq. 32-38: the wrench of each link carried back to every joint before it, (joint, 6, 30)."""
    U = np.zeros((3, 6, 30))
    for link in range(3):
        wrench = zeta[link]
        U[link, :, 10 * link : 10 * link + 10] = wrench
        for joint in reversed(range(link)):
            turn = turns[joint + 1]
            carried = np.block([[turn, np.zeros((3, 3))], [cross_matrix(arms[joint]) @ turn, turn]])  # eq. 33
            wrench = carried @ wrench
            U[joint, :, 10 * link : 10 * link + 10] = wrench
    return U


def cross_matrix(v: Array) -> Array:
    """[v x] of eq. 25."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def inertia_matrix(w: Array, inertia: str) -> Array:
    """[. w]: as eq. 28 has it, so that [. w] @ (Ixx Iyy Izz Ixy Ixz Iyz) = I w, or as eq. 26 has it."""
    x, y, z = w
    if inertia == "eq. 26":
        return np.array([[x, y, z, 0, 0, 0], [0, x, 0, y, z, 0], [0, 0, x, 0, y, z]])
    return np.array([[x, 0, 0, y, z, 0], [0, y, 0, x, 0, z], [0, 0, z, 0, x, y]])
