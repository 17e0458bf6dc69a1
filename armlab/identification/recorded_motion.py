"""How fast, and under which load, joints moved in the runs that a model was fitted on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.scene import LoadedScene, Scene
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

QUANTILES = 20
DIGITS = 4  # significant ones
SWEEPS = 10  # over all speeds in a run, so that friction that changes over the run is not that of one speed
STRIDE = 1e3  # rad (m) between two samples: friction that follows the way since a reversal has settled


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """The motion of the runs that a model was fitted on, as friction needs it.

    speeds: (joints, quantiles), rad/s (m/s), at which a joint spent equal shares of the time that it moved, rising;
    zeros for a joint that never moved. load: (joints,), mean size of the torque that the links need, N m (N).
    duration: of a run, mean, s. temperature: (sensors,), mean, degrees Celsius; None without thermometers.
    """

    speeds: Array
    load: Array
    duration: float
    temperature: Array | None = None

    @classmethod
    def of(cls, scenes: Sequence[Scene], inertial: Array) -> "RecordedMotion":
        """The motion of runs. inertial: (10 * joints,), the links of the model; the scenes' own do not matter."""
        velocity = np.concatenate([scene.motion.velocity for scene in scenes])
        load = np.concatenate([rigid_body_torque(scene.arm, scene.motion, inertial) for scene in scenes])
        thermometers = [scene.temperature for scene in scenes if scene.temperature is not None]
        return cls(
            speeds=np.array([_speed_quantiles(own) for own in velocity.T]),
            load=_rounded(np.abs(load).mean(axis=0)),
            duration=float(_rounded(np.mean([scene.time[-1] for scene in scenes]))),
            temperature=_rounded(np.nanmean(np.concatenate(thermometers), axis=0)) if thermometers else None,
        )

    def to_and_fro(self, arm: Arm, inertial: Array) -> Scene:
        """Every joint at each of its speeds, forwards and backwards, under its mean load.

        The speeds rise and fall again and again. The first sample begins the motion: friction with a memory has not
        settled there.
        """
        sweeps = np.tile(np.concatenate([self.speeds, self.speeds[:, ::-1]], axis=1), SWEEPS).T
        forwards = np.tile([0.0, 1.0], len(sweeps))[:, None]
        velocity = np.repeat(sweeps, 2, axis=0) * (2 * forwards - 1)
        velocity, forwards = np.vstack([-velocity[:1], velocity]), np.vstack([[[1.0]], forwards])
        samples, joints = velocity.shape
        loads = np.broadcast_to(self.load, velocity.shape)
        return LoadedScene(
            run="",
            time=np.linspace(0, self.duration, samples),
            motion=Motion(np.repeat(STRIDE * forwards, joints, axis=1), velocity, np.zeros_like(velocity)),
            arm=arm,
            inertial=inertial,
            torque=loads,
            temperature=None if self.temperature is None else np.tile(self.temperature, (samples, 1)),
            load=self.load,
        )


def _speed_quantiles(velocity: Array) -> Array:
    """Speeds (quantiles,) at the middles of equal shares of the samples (samples,) that move."""
    speeds = np.abs(velocity[velocity != 0])
    shares = (np.arange(QUANTILES) + 0.5) / QUANTILES
    return _rounded(np.quantile(speeds, shares)) if len(speeds) else np.zeros(QUANTILES)


def _rounded(values: Array | float) -> Array:
    return np.array([float(f"{value:.{DIGITS}g}") for value in np.ravel(values)]).reshape(np.shape(values))
