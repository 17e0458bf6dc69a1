"""Windows of measured motion in which one joint is replayed alone, the others where they were measured.

    (M_jj(q) + armature) qdd_j + load_j(t) + slope_j(t) (q_j - q_j measured) = drive - friction

load_j: gravity and the torque of all other joints' motion, at the measured positions. slope_j: derivative of the
gravity torque by the joint's own position. Each window is one block of the statistics. Its replay starts from the
measured position and velocity, so that errors do not pile up over a run, and earlier than the window by `warm_up_s`, so
that the encoder's error in the first state is forgotten where samples count.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.linear_filter import LinearFilter
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.recordings.recording import MotionRun
from problem.arm import Arm
from problem.drive_torque import position_torque
from problem.motion import Motion
from problem.regressor import rigid_body_torque

LOADS = ("inertia", "load", "slope", "unit_inertia", "unit_load", "unit_slope")
SLOPE_STEP = 1e-3  # rad (m), of the central difference
SAME_POSITION = 1e-6  # rad (m): rounding of one step of an encoder
COPPER_OFFSET = 234.5  # degrees Celsius: the resistance of copper grows with the temperature plus this (IEC 60034-1)
RATED_TEMPERATURE = 25.0  # degrees Celsius, of a data sheet


@dataclass(frozen=True, eq=False)
class Windows:
    """One joint in all windows, on a common grid of step_s; a shorter window repeats its last values.

    command: (windows, history + steps + history), rad, means over steps; the first step of a window is column
    `history`. measured: (windows, steps), smooth; inertia, load, slope: the same, in the middle of each step;
    unit_inertia, unit_load, unit_slope: those of 1 kg at the tool. supply: (windows, steps), factor of the torque, or
    None. first_velocity: (windows,), rad/s. run: (windows,), the run that a window was cut from; start: (windows,), its
    first step there. path_command: (runs, history + steps of a run), path_measured: (runs, steps of a run), rad;
    integral: (runs,), of the drive at the start of a run, N m. begin: (windows + 1,), the first sample of each window;
    row, fraction: (samples,), where on the grid a measured sample lies; position: (samples,), rad. encoder_step: the
    smallest step of the measured positions, rad (m), 0 where they have none; encoder_phase: one of these positions.
    """

    step_s: float
    history: int
    command: Array
    inertia: Array
    load: Array
    slope: Array
    unit_inertia: Array
    unit_load: Array
    unit_slope: Array
    measured: Array
    supply: Array | None
    first_velocity: Array
    run: NDArray[np.int64]
    start: NDArray[np.int64]
    path_command: Array
    path_measured: Array
    integral: Array
    begin: NDArray[np.int64]
    row: NDArray[np.int64]
    fraction: Array
    position: Array
    encoder_step: float
    encoder_phase: float

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.measured)

    @property
    def window(self) -> NDArray[np.intp]:
        """The window of each sample, (samples,)."""
        return np.repeat(np.arange(self.count), np.diff(self.begin))

    @property
    def encoder_noise(self) -> float:
        """Standard deviation of the errors that the steps of the encoder make, rad (m)."""
        return float(self.encoder_step / np.sqrt(12))

    @cached_property
    def sizes(self) -> tuple[float, float]:
        """The median inertia, kg m2, and the root mean square of the torque that the motion needs, N m (kg, N)."""
        return float(np.median(self.inertia)), float(np.sqrt(np.mean(needed_torque(self, 0.0)[-1] ** 2)))

    def with_integral(self, integral: Array) -> "Windows":
        """The windows with other integrals of the drive at the start of each run, (runs,), N m."""
        return replace(self, integral=np.ascontiguousarray(integral))

    def select(self, chosen: NDArray[np.intp]) -> "Windows":
        """Some of the windows, in the given order, which has to be that of time."""
        kept = np.isin(self.window, chosen)
        sizes = np.diff(self.begin)[chosen]
        return replace(
            self,
            command=self.command[chosen],
            inertia=self.inertia[chosen],
            load=self.load[chosen],
            slope=self.slope[chosen],
            unit_inertia=self.unit_inertia[chosen],
            unit_load=self.unit_load[chosen],
            unit_slope=self.unit_slope[chosen],
            measured=self.measured[chosen],
            supply=None if self.supply is None else self.supply[chosen],
            first_velocity=self.first_velocity[chosen],
            run=self.run[chosen],
            start=self.start[chosen],
            begin=np.append(0, np.cumsum(sizes)).astype(np.int64),
            row=self.row[kept],
            fraction=self.fraction[kept],
            position=self.position[kept],
        )


def needed_torque(windows: Windows, armature: float) -> tuple[int, Array, Array]:
    """Torque that the measured motion needs beside friction, N m, and the velocity, rad/s, (windows, instants) each.

    The instants are those of every n-th step; n comes first.
    """
    stride = max(round(0.02 / windows.step_s), 1)
    velocity = np.gradient(windows.measured[:, ::stride], stride * windows.step_s, axis=1)
    velocity = 0.5 * velocity + 0.25 * (np.roll(velocity, 1, axis=1) + np.roll(velocity, -1, axis=1))
    acceleration = np.gradient(velocity, stride * windows.step_s, axis=1)
    return stride, velocity, (windows.inertia[:, ::stride] + armature) * acceleration + windows.load[:, ::stride]


def smooth_motion(run: MotionRun, read_delay: Array, tuning: MotionTuning = DEFAULT) -> Motion:
    """Measured positions through a zero-phase low-pass, with their derivatives, at `even_time`.

    read_delay: of each joint's position after its stamp, (joints,), s.
    """
    time = even_time(run)
    rate_hz = 1 / (time[1] - time[0])
    read = zip(run.position.T, read_delay.tolist(), strict=True)
    even = np.stack([np.interp(time, run.time + late, column) for column, late in read], axis=1)
    return motion_of(low_pass(even, rate_hz, min(tuning.cutoff_hz, 0.2 * rate_hz)), rate_hz)


def even_time(run: MotionRun) -> Array:
    """As many instants as a run has samples, (samples,), s, evenly from its first stamp to its last."""
    return np.linspace(run.time[0], run.time[-1], run.samples)


LOW_PASS_PADDING = 9  # samples by which a signal is continued at its ends: three for each coefficient


def low_pass(signals: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Signals (samples, joints) without what is faster than a cut-off, and without delay."""
    return LinearFilter.butterworth(2, cutoff_hz, rate_hz).both_ways(signals, LOW_PASS_PADDING)


