"""A structure with values: predicts torque and tells its parameters with intervals; knows no files or pictures."""

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.effects.extras import Extra, torque_with_extras
from armlab.effects.scene import Scene, scene_of
from armlab.identification.components import Component
from armlab.identification.regression import signals_of
from armlab.identification.structure import Structure
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion

DERIVATIVE_STEP = 1e-6  # of a coefficient: for the derivatives of named parameters


@dataclass(frozen=True)
class Parameter:
    """A named parameter with its 95 % interval; None where the model gives none."""

    name: str
    value: float
    interval: tuple[float, float] | None
    unit: str


@dataclass(frozen=True, eq=False)
class TorqueModel:
    """A structure with values.

    robot: as recordings name it. values: (columns,), covariance: (columns, columns) or None. factor: from a
    standard error to half an interval. inertial: (10 * joints,) of physically consistent links, or None.
    cutoff_hz, position_factor: of the filters that it was identified with, see `signals_of`. extras: effects that
    plug-ins compute.
    """

    robot: str
    structure: Structure
    values: Array
    covariance: Array | None = None
    factor: float = float(norm.ppf(0.975))
    inertial: Array | None = None
    cutoff_hz: float | None = None
    position_factor: float = 1.0
    provenance: dict[str, Any] = field(default_factory=dict)
    extras: tuple[Extra, ...] = ()

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.structure.arm

    @property
    def base_values(self) -> Array:
        """Base parameters, (base,)."""
        return self.values[: len(self.structure.base)]

    def torque(self, motion: Motion, run: Run | None = None) -> Array:
        """Torque of a motion, (samples, joints), N m (N).

        run: where the motion comes from, sample by sample, for extras: ValueError where they lack it.
        """
        return self.torque_in(self._scene(motion, run)) if self.extras else self._linear(motion)

    def torque_in(self, scene: Scene) -> Array:
        """Torque of the motion of a scene, (samples, joints), N m (N); the scene's links and torque do not matter."""
        inertial = self.inertial if self.inertial is not None else self.structure.full(self.base_values)
        return torque_with_extras(self.extras, replace(scene, inertial=inertial, torque=self._linear(scene.motion)))

    def _linear(self, motion: Motion) -> Array:
        return (self.structure.matrix(motion) @ self.values).reshape(motion.samples, -1)

    def filtered_torque(self, signals: Signals) -> Array:
        """Torque that passed the filter of the recorded one, (kept, joints)."""
        if self.extras:
            return np.asarray(signals.filter(self.torque(signals.motion, signals.run)))
        return (self.structure.filtered(signals) @ self.values).reshape(-1, len(self.arm))

    def _scene(self, motion: Motion, run: Run | None) -> Scene:
        if run is None:
            effects = ", ".join(each.told["effect"] for each in self.extras)
            raise ValueError(f"torque of {effects} needs the run of the motion, for its times")
        return scene_of(run, motion, self.arm)

    def signals(self, run: Run) -> Signals:
        """A run that passed the filters of the identification."""
        return signals_of(run, self.cutoff_hz, self.position_factor)

    def predict(self, run: Run) -> Array:
        """Torque at every sample of a run, (samples, joints), by the cut-off of the identification."""
        signals = self.signals(run)
        return self.torque(signals.motion, signals.run)

    @property
    def base_parameters(self) -> tuple[Parameter, ...]:
        """The base parameters as sums."""
        base = self.structure.base
        half = self._half_widths(slice(0, len(base)))
        rows = zip(base.sums, self.base_values, half, self.structure.base_units, strict=True)
        return tuple(
            Parameter(name, float(value), _interval_around(value, width), unit) for name, value, width, unit in rows
        )

    def component_parameters(self, index: int) -> tuple[Parameter, ...]:
        """Named parameters of one component, those that are held included."""
        part, place = self.structure.components[index], self.structure.slices[index]
        values = part.parameters(self.values[place])
        half = self._half_widths(place, parameter_jacobian(part, self.values[place]))
        found = [
            Parameter(name, float(value), _interval_around(value, width), part.unit(name, self.arm))
            for name, value, width in zip(part.names, values, half, strict=True)
        ]
        if part.shape.held:
            found.append(Parameter(part.shape.held, part.held_value, None, part.unit(part.shape.held, self.arm)))
        return tuple(found)

    def _half_widths(self, place: slice, derivatives: Array | None = None) -> Array:
        """Half widths of the intervals, NaN without covariance."""
        if self.covariance is None:
            return np.full(place.stop - place.start, np.nan)
        block = self.covariance[place, place]
        if derivatives is not None:
            block = derivatives @ block @ derivatives.T
        return np.asarray(self.factor * np.sqrt(np.maximum(np.diag(block), 0)))

    def __repr__(self) -> str:
        """The robot, how many parameters of which components, and the cut-off of the identification."""
        parts = Counter(part.effect for part in self.structure.components)
        lines = [
            f"{type(self).__name__} of {self.robot}; joints: {len(self.arm)}, base parameters: {len(self.base_values)}",
            "  components: " + (", ".join(f"{count} {effect}" for effect, count in parts.items()) or "none"),
        ]
        if self.extras:
            lines.append("  effects: " + ", ".join(each.told["effect"] for each in self.extras))
        links = "physically consistent" if self.inertial is not None else "known by their base parameters"
        intervals = "without intervals" if self.covariance is None else "with 95 % intervals"
        cutoff = "" if self.cutoff_hz is None else f"; cut-off {self.cutoff_hz:.4g} Hz"
        return "\n".join([*lines, f"  links {links}; {intervals}{cutoff}"])

    def __str__(self) -> str:
        """A table of all parameters."""
        rows = [("base parameters", each) for each in self.base_parameters]
        for index, part in enumerate(self.structure.components):
            rows += [(part.label, each) for each in self.component_parameters(index)]
        return "\n".join(
            [*(f"{what}: {_parameter_line(each)}" for what, each in rows), *(str(each) for each in self.extras)]
        )


def _interval_around(value: float, half: float) -> tuple[float, float] | None:
    return None if np.isnan(half) else (float(value - half), float(value + half))


def parameter_jacobian(part: Component, coefficients: Array) -> Array:
    """Derivatives of the named parameters by the coefficients, by central differences."""
    steps = DERIVATIVE_STEP * np.maximum(np.abs(coefficients), 1e-3)
    columns = [
        (part.parameters(coefficients + step) - part.parameters(coefficients - step)) / (2 * step.sum())
        for step in np.diag(steps)
    ]
    return np.column_stack(columns)


def _parameter_line(parameter: Parameter) -> str:
    spread = "" if parameter.interval is None else f" [{parameter.interval[0]:.4g}, {parameter.interval[1]:.4g}]"
    return f"{parameter.name} = {parameter.value:.4g}{spread} {parameter.unit}"
