"""The simulation that a recording is compared with: its torque, and what the effects may know of it."""

from dataclasses import dataclass

import numpy as np

from diagnosis.settings import Baseline
from identification.model_file import read_model
from identification.scene import Scene, scene_of
from identification.torque_model import TorqueModel
from problem.arm import Arm
from problem.errors import InputError
from problem.regressor import rigid_body_torque
from recordings.differentiate import Signals
from recordings.recording import Recording
from recordings.run import Array


@dataclass(frozen=True, eq=False)
class Simulation:
    """kind: the baseline. inertial: (10 * joints,) of its links, None where there are none. model: its friction
    and other terms, None for a plain robot file.
    """

    kind: Baseline
    arm: Arm
    inertial: Array | None
    model: TorqueModel | None = None

    def torque(self, scene: Scene) -> Array:
        """Simulated torque of the motion of a scene, (samples, joints); zeros where there is no simulation."""
        if self.model is not None:
            return self.model.torque_in(scene)
        out = np.zeros(scene.torque.shape)
        if self.inertial is not None:
            out = rigid_body_torque(self.arm, scene.motion, self.inertial)
        if self.arm.rotor_inertia:
            out = out + np.asarray(self.arm.rotor_inertia) * scene.motion.acceleration
        return out

    def filtered(self, signals: Signals) -> Array:
        """Simulated torque through the filter of the measured one, (kept, joints)."""
        if self.kind == "simulated" and signals.run.simulated_torque is not None:
            return np.asarray(signals.filter(signals.run.simulated_torque))
        return np.asarray(signals.filter(self.torque(scene_of(signals.run, signals.motion, self.arm))))


def simulation_of(recording: Recording, baseline: Baseline | None) -> Simulation:
    """The simulation of a recording; InputError where the wanted baseline is not there."""
    kind: Baseline = baseline or ("nominal" if _has_nominal(recording) else "refit")
    if kind == "nominal" and not _has_nominal(recording):
        raise InputError(f"--baseline nominal: {recording.arm.name} has no `links` and {recording.name} no simulation")
    if kind == "simulated" and any(run.simulated_torque is None for run in recording.runs):
        raise InputError(f"--baseline simulated: not every run of {recording.name} has columns of simulated_torque")
    arm = recording.arm
    if recording.simulation is None:
        return Simulation(kind, arm, arm.parameters if arm.links is not None else None)
    model = read_model(recording.simulation)
    if len(model.arm) != len(arm):
        joints = f"{len(model.arm)} joints, the recording {len(arm)}"
        raise InputError(f"{recording.simulation} has {joints}: it is a model of another arm")
    inertial = model.inertial if model.inertial is not None else model.structure.full(model.base_values)
    return Simulation(kind, arm, inertial, model)


def _has_nominal(recording: Recording) -> bool:
    return recording.arm.links is not None or recording.simulation is not None