def motion_of(position: Array, rate_hz: float) -> Motion:
    """A motion of positions (samples, joints) at a constant rate."""
    acceleration = np.diff(position, 2, axis=0) * rate_hz**2
    return Motion(
        position, np.gradient(position, 1 / rate_hz, axis=0), np.pad(acceleration, ((1, 1), (0, 0)), mode="edge")
    )


def own_terms(arm: Arm, joints: Sequence[int], position: Array) -> tuple[Array, Array]:
    """Masses of the recorded joints, (samples, joints, joints), kg m2, and slope of each one's gravity torque, N m/rad,
    (samples, joints)."""
    still = np.zeros_like(position)
    whole = _whole_arm(arm, joints, Motion(position, still, still))
    rest = np.zeros_like(whole.position)
    weight = _held_torque(arm, whole)
    mass, slope = np.empty((*position.shape, position.shape[1])), np.empty(position.shape)
    for column, joint in enumerate(joints):
        unit = rest.copy()
        unit[:, joint] = 1.0
        mass[:, :, column] = (_held_torque(arm, Motion(whole.position, rest, unit)) - weight)[:, list(joints)]
        ahead, behind = (
            _held_torque(arm, Motion(whole.position + side * SLOPE_STEP * unit, rest, rest)) for side in (1, -1)
        )
        slope[:, column] = (ahead - behind)[:, joint] / (2 * SLOPE_STEP)
    return mass, slope


