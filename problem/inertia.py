"""Inertial parameters of one body as a pseudo-inertia, which moves between frames by one product.

J = [[sigma, h], [h^T, m]] with h the first moment and sigma = tr(I)/2 eye - I the second moments of mass
(Wensing, Kim and Slotine 2018, eq. 14). A body is physical where J is positive semidefinite.
"""

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Link


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
