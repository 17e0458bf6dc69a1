"""A load that some runs carry: its inertial parameters, or, where they are known, the torque gains.

Links and friction are the same in all runs; only what differs between them tells about the load (Khalil, Gautier
and Lemoine 2007). A known load shows the gain of each joint's torque reading (Gautier and Briot 2014).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.covariance import uncertainty
from identification.estimators.linear import WeightedLeastSquares, joint_weights
from identification.physical_load import nearest_physical
from identification.priors import point_mass
from identification.pseudo_inertia import link_of
from identification.regression import Regression, regression
from identification.structure import Structure
from problem.arm import Link
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque
from recordings.differentiate import Signals
from recordings.run import Array

DEPENDENT = 1e-8  # of the largest singular value of the load's columns at unit length


@dataclass(frozen=True)
class Place:
    """Where a load sits: on a link, counted from 1 (None: the last); as a point of its frame, m, if that is known.

    Of a load at a known point only the mass is sought.
    """

    link: int | None = None
    centre: tuple[float, float, float] | None = None

    @property
    def basis(self) -> Array:
        """Ten parameters for each number that is sought, (10, sought)."""
        return np.eye(10) if self.centre is None else point_mass(1, self.centre)[:, None]

    def columns(self, structure: Structure, signals: Signals) -> Array:
        """Filtered columns of the load, (kept * joints, sought)."""
        last = 10 * (self.link or len(structure.arm))
        own = observation_matrix(structure.arm, signals.motion)[:, last - 10 : last]
        return signals.columns(own @ self.basis)


@dataclass(frozen=True, eq=False)
class Payload:
    """A load: parameters (10,) about its link's frame, of a body that can exist; covariance (10, 10).

    factor: from a standard error to half of a 95 % interval. The covariance is that of a fit without the condition
    that the body can exist: on the safe side where the condition matters.
    """

    parameters: Array
    covariance: Array
    factor: float

    @property
    def link(self) -> Link:
        """The load as a body."""
        return link_of(self.parameters)

    @property
    def half_widths(self) -> Array:
        """Half widths of the 95 % intervals of the parameters, (10,)."""
        return np.asarray(self.factor * np.sqrt(np.maximum(np.diag(self.covariance), 0)))

    @property
    def centre(self) -> Array:
        """Centre of mass, (3,), m in its link's frame."""
        return np.asarray(self.parameters[1:4] / self.parameters[0])

    @property
    def centre_half_widths(self) -> Array:
        """Half widths of the 95 % intervals of the centre of mass, (3,), m."""
        slopes = np.column_stack([-self.centre, np.eye(3)]) / self.parameters[0]
        spread = np.diag(slopes @ self.covariance[:4, :4] @ slopes.T)
        return np.asarray(self.factor * np.sqrt(np.maximum(spread, 0)))


@dataclass(frozen=True, eq=False)
class TorqueGains:
    """How much each joint's torque reading is too large (1.09: 9 %), with half widths of 95 % intervals; (joints,)."""

    gains: Array
    half_widths: Array


def identify_payload(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], place: Place | None = None
) -> Payload:
    """The load that some runs carry, as the body that can exist and explains them best.

    without: runs without it; if there are none, the arm's own links stand for them. Raises ValueError where no
    run is loaded, or where these motions do not tell the load's parameters apart.
    """
    place = place or Place()
    if not loaded:
        raise ValueError("runs with the load are needed")
    columns = np.vstack([place.columns(structure, each) for each in loaded])
    data = _with_columns(_unloaded(structure, without, loaded), columns)
    _check(data.matrix, columns.shape[1])
    estimate = WeightedLeastSquares()(data)
    found = uncertainty(data, estimate)
    weighted = data.weighted(joint_weights(data, estimate.values))
    sought = slice(len(estimate.values) - columns.shape[1], None)
    values = nearest_physical(weighted, estimate.values[sought], place.basis)
    return Payload(place.basis @ values, place.basis @ found.covariance[sought, sought] @ place.basis.T, found.factor)


def torque_gains(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], payload: Link, link: int | None = None
) -> TorqueGains:
    """Gains from a load that is known, such as a weighed disc; ValueError as for `identify_payload`."""
    joints = len(structure.arm)
    if not without or not loaded:
        raise ValueError("runs with the load and runs without it are needed")
    blocks = []
    for each in loaded:
        torque = (Place(link).columns(structure, each) @ payload.parameters).reshape(-1, joints)
        blocks.append((torque[:, :, None] * np.eye(joints)).reshape(-1, joints))
    columns = np.vstack(blocks)
    moved = np.linalg.norm(columns, axis=0) > 0  # a joint that the load never loads tells nothing of its gain
    data = _with_columns(regression(structure, [*without, *loaded]), columns[:, moved])
    _check(data.matrix, int(moved.sum()))
    estimate = WeightedLeastSquares()(data)
    found = uncertainty(data, estimate)
    gains, half = np.full((2, joints), np.nan)
    gains[moved], half[moved] = estimate.values[-moved.sum() :], (found.factor * found.standard_errors)[-moved.sum() :]
    return TorqueGains(gains, half)


def _unloaded(structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals]) -> Regression:
    """The regression of the unloaded arm over all runs: free links, or nominal ones whose torque is known."""
    data = regression(structure, [*without, *loaded])
    if without:
        return data
    known = [each.filter(_nominal_torque(structure, each.motion)).ravel() for each in loaded]
    own = slice(len(structure.base), None)
    return replace(data.columns(own), torque=data.torque - np.concatenate(known))


def _nominal_torque(structure: Structure, motion: Motion) -> Array:
    """Torque of the arm's own links, and of its rotors where the structure does not seek them."""
    arm = structure.arm
    sought = any(part.effect == "rotor_inertia" for part in structure.components)
    rotors = np.zeros(len(arm)) if sought or not arm.rotor_inertia else np.array(arm.rotor_inertia)
    return rigid_body_torque(arm, motion, arm.parameters) + motion.acceleration * rotors


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
