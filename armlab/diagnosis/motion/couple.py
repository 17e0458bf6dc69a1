"""The motion that makes loads and couplings, from a replay of the whole arm.

A low-pass of the measured positions takes away the fast part of the accelerations, and with it that of the torques by
which joints push each other. So the arm is replayed, and only what the replay misses is smoothed:

    q = q_replayed + low-pass(q_measured - q_replayed)
"""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.replay import replay_paths
from armlab.diagnosis.motion.servo import Servos
from armlab.diagnosis.motion.simulation import ServoSimulation
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import TimedMotion, Windows, low_pass, make_windows, motion_of
from armlab.recordings.recording import MotionRun

HOLDING_GAIN = 100.0  # N m/rad, of a still joint whose gain is not known: it stays where it is


def coupled_windows(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    fitted: Sequence[Array | None],
    tuning: MotionTuning = DEFAULT,
) -> list[Windows]:
    """Windows of each joint whose loads come from a replay of the arm with fitted numbers, (parameters,) a joint."""
    motions = couple_joints(runs, simulation, _fill_servos(simulation, fitted), tuning)
    return make_windows(runs, simulation, tuning, motions)


def couple_joints(
    runs: Sequence[MotionRun], simulation: ServoSimulation, servos: Servos, tuning: MotionTuning = DEFAULT
) -> list[TimedMotion]:
    """The motions of all runs with the numbers of servos."""
    paths = replay_paths(simulation, servos, runs, tuning.coupling_step_s)
    return [_coupled(run, path, tuning) for run, path in zip(runs, paths, strict=True)]


def _coupled(run: MotionRun, path: Array, tuning: MotionTuning) -> TimedMotion:
    """The motion of one run. path: (steps, joints), rad, of its replay."""
    stride = tuning.coupling_stride
    time = run.time[0] + tuning.coupling_step_s * np.arange(len(path))[::stride]
    rate_hz = 1 / (tuning.coupling_step_s * stride)
    measured = np.stack([np.interp(time, run.time, column) for column in run.position.T], axis=1)
    missed = low_pass(measured - path[::stride], rate_hz, tuning.residual_cutoff_hz)
    return TimedMotion(time, motion_of(path[::stride] + missed, rate_hz))


def _fill_servos(simulation: ServoSimulation, fitted: Sequence[Array | None]) -> Servos:
    """Fitted numbers, (parameters,) a joint; those of the simulation for a joint without, or of a drive that holds."""
    known = simulation.nominal.values
    rows = [
        values if values is not None else np.where(np.isnan(known[number]), HOLDING_GAIN, known[number])
        for number, values in enumerate(fitted)
    ]
    return Servos(np.stack(rows))
