"""What the first recording holds already: the noise of the arm, and moments of everything that may be fitted to it."""

from dataclasses import dataclass

import numpy as np

from diagnosis.effects.contract import Scene
from diagnosis.engine.noise import noise_of
from diagnosis.engine.observed import Observed, observe
from diagnosis.next.moments import Index, Moments
from diagnosis.next.present import Present
from diagnosis.next.question import Layout
from diagnosis.next.sampling import Sampling, kept_columns
from diagnosis.next.whitening import Whitening
from diagnosis.settings import Settings
from problem.regressor import rigid_body_torque
from recordings.recording import Recording
from recordings.run import Array


@dataclass(frozen=True, eq=False)
class FirstRun:
    """observed: the runs. scenes: one a run. torque: (rows, joints), N m, what the links do not explain."""

    observed: Observed
    scenes: tuple[Scene, ...]
    torque: Array

    @property
    def rows(self) -> int:
        """Kept rows of all joints."""
        return self.observed.rows * self.observed.joints

    def columns(self, layout: Layout) -> Array:
        """All columns at the kept rows, (rows, joints, columns)."""
        pairs = zip(self.scenes, self.observed.signals, strict=True)
        return np.concatenate(
            [kept_columns(layout.base, layout.candidates, scene, signals.filter) for scene, signals in pairs]
        )

    def sampling(self, columns: Array, fitted: Index) -> Sampling:
        """The filter and the noise that is left when the fitted columns are taken out."""
        noise = noise_of(self._residual(columns[:, :, fitted]), self.observed, len(fitted) / self.observed.joints)
        return Sampling(self.observed.rate_hz, self.observed.cutoff_hz, Whitening(noise.taps, noise.scales))

    def moments(self, columns: Array, noise: Whitening) -> Moments:
        """Of all runs, in the rows where a joint moves."""
        size = columns.shape[2]
        whole = np.concatenate([columns, self.torque[:, :, None]], axis=2)
        gram = np.zeros((size + 1, size + 1))
        for joint in range(self.observed.joints):
            for part in self.observed.used(joint):
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
