"""A structure with values: predicts torque and states its parameters with intervals; knows no files or pictures."""

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.probabilities import normal_quantile
from armlab.effects.model import FittedEffect, torque_in_mechanism, torque_of_model
from armlab.effects.parameters import ParameterValue, parameter_values
from armlab.effects.scene import Scene, instants, scene_of
from armlab.identification.recorded_motion import RecordedMotion
from armlab.identification.regression import signals_of
from armlab.identification.structure import Structure
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.drive_torque import compensation_torque
from problem.motion import Motion
from problem.regressor import rigid_body_torque

ADDS_TO, SIMULATED_TORQUE = "adds_to", "simulated_torque"  # in the provenance


@dataclass(frozen=True, eq=False)
class TorqueModel:
    """A structure with values.

    robot: as recordings name it. values: (columns,), covariance: (columns, columns) or None; NaN where nothing is
    known. factor: from a standard error to half an interval. inertial: (10 * joints,) of physically consistent links,
    or None. cutoff_hz, position_factor: of the filters that it was identified with, see `signals_of`.
    stated: the parameters of each component as a file states them; empty for a model that was fitted. unclaimed:
    components that the model has because many arms have them, without enough evidence for a finding. simulated:
    components that the simulation has already. motion: of the runs that it was fitted on; None where that is not known.
    """

    robot: str
    structure: Structure
    values: Array
    covariance: Array | None = None
    factor: float = normal_quantile(0.975)
    inertial: Array | None = None
    cutoff_hz: float | None = None
    position_factor: float = 1.0
    provenance: dict[str, Any] = field(default_factory=dict)
    stated: tuple[tuple[ParameterValue, ...], ...] = ()
    unclaimed: frozenset[int] = frozenset()
    simulated: frozenset[int] = frozenset()
    motion: RecordedMotion | None = None

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.structure.arm

    @property
    def is_difference(self) -> bool:
        """Whether it adds to a torque that was simulated elsewhere, which a recording has in columns of its own."""
        return self.provenance.get(ADDS_TO) == SIMULATED_TORQUE

    @property
    def base_values(self) -> Array:
        """Base parameters, (base,)."""
        return self.values[: len(self.structure.base)]

    @property
    def effects(self) -> tuple[FittedEffect, ...]:
        """The components with their coefficients."""
        pairs = zip(self.structure.components, self.structure.slices, strict=True)
        return tuple(FittedEffect(part, self.values[place]) for part, place in pairs)

    @property
    def links(self) -> Array:
        """Inertial parameters (10 * joints,): of the links, or the base parameters and zeros elsewhere."""
        return self.inertial if self.inertial is not None else self.structure.full(self.base_values)

    @property
    def rotor_inertia(self) -> Array:
        """Inertia of each rotor on the joint side, (joints,), kg m2 (kg)."""
        out = np.zeros(len(self.arm))
        for effect in self.effects:
            out[effect.candidate.rows[0]] += effect.candidate.joint_fields(effect.coefficients).get("armature", 0.0)
        return out

    def torque(self, motion: Motion, run: Run | None = None) -> Array:
        """Torque of a motion, (samples, joints), N m (N).

        run: where the motion comes from, sample by sample. Without it the samples count as single instants; ValueError
        where an effect depends on their order in time. InputError where the model adds to a simulated torque that the
        run has not.
        """
        if run is not None:
            return self.torque_in(self._scene_of(run, motion))
        in_time = [part.label for part in self.structure.components if part.of_time]
        if in_time:
            raise ValueError(f"torque of {', '.join(in_time)} needs the run of the motion, for its times")
        return self.torque_in(instants(self.arm, motion))

    def torque_in(self, scene: Scene) -> Array:
        """Torque of the motion of a scene, (samples, joints), N m (N); the scene's links and torque do not matter."""
        return torque_of_model(self.effects, self._rigid_scene(scene))

    def torque_in_mechanism(self, scene: Scene) -> Array:
        """The same without faults of the torque's channel."""
        return torque_in_mechanism(self.effects, self._rigid_scene(scene))

    def _rigid_scene(self, scene: Scene) -> Scene:
        rigid = rigid_body_torque(self.arm, scene.motion, self.links)
        own = rigid - compensation_torque(self.arm, scene.motion)
        if scene.beside is None:
            return replace(scene, inertial=self.links, torque=own)
        links = self.links if self.structure.load is None else self.structure.load
        return replace(scene, inertial=links, torque=own + scene.beside)

    def filtered_torque(self, signals: Signals) -> Array:
        """Torque that passed the filter of the recorded one, (kept, joints)."""
        return np.asarray(signals.filter(self.torque(signals.motion, signals.run)))

    def signals(self, run: Run) -> Signals:
        """A run that passed the filters of the identification."""
        return signals_of(run, self.cutoff_hz, self.position_factor)

    def predict(self, run: Run) -> Array:
        """Torque at every sample of a run, (samples, joints), by the cut-off of the identification; see `torque`."""
        signals = self.signals(run)
        return self.torque(signals.motion, signals.run)

    def _scene_of(self, run: Run, motion: Motion) -> Scene:
        scene = scene_of(run, motion, self.arm)
        if not self.is_difference:
            return scene
        if run.simulated_torque is None:
            raise InputError(f"{run.name}: the model adds to columns of {SIMULATED_TORQUE}, which this run has not")
        return replace(scene, beside=run.simulated_torque)

    @property
    def base_parameters(self) -> tuple[ParameterValue, ...]:
        """The base parameters as sums."""
        base = self.structure.base
        half = np.full(len(base), np.nan)
        if self.covariance is not None:
            half = self.factor * np.sqrt(np.maximum(np.diag(self.covariance)[: len(base)], 0))
        rows = zip(base.sums, self.base_values.tolist(), half.tolist(), self.structure.base_units, strict=True)
        return tuple(ParameterValue(name, value, _around(value, width), unit) for name, value, width, unit in rows)

    def component_parameters(self, index: int) -> tuple[ParameterValue, ...]:
        """Named parameters of one component, those that are held included, which have no interval."""
        if self.stated:
            return self.stated[index]
        part, place = self.structure.components[index], self.structure.slices[index]
        covariance = None if self.covariance is None else self.covariance[place, place]
        parameters = parameter_values(part, self.values[place], covariance, self.factor)
        return tuple(replace(each, interval=None) if _is_held(each) else each for each in parameters)

    def __repr__(self) -> str:
        """The robot, how many parameters of which components, and the cut-off of the identification."""
        parts = Counter(part.effect for part in self.structure.components)
        lines = [
            f"{type(self).__name__} of {self.robot}; joints: {len(self.arm)}, base parameters: {len(self.base_values)}",
            "  components: " + (", ".join(f"{count} {effect}" for effect, count in parts.items()) or "none"),
        ]
        links = "physically consistent" if self.inertial is not None else "known by their base parameters"
        intervals = "without intervals" if self.covariance is None else "with 95 % intervals"
        cutoff = "" if self.cutoff_hz is None else f"; cut-off {self.cutoff_hz:.4g} Hz"
        return "\n".join([*lines, f"  links {links}; {intervals}{cutoff}"])

    def __str__(self) -> str:
        """A table of all parameters."""
        return "\n".join(f"{what}: {parameter_line(each)}" for what, each in self.named_parameters())

    def named_parameters(self) -> list[tuple[str, ParameterValue]]:
        """All parameters, each with what it is a parameter of."""
        rows = [("base parameters", each) for each in self.base_parameters]
        for index, part in enumerate(self.structure.components):
            rows += [(part.label, each) for each in self.component_parameters(index)]
        return rows


