"""The detection limit: what an oracle with the true form and the true noise finds with 90 % power.

The oracle tests one number, the effect's size, after everything free has been projected out of the effect's torque,
in whitened rows; the test's level is one per cent over all effects and places that a diagnosis may look at. An
effect's *multiple* is the square root of its noncentrality over that of the limit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from concealed.noise import Noise
from recordings.run import Array
from recordings.vocabulary import EFFECTS

ORACLE_HZ = 250.0  # rows a second: means over 4 ms
FAMILY_WISE, POWER = 0.01, 0.9
DEPENDENT = 1e-10  # share of a column's power that counts as rounding


def candidates(joints: int) -> int:
    """Effects times places in the vocabulary: what a test has to be corrected for."""
    places = {"joint": joints, "coupling": joints * (joints - 1), "link": joints, "robot": 1}
    return sum(places[effect.where] for effect in EFFECTS if effect.id != "unknown")


@lru_cache(maxsize=32)
def limit_noncentrality(joints: int) -> float:
    """Noncentrality of a chi-square of one degree of freedom that is found with 90 % power."""
    critical = chi2.isf(FAMILY_WISE / candidates(joints), 1)
    return float(brentq(lambda value: ncx2.sf(critical, 1, value) - POWER, 1.0, 200.0))


@dataclass(frozen=True, eq=False)
class Oracle:
    """Whitens rows by the true noise and projects out what is free.

    noise: of the recording's samples at rate_hz. basis: (rows, columns), orthonormal, of the free columns.
    """

    noise: Noise
    rate_hz: float
    basis: Array | None = None

    def freed(self, columns: Sequence[Array]) -> "Oracle":
        """The oracle with free columns, a (samples, joints, columns) each run."""
        flat = np.vstack([self._rows(run) for run in columns])
        return Oracle(self.noise, self.rate_hz, _orthonormal(flat))

    def multiple(self, torque: Sequence[Array], beside: Sequence[Array] | None = None) -> float:
        """How many detection limits an effect is large whose torque is (samples, joints) in each run.

        beside: columns that are free for this effect alone, (samples, joints, columns) each run.
        """
        joints = torque[0].shape[1]
        rows = np.vstack([self._rows(run[..., None]) for run in torque])
        parts = [] if self.basis is None else [self.basis]
        if beside is not None:
            parts.append(_orthonormal(_rest(np.vstack([self._rows(run) for run in beside]), parts)))
        return float(np.sqrt(np.sum(_rest(rows, parts) ** 2) / limit_noncentrality(joints)))

    def _rows(self, columns: Array) -> Array:
        """Whitened rows (samples * joints, columns)."""
        thinned = Noise(
            self.noise.kind,
            self.noise.white * np.sqrt(min(ORACLE_HZ / self.rate_hz, 1.0)),  # of a mean over several samples
            self.noise.coloured,
            self.noise.corner_hz,
        )
        out = [thinned.whitened(columns[:, joint], joint, ORACLE_HZ) for joint in range(columns.shape[1])]
        return np.vstack(out)


def _rest(rows: Array, bases: Sequence[Array]) -> Array:
    for _ in range(2):
        for basis in bases:
            rows = rows - basis @ (basis.T @ rows)
    return rows


def _orthonormal(columns: Array) -> Array:
    """An orthonormal basis of columns, dependent ones left out."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns[:, lengths > 0] / lengths[lengths > 0]
    power, axes = np.linalg.eigh(scaled.T @ scaled)
    kept = power > DEPENDENT
    return np.asarray(scaled @ (axes[:, kept] / np.sqrt(power[kept])))
