"""Re-simulation in short windows: each starts from the measured state and is driven by the measured torque.

A whole run of replayed torques drifts away from any model. In windows of half a second the error has no time to run
away, and its growth tells how good the model is. Friction and all other terms that are no inertia act as the model
says for the measured motion: they are a given torque here, not a feedback.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.diagnosis.data import Observed
from armlab.diagnosis.result import Diagnosis
from diagnosis.resimulate.dynamics import Body, NoInertiaError, runge_kutta
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix, rigid_body_torque
from recordings.run import Array

WINDOW_S = 0.5
MOST = 24  # windows
PROBES = 200  # random states at which the inertial part of a claim is read


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
        raise ValueError("nothing was fitted that could be simulated")
    rows, run = _windows(observed)
    new = _simulated(_new_body(diagnosis), observed, final, rows)
    try:
        old = _simulated(_old_body(diagnosis), observed, before, rows)
    except NoInertiaError:
        old = None
    time = np.arange(rows.shape[1]) / observed.rate_hz
    measured, starts = observed.kept("position")[rows], observed.time[rows[:, 0]]
    return Resimulation(time, measured, old, new, starts, run, refitted)


def _windows(observed: Observed) -> tuple[NDArray[np.intp], str]:
    """Rows (windows, samples) of windows spread over the longest held-out stretch, and its run."""
    count = max(int(WINDOW_S * observed.rate_hz), 4)
    segment = max(observed.of_role("validate"), key=lambda each: each.stop - each.start)
    starts = np.arange(segment.start, segment.stop - count, count)
    if not len(starts):
        raise ValueError("the held-out data are shorter than a window")
    chosen = starts[np.unique(np.linspace(0, len(starts) - 1, min(MOST, len(starts))).astype(int))]
    return chosen[:, None] + np.arange(count), observed.names[segment.run]


def _simulated(body: Body, observed: Observed, residual: Array, rows: NDArray[np.intp]) -> Array:
    """Positions (windows, samples, joints) of a body; what its model adds to the torque follows from its residual."""
    motion = observed.motion
    body.inertia(motion.position[rows[:, 0]])
    own = rigid_body_torque(body.arm, motion, body.inertial) + body.rotors * motion.acceleration
    # measured torque less the terms that are no inertia: torque - (torque - residual - own)
    driving = residual + own
    start = rows[:, 0]
    position, _ = runge_kutta(body, motion.position[start], motion.velocity[start], driving[rows], 1 / observed.rate_hz)
    return position


def _new_body(diagnosis: Diagnosis) -> Body:
    """Links and rotors of the model found."""
    assert diagnosis.inertial is not None
    rotors = _given_rotors(diagnosis)
    for claim in diagnosis.claims:
        if claim.effect == "rotor_inertia" and claim.coefficients is not None and claim.joint is not None:
            rotors[claim.joint - 1] += float(claim.coefficients[0])
    return Body(diagnosis.simulation.arm, diagnosis.inertial, rotors)


def _old_body(diagnosis: Diagnosis) -> Body:
    """Links and rotors of the simulation as given, or of the refitted rigid body where there is none."""
    simulation, observed = diagnosis.simulation, diagnosis.observed
    if simulation.kind != "refit" and simulation.inertial is not None:
        return Body(simulation.arm, simulation.inertial, _given_rotors(diagnosis))
    assert observed is not None
    assert diagnosis.refit is not None
    base = base_parameters(simulation.arm)
    matrix = observation_matrix(simulation.arm, observed.motion)[:, base.columns]
    inertial = np.zeros(10 * len(simulation.arm))
    predicted = (observed.torque - diagnosis.refit).ravel()
    inertial[base.columns] = np.linalg.lstsq(matrix, predicted, rcond=None)[0]
    return Body(simulation.arm, inertial, np.zeros(len(simulation.arm)))


def _given_rotors(diagnosis: Diagnosis) -> Array:
    """Rotor inertias that the simulation has, (joints,)."""
    simulation = diagnosis.simulation
    out = np.zeros(len(simulation.arm))
    if simulation.model is None:
        return out + (np.asarray(simulation.arm.rotor_inertia) if simulation.arm.rotor_inertia else 0.0)
    for part, place in zip(simulation.model.structure.components, simulation.model.structure.slices, strict=True):
        if part.effect == "rotor_inertia":
            out[part.joint - 1] += float(simulation.model.values[place][0])
    return out
