"""How good an excitation is: eq. 44, D- and E-optimality of its observation matrix."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from problem.spectrum import Spectrum


@dataclass(frozen=True)
class Criterion:
    """What is minimised for a trajectory within all limits.

    `eq44`: cond + weight_smallest / sigma_min + weight_largest * sigma_max (eq. 44; the paper gives neither
    the value of its one weight nor its place). `d_optimality`: -2 sum(log sigma) / n, that is -log det of the
    information matrix per parameter. `e_optimality`: -sigma_min.
    """

    kind: Literal["eq44", "d_optimality", "e_optimality"] = "eq44"
    weight_smallest: float = 0.0
    weight_largest: float = 0.0

    def value(self, spectrum: Spectrum) -> Array:
        """Criterion (points,) of observation matrices."""
        if self.kind == "e_optimality":
            return -spectrum.smallest
        if self.kind == "d_optimality":
            return -2.0 * spectrum.mean_logarithm
        with np.errstate(divide="ignore", invalid="ignore"):  # 0 / 0 where a weight is 0 too
            merit = self.weight_smallest / spectrum.smallest + self.weight_largest * spectrum.largest
        return np.where(spectrum.smallest > 0, spectrum.condition_number + merit, np.inf)
