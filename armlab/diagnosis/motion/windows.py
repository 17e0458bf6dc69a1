"""Windows of measured motion in which one joint is replayed alone, the others where they were measured.

    (M_jj(q) + armature) qdd_j + load_j(t) + slope_j(t) (q_j - q_j measured) = drive - friction

load_j: gravity and the torque of all other joints' motion, at the measured positions. slope_j: derivative of the
gravity torque by the joint's own position. Each window starts from the measured position and velocity, so that errors
do not pile up over a run, and is one block of the statistics.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from armlab.common.arrays import Array
from armlab.diagnosis.motion.simulation import ServoSimulation
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.recordings.recording import MotionRun
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

SLOPE_STEP = 1e-3  # rad (m), of the central difference


@dataclass(frozen=True, eq=False)
class Windows:
    """One joint in all windows, on a common grid of step_s; a shorter window repeats its last values.

    command: (windows, history + steps + history), rad; the first step of a window is column `history`. inertia, load,
    slope, measured: (windows, steps). supply: the same, factor of the torque, or None. first_velocity: (windows,),
    rad/s. run: (windows,), the run that a window was cut from. begin: (windows + 1,), the first sample of each window;
    row, fraction: (samples,), where on the grid a measured sample lies; position: (samples,), rad.
    """

    step_s: float
    history: int
    command: Array
    inertia: Array
    load: Array
    slope: Array
    measured: Array
    supply: Array | None
    first_velocity: Array
    run: NDArray[np.intp]
    begin: NDArray[np.int64]
    row: NDArray[np.int64]
    fraction: Array
    position: Array

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.measured)

    @property
    def window(self) -> NDArray[np.intp]:
        """The window of each sample, (samples,)."""
        return np.repeat(np.arange(self.count), np.diff(self.begin))

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
            measured=self.measured[chosen],
            supply=None if self.supply is None else self.supply[chosen],
            first_velocity=self.first_velocity[chosen],
            run=self.run[chosen],
            begin=np.append(0, np.cumsum(sizes)).astype(np.int64),
            row=self.row[kept],
            fraction=self.fraction[kept],
            position=self.position[kept],
        )


def smooth_motion(run: MotionRun, tuning: MotionTuning = DEFAULT) -> Motion:
    """Measured positions through a zero-phase low-pass, with their derivatives, at the stamps of the run."""
    time = np.linspace(run.time[0], run.time[-1], run.samples)
    rate_hz = (run.samples - 1) / (run.time[-1] - run.time[0])
    even = np.stack([np.interp(time, run.time, column) for column in run.position.T], axis=1)
    cutoff = min(tuning.cutoff_hz, 0.2 * rate_hz)
    smooth = sosfiltfilt(butter(2, cutoff, fs=rate_hz, output="sos"), even, axis=0)
    velocity = np.gradient(smooth, 1 / rate_hz, axis=0)
    return Motion(smooth, velocity, np.gradient(velocity, 1 / rate_hz, axis=0))


def joint_loads(arm: Arm, joints: Sequence[int], motion: Motion) -> tuple[Array, Array, Array]:
    """Own inertia, load and slope of the recorded joints, (samples, joints) each.

    motion: of the recorded joints; the other joints of the arm are at zero and still.
    """
    whole = _whole_arm(arm, joints, motion)
    still = np.zeros_like(whole.position)
    weight = rigid_body_torque(arm, Motion(whole.position, still, still))
    inertia, load, slope = (np.empty(motion.position.shape) for _ in range(3))
    for column, joint in enumerate(joints):
        unit = still.copy()
        unit[:, joint] = 1.0
        inertia[:, column] = (rigid_body_torque(arm, Motion(whole.position, still, unit)) - weight)[:, joint]
        others = whole.acceleration.copy()
        others[:, joint] = 0.0
        load[:, column] = rigid_body_torque(arm, Motion(whole.position, whole.velocity, others))[:, joint]
        ahead, behind = whole.position + SLOPE_STEP * unit, whole.position - SLOPE_STEP * unit
        difference = rigid_body_torque(arm, Motion(ahead, still, still)) - rigid_body_torque(
            arm, Motion(behind, still, still)
        )
        slope[:, column] = difference[:, joint] / (2 * SLOPE_STEP)
    return inertia, load, slope


def _whole_arm(arm: Arm, joints: Sequence[int], motion: Motion) -> Motion:
    parts = []
    for signal in (motion.position, motion.velocity, motion.acceleration):
        whole = np.zeros((motion.samples, len(arm)))
        whole[:, list(joints)] = signal
        parts.append(whole)
    return Motion(*parts)


@dataclass(frozen=True, eq=False)
class _Piece:
    """A window of a run: time of its first and last sample, and the samples."""

    run: int
    first: int
    last: int


def make_windows(
    runs: Sequence[MotionRun], simulation: ServoSimulation, tuning: MotionTuning = DEFAULT
) -> list[Windows]:
    """The windows of each recorded joint; runs are cut into stretches of about the same length."""
    pieces = _cut_runs(runs, tuning)
    sample = min(1 / run.rate_hz for run in runs)
    step = sample / np.ceil(sample / tuning.longest_step_s)
    motions = [smooth_motion(run, tuning) for run in runs]
    loads = [joint_loads(simulation.arm, simulation.joints, motion) for motion in motions]
    steps = max(int(np.ceil((runs[p.run].time[p.last] - runs[p.run].time[p.first]) / step)) + 2 for p in pieces)
    history = int(np.ceil(tuning.history_s / step))
    made = []
    for joint in range(len(simulation.joints)):
        columns = [
            _column(runs[p.run], motions[p.run], loads[p.run], p, joint, simulation, (step, steps, history))
            for p in pieces
        ]
        made.append(_stack(columns, np.array([p.run for p in pieces]), step, history))
    return made


def _cut_runs(runs: Sequence[MotionRun], tuning: MotionTuning) -> list[_Piece]:
    whole = sum(float(run.time[-1] - run.time[0]) for run in runs)
    seconds = min(max(whole / tuning.wanted_windows, tuning.shortest_window_s), tuning.longest_window_s)
    return [piece for number, run in enumerate(runs) for piece in _cut(run, number, seconds)]


def _cut(run: MotionRun, number: int, seconds: float) -> list[_Piece]:
    count = max(round((run.time[-1] - run.time[0]) / seconds), 1)
    edges = np.linspace(0, run.samples, count + 1).astype(int)
    return [_Piece(number, int(first), int(last) - 1) for first, last in pairwise(edges)]


def held_command(run: MotionRun, joint: int, time: Array, rate_hz: float | None) -> Array:
    """The command that holds at given times: the last logged one, taken over at `rate_hz` where that is known."""
    assert run.reference_position is not None
    taken = time if rate_hz is None else run.time[0] + np.floor((time - run.time[0]) * rate_hz + 1e-9) / rate_hz
    rows = np.clip(np.searchsorted(run.time, taken + 1e-9, side="right") - 1, 0, run.samples - 1)
    return np.asarray(run.reference_position[rows, joint])


def supply_factor(run: MotionRun, joint: int, time: Array, supply: float | None) -> Array | None:
    """Supply voltage over its nominal value at given times; None where it is not known to matter."""
    if supply is None or run.voltage is None:
        return None
    column = run.voltage[:, min(joint, run.voltage.shape[1] - 1)]
    return np.asarray(np.interp(time, run.time, column) / supply)


def _column(
    run: MotionRun,
    motion: Motion,
    loads: tuple[Array, Array, Array],
    piece: _Piece,
    joint: int,
    simulation: ServoSimulation,
    grid: tuple[float, int, int],
) -> dict[str, Array | None]:
    """One window of one joint on the grid: its step, the number of steps, and those before and after for delays."""
    step, steps, history = grid
    start = run.time[piece.first]
    time = start + step * np.arange(steps)
    inside = np.minimum(time, run.time[piece.last])
    around = start + step * np.arange(-history, steps + history)
    inertia, load, slope = (np.interp(inside, run.time, signal[:, joint]) for signal in loads)
    place = (run.time[piece.first : piece.last + 1] - start) / step
    return {
        "command": held_command(run, joint, around, simulation.rate_hz),
        "inertia": inertia,
        "load": load,
        "slope": slope,
        "measured": np.interp(inside, run.time, run.position[:, joint]),
        "supply": supply_factor(run, joint, inside, simulation.supply),
        "velocity": motion.velocity[piece.first, joint],
        "place": place,
        "position": run.position[piece.first : piece.last + 1, joint],
    }


def _stack(columns: list[dict[str, Array | None]], run: NDArray[np.intp], step: float, history: int) -> Windows:
    def grid(name: str) -> Array:
        return np.ascontiguousarray(np.stack([np.asarray(column[name]) for column in columns]))

    place = np.concatenate([np.asarray(column["place"]) for column in columns])
    row = np.floor(place + 1e-9).astype(np.int64)
    sizes = [len(np.asarray(column["place"])) for column in columns]
    return Windows(
        step_s=step,
        history=history,
        command=grid("command"),
        inertia=grid("inertia"),
        load=grid("load"),
        slope=grid("slope"),
        measured=grid("measured"),
        supply=None if columns[0]["supply"] is None else grid("supply"),
        first_velocity=np.array([float(np.asarray(column["velocity"])) for column in columns]),
        run=run,
        begin=np.append(0, np.cumsum(sizes)).astype(np.int64),
        row=row,
        fraction=place - row,
        position=np.concatenate([np.asarray(column["position"]) for column in columns]),
    )


def window_stretches(runs: Sequence[MotionRun], tuning: MotionTuning = DEFAULT) -> list[tuple[str, float, float]]:
    """Run, first and last instant (s) of each window that `make_windows` makes of the same runs."""
    stretches = ((runs[piece.run], piece) for piece in _cut_runs(runs, tuning))
    return [(run.name, float(run.time[piece.first]), float(run.time[piece.last])) for run, piece in stretches]