def joint_torque(arm: Arm, joints: Sequence[int], motion: Motion) -> Array:
    """Torque of links and gravity at the recorded joints, (samples, joints), N m; the other joints are at zero."""
    return np.asarray(_held_torque(arm, _whole_arm(arm, joints, motion))[:, list(joints)])


def _held_torque(arm: Arm, motion: Motion) -> Array:
    """Torque of the links and of the springs and the compensated weight that the robot file states, N m (N)."""
    return rigid_body_torque(arm, motion) + position_torque(arm, motion)


def _loads_and_units(simulation: ServoSimulation, loaded: Arm, motion: Motion) -> tuple[Array, ...]:
    """The LOADS of a motion; loaded: the arm with 1 kg at the tool."""
    found = []
    for arm in (simulation.arm, loaded):
        mass, slope = own_terms(arm, simulation.joints, motion.position)
        inertia = np.diagonal(mass, axis1=1, axis2=2)
        torque = joint_torque(arm, simulation.joints, motion)
        found.append((inertia, torque - inertia * motion.acceleration, slope))
    own, more = found
    return (*own, *(each - before for each, before in zip(more, own, strict=True)))


def _whole_arm(arm: Arm, joints: Sequence[int], motion: Motion) -> Motion:
    parts = []
    for signal in (motion.position, motion.velocity, motion.acceleration):
        whole = np.zeros((motion.samples, len(arm)))
        whole[:, list(joints)] = signal
        parts.append(whole)
    return Motion(*parts)


@dataclass(frozen=True, eq=False)
class _Piece:
    """A window of a run: the sample at which its replay starts, and the first and the last one that count."""

    run: int
    warm: int
    first: int
    last: int


def make_windows(
    runs: Sequence[MotionRun], simulation: ServoSimulation, tuning: MotionTuning = DEFAULT
) -> list[Windows]:
    """The windows of each recorded joint; runs are cut into stretches of about the same length.

    Loads and couplings come from the measured motion through a low-pass.
    """
    pieces = _cut_runs(runs, tuning)
    sample = min(1 / run.rate_hz for run in runs)
    step = sample / np.ceil(sample / tuning.longest_step_s)
    motions = [smooth_motion(run, simulation.read_delay, tuning) for run in runs]
    loaded = simulation.with_payload(1.0).arm
    loads = [_loads_and_units(simulation, loaded, each) for each in motions]
    late = float(simulation.read_delay.max())
    steps = max(int(np.ceil((runs[p.run].time[p.last] - runs[p.run].time[p.warm] + late) / step)) + 3 for p in pieces)
    history = int(np.ceil(tuning.history_s / step))
    made = []
    for joint in range(len(simulation.joints)):
        columns = [
            _column(runs[p.run], motions[p.run], loads[p.run], p, joint, simulation, (step, steps, history))
            for p in pieces
        ]
        paths = [_path(run, joint, simulation, step, history) for run in runs]
        windows = _stack(columns, paths, np.array([p.run for p in pieces], dtype=np.int64), step, history)
        made.append(at_rest(windows, simulation.nominal.values[joint]))
    return made


def _cut_runs(runs: Sequence[MotionRun], tuning: MotionTuning) -> list[_Piece]:
    whole = sum(float(run.time[-1] - run.time[0]) for run in runs)
    seconds = min(max(whole / tuning.wanted_windows, tuning.shortest_window_s), tuning.longest_window_s)
    return [piece for number, run in enumerate(runs) for piece in _cut(run, number, seconds, tuning.warm_up_s)]


def _cut(run: MotionRun, number: int, seconds: float, warm_up_s: float) -> list[_Piece]:
    count = max(round((run.time[-1] - run.time[0]) / seconds), 1)
    edges = np.linspace(0, run.samples, count + 1).astype(int)
    warm = np.searchsorted(run.time, run.time[edges[:-1]] - warm_up_s)
    return [
        _Piece(number, int(before), int(first), int(last) - 1)
        for before, (first, last) in zip(warm, pairwise(edges), strict=True)
    ]


