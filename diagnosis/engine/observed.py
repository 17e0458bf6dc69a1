"""Runs as the engine sees them: smooth motion, filtered and thinned torque, and which rows identify or validate."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.engine.bandwidth import usable_cutoff
from diagnosis.engine.segments import Segment, moving, parts, rows_of
from diagnosis.settings import Settings
from problem.arm import Arm
from problem.motion import Motion
from recordings.cutoff import choose_cutoff
from recordings.differentiate import Signals, differentiate
from recordings.filters import Butterworth, LowPass
from recordings.resample import evened, sampled_at
from recordings.run import Array, Role, Run

HIGHEST = 0.32  # of the sampling rate: the highest cut-off
WIDER = 2.0  # the positions' cut-off over that of the torque: what the torque holds, the motion has to hold too
HELD_OUT_BLOCKS = 6  # of a run, where no run validates; every third of them is held out


@dataclass(frozen=True, eq=False)
class Observed:
    """All runs, ready: signals of each, and the segments of their kept rows, stacked run after run.

    calm: the motion of each run with as little noise in its accelerations as can be, for columns that differentiate
    it further: in those the noise of the encoders would explain itself.
    rate_hz: of the kept rows. held_out_blocks: whether blocks of time had to stand in for validation runs. moving:
    (rows, joints), False where a joint stands still: friction at rest takes any value, and no law of motion holds.
    """

    signals: tuple[Signals, ...]
    calm: tuple[Motion, ...]
    segments: tuple[Segment, ...]
    rate_hz: float
    held_out_blocks: bool
    moving: NDArray[np.bool_]

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
        low_pass = self.signals[0].filter
        return low_pass.cutoff_hz if isinstance(low_pass, LowPass) else self.rate_hz / 2

    def of_role(self, role: Role, joint: int | None = None) -> tuple[Segment, ...]:
        """The segments of a role; only the parts in which a joint (from 0) moves, if one is given."""
        own = tuple(segment for segment in self.segments if segment.role == role)
        return own if joint is None else tuple(part for each in own for part in parts(each, self.moving[:, joint]))

    def at_rest(self, role: Role, joint: int) -> NDArray[np.intp]:
        """Rows of a role near a standstill or a reversal of a joint (from 0)."""
        whole = rows_of(self.of_role(role), self.rows)
        return np.flatnonzero(whole & ~rows_of(self.of_role(role, joint), self.rows))

    def stretches_at_rest(self, joint: int) -> tuple[Segment, ...]:
        """The stretches of time of those rows."""
        rest = ~rows_of(self.used(joint), self.rows)
        return tuple(part for each in self.segments for part in parts(each, rest, 1))

    def used(self, joint: int) -> tuple[Segment, ...]:
        """The parts of all segments in which a joint (from 0) moves."""
        return self.of_role("identify", joint) + self.of_role("validate", joint)


def observe(runs: Sequence[Run], arm: Arm, inertial: Array | None, settings: Settings) -> Observed:
    """Smooths, differentiates, filters and thins the runs. inertial: (10 * joints,) of the simulated links, if any."""
    even = _one_rate([evened(run) for run in runs])
    rate = even[0].rate_hz
    cutoff = usable_cutoff(even, arm, inertial, min(settings.cutoff_hz, HIGHEST * rate))
    step = max(round(rate / (settings.rows_per_cutoff * cutoff)), 1)
    motion = min(WIDER * cutoff, 0.4 * rate)
    signals = tuple(differentiate(run, cutoff_hz=motion, torque_cutoff_hz=cutoff, step=step) for run in even)
    calm = tuple(_calm(run, motion) for run in even)
    blocks = not any(run.role == "validate" for run in runs)
    segments = _segments(signals, blocks)
    return Observed(signals, calm, segments, rate / step, blocks, moving(signals, segments, motion))


def _one_rate(runs: list[Run]) -> list[Run]:
    """The runs at the lowest of their rates, so that one noise model serves them all."""
    lowest = min(run.rate_hz for run in runs)
    return [run if run.rate_hz < 1.001 * lowest else _resampled(run, lowest) for run in runs]


def _resampled(run: Run, rate: float) -> Run:
    count = int((run.time[-1] - run.time[0]) * rate)
    return sampled_at(run, run.time[0] + np.arange(count + 1) / rate)


def _calm(run: Run, highest_hz: float) -> Motion:
    choice = choose_cutoff(run.position, run.rate_hz, Butterworth).cutoff_hz
    return differentiate(run, cutoff_hz=min(choice, highest_hz)).motion


def _segments(signals: Sequence[Signals], blocks: bool) -> tuple[Segment, ...]:
    out: list[Segment] = []
    start = 0
    for index, each in enumerate(signals):
        stop = start + len(each.torque)
        if not blocks:
            out.append(Segment(index, each.run.role, start, stop))
        else:
            ends = np.linspace(start, stop, HELD_OUT_BLOCKS + 1).astype(int)
            pairs = pairwise(ends.tolist())
            roles: list[Role] = ["validate" if number % 3 == 2 else "identify" for number in range(HELD_OUT_BLOCKS)]
            out += [Segment(index, role, a, b) for role, (a, b) in zip(roles, pairs, strict=True)]
        start = stop
    return tuple(out)
