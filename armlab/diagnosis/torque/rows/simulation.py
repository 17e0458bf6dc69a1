"""The simulation that a recording is compared with, and recordings that cannot be compared with any."""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.settings import Baseline
from armlab.diagnosis.torque.columns.columns import place_of
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.tuning import SoundnessTuning
from armlab.effects.contract import Candidate
from armlab.effects.model import FittedEffect
from armlab.effects.scene import Scene, instants, scene_of
from armlab.identification.model_file import read_model
from armlab.identification.nominal import nominal_model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Recording, Run
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

SPEEDS = np.geomspace(1e-3, 5.0, 40)  # rad/s (m/s) at which two laws of friction are compared
FITTED = frozenset({"runs", "settings"})  # in a provenance: of what a model was fitted to, and how
MAX_LAW_ERROR = 1e-6  # of the largest torque: more is another law


@dataclass(frozen=True, eq=False)
class Simulation:
    """kind: the baseline. inertial: (10 * joints,) of its links, None where there are none; beside a torque that was
    simulated elsewhere they say how large a change of a link may be. model: its friction and other terms, None for a
    robot file that states links and rotors alone, and beside such a torque. is_fitted: whether its provenance
    tells of a fit to recordings, so that it lacks little.
    """

    kind: Baseline
    arm: Arm
    inertial: Array | None
    model: TorqueModel | None = None
    is_fitted: bool = False

    @property
    def joints_without_friction(self) -> frozenset[int]:
        """Joints, from 1, of whose friction it says nothing."""
        parts = () if self.model is None else self.model.structure.components
        known = {each.joints[0] for each in parts if each.is_friction}
        return frozenset(range(1, len(self.arm) + 1)) - known

    @property
    def joints_unsaid(self) -> frozenset[int]:
        """Joints, from 1, of whose friction nothing is said; torque that was simulated elsewhere may hold it."""
        return frozenset() if self.kind == "simulated" else self.joints_without_friction

    def coefficients_of(self, candidate: Candidate) -> Array:
        """Coefficients of a law as the simulation has it already at its place, zeros where it has none.

        Friction that is a special case of the law counts, as Coulomb friction is of Stribeck friction.
        """
        out = np.zeros(candidate.size)
        for each in () if self.model is None else self.model.effects:
            if place_of(each.candidate) == place_of(candidate) and len(each.coefficients) == len(out):
                out = out + each.coefficients
            elif _is_of_speed(candidate) and _is_of_speed(each.candidate) and each.candidate.joint == candidate.joint:
                out = out + _as_law(candidate, each, self.arm)
        return out

    def torque(self, scene: Scene) -> Array:
        """Simulated torque of the motion of a scene, (samples, joints); zeros where there is no simulation."""
        if scene.beside is not None:
            return scene.beside
        return self._rigid_torque(scene) if self.model is None else self.model.torque_in(scene)

    def torque_in_mechanism(self, scene: Scene) -> Array:
        """The same without faults of the torque's channel, which act on what is recorded alone."""
        if scene.beside is not None:
            return scene.beside
        return self._rigid_torque(scene) if self.model is None else self.model.torque_in_mechanism(scene)

    def _rigid_torque(self, scene: Scene) -> Array:
        """What the links and rotors of a robot file need."""
        out = np.zeros(scene.torque.shape)
        if self.inertial is not None:
            out = rigid_body_torque(self.arm, scene.motion, self.inertial)
        if self.arm.rotor_inertia:
            out = out + np.asarray(self.arm.rotor_inertia) * scene.motion.acceleration
        return out

    def beside(self, run: Run) -> Array | None:
        """Torque of a run that was simulated elsewhere, (samples, joints), where that is what is compared with."""
        return run.simulated_torque if self.kind == "simulated" else None

    def scene_of(self, run: Run, motion: Motion) -> Scene:
        """The scene of a run and of its motion, with what was simulated beside it."""
        return replace(scene_of(run, motion, self.arm), beside=self.beside(run))

    def filtered(self, signals: Signals) -> Array:
        """Simulated torque through the filter of the measured one, (kept, joints)."""
        return np.asarray(signals.filter(self.torque(self.scene_of(signals.run, signals.motion))))


def _is_of_speed(candidate: Candidate) -> bool:
    """Whether it is friction of one joint by that joint's velocity alone, now."""
    of_other = candidate.of_time or candidate.follows_model or candidate.of_channel
    return candidate.is_friction and candidate.facts.axis == "velocity" and not of_other


