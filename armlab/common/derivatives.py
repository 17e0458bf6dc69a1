"""First derivatives at one point: what an algorithm asks of a problem, and what the problem answers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array


class Question(NamedTuple):
    """What an algorithm asks about a point beside its fitness.

    sharpness: of the smooth value; the larger, the closer it follows the fitness of a point within all limits.
    watched: limits whose slopes are wanted (k,). within: so are those of every limit that is nearer than this.
    """

    sharpness: float
    watched: NDArray[np.intp]
    within: float


class Derivatives(NamedTuple):
    """The answer for a point (d,).

    value, slope (d,): a smooth value and its derivatives; not finite where there are none.
    margins (m,): how far each limit is away, negative where it is broken, in units of half of its range.
    watched (k,): the limits that were asked for, and margin_slopes (k, d) their derivatives.
    """

    value: float
    slope: Array
    margins: Array
    watched: NDArray[np.intp]
    margin_slopes: Array
