"""Runs as the diagnosis sees them: filtered and thinned signals, and which rows identify, validate or stand still."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_opening, median_filter

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.tuning import DataTuning
from armlab.recordings.cutoff import acceleration_spectrum, choose_cutoff, noise_level
from armlab.recordings.differentiate import Signals, differentiate, resample_at, resample_evenly
from armlab.recordings.recording import ROLES, Role, Run
from problem.arm import Arm
from problem.joint_words import joint_in_words
from problem.motion import Motion
from problem.regressor import inertia_column

LONG_STRETCH = 4  # stretches


@dataclass(frozen=True, eq=False)
class Segment:
    """Rows [start, stop) of the stacked runs that stand together in time and share a role."""

    run: int
    role: Role
    start: int
    stop: int


def moving_rows(
    signals: Sequence[Signals], segments: Sequence[Segment], cutoff_hz: float, tuning: DataTuning
) -> NDArray[np.bool_]:
    """Rows (rows, joints) in which a joint moves. cutoff_hz: of the positions."""
    velocity = np.concatenate([each.motion.velocity for each in signals])
    creep = tuning.creep_ratio * np.quantile(np.abs(velocity), tuning.high_speed_quantile, axis=0)
    whole = np.concatenate([_moving_rows_of_run(each, cutoff_hz, creep, tuning) for each in signals])
    for joint in range(whole.shape[1]):
        for role in ("identify", "validate"):
            own = [each for each in segments if each.role == role]
            parts = [part for each in own for part in split_segment(each, whole[:, joint], tuning.min_segment_rows)]
            left = sum(part.stop - part.start for part in parts)
            if left < tuning.min_moving_share * sum(each.stop - each.start for each in own):
                for each in own:
                    whole[each.start : each.stop, joint] = True
    return whole


def _moving_rows_of_run(signals: Signals, cutoff_hz: float, creep: Array, tuning: DataTuning) -> NDArray[np.bool_]:
    """Rows (kept, joints) in which a joint is faster than its noise and than creeping (joints,)."""
    run = signals.run
    frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
    density = noise_level(frequency, spectrum, shape, run.rate_hz)
    noise = 2 * np.pi * np.sqrt(density * cutoff_hz**3 / 3)  # of white noise, differentiated, up to the cut-off
    slow = np.abs(signals.motion.velocity) < np.maximum(tuning.standstill_sigmas * noise, creep)
    still = binary_opening(slow, structure=np.ones((max(round(tuning.min_standstill_s * run.rate_hz), 1), 1)))
    reach = tuning.standstill_margin / signals.filter.cutoff_hz
    near = binary_dilation(still, structure=np.ones((2 * round(reach * run.rate_hz) + 1, 1)))
    return np.asarray(~near[signals.filter.rows])


def split_segment(segment: Segment, chosen: NDArray[np.bool_], shortest: int) -> list[Segment]:
    """The stretches of a segment in which `chosen` (rows,) holds, those with fewer than `shortest` rows left out."""
    inside = np.concatenate([[False], chosen[segment.start : segment.stop], [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8))) + segment.start
    found = [Segment(segment.run, segment.role, int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    return [each for each in found if each.stop - each.start >= shortest]


def rows_in(segments: Sequence[Segment], rows: int) -> NDArray[np.bool_]:
    """Which of the stacked rows are in these segments, (rows,)."""
    chosen = np.zeros(rows, dtype=bool)
    for each in segments:
        chosen[each.start : each.stop] = True
    return chosen


def usable_cutoff(
    runs: Sequence[Run], arm: Arm, inertial: Array | None, highest_hz: float, tuning: DataTuning
) -> float:
    """The highest frequency, Hz, up to which the encoders' noise stays below the torque's power on every joint.

    inertial: (10 * joints,) of the links; without them the highest is taken.
    """
    if inertial is None:
        return highest_hz
    usable = min(_usable_cutoff_of_run(run, arm, inertial, highest_hz, tuning) for run in runs)
    return max(usable, min(tuning.min_cutoff_hz, highest_hz))


def _usable_cutoff_of_run(run: Run, arm: Arm, inertial: Array, highest_hz: float, tuning: DataTuning) -> float:
    frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
    noise = noise_level(frequency, spectrum, shape, run.rate_hz)
    inertia = _rms_inertia(run, arm, inertial, tuning.inertia_states)
    induced = np.outer(shape, np.square(inertia) @ noise)
    density = _power_density(run.torque, run.rate_hz, len(run.position) - 2)
    power = _running_median(density, tuning.median_width)
    allowed = np.all(induced <= tuning.max_encoder_share * power[: len(induced)], axis=1)
    too_much = np.flatnonzero(~allowed & (frequency >= tuning.min_cutoff_hz))
    return float(min(frequency[too_much[0]] if len(too_much) else highest_hz, highest_hz))


def _rms_inertia(run: Run, arm: Arm, inertial: Array, states: int) -> Array:
    """Root mean square of the mass matrix over some states of the run, (joints, joints)."""
    position = run.position[:: max(run.samples // states, 1)]
    columns = [inertia_column(arm, position, joint, inertial) for joint in range(len(arm))]
    rotors = np.diag(arm.rotor_inertia) if arm.rotor_inertia else 0.0
    return np.asarray(np.sqrt(np.mean(np.square(np.stack(columns, axis=-1) + rotors), axis=0)))


def _power_density(signal: Array, rate_hz: float, samples: int) -> Array:
    """One-sided power density (frequencies, channels), on the frequencies of `samples` samples."""
    part = signal[:samples]
    window = np.hanning(samples)[:, None]
    scale = 2 / (np.sum(window**2) * rate_hz)
    return np.asarray(scale * np.abs(np.fft.rfft((part - part.mean(axis=0)) * window, axis=0)) ** 2)


def _running_median(power: Array, width: int) -> Array:
    return np.asarray(median_filter(power, size=(width, 1), mode="nearest") / np.log(2))


@dataclass(frozen=True, eq=False)
class Observed:
    """All runs, ready: signals of each, and the segments of their kept rows, stacked run after run.

    calm: the motion of each run with as little noise in its accelerations as can be, for columns that differentiate
    it further: in those the noise of the encoders would explain itself.
    rate_hz: of the kept rows. held_out_blocks: whether blocks of time had to stand in for validation runs. moving:
    (rows, joints), False where a joint stands still: friction at rest takes any value, and no law of motion holds.
    min_segment_rows: shorter stretches in motion are not used. stretch_s, min_stretches, min_held_out_stretches: of
    `stretches` and their likes.
    """

    signals: tuple[Signals, ...]
    calm: tuple[Motion, ...]
    segments: tuple[Segment, ...]
    rate_hz: float
    held_out_blocks: bool
    moving: NDArray[np.bool_]
    min_segment_rows: int
    stretch_s: float
    min_stretches: int
    min_held_out_stretches: int

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.signals[0].motion.joints

    @property
    def rows(self) -> int:
        """Number of kept rows."""
        return self.segments[-1].stop

    @property
    def torque(self) -> Array:
        """Measured torque, filtered and kept, (rows, joints)."""
        return np.concatenate([each.torque for each in self.signals])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(each.run.name for each in self.signals)

    def kept(self, signal: str) -> Array:
        """Position, velocity or acceleration at the kept rows, (rows, joints)."""
        return np.concatenate([getattr(each.motion, signal)[each.filter.rows] for each in self.signals])

    @property
    def time(self) -> Array:
        """Stamps of the kept rows from the start of their runs, (rows,), s."""
        return np.concatenate([each.time - each.run.time[0] for each in self.signals])

    @property
    def motion(self) -> Motion:
        """The motion at the kept rows."""
        return Motion(self.kept("position"), self.kept("velocity"), self.kept("acceleration"))

    @property
    def cutoff_hz(self) -> float:
        """Of the filter that torque and columns share."""
        return self.signals[0].filter.cutoff_hz

    @cached_property
    def stretches(self) -> NDArray[np.intp]:
        """Number of the stretch of time of each row, (rows,): the units of chance; none reaches over a segment's end.

        Stretches are shorter in a short recording: a variance between them needs many of each role.
        """
        return self._number_stretches(self.stretch_s, self.min_stretches)

    @cached_property
    def held_out_stretches(self) -> NDArray[np.intp]:
        """The same for predictions of held-out rows, whose errors are tied for longer: longer where time is short."""
        return self._number_stretches(self.stretch_s, self.min_held_out_stretches)

    @cached_property
    def long_stretches(self) -> NDArray[np.intp]:
        """The same of longer stretches, which hold what errors that are not whitened tie together, (rows,)."""
        return self._number_stretches(LONG_STRETCH * self.stretch_s, self.min_held_out_stretches)

    def _number_stretches(self, length_s: float, least: int) -> NDArray[np.intp]:
        numbers, start = np.empty(self.rows, dtype=np.intp), 0
        rows = {role: sum(each.stop - each.start for each in self.of_role(role)) for role in ROLES}
        for each in self.segments:
            count = each.stop - each.start
            length = min(length_s, rows[each.role] / self.rate_hz / least)
            blocks = max(int(count / self.rate_hz / length), 1)
            numbers[each.start : each.stop] = start + np.arange(count) * blocks // count
            start += blocks
        return numbers

    def of_role(self, role: Role, joint: int | None = None) -> tuple[Segment, ...]:
        """The segments of a role; only the parts in which a joint (from 0) moves, if one is given."""
        return self._segments_of_roles[role, joint]

    @cached_property
    def _segments_of_roles(self) -> dict[tuple[Role, int | None], tuple[Segment, ...]]:
        out: dict[tuple[Role, int | None], tuple[Segment, ...]] = {}
        for role in ROLES:
            own = tuple(segment for segment in self.segments if segment.role == role)
            out[role, None] = own
            for joint, moving in enumerate(self.moving.T):
                parts = (part for each in own for part in split_segment(each, moving, self.min_segment_rows))
                out[role, joint] = tuple(parts)
        return out

    def rows_held_out(self, joint: int) -> NDArray[np.bool_]:
        """The rows (rows,) that took no part in a fit, and in which a joint (from 0) moves."""
        return rows_in(self.of_role("validate", joint), self.rows)

    def short_joints(self) -> list[int]:
        """Joints (from 1) that have no stretch in motion in what is fitted, or in what is held out."""
        return [joint + 1 for joint in range(self.joints) if not all(self.of_role(role, joint) for role in ROLES)]

    def reason_too_short(self, arm: Arm) -> str | None:
        """Why nothing can be said of a joint: it is never in motion for long enough in what is fitted, or in what is
        held out; None where all are.
        """
        least, short = self.min_segment_rows / self.rate_hz, self.short_joints()
        if not short:
            return None
        if not all(self.of_role(role) for role in ROLES):
            return f"no run is so long that {least:.2g} s of it can be held out: record longer runs"
        return f"{joint_in_words(arm, short[0])} is never in motion for {least:.2g} s on end: record longer runs"

    def at_rest(self, role: Role, joint: int) -> NDArray[np.intp]:
        """Rows of a role near a standstill or a reversal of a joint (from 0)."""
        return self._rows_at_rest[role, joint]

    @cached_property
    def _rows_at_rest(self) -> dict[tuple[Role, int], NDArray[np.intp]]:
        whole = {role: rows_in(self.of_role(role), self.rows) for role in ROLES}
        return {
            (role, joint): np.flatnonzero(whole[role] & ~rows_in(self.of_role(role, joint), self.rows))
            for role in ROLES
            for joint in range(self.joints)
        }

    def stretches_at_rest(self, joint: int, segment: Segment) -> tuple[Segment, ...]:
        """The stretches of a segment near a standstill or a reversal of a joint (from 0)."""
        rest = ~rows_in(split_segment(segment, self.moving[:, joint], self.min_segment_rows), self.rows)
        return tuple(split_segment(segment, rest, 1))

    def used(self, joint: int) -> tuple[Segment, ...]:
        """The parts of all segments in which a joint (from 0) moves."""
        return self.of_role("identify", joint) + self.of_role("validate", joint)


def observe(runs: Sequence[Run], arm: Arm, inertial: Array | None, settings: Settings) -> Observed:
    """Smooths, differentiates, filters and thins the runs. inertial: (10 * joints,) of the simulated links, if any.

    Where a joint has no stretch in motion of the usual length, stretches of half of it count, and of half of that.
    """
    tuning = settings.tuning.data
    even = _to_common_rate([resample_evenly(run) for run in runs])
    rate = even[0].rate_hz
    cutoff = usable_cutoff(even, arm, inertial, min(tuning.cutoff_hz, tuning.max_cutoff_ratio * rate), tuning)
    step = max(round(rate / (tuning.rows_per_cutoff * cutoff)), 1)
    motion = min(tuning.position_cutoff_ratio * cutoff, tuning.max_position_cutoff_ratio * rate)
    signals = tuple(differentiate(run, cutoff_hz=motion, torque_cutoff_hz=cutoff, step=step) for run in even)
    calm = tuple(_smooth_motion(run, motion) for run in even)
    usual = found = _with_segments(signals, calm, motion, rate / step, tuning)
    while found.short_joints() and found.min_segment_rows // 2 >= tuning.least_segment_rows:
        shorter = replace(tuning, min_segment_rows=found.min_segment_rows // 2)
        found = _with_segments(signals, calm, motion, rate / step, shorter)
    return usual if found.short_joints() else found


def _with_segments(
    signals: tuple[Signals, ...], calm: tuple[Motion, ...], cutoff_hz: float, rate_hz: float, tuning: DataTuning
) -> Observed:
    """cutoff_hz: of the positions. rate_hz: of the kept rows."""
    least = tuning.min_segment_rows
    blocks = not any(each.run.role == "validate" and len(each.torque) >= least for each in signals)
    segments = _split_runs(signals, blocks, tuning)
    moving = moving_rows(signals, segments, cutoff_hz, tuning)
    stretches = tuning.stretch_s, tuning.min_stretches, tuning.min_held_out_stretches
    return Observed(signals, calm, segments, rate_hz, blocks, moving, least, *stretches)


def in_fixed_order(runs: Sequence[Run]) -> list[Run]:
    """Runs that identify first, then the longest, then the widest: the order in which they are listed says nothing."""
    return sorted(
        runs, key=lambda run: (run.role != "identify", -run.samples, -float(np.ptp(run.position, axis=0).sum()))
    )


def _to_common_rate(runs: list[Run]) -> list[Run]:
    """The runs at the lowest of their rates, so that one noise model serves them all."""
    lowest = min(run.rate_hz for run in runs)
    return [run if run.rate_hz < 1.001 * lowest else _resample(run, lowest) for run in runs]


def _resample(run: Run, rate: float) -> Run:
    count = int((run.time[-1] - run.time[0]) * rate)
    return resample_at(run, run.time[0] + np.arange(count + 1) / rate)


def _smooth_motion(run: Run, highest_hz: float) -> Motion:
    choice = choose_cutoff(run.position, run.rate_hz).cutoff_hz
    return differentiate(run, cutoff_hz=min(choice, highest_hz)).motion


def _split_runs(signals: Sequence[Signals], blocks: bool, tuning: DataTuning) -> tuple[Segment, ...]:
    """The runs by their roles, or blocks of them: no block is shorter than a stretch that counts."""
    out: list[Segment] = []
    start = 0
    for index, each in enumerate(signals):
        stop = start + len(each.torque)
        if not blocks:
            out.append(Segment(index, each.run.role, start, stop))
        else:
            every = tuning.held_out_every
            count = max(min(tuning.held_out_blocks, (stop - start) // tuning.min_segment_rows), 1)
            pairs = pairwise(np.linspace(start, stop, count + 1).astype(int).tolist())
            roles: list[Role] = ["validate" if number % every == every - 1 else "identify" for number in range(count)]
            out += [Segment(index, role, a, b) for role, (a, b) in zip(roles, pairs, strict=True)]
        start = stop
    return tuple(out)


def identification_runs(observed: Observed) -> list[Run]:
    """The stretches of the runs that identify, even in time, as runs."""
    out, start = [], 0
    for index, each in enumerate(observed.signals):
        kept = np.arange(each.run.samples)[each.filter.rows]
        for part in observed.of_role("identify"):
            if part.run == index:
                first, last = kept[part.start - start], kept[part.stop - start - 1]
                out.append(each.run.rows(slice(int(first), int(last) + 1)))
        start += len(each.torque)
    return out
