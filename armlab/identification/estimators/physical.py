"""Full physical consistency: pseudo-inertias positive semidefinite, friction dissipative; a convex problem.

Sousa and Cortesao 2014; Wensing, Kim and Slotine 2018; the pull to the nominal model is the entropic
(Bregman log-det) divergence of Lee, Wensing and Park 2020.

Friction takes energy away: linear conditions on its coefficients.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from armlab.common.arrays import Array
from armlab.effects.drive import RotorInertia
from armlab.effects.scene import instants
from armlab.identification.estimators.conic import ConicProgram
from armlab.identification.estimators.least_squares import (
    Estimate,
    WeightedLeastSquares,
    column_lengths,
    joint_weights,
    pseudo_inverse,
)
from armlab.identification.priors import NO_PULL, Pull, nominal_prior, nominal_rotors, point_mass
from armlab.identification.regression import Regression
from armlab.identification.structure import Structure
from problem.motion import Motion
from problem.pseudo_inertia import pseudo_inertia_basis, regular_nominal

SPEED_SHARES = np.geomspace(0.01, 1, 12)  # of the fastest


def dissipation_rows(structure: Structure, fastest: Array) -> Array:
    """Rows (conditions, columns) with rows @ parameters >= 0: friction against the motion at every speed.

    fastest: (joints,), rad/s. A rotor inertia is not negative either.
    """
    joints = len(structure.arm)
    speeds = np.concatenate([-SPEED_SHARES[::-1], SPEED_SHARES])[:, None] * fastest
    scene = instants(structure.arm, Motion(np.zeros_like(speeds), speeds, np.ones_like(speeds)))
    against = np.zeros((len(speeds), joints, structure.size))
    inertia = np.zeros((joints, structure.size))
    for part, place in zip(structure.components, structure.slices, strict=True):
        joint = part.rows[0]
        if part.facts.dissipates and not part.follows_model:
            against[:, joint, place] = part.columns(scene)[:, 0] * np.sign(speeds[:, joint, None])
        elif isinstance(part, RotorInertia):
            inertia[joint, place] = 1.0
    rows = np.vstack([against.reshape(-1, structure.size), inertia])
    return np.asarray(rows[np.any(rows != 0, axis=1)])


MIN_BODY_EIGENVALUE = 1e-9  # of the largest nominal or fitted body: the solver's rounding stays on the physical side
WEAK_TOLERANCE = 10.0  # tolerance where none is given: it settles what the data do not determine, and little else
TYPICAL_BODY = (0.3, 0.3, 0.3, 1.0)  # m and sqrt(kg): the body that stands for a link without a nominal one


@dataclass(frozen=True, eq=False)
class PhysicalEstimate(Estimate):
    """An estimate that some bodies can have: inertial parameters (10 * joints,) of the links."""

    inertial: Array | None = None


@dataclass(frozen=True, eq=False)
class PhysicalLeastSquares:
    """Least squares over bodies that can exist and friction that dissipates.

    pull: `nominal` draws links and rotors to the arm's own as far as its tolerance says, with a point mass of
    free size on the last link where it names a payload; any other leaves them to the data.
    fastest: (joints,), rad/s, up to where friction has to dissipate. by_joint: weights by the joints' errors.
    """

    structure: Structure
    fastest: Array
    pull: Pull = NO_PULL
    by_joint: bool = True

    def __call__(self, data: Regression) -> PhysicalEstimate:
        """The estimate; raises InputError without Clarabel, RuntimeError where the solver finds no solution."""
        weights = self._weights(data)
        weighted = data.weighted(weights)
        inertial, values = self._solve(weighted)
        for part, place in zip(self.structure.components, self.structure.slices, strict=True):
            if isinstance(part, RotorInertia):  # the solver's rounding may leave one a hair below zero
                values[place] = np.maximum(values[place], 0)
        gram, information = weighted.matrix.T @ weighted.matrix, None
        if self.pull.kind == "nominal":
            information = nominal_prior(self.structure, self.pull.size, self.pull.payload).information
            gram = gram + information
        instruments = data.weighted(weights**2).matrix
        return PhysicalEstimate(values, pseudo_inverse(gram), instruments, information, inertial)

    def _weights(self, data: Regression) -> Array:
        free = WeightedLeastSquares()(data).values
        by_joint = joint_weights(data, free)
        if self.by_joint:
            return by_joint
        return np.full(data.joints, 1 / np.sqrt(np.mean(data.residuals(free) ** 2)))

    def _solve(self, data: Regression) -> tuple[Array, Array]:
        """Inertial parameters (10 * joints,) of the links, and all values (size,).

        The unknowns are the scaled bodies' upper triangles, the payload's mass, and what is no inertial parameter.
        """
        base, links = self.structure.base, len(self.structure.arm)
        lengths = column_lengths(data.matrix)
        entries = _triangle_basis()
        to_inertial = block_diag(*(_inertial_parameters(entries, scale) for scale in self._scales()))
        if self.pull.payload is not None:
            to_inertial = np.column_stack([to_inertial, point_mass(links, self.pull.payload)])
        to_values = block_diag(base.grouping @ to_inertial, np.diag(1 / lengths[len(base) :]))
        program = ConicProgram(to_values.shape[1])
        bodies = np.zeros((links, program.size, 4, 4))
        for link, matrices in enumerate(bodies):
            matrices[10 * link : 10 * (link + 1)] = entries
            program.require_semidefinite(matrices, -MIN_BODY_EIGENVALUE * np.eye(4))
        if self.pull.payload is not None:
            program.require_nonnegative(np.eye(1, program.size, 10 * links))
        rows = dissipation_rows(self.structure, self.fastest)
        if len(rows):
            program.require_nonnegative(rows / np.abs(rows).max(axis=1, keepdims=True) @ to_values)
        triangle = np.asarray(np.linalg.qr(np.column_stack([data.matrix / lengths, data.torque]))[1])[: len(lengths)]
        tolerance = self.pull.size if self.pull.kind == "nominal" else WEAK_TOLERANCE
        rotors, ones = self._rotor_pull(to_values)
        factor = np.vstack([tolerance * triangle[:, :-1] * lengths @ to_values, rotors])
        target = np.append(tolerance * triangle[:, -1], ones)
        # The pull to the nominal body, the unit matrix here: twice its divergence, trace - log det - 4.
        costs = 2 * np.trace(bodies.sum(axis=0), axis1=1, axis2=2)
        for matrices in bodies:
            logarithm = program.log_determinant(matrices)
            costs = np.pad(costs, (0, len(logarithm) - len(costs))) - 2 * logarithm
        found = program.solve(factor, target, costs)
        if isinstance(found, str):
            raise RuntimeError(f"no physically consistent parameters found: the solver says '{found}'")
        return to_inertial @ found[: to_inertial.shape[1]], to_values @ found

    def _scales(self) -> Array:
        """Factors (joints, 4, 4) that bring each body near the unit matrix: S with body = S link S'."""
        if self.structure.arm.links is not None:
            return np.asarray(np.linalg.cholesky(regular_nominal(self.structure.arm)))
        return np.tile(np.diag(TYPICAL_BODY), (len(self.structure.arm), 1, 1))

    def _rotor_pull(self, to_values: Array) -> tuple[Array, Array]:
        """Rows that are one where rotors have their nominal inertia, and that one for each."""
        rotors = nominal_rotors(self.structure) if self.pull.kind == "nominal" else []
        rows = [to_values[place] / inertia for place, inertia in rotors]
        return np.reshape(rows, (len(rows), to_values.shape[1])), np.ones(len(rows))


def _triangle_basis() -> Array:
    """The symmetric matrices (10, 4, 4) of the entries of an upper triangle."""
    rows, columns = np.triu_indices(4)
    entries = np.zeros((10, 4, 4))
    entries[np.arange(10), rows, columns] = entries[np.arange(10), columns, rows] = 1.0
    return entries


def _inertial_parameters(entries: Array, scale: Array) -> Array:
    """Columns (10, 10): ten parameters of each scaled pseudo-inertia in entries."""
    gram = np.einsum("iab,jab->ij", pseudo_inertia_basis(), pseudo_inertia_basis())
    dual = np.einsum("ij,jab->iab", np.linalg.inv(gram), pseudo_inertia_basis())
    return np.asarray(np.einsum("iac,eac->ie", dual, scale @ entries @ scale.T))
