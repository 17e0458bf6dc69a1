"""Named parameters of a law with their intervals, by the delta method."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Value

Interval = tuple[float, float] | tuple[tuple[float, float], ...]
COEFFICIENT_STEP = 1e-6  # of a coefficient, for derivatives
SMALLEST_COEFFICIENT = 1e-9  # SI units, where a coefficient is about zero


@dataclass(frozen=True)
class ParameterValue:
    """A named parameter, SI units, with its 95 % interval: one pair, or one a component of a vector."""

    name: str
    value: Value
    interval: Interval | None
    unit: str


def parameter_values(
    candidate: Candidate, coefficients: Array, covariance: Array | None, factor: float
) -> tuple[ParameterValue, ...]:
    """The parameters in the candidate's order; intervals are None where the covariance does not determine them.

    covariance: of the coefficients, or of the coefficients and then the shapes. factor: from a standard error to half
    an interval.
    """
    out = []
    slopes = {} if covariance is None else parameter_slopes(candidate, coefficients, len(covariance))
    for name, value in candidate.parameters(coefficients).items():
        interval = None if covariance is None else _interval(value, slopes[name], covariance, factor)
        out.append(ParameterValue(name, value, interval, candidate.unit(name)))
    return tuple(out)


def _interval(value: Value, slopes: Array, covariance: Array, factor: float) -> Interval | None:
    half = half_widths(slopes, covariance, factor)
    if not np.isfinite(half).all():
        return None
    if isinstance(value, tuple):
        return tuple((each - by, each + by) for each, by in zip(value, half.tolist(), strict=True))
    return value - float(half[0]), value + float(half[0])


def half_widths(slopes: Array, covariance: Array, factor: float) -> Array:
    """Half widths of the intervals of a parameter's components; slopes: (components, numbers)."""
    return np.asarray(factor * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0)))


def parameter_slopes(candidate: Candidate, coefficients: Array, numbers: int) -> dict[str, Array]:
    """Derivatives (components, numbers) of each named parameter by the coefficients, and then by the shapes.

    numbers: of coefficients, and of shapes where there are more.
    """
    columns: dict[str, list[Array]] = {name: [] for name in candidate.parameters(coefficients)}

    def add(at: Callable[[float], dict[str, Value]], step: float) -> None:
        after, before = at(step), at(-step)
        for name, column in columns.items():
            column.append((np.atleast_1d(after[name]) - np.atleast_1d(before[name])) / (2 * step))

    for index, value in enumerate(coefficients):
        unit = np.eye(len(coefficients))[index]

        def moved(by: float, unit: Array = unit) -> dict[str, Value]:
            return candidate.parameters(coefficients + by * unit)

        add(moved, COEFFICIENT_STEP * max(abs(float(value)), SMALLEST_COEFFICIENT))
    for index in range(numbers - len(coefficients)):
        low, high = candidate.bounds[index]

        def shaped(by: float, index: int = index) -> dict[str, Value]:
            shape = list(candidate.shape)
            shape[index] += by
            return candidate.with_shape(tuple(shape)).parameters(coefficients)

        add(shaped, COEFFICIENT_STEP * (high - low))
    return {name: np.column_stack(column) for name, column in columns.items()}
