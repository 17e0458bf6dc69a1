"""What one simulated run left behind, at the step of the simulation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problem.motion import Motion
from recordings.run import Array


@dataclass(frozen=True, eq=False)
class Track:
    """A motion of the motor side and the torque that moves the mechanism, all at one instant a row.

    time: (steps,), s, from the first sample. position, velocity, acceleration: (steps, joints); velocities are
    those of the middle of two half steps. load: (steps, joints), N m, torque that the mechanism takes: that of
    the motors without what the laws of the hidden effects take on top.
    """

    time: Array
    motion: Motion
    load: Array

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.motion.joints

    @property
    def step_s(self) -> float:
        """Step of the simulation, s."""
        return float(self.time[1] - self.time[0])

    @cached_property
    def position(self) -> Array:
        """(steps, joints), rad."""
        return self.motion.position

    @cached_property
    def velocity(self) -> Array:
        """(steps, joints), rad/s."""
        return self.motion.velocity

    @cached_property
    def acceleration(self) -> Array:
        """(steps, joints), rad/s2."""
        return self.motion.acceleration

    def at(self, time: Array) -> "Track":
        """The track at other instants, by straight lines."""
        motion = Motion(
            *(_lines(time, self.time, signal) for signal in (self.position, self.velocity, self.acceleration))
        )
        return Track(time, motion, _lines(time, self.time, self.load))

    def means(self, signal: Array, centre: Array, width_s: float) -> Array:
        """Mean of a signal (steps, joints) over an interval about each instant of `centre` (samples, joints).

        This is how drives log torque; the interval is symmetric, so that nothing is late.
        """
        integral = np.vstack([np.zeros((1, signal.shape[1])), np.cumsum((signal[1:] + signal[:-1]) / 2, axis=0)])
        late, early = (centre + width_s / 2, centre - width_s / 2)
        out = np.empty(centre.shape)
        for joint in range(signal.shape[1]):
            up, down = (np.interp(edge[:, joint], self.time, integral[:, joint]) for edge in (late, early))
            out[:, joint] = (up - down) * self.step_s / width_s
        return out


def _lines(time: Array, known: Array, signal: Array) -> Array:
    return np.column_stack([np.interp(time, known, column) for column in signal.T])
