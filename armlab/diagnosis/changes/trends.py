"""How parameters move over more than two recordings: a step, a steady slope, or neither; with dates where known."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.probabilities import chi_square_tail
from armlab.diagnosis.changes.numbers import Movement
from armlab.recordings.motion import MotionRecording
from armlab.recordings.recording import Recording

FIRST_EPOCH_S = 5e8  # stamps beyond this count seconds since 1970
MIN_FIT_P = 0.01  # a shape that the values contradict at this level is not theirs
MIN_EXPLAINED_SHARE = 0.8  # of the movement, where every shape is contradicted

TrendKind = Literal["step", "slope", "scatter"]


@dataclass(frozen=True, eq=False)
class Trend:
    """A parameter that moves. values: (recordings,), intervals: (recordings, 2), 95 %.

    absolute: whether values are levels; else they are changes from the mean. change_point: the first recording after
    a step, from 0. slope: per day, or per recording where dates are not known.
    """

    movement: Movement
    kind: TrendKind
    change_point: int | None
    slope: float | None
    per_day: bool

    @property
    def values(self) -> Array:
        """Of each recording."""
        return self.movement.values

    @property
    def intervals(self) -> Array:
        """Of each recording, (recordings, 2)."""
        half = self.movement.half_widths
        return np.column_stack([self.values - half, self.values + half])


def find_trends(movements: Sequence[Movement], dates: Sequence[date | None]) -> tuple[Trend, ...]:
    """The shape of each movement over the recordings, in their order, or by their dates where all are known."""
    known = [each for each in dates if each is not None]
    by_date = len(known) == len(dates) and len(set(known)) > 1
    clock = (
        np.array([each.toordinal() for each in known], dtype=float) if by_date else np.arange(len(dates), dtype=float)
    )
    return tuple(_shape_of(each, clock - clock[0], per_day=by_date) for each in movements)


def _shape_of(movement: Movement, clock: Array, *, per_day: bool) -> Trend:
    """The simplest shape that the values do not contradict; of two, the one that leaves less."""
    count = len(clock)
    steps = [(np.arange(count) >= at).astype(float) for at in range(1, count)]
    fits = [_fit(movement, shape) for shape in (clock, *steps)]
    left = np.array([each[0] for each in fits])
    whole = _fit(movement, np.zeros(count))[0]
    best = int(np.argmin(left))
    fitted = chi_square_tail(left[best], max(count - 2 - (best > 0), 1))
    if fitted < MIN_FIT_P and left[best] > (1 - MIN_EXPLAINED_SHARE) * whole:
        return Trend(movement, "scatter", None, None, per_day)
    if best == 0:
        return Trend(movement, "slope", None, fits[0][1], per_day)
    return Trend(movement, "step", best, None, per_day)


def _fit(movement: Movement, shape: Array) -> tuple[float, float]:
    """Chi-square that a shape times its best size leaves of the values about their mean, and that size."""
    count = len(shape)
    centre = np.eye(count) - 1 / count
    precision = np.linalg.pinv(movement.covariance, rcond=1e-9, hermitian=True)
    own, values = centre @ shape, centre @ movement.values
    power = float(own @ precision @ own)
    size = float(own @ precision @ values) / power if power > 0 else 0.0
    rest = values - size * own
    return float(rest @ precision @ rest), size


def recording_dates(
    recordings: Sequence[Recording | MotionRecording], dates: Sequence[date]
) -> tuple[date | None, ...]:
    """Those that are given; else those that the files give, or that stamps since 1970 show.

    Raises InputError where dates are not as many as recordings.
    """
    if dates and len(dates) != len(recordings):
        raise InputError(f"{len(dates)} dates for {len(recordings)} recordings: give one each, or none")
    return tuple(dates) or tuple(_recording_date(each) for each in recordings)


def _recording_date(recording: Recording | MotionRecording) -> date | None:
    if recording.recorded is not None:
        return recording.recorded
    first = min((float(run.time[0]) for run in recording.runs), default=0.0)
    return datetime.fromtimestamp(first, UTC).date() if first > FIRST_EPOCH_S else None
