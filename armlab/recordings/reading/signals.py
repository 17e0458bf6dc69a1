"""Filtered channels of the identification runs at a few instants, cut into blocks of time.

Readings are looked for on a sixth of the instants and judged on the others.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.recordings.channels import gravity_torque
from armlab.recordings.cutoff import MAX_CUTOFF_SHARE, MIN_CUTOFF_PERIODS, travel_bandwidth
from armlab.recordings.differentiate import Signals, differentiate, resample_evenly
from armlab.recordings.filters import Butterworth
from armlab.recordings.identifiable import MIN_DURATION_S
from armlab.recordings.reading.reading import Reading, second_drives
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording, Run
from problem.motion import Motion


@dataclass(frozen=True, eq=False)
class RunSamples:
    """All samples of a run, before any reading: position and velocity, (samples, channels).

    low_pass: that the torque passed. rows: the samples that became rows of `Channels`.
    """

    position: Array
    velocity: Array
    low_pass: Butterworth
    rows: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Channels:
    """Recorded channels, filtered, before any reading.

    motion: (rows, channels) of the positions. stamps: (rows,), s. run: (rows,), the number of the run. torques: of each
    run all stamps (samples,) and torques (samples, channels). samples: of each run. block: (rows,), the
    number of the block of time. margin_s: how far torque can be shifted in time.
    """

    motion: Motion
    stamps: Array
    run: NDArray[np.intp]
    torques: tuple[tuple[Array, Array], ...]
    samples: tuple[RunSamples, ...]
    block: NDArray[np.intp]
    margin_s: float
    _shifted: dict[float, Array] = field(default_factory=dict)
    _signs: dict[bytes, Array] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of instants."""
        return len(self.stamps)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1

    def torque_at(self, shift_s: float) -> Array:
        """Torque channels (rows, channels) so much later than the instants, by linear interpolation."""
        key = round(shift_s, 9)
        if key not in self._shifted:
            out = np.empty((self.rows, self.torques[0][1].shape[1]))
            for number, (known, values) in enumerate(self.torques):
                own = self.run == number
                for channel, signal in enumerate(values.T):
                    out[own, channel] = np.interp(self.stamps[own] + shift_s, known, signal)
            self._shifted[key] = out
        return self._shifted[key]

    def drive_signals(self, reading: Reading, motion: Motion, width: float) -> Array:
        """Velocity, its sign and acceleration of the drives, in the direction of the joint, (rows, joints, 2, 3).

        Of the joint's own drive, and of a second one, zeros without it. Signs are behind the low-pass that the torque
        passed. width: of a drive's top speed, where its sign is taken for full.
        """
        out = np.zeros((self.rows, reading.joints, 2, 3))
        moved, second = reading.drives, second_drives(reading)
        ways = reading.friction_ways or (0.0,) * reading.joints
        for joint in range(reading.joints):
            for number, place in enumerate((joint, second[joint])):
                share = 0.0 if place is None else float(moved[place, joint])
                if place is None or share == 0:
                    continue
                direction = np.zeros(self.motion.position.shape[1])
                direction[list(reading.position_order)] = moved[place] @ reading.position
                sign = self._sign_along(direction / (np.abs(direction).max() or 1.0), width, ways[joint])
                velocity, acceleration = (each @ moved[place] for each in (motion.velocity, motion.acceleration))
                out[:, joint, number] = share * np.stack([velocity, sign, acceleration], axis=1)
        return out

    def _sign_along(self, direction: Array, width: float, way: float) -> Array:
        """Sign of the velocity of a sum of channels behind the low-pass, (rows,), or of friction that turns over a way.

        way: share of the sum's travel, 0 for a sign. Opposite directions share one computation.
        """
        side = 1.0 if direction[np.argmax(np.abs(direction))] > 0 else -1.0
        key = (side * direction).tobytes() + np.float64(way).tobytes()
        if key not in self._signs:
            if way > 0:
                positions = [each.position @ (side * direction) for each in self.samples]
                travel = max(float(np.ptp(each)) for each in positions) or 1.0
                signs = [dahl_state(each, way * travel) for each in positions]
            else:
                speeds = [each.velocity @ (side * direction) for each in self.samples]
                top = max(float(np.abs(each).max()) for each in speeds) or 1.0
                signs = [np.tanh(each / (width * top)) for each in speeds]
            parts = [
                each.low_pass.smooth(sign[:, None])[each.rows, 0]
                for sign, each in zip(signs, self.samples, strict=True)
            ]
            self._signs[key] = np.concatenate(parts)
        return side * self._signs[key]

    def read_motion(self, reading: Reading) -> Motion:
        """Motion of the joints, (rows, joints)."""
        order, to_joints = list(reading.position_order), reading.position.T
        position = self.motion.position[:, order] @ to_joints + reading.offset
        velocity = self.motion.velocity[:, order] @ to_joints * reading.clock
        acceleration = self.motion.acceleration[:, order] @ to_joints * reading.clock**2
        return Motion(position, velocity, acceleration)

    def read_torque(self, reading: Reading) -> Array:
        """Torque of the joints as it was recorded, (rows, joints)."""
        order, out = list(reading.torque_order), np.empty((self.rows, reading.joints))
        for joint, (row, delay) in enumerate(zip(reading.torque, reading.delay, strict=True)):
            out[:, joint] = self.torque_at(float(delay * reading.clock))[:, order] @ row
        return out

    def added_gravity(self, reading: Reading) -> Array | float:
        """What the drive took from it: the gravity of the links of the robot file, (rows, joints), where it did."""
        return gravity_torque(reading.arm, self.read_motion(reading).position) if reading.adds_gravity else 0.0


