"""Forward dynamics of an arm whose model is linear in its inertial parameters: accelerations from torques."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.run import Array


class NoInertiaError(ValueError):
    """Inertial parameters that give no positive definite inertia matrix somewhere: nothing can be simulated."""


@dataclass(frozen=True, eq=False)
class Body:
    """What moves. inertial: (10 * joints,) of the links; rotors: (joints,), kg m2 (kg) on the joint side."""

    arm: Arm
    inertial: Array
    rotors: Array

    def inertia(self, position: Array) -> Array:
        """Inertia matrices at positions (states, joints): (states, joints, joints); Walker and Orin 1982, method 1.

        Raises NoInertiaError where one is not positive definite.
        """
        matrices = self._with_bias(position, np.zeros_like(position))[0]
        if not self.solid(matrices):
            raise NoInertiaError("the inertia matrix of the fitted links is not positive definite along this motion")
        return matrices

    def solid(self, matrices: Array) -> bool:
        """Whether all matrices are positive definite."""
        return bool(np.all(np.linalg.eigvalsh(matrices)[..., 0] > 0))

    def acceleration(self, position: Array, velocity: Array, torque: Array) -> Array:
        """Joint accelerations (states, joints) under torques (states, joints), gravity included."""
        matrices, bias = self._with_bias(position, velocity)
        return np.asarray(np.linalg.solve(matrices, (torque - bias)[..., None])[..., 0])

    def _with_bias(self, position: Array, velocity: Array) -> tuple[Array, Array]:
        """Inertia matrices, and the torque without acceleration: one column a unit acceleration, all in one batch."""
        states, joints = position.shape
        unit = np.vstack([np.zeros(joints), np.eye(joints)])
        accelerations = np.repeat(unit[:, None], states, axis=1)
        places: NDArray[np.float64] = np.broadcast_to(position, accelerations.shape)
        speeds: NDArray[np.float64] = np.broadcast_to(velocity, accelerations.shape)
        torque = rigid_body_torque(self.arm, Motion(places, speeds, accelerations), self.inertial)
        matrices = np.moveaxis(torque[1:] - torque[0], 0, -1) + np.diag(self.rotors)
        return (matrices + np.swapaxes(matrices, -1, -2)) / 2, torque[0]


def runge_kutta(body: Body, position: Array, velocity: Array, torque: Array, step: float) -> tuple[Array, Array]:
    """Motion under given torques from given states, by the classical fourth-order method.

    position, velocity: (windows, joints) at the start. torque: (windows, samples, joints), taken as straight between
    the samples; step: between them, s. Returns positions and velocities (windows, samples, joints).
    """
    places, speeds = [position], [velocity]
    for now in range(torque.shape[1] - 1):
        first, last = torque[:, now], torque[:, now + 1]
        middle = (first + last) / 2
        q, v = places[-1], speeds[-1]
        a1 = body.acceleration(q, v, first)
        v2 = v + step / 2 * a1
        a2 = body.acceleration(q + step / 2 * v, v2, middle)
        v3 = v + step / 2 * a2
        a3 = body.acceleration(q + step / 2 * v2, v3, middle)
        v4 = v + step * a3
        a4 = body.acceleration(q + step * v3, v4, last)
        places.append(q + step / 6 * (v + 2 * v2 + 2 * v3 + v4))
        speeds.append(v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4))
    return np.stack(places, axis=1), np.stack(speeds, axis=1)
