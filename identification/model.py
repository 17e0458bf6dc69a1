"""An identified model: predicts torque, tells its parameters with intervals, saves and loads itself."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import norm

from identification.components import Component
from identification.structure import Structure
from problem.arm import Arm
from problem.motion import Motion
from recordings.differentiate import Signals
from recordings.run import Array, Run

STEP = 1e-6  # of a coefficient: for the derivatives of named parameters


@dataclass(frozen=True)
class Parameter:
    """A named parameter with its 95 % interval; None where the model gives none."""

    name: str
    value: float
    interval: tuple[float, float] | None
    unit: str


@dataclass(frozen=True, eq=False)
class Model:
    """A structure with values.

    robot: as recordings name it. values: (columns,), covariance: (columns, columns) or None. factor: from a
    standard error to half an interval. inertial: (10 * joints,) of physically consistent links, or None.
    cutoff_hz: of the filter that it was identified with.
    """

    robot: str
    structure: Structure
    values: Array
    covariance: Array | None = None
    factor: float = float(norm.ppf(0.975))
    inertial: Array | None = None
    cutoff_hz: float | None = None
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.structure.arm

    @property
    def base_values(self) -> Array:
        """Base parameters, (base,)."""
        return self.values[: len(self.structure.base)]

    def torque(self, motion: Motion) -> Array:
        """Torque of a motion, (samples, joints), N m (N)."""
        return (self.structure.matrix(motion) @ self.values).reshape(motion.samples, -1)

    def filtered_torque(self, signals: Signals) -> Array:
        """Torque that passed the filter of the recorded one, (kept, joints)."""
        return (self.structure.filtered(signals) @ self.values).reshape(-1, len(self.arm))

    def predict(self, run: Run) -> Array:
        """Torque at every sample of a run, (samples, joints), by the cut-off of the identification."""
        from identification.regression import signals_of

        return self.torque(signals_of(run, self.cutoff_hz).motion)

    @property
    def base_parameters(self) -> tuple[Parameter, ...]:
        """The base parameters as sums."""
        base = self.structure.base
        half = self._half_widths(slice(0, len(base)))
        rows = zip(base.sums, self.base_values, half, self.structure.base_units, strict=True)
        return tuple(Parameter(name, float(value), _around(value, width), unit) for name, value, width, unit in rows)

    def component_parameters(self, index: int) -> tuple[Parameter, ...]:
        """Named parameters of one component, those that are held included."""
        part, place = self.structure.components[index], self.structure.slices[index]
        values = part.parameters(self.values[place])
        half = self._half_widths(place, _jacobian(part, self.values[place]))
        found = [
            Parameter(name, float(value), _around(value, width), part.unit(name, self.arm))
            for name, value, width in zip(part.names, values, half, strict=True)
        ]
        if part.shape.held:
            found.append(Parameter(part.shape.held, part.held_value, None, part.unit(part.shape.held, self.arm)))
        return tuple(found)

    def _half_widths(self, place: slice, jacobian: Array | None = None) -> Array:
        """Half widths of the intervals, NaN without covariance."""
        if self.covariance is None:
            return np.full(place.stop - place.start, np.nan)
        block = self.covariance[place, place]
        if jacobian is not None:
            block = jacobian @ block @ jacobian.T
        return np.asarray(self.factor * np.sqrt(np.maximum(np.diag(block), 0)))

    def save(self, path: str | Path) -> Path:
        """Writes `model.yaml`; InputError where it cannot be written."""
        from identification.model_file import write_model

        return write_model(self, Path(path))

    @staticmethod
    def load(path: str | Path) -> "Model":
        """The model of a `model.yaml`; InputError, in one line, where it is wrong."""
        from identification.model_file import read_model

        return read_model(Path(path))

    def __str__(self) -> str:
        """A table of all parameters."""
        rows = [("base parameters", each) for each in self.base_parameters]
        for index, part in enumerate(self.structure.components):
            rows += [(part.label, each) for each in self.component_parameters(index)]
        return "\n".join(f"{what}: {_line(each)}" for what, each in rows)

    def plot(self, run: Run) -> Any:
        """A figure of recorded and predicted torque and what is left, joint by joint."""
        from identification.pictures import residual_figure
        from identification.regression import signals_of

        return residual_figure(self, signals_of(run, self.cutoff_hz))


def _around(value: float, half: float) -> tuple[float, float] | None:
    return None if np.isnan(half) else (float(value - half), float(value + half))


def _jacobian(part: Component, coefficients: Array) -> Array:
    """Derivatives of the named parameters by the coefficients, by central differences."""
    steps = STEP * np.maximum(np.abs(coefficients), 1e-3)
    columns = [
        (part.parameters(coefficients + step) - part.parameters(coefficients - step)) / (2 * step.sum())
        for step in np.diag(steps)
    ]
    return np.column_stack(columns)


def _line(parameter: Parameter) -> str:
    spread = "" if parameter.interval is None else f" [{parameter.interval[0]:.4g}, {parameter.interval[1]:.4g}]"
    return f"{parameter.name} = {parameter.value:.4g}{spread} {parameter.unit}"
