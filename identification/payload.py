"""Runs with and without a load: the load's inertial parameters, or, where they are known, the torque gains.

Links and friction are the same in all runs; only what differs between them tells about the load (Khalil, Gautier
and Lemoine 2007). A known load shows the gain of each joint's torque reading (Gautier and Briot 2014).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.covariance import uncertainty
from identification.estimators.linear import WeightedLeastSquares
from identification.pseudo_inertia import link_of
from identification.regression import Regression, regression
from identification.structure import Structure
from problem.arm import Link
from problem.regressor import observation_matrix
from recordings.differentiate import Signals
from recordings.run import Array

DEPENDENT = 1e-8  # of the largest singular value of the load's columns at unit length


@dataclass(frozen=True, eq=False)
class Payload:
    """A load on the last link: parameters (10,) about its frame, half widths (10,) of their 95 % intervals."""

    parameters: Array
    half_widths: Array

    @property
    def link(self) -> Link:
        """The load as a body."""
        return link_of(self.parameters)

    @property
    def centre(self) -> Array:
        """Centre of mass, (3,), m in the last link's frame."""
        return np.asarray(self.parameters[1:4] / self.parameters[0])


@dataclass(frozen=True, eq=False)
class TorqueGains:
    """How much each joint's torque reading is too large (1.09: 9 %), with half widths of 95 % intervals; (joints,)."""

    gains: Array
    half_widths: Array


def identify_payload(structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals]) -> Payload:
    """The load that some runs carry.

    Raises ValueError where no run is of one kind, or where these motions do not tell its ten parameters apart.
    """
    columns = np.vstack([_load_columns(structure, each) for each in loaded]) if loaded else np.empty((0, 10))
    values, half = _fit(structure, without, loaded, columns)
    return Payload(values, half)


def torque_gains(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], payload: Link
) -> TorqueGains:
    """Gains from a load that is known, such as a weighed disc; ValueError as for `identify_payload`."""
    joints = len(structure.arm)
    blocks = []
    for each in loaded:
        torque = (_load_columns(structure, each) @ payload.parameters).reshape(-1, joints)
        blocks.append((torque[:, :, None] * np.eye(joints)).reshape(-1, joints))
    values, half = _fit(structure, without, loaded, np.vstack(blocks) if blocks else np.empty((0, joints)))
    return TorqueGains(values, half)


def _load_columns(structure: Structure, signals: Signals) -> Array:
    return signals.columns(observation_matrix(structure.arm, signals.motion)[:, -10:])


def _fit(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], columns: Array
) -> tuple[Array, Array]:
    """Values and half widths of the columns that only the loaded runs have."""
    if not without or not loaded:
        raise ValueError("runs with the load and runs without it are needed")
    data = _with_columns(regression(structure, [*without, *loaded]), columns)
    _check(data.matrix, columns.shape[1])
    estimate = WeightedLeastSquares()(data)
    found = uncertainty(data, estimate)
    count = columns.shape[1]
    return estimate.values[-count:], found.factor * found.standard_errors[-count:]


def _with_columns(data: Regression, columns: Array) -> Regression:
    padded = np.vstack([np.zeros((len(data.torque) - len(columns), columns.shape[1])), columns])
    return replace(data, matrix=np.hstack([data.matrix, padded]))


def _check(matrix: Array, count: int) -> None:
    """Raises ValueError where the last columns depend on each other or on the others."""
    lengths = np.linalg.norm(matrix, axis=0)
    values = np.linalg.svd(
        np.linalg.qr(matrix / np.where(lengths > 0, lengths, 1))[1][-count:, -count:], compute_uv=False
    )
    if values[-1] < DEPENDENT:
        raise ValueError("these motions do not tell the load's parameters apart: move more joints, and faster")