@dataclass(frozen=True, eq=False)
class ThinnedRows:
    """The instants on which readings are looked for, and those on which they are judged."""

    search: Channels
    judge: Channels


def thin_channels(recording: Recording, tuning: ReadingTuning) -> ThinnedRows | None:
    """The channels of the runs that identify, short ones left out; None without any, or without a way back to channels.

    A transmission has to be undone: it leads from channels to joints.
    """
    given = recording.transmission
    to_torque = given.torque * given.gains
    for matrix in (given.position, to_torque):
        if matrix.shape[0] != matrix.shape[1] or np.linalg.matrix_rank(matrix) < len(matrix):
            return None
    identify = recording.with_role("identify") or recording.runs
    runs = [resample_evenly(run) for run in identify if _length(run) >= MIN_DURATION_S]
    if not runs:
        return None
    signals = [differentiate(run, cutoff_hz=_cutoff_hz(run)) for run in runs]
    return ThinnedRows(
        _channels(recording, signals, tuning, SEARCHED),
        _channels(recording, signals, tuning, tuple(not each for each in SEARCHED)),
    )


def _channels(
    recording: Recording, signals: list[Signals], tuning: ReadingTuning, chosen: tuple[bool, ...]
) -> Channels:
    """The channels at every instant of each six that is chosen."""
    given = recording.transmission
    undo, undo_torque = np.linalg.inv(given.position).T, np.linalg.inv(given.torque * given.gains).T
    lengths = [_length(each.run) for each in signals]
    margin, whole_s = min(tuning.max_delay_s, tuning.max_delay_share * min(lengths)), sum(lengths)
    step_s = whole_s / tuning.rows
    motions, stamps, numbers, torques, samples, blocks = [], [], [], [], [], []
    first = 0
    for number, filtered in enumerate(signals):
        time = filtered.run.time
        inside = filtered.filter.rows
        low, high = time[inside][0] + margin, time[inside][-1] - margin
        rows = np.flatnonzero((time >= low) & (time <= high))[:: max(round(step_s * filtered.run.rate_hz), 1)]
        kept = np.resize(chosen, len(rows))
        count = int(np.clip(round(tuning.blocks * _length(filtered.run) / whole_s), 1, len(rows) // len(chosen)))
        blocks.append((first + np.arange(len(rows)) * count // len(rows))[kept])
        first += count
        rows = rows[kept]
        motion = filtered.motion
        raw = (motion.position[rows] - given.offset) @ undo
        motions.append(Motion(raw, motion.velocity[rows] @ undo, motion.acceleration[rows] @ undo))
        stamps.append(time[rows])
        numbers.append(np.full(len(rows), number))
        samples.append(RunSamples(motion.position @ undo, motion.velocity @ undo, filtered.filter, rows))
        torques.append((time, filtered.filter.smooth(filtered.run.torque) @ undo_torque))
    motion = Motion(*(np.concatenate([getattr(each, name) for each in motions]) for name in _MOTION))
    return Channels(
        motion,
        np.concatenate(stamps),
        np.concatenate(numbers),
        tuple(torques),
        tuple(samples),
        np.concatenate(blocks),
        margin,
    )


_MOTION = ("position", "velocity", "acceleration")


def _cutoff_hz(run: Run) -> float:
    """Of a mistake in the reading all of the motion tells: harmonics of it suffice, and torque above them is noise."""
    wanted = max(HARMONICS_KEPT * travel_bandwidth(run.position, run.rate_hz), MIN_CUTOFF_PERIODS / _length(run))
    return min(wanted, MAX_CUTOFF_SHARE * run.rate_hz)


SEARCHED = (True, False, False, False, False, False)  # of each six instants
HARMONICS_KEPT = 5  # of the bandwidth of the motion: what friction at reversals needs


def _length(run: Run) -> float:
    return float(run.time[-1] - run.time[0])
