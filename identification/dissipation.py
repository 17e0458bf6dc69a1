"""Friction takes energy away: linear conditions on the coefficients of friction."""

import numpy as np

from identification.structure import Structure
from problem.motion import Motion
from recordings.run import Array

FRICTION = ("viscous_friction", "coulomb_friction", "nonlinear_viscous_friction", "asymmetric_friction")
SPEEDS = np.geomspace(0.01, 1, 12)  # of the fastest


def dissipation_rows(structure: Structure, fastest: Array) -> Array:
    """Rows (conditions, columns) with rows @ parameters >= 0: friction against the motion at every speed.

    fastest: (joints,), rad/s. A rotor inertia is not negative either.
    """
    joints = len(structure.arm)
    speeds = np.concatenate([-SPEEDS[::-1], SPEEDS])[:, None] * fastest
    motion = Motion(np.zeros_like(speeds), speeds, np.ones_like(speeds))
    against = np.zeros((len(speeds), joints, structure.size))
    inertia = np.zeros((joints, structure.size))
    for part, place in zip(structure.components, structure.slices, strict=True):
        joint = part.joint - 1
        if part.effect in FRICTION:
            against[:, joint, place] = part.columns(motion) * np.sign(speeds[:, joint, None])
        elif part.effect == "rotor_inertia":
            inertia[joint, place] = 1.0
    rows = np.vstack([against.reshape(-1, structure.size), inertia])
    return np.asarray(rows[np.any(rows != 0, axis=1)])
