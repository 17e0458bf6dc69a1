"""What the first recording holds already: the noise of the arm, and moments of everything that may be fitted to it."""

from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.data import (
    CREEP_RATIO,
    HIGH_SPEED_QUANTILE,
    POSITION_CUTOFF_RATIO,
    STANDSTILL_SIGMAS,
    Observed,
    observe,
)
from armlab.diagnosis.noise import fit_noise
from armlab.diagnosis.settings import Settings
from armlab.effects.contract import Scene
from diagnosis.next.moments import Index, Moments
from diagnosis.next.present import Present
from diagnosis.next.question import Layout
from diagnosis.next.sampling import Sampling, kept_columns
from diagnosis.next.whitening import Whitening
from problem.regressor import rigid_body_torque
from recordings.cutoff import acceleration_spectrum, noise_level
from recordings.recording import Recording
from recordings.run import Array, Role


@dataclass(frozen=True, eq=False)
class FirstRun:
    """observed: the runs. scenes: one a run. torque: (rows, joints), N m, what the links do not explain."""

    observed: Observed
    scenes: tuple[Scene, ...]
    torque: Array

    @property
    def rows(self) -> int:
        """Kept rows of all joints from which a diagnosis learns."""
        return sum(each.stop - each.start for each in self.observed.of_role("identify")) * self.observed.joints

    @property
    def counted(self) -> float:
        """Share of one more run from which a diagnosis will learn: where no run validates, stretches of all do."""
        return 2 / 3 if self.observed.held_out_blocks else 1.0

    def columns(self, layout: Layout) -> Array:
        """All columns at the kept rows, (rows, joints, columns)."""
        pairs = zip(self.scenes, self.observed.signals, strict=True)
        return np.concatenate(
            [kept_columns(layout.base, layout.candidates, scene, signals.filter) for scene, signals in pairs]
        )

    def sampling(self, columns: Array, fitted: Index) -> Sampling:
        """The filter and the noise that is left when the fitted columns are taken out."""
        noise = fit_noise(self._residual(columns[:, :, fitted]), self.observed, len(fitted) / self.observed.joints)
        whitening = Whitening(noise.taps, noise.scales)
        return Sampling(self.observed.rate_hz, self.observed.cutoff_hz, whitening, self._standing())

    def _standing(self) -> tuple[float, ...]:
        """Speed of each joint (joints,) below which a diagnosis takes it as standing still, rad/s (m/s)."""
        speed = np.quantile(np.abs(self.observed.motion.velocity), HIGH_SPEED_QUANTILE, axis=0)
        highest = POSITION_CUTOFF_RATIO * self.observed.cutoff_hz
        noise = []
        for signals in self.observed.signals:
            run = signals.run
            frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
            density = noise_level(frequency, spectrum, shape, run.rate_hz)
            noise.append(2 * np.pi * np.sqrt(density * highest**3 / 3))
        slow: list[float] = np.maximum(STANDSTILL_SIGMAS * np.max(noise, axis=0), CREEP_RATIO * speed).tolist()
        return tuple(slow)

    def moments(self, columns: Array, noise: Whitening, role: Role) -> Moments:
        """Of the rows of a role in which a joint moves."""
        size = columns.shape[2]
        whole = np.concatenate([columns, self.torque[:, :, None]], axis=2)
        gram = np.zeros((size + 1, size + 1))
        for joint in range(self.observed.joints):
            for part in self.observed.of_role(role, joint):
                rows = noise(whole[part.start : part.stop, joint], joint)
                gram += rows.T @ rows
        return Moments(gram[:size, :size], gram[:size, size])

    def _residual(self, columns: Array) -> Array:
        flat, torque = columns.reshape(-1, columns.shape[2]), self.torque.reshape(-1)
        lengths = np.linalg.norm(flat, axis=0)
        scaled = flat / np.where(lengths > 0, lengths, 1.0)
        values = np.linalg.lstsq(scaled, torque, rcond=1e-9)[0]
        return np.asarray((torque - scaled @ values).reshape(self.torque.shape))


def first_run(recording: Recording, present: Present) -> FirstRun:
    """Filters and thins the runs as a diagnosis does."""
    observed = observe(recording.runs, present.arm, present.inertial, Settings())
    scenes, torques = [], []
    for signals in observed.signals:
        time = signals.run.time - signals.run.time[0]
        scenes.append(present.scene(signals.motion, time, signals.run.name))
        torques.append(signals.torque - signals.filter(_links(present, scenes[-1])))
    return FirstRun(observed, tuple(scenes), np.concatenate(torques))


def _links(present: Present, scene: Scene) -> Array:
    torque = rigid_body_torque(present.arm, scene.motion, present.inertial)
    rotors = np.asarray(present.arm.rotor_inertia) if present.arm.rotor_inertia else np.zeros(len(present.arm))
    return np.asarray(torque + rotors * scene.motion.acceleration)
