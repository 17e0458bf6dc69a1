"""Loads that the joints exchange, from the replay of all joints together in windows.

A low-pass of the measured positions takes away the fast part of the accelerations, and with it that of the torques by
which joints push each other. So the joints are replayed together with their numbers, and their motion makes the loads.
Masses, gravity and the torques of velocities follow from a path, that of the replay before, again and again. What the
replay misses is smoothed and counts as well:

    q = q_replayed + low-pass(q_measured - q_replayed)

Windows have each their own first state, and no joint strays over a whole run as it does in a simulation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import settle
from armlab.diagnosis.motion.joint_replay import FARTHEST, joint_errors, replay_arm
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import PARAMETERS, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
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

SLOW_STEPS = 8  # between two instants at which masses and slopes are computed: they follow the position alone
MISSED_STEPS = 4  # between two instants of what a replay misses


Terms = tuple[Array, Array]  # masses at some steps, (windows, rows, joints, joints); slopes, (windows, steps, joints)
Path = tuple[Array, ...]  # position, velocity, acceleration, replayed part of it, of one joint, (windows, steps) each


def coupled_windows(
    runs: Sequence[MotionRun],
    simulation: ServoSimulation,
    fitted: Sequence[Array | None],
    tuning: MotionTuning = DEFAULT,
) -> list[Windows]:
    """Windows of each joint whose loads come from the replay of all with fitted numbers, (parameters,) a joint.

    None for a joint that is not replayed: it moves as measured.
    """
    windows = make_windows(runs, simulation, tuning)
    replayed = np.array([each is not None for each in fitted])
    values = np.stack([np.zeros(len(PARAMETERS)) if each is None else each for each in fitted])
    paths = _measured_paths(runs, windows[0], replayed, simulation.read_delay, tuning)
    for _ in range(tuning.coupling_rounds):
        mass, slope = _own_terms(simulation.arm, simulation, paths)
        settled = windows
        if (values[:, place("ki")] > 0).any():  # an integral carries the whole load
            loaded = _with_loads(windows, simulation, paths, (mass, slope))
            settled = [settle(*pair) for pair in zip(loaded, values, strict=True)]
        for joint in np.flatnonzero(replayed).tolist():
            paths.moves[_runs_away(settled[joint], values[joint]), joint] = False
        windows, position, velocity = _replay(settled, simulation, values, paths, (mass, slope))
        for joint in np.flatnonzero(replayed).tolist():
            late = float(simulation.read_delay[joint])
            replay, sound = (position[joint], velocity[joint]), paths.moves[:, joint]
            windows[joint], path = _follow(windows[joint], replay, sound, (runs, late), tuning)
            paths.put(joint, path)
    mass, slope = _own_terms(simulation.arm, simulation, paths)
    return _with_units(_with_loads(windows, simulation, paths, (mass, slope)), simulation, paths)


@dataclass(frozen=True, eq=False)
class _Paths:
    """Motion of all joints in the middle of each step, (windows, steps, joints) each.

    replayed: the part of the acceleration that a replay of the arm computes itself; moves: (windows, joints), where it
    does.
    """

    position: Array
    velocity: Array
    acceleration: Array
    replayed: Array
    moves: NDArray[np.bool_]

    def put(self, joint: int, path: Path) -> None:
        """Takes another motion of a joint in the windows where it is replayed."""
        sound = self.moves[:, joint]
        for signal, own in zip((self.position, self.velocity, self.acceleration, self.replayed), path, strict=True):
            signal[sound, :, joint] = own[sound]

    def without_replayed(self) -> "_Paths":
        """The same without the accelerations that a replay of the arm computes itself."""
        own = np.where(self.moves[:, None], self.replayed, 0.0)
        return replace(self, acceleration=self.acceleration - own)

    @property
    def motion(self) -> Motion:
        """The same, (windows times steps, joints)."""
        joints = self.position.shape[-1]
        return Motion(*(each.reshape(-1, joints) for each in (self.position, self.velocity, self.acceleration)))


def _middle_times(runs: Sequence[MotionRun], windows: Windows) -> Array:
    """Middle of each step of each window, (windows, steps), s."""
    begun = np.array([run.time[0] for run in runs])[windows.run] + windows.step_s * windows.start
    return np.asarray(begun[:, None] + windows.step_s * (np.arange(windows.measured.shape[1]) + 0.5))


def _measured_paths(
    runs: Sequence[MotionRun], windows: Windows, replayed: NDArray[np.bool_], read_delay: Array, tuning: MotionTuning
) -> _Paths:
    """The smooth measured motion. replayed: which joints a replay of the arm moves."""
    time = _middle_times(runs, windows)
    motions = [smooth_motion(run, read_delay, tuning) for run in runs]
    evens = [even_time(run) for run in runs]

    def at(name: str) -> Array:
        rows = [
            np.stack([np.interp(own, evens[run], column) for column in getattr(motions[run], name).T], axis=1)
            for own, run in zip(time, windows.run.tolist(), strict=True)
        ]
        return np.stack(rows)

    acceleration = at("acceleration")
    moves = np.tile(replayed, (len(time), 1))
    return _Paths(at("position"), at("velocity"), acceleration, acceleration.copy(), moves)


def _own_terms(arm: Arm, simulation: ServoSimulation, paths: _Paths) -> Terms:
    """Masses at some steps and at one after the last, and slopes, linear between these steps."""
    steps = paths.position.shape[1]
    rows = (steps - 1) // SLOW_STEPS + 2
    position = paths.position[:, np.minimum(SLOW_STEPS * np.arange(rows), steps - 1)]
    mass, slope = own_terms(arm, simulation.joints, position.reshape(-1, position.shape[-1]))
    return mass.reshape(*position.shape, position.shape[-1]), _between(slope.reshape(position.shape), steps)


def _between(values: Array, steps: int) -> Array:
    """Values at every SLOW_STEPS steps, (windows, rows, joints), at all steps, (windows, steps, joints)."""
    row, share = np.divmod(np.arange(steps), SLOW_STEPS)
    share = (share / SLOW_STEPS)[None, :, None]
    return np.asarray((1 - share) * values[:, row] + share * values[:, row + 1])


def _inertia_and_load(simulation: ServoSimulation, arm: Arm, paths: _Paths, mass: Array) -> tuple[Array, Array]:
    """Own inertia of each joint, and its load, (windows, steps, joints) each."""
    inertia = _between(np.diagonal(mass, axis1=2, axis2=3), paths.position.shape[1])
    torque = joint_torque(arm, simulation.joints, paths.motion).reshape(inertia.shape)
    return inertia, torque - inertia * paths.acceleration


def _with_loads(windows: Sequence[Windows], simulation: ServoSimulation, paths: _Paths, terms: Terms) -> list[Windows]:
    """The windows with what the motion of all joints makes of each one's inertia, load and slope."""
    inertia, load = _inertia_and_load(simulation, simulation.arm, paths, terms[0])
    signals = inertia, load, terms[1]
    columns = [[np.ascontiguousarray(each[..., joint]) for each in signals] for joint in range(len(windows))]
    return [
        replace(own, inertia=inertia, load=load, slope=slope)
        for own, (inertia, load, slope) in zip(windows, columns, strict=True)
    ]


