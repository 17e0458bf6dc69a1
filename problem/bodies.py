"""Which pseudo-inertias bodies have: points, rods and plates do, at the edge; what no body has gets the nearest one."""

import numpy as np

from armlab.common.arrays import Array
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertias

MAX_ROUNDING_SHARE = 1e-6  # of a body's size: files round their numbers, so less below zero is no mistake
MIN_EXTENT_SHARE = 1e-9  # of a body's size: simulators refuse points, rods and plates


def spread_at_centre(pseudo: Array) -> Array:
    """Second moments of mass (3, 3) about the centre of a body; about its frame where it has no mass."""
    mass = pseudo[3, 3]
    return np.asarray(pseudo[:3, :3] - np.outer(pseudo[:3, 3], pseudo[:3, 3]) / mass if mass > 0 else pseudo[:3, :3])


def is_body(pseudo: Array) -> bool:
    """Whether a body can have a pseudo-inertia (4, 4), as finely as files state numbers."""
    spread = spread_at_centre(pseudo)
    size = max(float(np.abs(np.linalg.eigvalsh(spread)).max()), 1e-300)
    without_mass = pseudo[3, 3] == 0 and np.any(pseudo[:3, 3])
    return bool(pseudo[3, 3] >= 0 and not without_mass and np.linalg.eigvalsh(spread)[0] >= -MAX_ROUNDING_SHARE * size)


def nearest_body(pseudo: Array) -> Array:
    """The body of the same mass and centre (4, 4) whose second moments are nearest: none of them is negative."""
    values, axes = np.linalg.eigh(spread_at_centre(pseudo))
    return _about_frame(pseudo, (axes * np.maximum(values, 0.0)) @ axes.T)


def with_extent(parameters: Array) -> Array:
    """Links (10 * joints,) as simulators take them: each with some extent in all directions, and some mass.

    A body without mass gets the share of the largest one; what no body is becomes the nearest one.
    """
    pseudos = pseudo_inertias(parameters)
    sizes = np.trace(pseudos, axis1=1, axis2=2)
    out: list[Array] = []
    for pseudo, size in zip(pseudos, np.maximum(sizes, MIN_EXTENT_SHARE * sizes.max(initial=0.0)), strict=True):
        least = MIN_EXTENT_SHARE * size
        values, axes = np.linalg.eigh(spread_at_centre(pseudo))
        if pseudo[3, 3] >= least and values[0] >= least:
            out.append(parameters[10 * len(out) : 10 * len(out) + 10])
            continue
        raised = pseudo.copy()
        raised[3, 3] = max(pseudo[3, 3], least)
        body = _about_frame(raised, (axes * np.maximum(values, least)) @ axes.T)
        out.append(link_from_pseudo_inertia(body).parameters)
    return np.concatenate(out)


def _about_frame(pseudo: Array, spread: Array) -> Array:
    """The pseudo-inertia with the mass and centre of another one, and second moments (3, 3) about the centre."""
    out = pseudo.copy()
    mass = pseudo[3, 3]
    out[:3, :3] = spread + (np.outer(pseudo[:3, 3], pseudo[:3, 3]) / mass if mass > 0 else 0.0)
    return out
