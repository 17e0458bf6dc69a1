"""The present model (links and effects found) in any motion, and what the first recording shows: its noise, and the
moments of all columns.
"""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.next.moments import DesignMoments, Index
from armlab.diagnosis.next.question import Layout
from armlab.diagnosis.next.sampling import Sampling, kept_columns
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.rows.data import Observed, observe
from armlab.diagnosis.torque.rows.noise import Noise, fit_noise
from armlab.effects.contract import Candidate, Scene
from armlab.effects.model import FittedEffect, torque_in_mechanism
from armlab.recordings.cutoff import acceleration_spectrum, noise_level
from armlab.recordings.identifiable import reason_impossible, reason_not_identifiable
from armlab.recordings.recording import Recording, Role
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

FoundEffect = tuple[Candidate, Array]


@dataclass(frozen=True, eq=False)
class PresentModel:
    """inertial: (10 * joints,) of the links. parts: effects with their coefficients."""

    arm: Arm
    inertial: Array
    parts: tuple[FoundEffect, ...] = ()

    def scene(self, motion: Motion, time: Array, run: str = "designed") -> Scene:
        """A run as effects see it; time: (samples,), s, from the first sample."""
        torque = rigid_body_torque(self.arm, motion, self.inertial)
        if self.arm.rotor_inertia:
            torque = torque + np.asarray(self.arm.rotor_inertia) * motion.acceleration
        scene = Scene(run, time, motion, self.arm, self.inertial, torque)
        effects = [FittedEffect(candidate, values) for candidate, values in self.parts]
        return replace(scene, torque=torque_in_mechanism(effects, scene))


@dataclass(frozen=True, eq=False)
class FirstRun:
    """The first recording. scenes: one for each run. torque: (rows, joints), N m, measured less that of the links."""

    observed: Observed
    scenes: tuple[Scene, ...]
    torque: Array

    @property
    def rows(self) -> int:
        """Kept rows of all joints from which a diagnosis learns."""
        return sum(each.stop - each.start for each in self.observed.of_role("identify")) * self.observed.joints

    @property
    def learned_share(self) -> float:
        """Share of one more run from which a diagnosis will learn: where no run validates, stretches of all do."""
        return 2 / 3 if self.observed.held_out_blocks else 1.0

    def columns(self, layout: Layout) -> Array:
        """Columns of a layout at the kept rows, (rows, joints, columns)."""
        pairs = zip(self.scenes, self.observed.signals, strict=True)
        return np.concatenate(
            [kept_columns(layout.base, layout.candidates, scene, signals.filter) for scene, signals in pairs]
        )

    def sampling(self, columns: Array, fitted: Index) -> Sampling:
        """The filter and the noise that is left when the fitted columns are taken out."""
        left, each = self._fit_residual(columns[:, :, fitted]), len(fitted) / self.observed.joints
        noise = fit_noise(left, self.observed, each, Settings().tuning.noise)
        return Sampling(self.observed.rate_hz, self.observed.cutoff_hz, noise, self._standing_speeds())

    def _standing_speeds(self) -> tuple[float, ...]:
        """Speed of each joint (joints,) below which a diagnosis takes it as standing still, rad/s (m/s)."""
        tuning = Settings().tuning.data
        speed = np.quantile(np.abs(self.observed.motion.velocity), tuning.high_speed_quantile, axis=0)
        highest = tuning.position_cutoff_ratio * self.observed.cutoff_hz
        noise = []
        for signals in self.observed.signals:
            run = signals.run
            frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
            density = noise_level(frequency, spectrum, shape, run.rate_hz)
            noise.append(2 * np.pi * np.sqrt(density * highest**3 / 3))
        noisy = tuning.standstill_sigmas * np.max(noise, axis=0)
        slow: list[float] = np.maximum(noisy, tuning.creep_ratio * speed).tolist()
        return tuple(slow)

    def moments(self, columns: Array, noise: Noise, role: Role) -> DesignMoments:
        """Moments of the rows of a role in which a joint moves. columns: (rows, joints, columns)."""
        size = columns.shape[2]
        whole = np.concatenate([columns, self.torque[:, :, None]], axis=2)
        gram = np.zeros((size + 1, size + 1))
        for joint in range(self.observed.joints):
            for part in self.observed.of_role(role, joint):
                rows = noise.whitened(whole[:, joint], joint, [part])
                gram += rows.T @ rows
        return DesignMoments(gram[:size, :size], gram[:size, size])

    def _fit_residual(self, columns: Array) -> Array:
        flat, torque = columns.reshape(-1, columns.shape[2]), self.torque.reshape(-1)
        lengths = np.linalg.norm(flat, axis=0)
        scaled = flat / np.where(lengths > 0, lengths, 1.0)
        values = np.linalg.lstsq(scaled, torque, rcond=1e-9)[0]
        return np.asarray((torque - scaled @ values).reshape(self.torque.shape))


def observe_first_run(recording: Recording, present: PresentModel) -> FirstRun:
    """Filters and thins the runs as a diagnosis does; InputError where a diagnosis could not use them."""
    settings = Settings()
    reason = reason_not_identifiable(recording) or reason_impossible(recording.runs, recording.arm)
    observed = None if reason else observe(recording.runs, present.arm, present.inertial, settings)
    reason = reason if observed is None else observed.reason_too_short(present.arm)
    if reason or observed is None:
        raise InputError(f"--recording {recording.name}: {reason}")
    scenes, torques = [], []
    for signals in observed.signals:
        time = signals.run.time - signals.run.time[0]
        scenes.append(present.scene(signals.motion, time, signals.run.name))
        torques.append(signals.torque - signals.filter(_link_torque(present, scenes[-1])))
    return FirstRun(observed, tuple(scenes), np.concatenate(torques))


def _link_torque(present: PresentModel, scene: Scene) -> Array:
    torque = rigid_body_torque(present.arm, scene.motion, present.inertial)
    rotors = np.asarray(present.arm.rotor_inertia) if present.arm.rotor_inertia else np.zeros(len(present.arm))
    return np.asarray(torque + rotors * scene.motion.acceleration)