def _around(value: float, half: float) -> tuple[float, float] | None:
    return None if np.isnan(half) else (value - half, value + half)


def _is_held(parameter: ParameterValue) -> bool:
    """Whether no fitted coefficient changes a parameter."""
    return parameter.interval is not None and parameter.interval[0] == parameter.interval[-1]


def is_told(parameter: ParameterValue) -> bool:
    """Whether the data tell a scalar parameter: its 95 % interval does not hold zero; vectors and what has none are."""
    if parameter.interval is None or isinstance(parameter.value, tuple):
        return True
    low, high = parameter.interval
    return not float(np.asarray(low)) <= 0 <= float(np.asarray(high))


def parameter_line(parameter: ParameterValue) -> str:
    """`coefficient = 2.31 [2.27, 2.35] N.m.s/rad`."""
    values = parameter.value if isinstance(parameter.value, tuple) else (parameter.value,)
    numbers = ", ".join(f"{value:.4g}" for value in values)
    spread = ""
    if parameter.interval is not None and not isinstance(parameter.value, tuple):
        low, high = (f"{end:.4g}" for end in parameter.interval)
        width = float(np.ptp(parameter.interval))
        spread = f" [{low}, {high}]" if low != high else f" within {width / 2:.1g}" if width else " (no interval)"
    return f"{parameter.name} = {numbers}{spread} {parameter.unit}"
