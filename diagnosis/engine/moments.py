"""Products of the whitened columns: all that a fit of any subset of them needs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.engine.columns import Columns
from diagnosis.engine.noise import Noise
from diagnosis.engine.observed import Observed
from recordings.run import Array


@dataclass(frozen=True, eq=False)
class Moments:
    """gram: (size + 1, size + 1), of the identification rows of all joints, columns scaled to unit length.

    The last row and column belong to the torque, which is not scaled. lengths: (size,), of the columns. heldout: per
    joint (own + 1, own + 1) of the validation rows, in the same scale. rows: whitened identification rows a joint.
    heldout_rows: those of validation.
    """

    gram: Array
    lengths: Array
    heldout: tuple[Array, ...]
    index: tuple[NDArray[np.intp], ...]
    rows: tuple[int, ...]
    heldout_rows: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of columns, the torque aside."""
        return len(self.gram) - 1

    @property
    def power(self) -> float:
        """Squared length of the whitened torque."""
        return float(self.gram[-1, -1])

    def heldout_error(self, coefficients: Array) -> Array:
        """Whitened squared error on held-out rows, (joints,); coefficients: (size,), of scaled columns."""
        full = np.append(-coefficients, 1.0)
        out = []
        for gram, index in zip(self.heldout, self.index, strict=True):
            part = full[index]
            used = np.flatnonzero(part)
            out.append(part[used] @ gram[np.ix_(used, used)] @ part[used])
        return np.asarray(np.maximum(np.array(out, dtype=np.float64), 0))


def moments(columns: Columns, noise: Noise, observed: Observed) -> Moments:
    """Whitens all columns and multiplies them."""
    gram = np.zeros((columns.size + 1, columns.size + 1))
    heldout, rows, held_rows = [], [], []
    for joint, (matrix, index) in enumerate(zip(columns.matrices, columns.index, strict=True)):
        identify = _product(noise.white(matrix, joint, observed, "identify"))
        gram[np.ix_(index, index)] += identify[0]
        validate = _product(noise.white(matrix, joint, observed, "validate"))
        heldout.append(validate[0])
        rows.append(identify[1])
        held_rows.append(validate[1])
    lengths = np.sqrt(np.diag(gram)[:-1])
    scale = np.append(np.where(lengths > 0, lengths, 1.0), 1.0)
    gram /= np.outer(scale, scale)
    scaled = tuple(each / np.outer(scale[own], scale[own]) for each, own in zip(heldout, columns.index, strict=True))
    return Moments(gram, scale[:-1], scaled, columns.index, tuple(rows), tuple(held_rows))


def _product(white: Array) -> tuple[Array, int]:
    return white.T @ white, len(white)
