"""A motion: joint positions, velocities and accelerations, batch first, then samples, then joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array

MAX_RATE_AT_REST = 1e-9  # rad/s and rad/s2 (m): what rounding leaves


@dataclass(frozen=True, eq=False)
class Motion:
    """Arrays of one shape (..., samples, joints): rad, rad/s, rad/s2 (m for prismatic joints).

    Raises ValueError if the shapes differ.
    """

    position: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        """Holds contiguous float arrays of one shape, as the compiled kernel reads them."""
        for name in ("position", "velocity", "acceleration"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64))
        shapes = {self.position.shape, self.velocity.shape, self.acceleration.shape}
        if len(shapes) != 1 or self.position.ndim < 2:
            raise ValueError(f"a motion needs three arrays of one shape (..., samples, joints), not {shapes}")

    @property
    def samples(self) -> int:
        """Instants of each trajectory."""
        return int(self.position.shape[-2])

    @property
    def joints(self) -> int:
        """Joints of the arm."""
        return int(self.position.shape[-1])

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape in front of samples and joints."""
        return self.position.shape[:-2]

    def select(self, chosen: NDArray[np.bool_] | np.intp) -> "Motion":
        """One trajectory of a batch, or those for which `chosen` (batch,) holds."""
        return Motion(self.position[chosen], self.velocity[chosen], self.acceleration[chosen])
