"""Base parameters: the combinations of inertial parameters that joint torques identify.

Columns of the observation matrix that are zero belong to parameters without any effect. Of the others, a
largest independent set is kept, in an order of preference; the torque depends on the rest only through
fixed sums with the kept ones (Gautier and Khalil 1990; numerically, Gautier 1991).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import observation_matrix

Preference = Literal["later_columns", "earlier_columns"] | Sequence[str]
RANDOM_STATES = 200  # random states that probe the columns
DEPENDENCE_TOLERANCE = 1e-9  # of a column's length: above rounding (1e-13), below any real dependence of an arm


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Which parameters are identifiable, and how the others regroup with them.

    columns: (base,), ascending: indices of the kept columns. grouping: (base, 10 * joints): the base
    parameters are `grouping @ phi`. names: of all parameters.
    """

    names: tuple[str, ...]
    columns: NDArray[np.intp]
    grouping: Array

    def __len__(self) -> int:
        """Number of base parameters: the rank of the observation matrix."""
        return len(self.columns)

    @property
    def alone(self) -> tuple[str, ...]:
        """Parameters that are identifiable individually."""
        return tuple(self.names[column] for column in self.columns[self._single])

    @property
    def grouped(self) -> tuple[str, ...]:
        """Parameters that are identifiable only in sums with others."""
        return self._named(np.any(self.grouping[~self._single] != 0, axis=0))

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Parameters without any effect on the torques."""
        return self._named(np.all(self.grouping == 0, axis=0))

    @property
    def sums(self) -> tuple[str, ...]:
        """Each base parameter as a readable sum, like `Iyy3 - Ixx3 + 0.0049 m3`."""
        return tuple(self._sum(row, kept) for row, kept in zip(self.grouping, self.columns, strict=True))

    def values(self, parameters: Array) -> Array:
        """Base parameters (base,) of inertial parameters (10 * joints,)."""
        return np.asarray(self.grouping @ parameters)

    @property
    def _single(self) -> NDArray[np.bool_]:
        return np.asarray(np.count_nonzero(self.grouping, axis=1) == 1)

    def _named(self, chosen: NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple(name for name, wanted in zip(self.names, chosen, strict=True) if wanted)

    def _sum(self, row: Array, kept: int) -> str:
        others = [column for column in np.flatnonzero(row) if column != kept]
        return self.names[kept] + "".join(_term(row[column], self.names[column]) for column in others)


def base_parameters(arm: Arm, preference: Preference = "later_columns") -> BaseParameters:
    """The base parameters of an arm under its gravity.

    preference: which columns are kept where there is a choice: the later ones (from the last parameter of
    the last link backwards), the earlier ones, or names of parameters to keep first, then the later ones.
    Raises ValueError for an unknown name.
    """
    matrix = _random_observation_matrix(arm)
    lengths = np.linalg.norm(matrix, axis=0)
    effective = lengths > DEPENDENCE_TOLERANCE * lengths.max()
    unit = matrix / np.where(effective, lengths, 1.0)
    kept = independent_columns(unit, [column for column in _column_order(arm, preference) if effective[column]])
    dependent = np.flatnonzero(effective & ~np.isin(np.arange(matrix.shape[1]), kept))
    combination = np.linalg.lstsq(unit[:, kept], unit[:, dependent], rcond=None)[0]
    combination *= lengths[dependent] / lengths[kept, None]
    combination[np.abs(combination) < DEPENDENCE_TOLERANCE] = 0.0
    grouping = np.zeros((len(kept), matrix.shape[1]))
    grouping[:, kept] = np.eye(len(kept))
    grouping[:, dependent] = combination
    return BaseParameters(arm.parameter_names, kept, grouping)


def _random_observation_matrix(arm: Arm) -> Array:
    """Observation matrix at random states, the same for each call."""
    rng = np.random.default_rng(0)
    shape = (RANDOM_STATES, len(arm))
    position = rng.uniform(-2, 2, shape)
    velocity = rng.uniform(-2, 2, shape)
    acceleration = rng.uniform(-2, 2, shape)
    return observation_matrix(arm, Motion(position, velocity, acceleration))


def _column_order(arm: Arm, preference: Preference) -> list[int]:
    columns = list(range(10 * len(arm)))
    if preference == "later_columns":
        return columns[::-1]
    if preference == "earlier_columns":
        return columns
    unknown = [name for name in preference if name not in arm.parameter_names]
    if unknown:
        raise ValueError(f"no parameter '{unknown[0]}' in {arm.name}: names are like {arm.parameter_names[1]}")
    wanted = [arm.parameter_names.index(name) for name in preference]
    return wanted + [column for column in columns[::-1] if column not in wanted]


def independent_columns(unit: Array, order: Sequence[int], tolerance: float = DEPENDENCE_TOLERANCE) -> NDArray[np.intp]:
    """Columns kept by Gram-Schmidt with reorthogonalisation, in the given order; returned ascending.

    unit: (rows, columns) of unit length. tolerance: length of what the columns before it leave of a dependent one.
    """
    basis = np.empty((unit.shape[0], 0))
    kept = []
    for column in order:
        rest = unit[:, column]
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > tolerance:
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            kept.append(column)
    return np.sort(np.array(kept, dtype=np.intp))


def _term(coefficient: float, name: str) -> str:
    sign = "-" if coefficient < 0 else "+"
    size = f"{abs(coefficient):.6g}"
    return f" {sign} {name}" if size == "1" else f" {sign} {size} {name}"
