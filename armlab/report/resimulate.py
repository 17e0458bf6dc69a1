"""Forward simulation of a measured run in short windows, driven by the measured torque, from the measured state.

In a whole run, replayed torques drift away from any model. In windows of half a second the growth of the error
shows how good the model is. Friction and all other terms that are no inertia act as the model predicts for the
measured motion: they are a given torque, not a feedback.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.rows.data import Observed
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

NO_INERTIA = (
    "the recorded motion does not determine the mass of every link well enough; with the fitted links some joint would "
    "have no inertia of its own"
)


class NoInertiaError(DataError):
    """Inertial parameters that give no positive definite inertia matrix somewhere: nothing can be simulated."""


@dataclass(frozen=True, eq=False)
class MovingArm:
    """What moves. inertial: (10 * joints,) of the links; rotors: (joints,), kg m2 (kg) on the joint side."""

    arm: Arm
    inertial: Array
    rotors: Array

    def inertia(self, position: Array) -> Array:
        """Inertia matrices at positions (states, joints): (states, joints, joints); Walker and Orin 1982, method 1.

        Raises NoInertiaError where one is not positive definite.
        """
        matrices = self._with_bias(position, np.zeros_like(position))[0]
        if not self.is_positive_definite(matrices):
            raise NoInertiaError(NO_INERTIA)
        return matrices

    def is_positive_definite(self, matrices: Array) -> bool:
        """Whether all matrices are positive definite."""
        return bool(np.all(np.linalg.eigvalsh(matrices)[..., 0] > 0))

    def acceleration(self, position: Array, velocity: Array, torque: Array) -> Array:
        """Joint accelerations (states, joints) under torques (states, joints), gravity included; NoInertiaError."""
        matrices, bias = self._with_bias(position, velocity)
        try:
            return np.asarray(np.linalg.solve(matrices, (torque - bias)[..., None])[..., 0])
        except np.linalg.LinAlgError:
            raise NoInertiaError(NO_INERTIA) from None

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


def runge_kutta(body: MovingArm, position: Array, velocity: Array, torque: Array, step: float) -> tuple[Array, Array]:
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


WINDOW_SECONDS = 0.5
MAX_WINDOWS = 24  # windows


@dataclass(frozen=True, eq=False)
class Resimulation:
    """What was measured, and what old and new model make of it.

    time: (samples,), s, from the start of a window. measured, old, new: positions (windows, samples, joints); old is
    None where it has no positive definite inertia. starts: (windows,), s, in the run; run: its name. refitted:
    whether the old model is the refitted rigid body, for want of a simulation.
    """

    time: Array
    measured: Array
    old: Array | None
    new: Array
    starts: Array
    run: str
    refitted: bool

    def growth(self, simulated: Array) -> Array:
        """rms position error over the windows, (samples, joints), rad (m)."""
        return np.asarray(np.sqrt(np.mean((simulated - self.measured) ** 2, axis=0)))


def resimulate(diagnosis: Diagnosis) -> Resimulation:
    """Old and new model in windows of the held-out runs.

    Raises NoInertiaError where the new model has no positive definite inertia, ValueError where nothing was fitted.
    """
    observed, final = diagnosis.observed, diagnosis.final
    refitted = diagnosis.simulation.kind == "refit"
    before = diagnosis.refit if refitted else diagnosis.nominal
    if observed is None or final is None or before is None or diagnosis.inertial is None:
        raise DataError("nothing was fitted that could be simulated")
    rows, run = _window_rows(observed)
    new = _simulate_windows(_new_body(diagnosis), observed, final, rows)
    try:
        old = _simulate_windows(_old_body(diagnosis), observed, before, rows)
    except NoInertiaError:
        old = None
    time = np.arange(rows.shape[1]) / observed.rate_hz
    measured, starts = observed.kept("position")[rows], observed.time[rows[:, 0]]
    return Resimulation(time, measured, old, new, starts, run, refitted)


def _window_rows(observed: Observed) -> tuple[NDArray[np.intp], str]:
    """Rows (windows, samples) of windows spread over the longest held-out stretch, and its run."""
    count = max(int(WINDOW_SECONDS * observed.rate_hz), 4)
    segment = max(observed.of_role("validate"), key=lambda each: each.stop - each.start)
    starts = np.arange(segment.start, segment.stop - count, count)
    if not len(starts):
        raise DataError("the held-out data are shorter than a window")
    chosen = starts[np.unique(np.linspace(0, len(starts) - 1, min(MAX_WINDOWS, len(starts))).astype(int))]
    return chosen[:, None] + np.arange(count), observed.names[segment.run]


def _simulate_windows(body: MovingArm, observed: Observed, residual: Array, rows: NDArray[np.intp]) -> Array:
    """Positions (windows, samples, joints) of a body; what its model adds to the torque follows from its residual."""
    motion = observed.motion
    body.inertia(motion.position[rows[:, 0]])
    own = rigid_body_torque(body.arm, motion, body.inertial) + body.rotors * motion.acceleration
    # measured torque less the terms that are no inertia: torque - (torque - residual - own)
    driving = residual + own
    start = rows[:, 0]
    position, _ = runge_kutta(body, motion.position[start], motion.velocity[start], driving[rows], 1 / observed.rate_hz)
    return position


def _new_body(diagnosis: Diagnosis) -> MovingArm:
    """Links and rotors of the model found."""
    assert diagnosis.inertial is not None
    assert diagnosis.model is not None
    return MovingArm(diagnosis.simulation.arm, diagnosis.inertial, diagnosis.model.rotor_inertia)


def _old_body(diagnosis: Diagnosis) -> MovingArm:
    """Links and rotors of the simulation as given, or of the refitted rigid body where there is none."""
    simulation, observed = diagnosis.simulation, diagnosis.observed
    if simulation.kind != "refit" and simulation.inertial is not None:
        return MovingArm(simulation.arm, simulation.inertial, _given_rotors(diagnosis))
    assert observed is not None
    assert diagnosis.refit is not None
    base = base_parameters(simulation.arm)
    matrix = observation_matrix(simulation.arm, observed.motion)[:, base.columns]
    inertial = np.zeros(10 * len(simulation.arm))
    predicted = (observed.torque - diagnosis.refit).ravel()
    inertial[base.columns] = np.linalg.lstsq(matrix, predicted, rcond=None)[0]
    return MovingArm(simulation.arm, inertial, np.zeros(len(simulation.arm)))


def _given_rotors(diagnosis: Diagnosis) -> Array:
    """Rotor inertias that the simulation has, (joints,)."""
    simulation = diagnosis.simulation
    if simulation.model is not None:
        return simulation.model.rotor_inertia
    return np.zeros(len(simulation.arm)) + (
        np.asarray(simulation.arm.rotor_inertia) if simulation.arm.rotor_inertia else 0.0
    )
