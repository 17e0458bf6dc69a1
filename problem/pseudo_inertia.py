"""A link's ten parameters as a 4 x 4 pseudo-inertia, linear both ways (Wensing, Kim and Slotine 2018)."""

from functools import lru_cache

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm, Link
from problem.inertia import link_from_pseudo_inertia, pseudo_inertia_of

MIN_EIGENVALUE_SHARE = 1e-3  # of a body's mean eigenvalue: point masses and rods get that much of it in each direction


def link_of(parameters: Array) -> Link:
    """The link with parameters (10,) in the order of eq. 31."""
    mass, *rest = (float(value) for value in parameters)
    return Link(mass, (rest[0], rest[1], rest[2]), (rest[3], rest[4], rest[5], rest[6], rest[7], rest[8]))


def links_of(parameters: Array) -> tuple[Link, ...]:
    """Links with parameters (10 * joints,)."""
    return tuple(link_of(ten) for ten in parameters.reshape(-1, 10))


@lru_cache(maxsize=1)
def pseudo_inertia_basis() -> Array:
    """Pseudo-inertia of each parameter alone, (10, 4, 4)."""
    return np.stack([pseudo_inertia_of(link_of(unit)) for unit in np.eye(10)])


def pseudo_inertias(parameters: Array) -> Array:
    """(joints, 4, 4) of parameters (10 * joints,)."""
    return np.asarray(np.einsum("jp,pab->jab", parameters.reshape(-1, 10), pseudo_inertia_basis()))


def least_eigenvalues(parameters: Array) -> Array:
    """Smallest eigenvalue of each link's pseudo-inertia, (joints,): negative where no body can have it."""
    return np.asarray(np.linalg.eigvalsh(pseudo_inertias(parameters))[:, 0])


def regular_nominal(arm: Arm) -> Array:
    """The arm's parameters with bodies that are points or rods thickened a little, (joints, 4, 4).

    Distances to a singular pseudo-inertia are infinite. Raises ValueError for an arm without `links`.
    """
    pseudos = pseudo_inertias(arm.parameters)
    out = []
    for pseudo in pseudos:
        moments = pseudo[:3, :3] + MIN_EIGENVALUE_SHARE * (
            np.trace(pseudo[:3, :3]) / 3 + pseudo[3, 3] * MIN_EIGENVALUE_SHARE
        ) * np.eye(3)
        raised = pseudo.copy()
        raised[:3, :3] = moments
        out.append(_make_definite(raised))
    return np.stack(out)


def _make_definite(pseudo: Array) -> Array:
    values, vectors = np.linalg.eigh(pseudo)
    raised = np.maximum(values, MIN_EIGENVALUE_SHARE**2 * values.max())
    return np.asarray((vectors * raised) @ vectors.T)


def parameters_of(pseudos: Array) -> Array:
    """Parameters (10 * joints,) of pseudo-inertias (joints, 4, 4)."""
    return np.concatenate([link_from_pseudo_inertia(pseudo).parameters for pseudo in pseudos])


def entropic_information(pseudos: Array) -> Array:
    """Second derivative of twice the entropic divergence at given bodies, (10 * joints, 10 * joints).

    tr(J^-1 E_i J^-1 E_j): the metric in which a change of coordinates changes nothing (Lee and Park 2018).
    """
    joints = len(pseudos)
    out = np.zeros((10 * joints, 10 * joints))
    for link, pseudo in enumerate(pseudos):
        units = np.linalg.inv(pseudo) @ pseudo_inertia_basis()
        place = slice(10 * link, 10 * link + 10)
        out[place, place] = np.einsum("iab,jba->ij", units, units)
    return out