def mean_command(run: MotionRun, joint: int, time: Array, width: float, rate_hz: float | None) -> Array:
    """Mean of the held command over [time, time + width]: exact wherever the command changes within a step."""
    assert run.reference_position is not None
    if rate_hz is None:
        instants, values = run.time, run.reference_position[:, joint]
    else:
        instants = np.arange(run.time[0], run.time[-1] + 1 / rate_hz, 1 / rate_hz)
        values = held_command(run, joint, instants, rate_hz)
    areas = np.append(0.0, np.cumsum(values[:-1] * np.diff(instants)))

    def area(at: Array) -> Array:
        before, after = np.minimum(at - instants[0], 0.0), np.maximum(at - instants[-1], 0.0)
        return np.asarray(np.interp(at, instants, areas) + before * values[0] + after * values[-1])

    return np.asarray((area(time + width) - area(time)) / width)


def held_command(run: MotionRun, joint: int, time: Array, rate_hz: float | None) -> Array:
    """The command that holds at given times: the last logged one, taken over at `rate_hz` where that is known."""
    assert run.reference_position is not None
    taken = time if rate_hz is None else run.time[0] + np.floor((time - run.time[0]) * rate_hz + 1e-9) / rate_hz
    rows = np.clip(np.searchsorted(run.time, taken + 1e-9, side="right") - 1, 0, run.samples - 1)
    return np.asarray(run.reference_position[rows, joint])


def supply_factor(run: MotionRun, joint: int, time: Array, supply: float | None) -> Array | None:
    """Supply voltage over its nominal value at given times; None where it is not known to matter.

    The current of a drive that commands a voltage falls as its copper warms, by 1 / (234.5 + T) (IEC 60034-1). Where a
    temperature is recorded, the factor is one at RATED_TEMPERATURE.
    """
    if supply is None or run.voltage is None:
        return None
    factor = _sensor(run.voltage, joint) / supply
    if run.temperature is not None:
        factor = factor * (COPPER_OFFSET + RATED_TEMPERATURE) / (COPPER_OFFSET + _sensor(run.temperature, joint))
    return np.asarray(np.interp(time, run.time, factor))


def _sensor(signal: Array, joint: int) -> Array:
    """The channel of a joint, (samples,), or the last one."""
    return np.asarray(signal[:, min(joint, signal.shape[1] - 1)])


def _column(
    run: MotionRun,
    motion: Motion,
    loads: tuple[Array, ...],
    piece: _Piece,
    joint: int,
    simulation: ServoSimulation,
    grid: tuple[float, int, int],
) -> dict[str, Array | None]:
    """One window of one joint on the grid: its step, the number of steps, and those before and after for delays."""
    step, steps, history = grid
    begun = np.floor((run.time[piece.warm] - run.time[0]) / step + 1e-9)
    start = run.time[0] + step * begun
    time = start + step * np.arange(steps)
    inside = np.minimum(time, run.time[piece.last])
    around = start + step * np.arange(-history, steps + history)
    even = even_time(run)
    own = [np.interp(inside + step / 2, even, signal[:, joint]) for signal in loads]
    rows = (run.time[piece.first : piece.last + 1] + simulation.read_delay[joint] - start) / step
    return {
        **dict(zip(LOADS, own, strict=True)),
        "command": mean_command(run, joint, around, step, simulation.rate_hz),
        "measured": np.interp(inside, even, motion.position[:, joint]),
        "supply": supply_factor(run, joint, inside, simulation.supply),
        "velocity": np.interp(start, even, motion.velocity[:, joint]),
        "start": begun,
        "row": rows,
        "position": run.position[piece.first : piece.last + 1, joint],
    }


