"""Classical test functions with a known optimum, to test algorithms without an arm."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from armlab.common.arrays import Array
from problem.contract import Evaluation


def sphere(x: Array) -> Array:
    """Sum of squares (points,); minimum 0 at 0."""
    return np.asarray(np.square(x).sum(axis=1))


def ellipsoid(x: Array) -> Array:
    """Sum of squares with weights from 1 to 1e6 (Hansen 2009, f2); minimum 0 at 0."""
    return np.asarray((np.square(x) * np.logspace(0, 6, x.shape[1])).sum(axis=1))


def rosenbrock(x: Array) -> Array:
    """Rosenbrock's valley, moved so that the minimum 0 is at 0."""
    z = x + 1.0
    return np.asarray((100.0 * np.square(z[:, 1:] - np.square(z[:, :-1])) + np.square(z[:, :-1] - 1.0)).sum(axis=1))


def rastrigin(x: Array) -> Array:
    """Rastrigin's function; minimum 0 at 0."""
    return np.asarray((np.square(x) - 10.0 * np.cos(2 * np.pi * x) + 10.0).sum(axis=1))


def ackley(x: Array) -> Array:
    """Ackley's function; minimum 0 at 0."""
    root = np.sqrt(np.square(x).mean(axis=1))
    waves = np.cos(2 * np.pi * x).mean(axis=1)
    return np.asarray(-20.0 * np.expm1(-0.2 * root) - np.exp(waves) + np.e)


FUNCTIONS: Mapping[str, Callable[[Array], Array]] = MappingProxyType(
    {
        "sphere": sphere,
        "ellipsoid": ellipsoid,
        "rosenbrock": rosenbrock,
        "rastrigin": rastrigin,
        "ackley": ackley,
    }
)


@dataclass(frozen=True, eq=False)
class TestFunction:
    """A function on the box [-half_width, half_width]^dimension with its minimum 0 at `optimum` (dimension,)."""

    __test__ = False  # not a test case, whatever its name looks like to pytest

    name: str
    function: Callable[[Array], Array]
    half_width: float
    optimum: Array

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return np.full(len(self.optimum), -self.half_width)

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return np.full(len(self.optimum), self.half_width)

    def evaluate(self, points: Array) -> Evaluation:
        """The function's values (points,) as fitness and value; every point is within limits."""
        values = self.function(points - self.optimum)
        return Evaluation(values, values, np.zeros(len(points)))