def _as_law(candidate: Candidate, effect: FittedEffect, arm: Arm) -> Array:
    """Coefficients with which a friction law is another friction of its joint exactly; zeros where none are."""
    velocity = np.zeros((2 * len(SPEEDS), len(arm)))
    velocity[:, candidate.rows[0]] = np.concatenate([SPEEDS, -SPEEDS])
    still = np.zeros_like(velocity)
    scene = instants(arm, Motion(still, velocity, still))
    columns, torque = candidate.columns(scene)[:, 0], effect.torque(scene)[:, candidate.rows[0]]
    found = np.linalg.lstsq(columns, torque, rcond=None)[0]
    is_same = np.abs(columns @ found - torque).max() <= MAX_LAW_ERROR * np.abs(torque).max()
    return np.asarray(found) if is_same else np.zeros(candidate.size)


def read_simulation(recording: Recording, baseline: Baseline | None) -> Simulation:
    """The simulation of a recording; InputError where the wanted baseline is not there."""
    kind: Baseline = baseline or _usual_baseline(recording)
    if kind == "nominal" and not _has_nominal(recording):
        raise InputError(f"--baseline nominal: {recording.arm.name} has no `links` and {recording.name} no simulation")
    if kind == "simulated" and not _has_simulated_torque(recording):
        raise InputError(f"--baseline simulated: not every run of {recording.name} has columns of simulated_torque")
    arm = recording.arm
    links = arm.parameters if arm.links is not None else None
    if kind == "simulated":
        return Simulation(kind, arm, links)
    if recording.simulation is None:
        return Simulation(kind, arm, links, nominal_model(arm, recording.robot))
    model = read_model(recording.simulation)
    if len(model.arm) != len(arm):
        joints = f"{len(model.arm)} joints, the recording {len(arm)}"
        raise InputError(f"{recording.simulation} has {joints}: it is a model of another arm")
    inertial = model.inertial if model.inertial is not None else model.structure.full(model.base_values)
    return Simulation(kind, arm, inertial, model, is_fitted=not FITTED.isdisjoint(model.provenance))


def _usual_baseline(recording: Recording) -> Baseline:
    """What a recording is compared with by itself: the torque that was simulated beside it, else its simulation."""
    return "simulated" if _has_simulated_torque(recording) else model_baseline(recording)


def model_baseline(recording: Recording) -> Baseline:
    """The simulation of a recording where it has one, else its links fitted anew."""
    return "nominal" if _has_nominal(recording) else "refit"


def _has_simulated_torque(recording: Recording) -> bool:
    return all(run.simulated_torque is not None for run in recording.runs)


def _has_nominal(recording: Recording) -> bool:
    return recording.arm.links is not None or recording.simulation is not None


def reason_misread(observed: Observed, simulation: Simulation, tuning: SoundnessTuning) -> str | None:
    """Torque in a wrong unit or of the wrong sign, where all joints say so together."""
    if simulation.kind == "refit" or simulation.inertial is None:
        return None
    gains, shares = _torque_gains(observed, simulation)
    told = shares > tuning.min_explained_share
    factor = float(np.median(gains[told])) if told.any() else 1.0
    if factor < 0:
        return "The measured torque has the opposite sign of the simulated one: turn its sign in `transmission`."
    if factor > tuning.unit_factor or factor < 1 / tuning.unit_factor:
        return f"The measured torque is about {factor:.3g} times the simulated one: another unit, or gains missing?"
    return None


def _torque_gains(observed: Observed, simulation: Simulation) -> tuple[Array, Array]:
    """Per joint the factor between measured and simulated torque, friction fitted, and the share it explains."""
    simulated = np.concatenate([simulation.filtered(signals) for signals in observed.signals])
    measured, velocity = observed.torque, observed.kept("velocity")
    gains, shares = [], []
    for joint in range(observed.joints):
        friction = np.column_stack([velocity[:, joint], np.sign(velocity[:, joint]), np.ones(observed.rows)])
        column = simulated[:, joint] - friction @ np.linalg.lstsq(friction, simulated[:, joint])[0]
        torque = measured[:, joint] - friction @ np.linalg.lstsq(friction, measured[:, joint])[0]
        power = float(column @ column)
        gain = float(column @ torque) / power if power > 0 else 0.0
        gains.append(gain)
        shares.append(gain**2 * power / max(float(torque @ torque), 1e-300))
    return np.array(gains), np.array(shares)
