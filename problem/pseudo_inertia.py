"""A body's ten inertial parameters as a 4 x 4 pseudo-inertia, which is linear in them.

J = [[sigma, h], [h^T, m]] with h the first moment and sigma = tr(I)/2 eye - I the second moments of mass
(Wensing, Kim and Slotine 2018, eq. 14). One product moves it between frames. A body is physical where J is positive
semidefinite.
"""

from functools import lru_cache

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm, Link

ROUNDING = 1e-12  # of the largest eigenvalue: less below zero is none
MIN_EIGENVALUE_SHARE = 1e-3  # of a body's mean eigenvalue: point masses and rods get that much of it in each direction


def pseudo_inertia_of(link: Link) -> Array:
    """Pseudo-inertia (4, 4) of a link about the origin of its frame."""
    xx, yy, zz, xy, xz, yz = link.inertia
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    pseudo[:3, 3] = pseudo[3, :3] = link.first_moment
    pseudo[3, 3] = link.mass
    return pseudo


def transform_pseudo_inertia(pseudo: Array, pose: Array) -> Array:
    """The same body seen from a frame in which its own frame has the given pose (4, 4); eq. 17 and a turn."""
    return pose @ pseudo @ pose.T


def link_from_pseudo_inertia(pseudo: Array) -> Link:
    """The link whose pseudo-inertia is given."""
    inertia = np.trace(pseudo[:3, :3]) * np.eye(3) - pseudo[:3, :3]
    entries = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return Link(float(pseudo[3, 3]), tuple(pseudo[:3, 3].tolist()), tuple(entries.tolist()))


def link_from_centre_of_mass(mass: float, centre: Array, inertia: Array) -> Link:
    """A link from its centre of mass (3,), m, and the inertia (3, 3) about it, kg m2 (eq. 17)."""
    entries = tuple(np.asarray(inertia)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist())
    pose = np.eye(4)
    pose[:3, 3] = centre
    return link_from_pseudo_inertia(
        transform_pseudo_inertia(pseudo_inertia_of(Link(mass, (0.0, 0.0, 0.0), entries)), pose)
    )


def link_of(parameters: Array) -> Link:
    """The link with parameters (10,) in the order of eq. 31."""
    mass, x, y, z, xx, yy, zz, xy, xz, yz = parameters.tolist()
    return Link(mass, (x, y, z), (xx, yy, zz, xy, xz, yz))


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


def are_bodies(inertial: Array) -> bool:
    """Whether links with parameters (10 * joints,) are bodies, frames without mass among them included.

    Base parameters alone leave links out, and make of others what no body is.
    """
    values = np.linalg.eigvalsh(pseudo_inertias(inertial))
    is_something = values[:, -1] > 0
    return bool(np.all(is_something) or (np.any(is_something) and np.all(values[:, 0] >= -ROUNDING * values.max())))


def least_eigenvalues(parameters: Array) -> Array:
    """Smallest eigenvalue of each link's pseudo-inertia, (joints,): negative where no body can have it."""
    return np.asarray(np.linalg.eigvalsh(pseudo_inertias(parameters))[:, 0])


def regular_nominal(arm: Arm) -> Array:
    """The arm's parameters with bodies that are points or rods thickened a little, (joints, 4, 4).

    A frame without mass becomes a body that is nothing beside the others.
    Distances to a singular pseudo-inertia are infinite. Raises ValueError for an arm without `links`.
    """
    pseudos = pseudo_inertias(arm.parameters)
    largest = float(np.trace(pseudos, axis1=1, axis2=2).max())
    out = []
    for pseudo in pseudos:
        moments = pseudo[:3, :3] + MIN_EIGENVALUE_SHARE * (
            np.trace(pseudo[:3, :3]) / 3 + pseudo[3, 3] * MIN_EIGENVALUE_SHARE
        ) * np.eye(3)
        raised = pseudo.copy()
        raised[:3, :3] = moments
        out.append(_make_definite(raised, largest))
    return np.stack(out)


def _make_definite(pseudo: Array, largest: float) -> Array:
    """largest: of the sizes of all bodies, of which one that is nothing gets a share."""
    values, vectors = np.linalg.eigh(pseudo)
    size = values.max() if values.max() > 0 else MIN_EIGENVALUE_SHARE**2 * largest
    raised = np.maximum(values, MIN_EIGENVALUE_SHARE**2 * size)
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
