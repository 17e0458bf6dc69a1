"""Loads that the joints exchange, from the replays of all joints in windows.

A low-pass of the measured positions takes away the fast part of the accelerations, and with it that of the torques by
which joints push each other. So joint after joint is replayed with its numbers, and its motion makes the loads of the
next ones, again and again (waveform relaxation, Lelarasmee et al. 1982; in the order of Gauss and Seidel, which
converges because a mass matrix is positive definite). With the true numbers that ends at the motion of the arm. What
the replays miss is smoothed and counts as well:

    q = q_replayed + low-pass(q_measured - q_replayed)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import settle
from armlab.diagnosis.motion.joint_replay import FARTHEST, joint_errors, replay_paths
from armlab.diagnosis.motion.simulation import ServoSimulation
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import (
    Windows,
    even_time,
    joint_torque,
    low_pass,
    make_windows,
    motion_of,
    own_terms,
    smooth_motion,
)
from armlab.recordings.recording import MotionRun
from problem.arm import Arm
from problem.motion import Motion

SLOW_STEPS = 8  # between two instants at which own inertia and slope are computed: they follow the position alone
MISSED_STEPS = 4  # between two instants of what a replay misses


def coupled_windows(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    fitted: Sequence[Array | None],
    tuning: MotionTuning = DEFAULT,
) -> list[Windows]:
    """Windows of each joint whose loads come from the replays of all with fitted numbers, (parameters,) a joint.

    None for a joint that is not replayed: it moves as measured.
    """
    windows = make_windows(runs, simulation, tuning)
    paths = _measured_paths(runs, windows[0], tuning)
    for _ in range(tuning.coupling_sweeps):
        terms = _own_terms(simulation.arm, simulation, paths)
        for joint, values in enumerate(fitted):
            loaded = _with_loads(windows[joint], joint, terms, paths, simulation)
            if values is None:
                windows[joint] = loaded
                continue
            windows[joint], path, sound = _replay(settle(loaded, values), values, runs, tuning)
            paths = paths.with_joint(joint, path, sound)
    return _with_units(windows, simulation, paths)


@dataclass(frozen=True, eq=False)
class _Paths:
    """Motion of all joints in the middle of each step, (windows, steps, joints) each."""

    position: Array
    velocity: Array
    acceleration: Array

    def with_joint(self, joint: int, path: Sequence[Array], sound: NDArray[np.bool_]) -> "_Paths":
        """The same with another motion of a joint in the windows that are sound, (windows,)."""
        signals = [each.copy() for each in (self.position, self.velocity, self.acceleration)]
        for signal, own in zip(signals, path, strict=True):
            signal[sound, :, joint] = own[sound]
        return _Paths(*signals)

    @property
    def motion(self) -> Motion:
        """The same, (windows times steps, joints)."""
        joints = self.position.shape[-1]
        return Motion(*(each.reshape(-1, joints) for each in (self.position, self.velocity, self.acceleration)))


Terms = tuple[Array, Array]  # own inertia and slope, (windows, steps, joints) each
Path = tuple[Array, ...]  # position, velocity and acceleration of one joint, (windows, steps) each


def _middle_times(runs: Sequence[MotionRun], windows: Windows) -> Array:
    """Middle of each step of each window, (windows, steps), s."""
    begun = np.array([run.time[0] for run in runs])[windows.run] + windows.step_s * windows.start
    return np.asarray(begun[:, None] + windows.step_s * (np.arange(windows.measured.shape[1]) + 0.5))


def _measured_paths(runs: Sequence[MotionRun], windows: Windows, tuning: MotionTuning) -> _Paths:
    """The smooth measured motion."""
    time = _middle_times(runs, windows)
    motions = [smooth_motion(run, tuning) for run in runs]
    evens = [even_time(run) for run in runs]

    def at(name: str) -> Array:
        rows = [
            np.stack([np.interp(own, evens[run], column) for column in getattr(motions[run], name).T], axis=1)
            for own, run in zip(time, windows.run.tolist(), strict=True)
        ]
        return np.stack(rows)

    return _Paths(at("position"), at("velocity"), at("acceleration"))


def _own_terms(arm: Arm, simulation: ServoSimulation, paths: _Paths) -> Terms:
    """Own inertias and slopes, computed at some steps and linear between."""
    steps = paths.position.shape[1]
    chosen = np.append(np.arange(0, steps - 1, SLOW_STEPS), steps - 1)
    position = paths.position[:, chosen]
    found = own_terms(arm, simulation.joints, position.reshape(-1, position.shape[-1]))
    inertia, slope = (_linear(each.reshape(position.shape), chosen, steps) for each in found)
    return inertia, slope


def _linear(values: Array, chosen: Array, steps: int) -> Array:
    """Values at chosen steps, (windows, chosen, joints), at all steps, (windows, steps, joints)."""
    place = np.interp(np.arange(steps), chosen, np.arange(len(chosen)))
    before = np.minimum(place.astype(np.intp), len(chosen) - 2)
    share = (place - before)[None, :, None]
    return np.asarray((1 - share) * values[:, before] + share * values[:, before + 1])


def _with_loads(windows: Windows, joint: int, terms: Terms, paths: _Paths, simulation: ServoSimulation) -> Windows:
    inertia, slope = (np.ascontiguousarray(each[..., joint]) for each in terms)
    torque = joint_torque(simulation.arm, simulation.joints, paths.motion)[:, joint].reshape(inertia.shape)
    return replace(windows, inertia=inertia, load=torque - inertia * paths.acceleration[..., joint], slope=slope)


def _with_units(windows: Sequence[Windows], simulation: ServoSimulation, paths: _Paths) -> list[Windows]:
    """The windows with what 1 kg at the tool adds to each joint."""
    loaded = simulation.with_payload(1.0).arm
    inertia, slope = _own_terms(loaded, simulation, paths)
    torque = joint_torque(loaded, simulation.joints, paths.motion).reshape(inertia.shape)
    load = torque - inertia * paths.acceleration
    return [
        replace(
            own,
            unit_inertia=inertia[..., joint] - own.inertia,
            unit_load=load[..., joint] - own.load,
            unit_slope=slope[..., joint] - own.slope,
        )
        for joint, own in enumerate(windows)
    ]


def _replay(
    windows: Windows, values: Array, runs: Sequence[MotionRun], tuning: MotionTuning
) -> tuple[Windows, Path, NDArray[np.bool_]]:
    """The windows with a joint's replay as the measured motion; this motion in the middle of each step; sound windows.

    A window begins where the one before it in the run is at that instant. Where a replay runs away, the window stays as
    it is, and is not sound.
    """
    step, middle = windows.step_s, _middle_times(runs, windows)
    position, velocity = replay_paths(windows, values)
    sound = np.asarray(np.all(np.abs(position) < FARTHEST, axis=1))  # NaN is not below it either
    position[~sound], velocity[~sound] = windows.measured[~sound], 0.0
    missed = _missed(windows, values, runs, sound, tuning)
    begun, moved, _ = _at_windows(missed, windows, middle - step / 2)
    measured, first_velocity = position + begun, windows.first_velocity.copy()
    measured[:, 0] = windows.measured[:, 0]
    measured[~sound] = windows.measured[~sound]
    follows = (np.diff(windows.run, prepend=-1) == 0) & sound & np.roll(sound, 1)
    for later in np.flatnonzero(follows).tolist():
        column = int(windows.start[later] - windows.start[later - 1])
        measured[later, 0] = position[later - 1, column] + begun[later - 1, column]
        first_velocity[later] = velocity[later - 1, column] + moved[later - 1, column]
    after = np.concatenate([velocity[:, 1:], velocity[:, -1:]], axis=1)
    replayed = position + step / 2 * velocity, (velocity + after) / 2, (after - velocity) / step
    path = tuple(own + slow for own, slow in zip(replayed, _at_windows(missed, windows, middle), strict=True))
    return replace(windows, measured=measured, first_velocity=first_velocity), path, sound


def _missed(
    windows: Windows, values: Array, runs: Sequence[MotionRun], sound: NDArray[np.bool_], tuning: MotionTuning
) -> list[tuple[Array, Motion]]:
    """What a replay misses of each run, through a low-pass: its instants, s, and its motion, one column."""
    errors, of_run = -joint_errors(windows, values)[0], windows.run[windows.window]
    errors[~sound[windows.window]] = 0.0
    rate_hz = 1 / (MISSED_STEPS * windows.step_s)
    missed = []
    for number, run in enumerate(runs):
        time = np.arange(run.time[0], run.time[-1] + 1 / rate_hz, 1 / rate_hz)
        even = np.interp(time, run.time, errors[of_run == number])[:, None]
        missed.append((time, motion_of(low_pass(even, rate_hz, tuning.residual_cutoff_hz), rate_hz)))
    return missed


def _at_windows(missed: Sequence[tuple[Array, Motion]], windows: Windows, instants: Array) -> tuple[Array, ...]:
    """Position and its two derivatives at the instants of each window, (windows, steps) each."""
    rows = []
    for own, run in zip(instants, windows.run.tolist(), strict=True):
        time, motion = missed[run]
        signals = motion.position, motion.velocity, motion.acceleration
        rows.append([np.interp(own, time, signal[:, 0]) for signal in signals])
    return tuple(np.stack(signal) for signal in zip(*rows, strict=True))