def _with_units(windows: Sequence[Windows], simulation: ServoSimulation, paths: _Paths) -> list[Windows]:
    """The windows with what 1 kg at the tool adds to each joint."""
    loaded = simulation.with_payload(1.0).arm
    mass, slope = _own_terms(loaded, simulation, paths)
    inertia, load = _inertia_and_load(simulation, loaded, paths, mass)
    return [
        replace(
            own,
            unit_inertia=inertia[..., joint] - own.inertia,
            unit_load=load[..., joint] - own.load,
            unit_slope=slope[..., joint] - own.slope,
        )
        for joint, own in enumerate(windows)
    ]


def _runs_away(windows: Windows, values: Array) -> NDArray[np.intp]:
    """The windows in which a joint runs away even alone."""
    return np.unique(windows.window[np.abs(joint_errors(windows, values)[0]) >= FARTHEST])


def _replay(
    settled: Sequence[Windows], simulation: ServoSimulation, values: Array, paths: _Paths, terms: Terms
) -> tuple[list[Windows], Array, Array]:
    """Windows with the loads of a replay of the arm, and its positions and velocities.

    Joints that run away in a window move there as before, and the others are replayed again without them.
    """
    while True:
        windows = _with_loads(settled, simulation, paths.without_replayed(), terms)
        position, velocity = replay_arm(windows, values, terms[0], SLOW_STEPS, paths.moves)
        lost = paths.moves & (np.abs(position).max(axis=2) >= FARTHEST).T
        if not lost.any():
            return windows, position, velocity
        paths.moves[lost] = False


def _follow(
    windows: Windows,
    replay: tuple[Array, Array],
    sound: NDArray[np.bool_],
    recorded: tuple[Sequence[MotionRun], float],
    tuning: MotionTuning,
) -> tuple[Windows, Path]:
    """The windows with a joint's replay as the measured motion; this motion in the middle of each step.

    A window begins where the one before it in the run is at that instant. sound: windows, (windows,), in which the
    joint is replayed; the others stay as they are. replay: position and velocity, (windows, steps) each. recorded: the
    runs, and how late the joint is read, s.
    """
    step, middle = windows.step_s, _middle_times(recorded[0], windows)
    position, velocity = (each.copy() for each in replay)
    position[~sound], velocity[~sound] = windows.measured[~sound], 0.0
    missed = _missed(windows, position, recorded, sound, tuning)
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
    slow = _at_windows(missed, windows, middle)
    replayed = position + step / 2 * velocity, (velocity + after) / 2, (after - velocity) / step
    path = tuple(own + rest for own, rest in zip(replayed, slow, strict=True))
    return replace(windows, measured=measured, first_velocity=first_velocity), (*path, replayed[-1])


def _missed(
    windows: Windows,
    position: Array,
    recorded: tuple[Sequence[MotionRun], float],
    sound: NDArray[np.bool_],
    tuning: MotionTuning,
) -> list[tuple[Array, Motion]]:
    """What a replay misses of each run, through a low-pass: its instants, s, and its motion, one column."""
    window, of_run = windows.window, windows.run[windows.window]
    ahead = np.minimum(windows.row + 1, position.shape[1] - 1)
    before, after = position[window, windows.row], position[window, ahead]
    errors = np.where(sound[window], windows.position - before - windows.fraction * (after - before), 0.0)
    rate_hz = 1 / (MISSED_STEPS * windows.step_s)
    missed, (runs, late) = [], recorded
    for number, run in enumerate(runs):
        time = np.arange(run.time[0], run.time[-1] + 1 / rate_hz, 1 / rate_hz)
        even = np.interp(time, run.time + late, errors[of_run == number])[:, None]
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