def _path(run: MotionRun, joint: int, simulation: ServoSimulation, step: float, history: int) -> tuple[Array, Array]:
    """Commands from `history` steps before a run on, and measured positions, on a grid of the whole run."""
    time = run.time[0] + step * np.arange(int(np.ceil((run.time[-1] - run.time[0]) / step)) + 1)
    around = np.concatenate([time[0] + step * np.arange(-history, 0), time])
    measured = np.interp(time, run.time + simulation.read_delay[joint], run.position[:, joint])
    return mean_command(run, joint, around, step, simulation.rate_hz), measured


def at_rest(windows: Windows, values: Array) -> Windows:
    """The windows with what an integral gain holds at the first sample of each run if the drive is at rest there.

    values: (parameters,), which may be unknown.
    """
    kp, ki, of_speed, limit = (float(values[place(key)]) for key in ("kp", "ki", "ki_speed", "integral_limit"))
    held = np.zeros(len(windows.path_command))
    if ki > 0 and np.isfinite(kp):
        for window in np.flatnonzero(windows.start == 0):
            error = windows.command[window, windows.history] - windows.measured[window, 0]
            held[windows.run[window]] = np.clip(windows.load[window, 0] - (kp - of_speed) * error, -limit, limit)
    return windows.with_integral(held)


def smallest_step(position: Array) -> float:
    """The smallest difference of positions, rad (m): 0 where they do not change."""
    steps = np.diff(np.unique(position))
    steps = steps[steps > SAME_POSITION]
    return float(steps.min()) if len(steps) else 0.0


def phase_of_steps(position: Array, step: float) -> float:
    """The position nearest to zero that an encoder with a step reads, rad (m)."""
    return float(np.angle(np.mean(np.exp(2j * np.pi * position / step))) / (2 * np.pi) * step) if step else 0.0


def read_in_steps(position: Array, windows: Windows) -> Array:
    """Positions as the encoder of these windows reads them, rad (m)."""
    step, phase = windows.encoder_step, windows.encoder_phase
    return np.asarray(np.rint((position - phase) / step) * step + phase) if step else position


def _stack(
    columns: list[dict[str, Array | None]],
    paths: list[tuple[Array, Array]],
    run: NDArray[np.int64],
    step: float,
    history: int,
) -> Windows:
    def joined(signals: list[Array]) -> Array:
        """Runs of different lengths as rows, each with its last value to the end."""
        longest = max(map(len, signals))
        return np.stack([np.pad(each, (0, longest - len(each)), mode="edge") for each in signals])

    def grid(name: str) -> Array:
        return np.ascontiguousarray(np.stack([np.asarray(column[name]) for column in columns]))

    rows = np.concatenate([np.asarray(column["row"]) for column in columns])
    whole = np.floor(rows + 1e-9).astype(np.int64)
    sizes = [len(np.asarray(column["row"])) for column in columns]
    position = np.concatenate([np.asarray(column["position"]) for column in columns])
    encoder_step = smallest_step(position)
    return Windows(
        step_s=step,
        history=history,
        command=grid("command"),
        **{name: grid(name) for name in LOADS},
        measured=grid("measured"),
        supply=None if columns[0]["supply"] is None else grid("supply"),
        first_velocity=np.array([float(np.asarray(column["velocity"])) for column in columns]),
        run=run,
        start=np.array([int(np.asarray(column["start"])) for column in columns], dtype=np.int64),
        path_command=joined([command for command, _ in paths]),
        path_measured=joined([measured for _, measured in paths]),
        integral=np.zeros(len(paths)),
        begin=np.append(0, np.cumsum(sizes)).astype(np.int64),
        row=whole,
        fraction=rows - whole,
        position=position,
        encoder_step=encoder_step,
        encoder_phase=phase_of_steps(position, encoder_step),
    )


def window_stretches(runs: Sequence[MotionRun], tuning: MotionTuning = DEFAULT) -> list[tuple[str, float, float]]:
    """Run, first and last instant (s) of each window that `make_windows` makes of the same runs."""
    stretches = ((runs[piece.run], piece) for piece in _cut_runs(runs, tuning))
    return [(run.name, float(run.time[piece.first]), float(run.time[piece.last])) for run, piece in stretches]
