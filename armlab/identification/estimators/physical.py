"""Full physical consistency: pseudo-inertias positive semidefinite, friction dissipative; a convex problem.

Sousa and Cortesao 2014; Wensing, Kim and Slotine 2018; the pull to the nominal model is the entropic
(Bregman log-det) divergence of Lee, Wensing and Park 2020. Solved by Clarabel through CVXPY (extra
`identify`).

Friction takes energy away: linear conditions on its coefficients.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.effects.drive import RotorInertia
from armlab.effects.scene import instants
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
        """The estimate; raises InputError without CVXPY, RuntimeError where the solver finds no solution."""
        weights = self._weights(data)
        weighted = data.weighted(weights)
        inertial, values = self._solve(weighted)
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
        cp = load_cvxpy()
        lengths = column_lengths(data.matrix)
        triangle = np.linalg.qr(np.column_stack([data.matrix / lengths, data.torque]))[1]
        size, base = self.structure.size, self.structure.base
        links = [cp.Variable((4, 4), PSD=True) for _ in range(len(self.structure.arm))]
        scales = self._scales()
        inertial = cp.hstack([_inertial_parameters(cp, link, scale) for link, scale in zip(links, scales, strict=True)])
        conditions = [link >> MIN_BODY_EIGENVALUE * np.eye(4) for link in links]
        if self.pull.payload is not None:
            mass = cp.Variable(nonneg=True)
            inertial = inertial + mass * point_mass(len(links), self.pull.payload)
        parts = [base.grouping @ inertial]
        others = cp.Variable(size - len(base)) if size > len(base) else None
        if others is not None:
            parts.append(cp.multiply(others, 1 / lengths[len(base) :]))
        values = cp.hstack(parts)
        fitted = triangle[:, :size] @ cp.multiply(lengths, values)
        noise = float(np.linalg.norm(triangle[:, size])) or 1.0
        error = cp.sum_squares((fitted - triangle[:, size]) / noise)
        pull = self._pull(cp, links, values) / noise**2
        rows = dissipation_rows(self.structure, self.fastest)
        if len(rows):
            conditions.append((rows / np.abs(rows).max(axis=1, keepdims=True)) @ values >= 0)
        minimise(cp, error + pull, conditions, "physically consistent parameters")
        return np.asarray(inertial.value), np.asarray(values.value)

    def _scales(self) -> Array:
        """Factors (joints, 4, 4) that bring each body near the unit matrix: S with body = S link S'."""
        if self.structure.arm.links is not None:
            return np.asarray(np.linalg.cholesky(regular_nominal(self.structure.arm)))
        return np.tile(np.diag(TYPICAL_BODY), (len(self.structure.arm), 1, 1))

    def _pull(self, cp: Any, links: list[Any], values: Any) -> Any:
        """Twice the divergence to the nominal bodies (the unit matrix here) over the squared tolerance."""
        nominal = self.pull.kind == "nominal"
        bodies = sum(2 * (cp.trace(link) - cp.log_det(link) - 4) for link in links)
        rotors = [values[place] / inertia - 1 for place, inertia in nominal_rotors(self.structure)] if nominal else []
        return (bodies + sum(cp.square(off) for off in rotors)) / (self.pull.size if nominal else WEAK_TOLERANCE) ** 2


def _inertial_parameters(cp: Any, link: Any, scale: Array) -> Any:
    """Ten parameters, linear in the scaled pseudo-inertia."""
    gram = np.einsum("iab,jab->ij", pseudo_inertia_basis(), pseudo_inertia_basis())
    dual = np.einsum("ij,jab->iab", np.linalg.inv(gram), pseudo_inertia_basis())
    turned = np.einsum("ab,iac,cd->ibd", scale, dual, scale)
    return turned.reshape(10, 16) @ cp.vec(link, order="C")


def load_cvxpy() -> Any:
    """CVXPY; InputError, in one line, where it is not installed."""
    try:
        import cvxpy
    except ImportError:
        raise InputError("physically consistent parameters need CVXPY: pip install 'armlab[identify]'") from None
    return cvxpy


def minimise(cp: Any, objective: Any, conditions: list[Any], sought: str) -> None:
    """Solves a convex problem: the variables hold the solution. RuntimeError where the solver finds none."""
    task = cp.Problem(cp.Minimize(objective), conditions)
    task.solve(solver=cp.CLARABEL)
    if task.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise RuntimeError(f"no {sought} found: the solver says '{task.status}'")
