"""Bound policies: how the driver brings asked points into the box, coordinate by coordinate.

Each is a function of the points (n, d) and the box alone and leaves a coordinate inside as it is, to the bit.
"""

from collections.abc import Callable

import numpy as np

from algorithms.contract import Array, Box

BoundPolicy = Callable[[Array, Box], Array]


def clip(X: Array, box: Box) -> Array:
    """A coordinate outside goes to the bound it crossed."""
    return np.minimum(np.maximum(X, box.lower), box.upper)


def reflect(X: Array, box: Box) -> Array:
    """A coordinate outside is mirrored at the bound, as often as it takes to be inside."""
    width = box.upper - box.lower
    return _replace_outside(X, box, box.upper - np.abs(np.mod(X - box.lower, 2 * width) - width))


def wrap(X: Array, box: Box) -> Array:
    """A coordinate outside comes in again at the opposite bound."""
    return _replace_outside(X, box, box.lower + np.mod(X - box.lower, box.upper - box.lower))


def _replace_outside(X: Array, box: Box, replacement: Array) -> Array:
    inside = (box.lower <= X) & (box.upper >= X)
    return np.where(inside, X, clip(replacement, box))  # clip: rounding may leave the box by one bit


POLICIES: dict[str, BoundPolicy] = {"clip": clip, "reflect": reflect, "wrap": wrap}


def bound_policy(name: str) -> BoundPolicy:
    """The policy of that name; raises ValueError with the known names."""
    if name not in POLICIES:
        raise ValueError(f"unknown bound policy {name!r}: choose one of {', '.join(POLICIES)}")
    return POLICIES[name]
