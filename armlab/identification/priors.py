"""Priors: how far parameters may be from the nominal (CAD) model, or from nothing, before the data speak."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.effects.drive import RotorInertia
from armlab.effects.links import unit_mass_at
from armlab.identification.estimators.least_squares import Prior
from armlab.identification.regression import Regression
from armlab.identification.structure import Structure
from problem.pseudo_inertia import entropic_information, parameters_of, regular_nominal


@dataclass(frozen=True)
class Pull:
    """What parameters are drawn to: `none`, to zero (`shrinkage`) or to the arm's own links (`nominal`).

    size: the share of shrinkage, or the tolerance of the nominal model. payload: where a point mass of unknown
    size may sit on the last link, m in its frame.
    """

    kind: Literal["none", "shrinkage", "nominal"] = "none"
    size: float = 1.0
    payload: tuple[float, float, float] | None = None

    def prior(self, structure: Structure, data: Regression) -> Prior | None:
        """The normal prior of these columns; None for none."""
        if self.kind == "none":
            return None
        if self.kind == "shrinkage":
            return shrinkage_prior(structure, data, self.size)
        return nominal_prior(structure, self.size, self.payload)

    def __str__(self) -> str:
        """For a table."""
        return self.kind if self.kind == "none" else f"{self.kind} {self.size:g}"


NO_PULL = Pull()


def point_mass(joints: int, centre: tuple[float, float, float]) -> Array:
    """Parameters (10 * joints,) of a kilogram at a point of the last link's frame."""
    out = np.zeros(10 * joints)
    out[-10:] = unit_mass_at(centre)
    return out


def nominal_prior(structure: Structure, tolerance: float, payload: tuple[float, float, float] | None = None) -> Prior:
    """A normal prior about the arm's `links`, as wide as `tolerance` (0.1: bodies that are 10 % off).

    The metric is that of the pseudo-inertias at the nominal, which no choice of frame changes; rotor inertias
    that the arm names are drawn to theirs, other components are free. payload: see `Pull`. Raises ValueError
    for an arm without links or a tolerance that is not positive.
    """
    if tolerance <= 0:
        raise DataError(f"a prior's tolerance should be positive, not {tolerance:g}")
    pseudos = regular_nominal(structure.arm)
    grouping, base = structure.base.grouping, len(structure.base)
    spread = tolerance**2 * grouping @ np.linalg.inv(entropic_information(pseudos)) @ grouping.T
    mean, precision = np.zeros(structure.size), np.zeros((structure.size, structure.size))
    mean[:base] = structure.base.values(parameters_of(pseudos))
    precision[:base, :base] = _scaled_inverse(spread)
    if payload is not None:
        precision[:base, :base] = _without_direction(
            precision[:base, :base], grouping @ point_mass(len(structure.arm), payload)
        )
    for place, nominal in nominal_rotors(structure):
        mean[place], precision[place, place] = nominal, 1 / (tolerance * nominal) ** 2
    return Prior(mean, precision)


def _scaled_inverse(spread: Array) -> Array:
    """Inverse of a covariance whose parameters have sizes of their own."""
    scale = np.sqrt(np.diag(spread))
    return np.asarray(np.linalg.inv(spread / np.outer(scale, scale)) / np.outer(scale, scale))


def _without_direction(precision: Array, direction: Array) -> Array:
    """Precision without information along one direction: the limit of an infinite variance there."""
    known = precision @ direction
    rest = precision - np.outer(known, known) / (direction @ known)
    return np.asarray((rest + rest.T) / 2)


def nominal_rotors(structure: Structure) -> list[tuple[int, float]]:
    """Column and nominal value of each rotor inertia that the arm names."""
    known = structure.arm.rotor_inertia
    return [
        (place.start, known[part.rows[0]])
        for part, place in zip(structure.components, structure.slices, strict=True)
        if isinstance(part, RotorInertia) and known and known[part.rows[0]] > 0
    ]


def shrinkage_prior(structure: Structure, data: Regression, share: float) -> Prior:
    """A ridge in the metric of the columns' lengths: each parameter's torque is drawn to zero.

    share: weight of the prior as a share of each column's own information, with the torque's deviation as the
    unit. Only the base parameters and rotor inertias are drawn: friction is where it is.
    """
    drawn = np.zeros(structure.size)
    drawn[: len(structure.base)] = 1.0
    for part, place in zip(structure.components, structure.slices, strict=True):
        drawn[place] = float(isinstance(part, RotorInertia))
    power = np.sum(data.matrix**2, axis=0) / float(np.var(data.torque))
    return Prior(np.zeros(structure.size), np.diag(share * drawn * power))
