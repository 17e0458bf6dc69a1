"""Time as files write it: stamps as text, or in two columns.

Stamps as text are ISO 8601 with or without a zone, dates of other orders, times of the day, or parts of both. Each
becomes nanoseconds; what is no stamp becomes NO_STAMP. A time of the day counts from midnight. Two columns hold seconds
and a fraction of them, or date and time of the day; they become one column of seconds.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.table import Table
from armlab.recordings.units import TIME_UNITS

NO_STAMP = np.iinfo(np.int64).min  # of NumPy's missing time
MIN_STAMP_SHARE = 0.9  # of the cells of a column of stamps
DAY_NS = 86_400 * 10**9
DATE_FORMATS = {
    r"\d{1,2}\.\d{1,2}\.\d{4}": ("%d.%m.%Y",),
    r"\d{1,2}/\d{1,2}/\d{4}": ("%d/%m/%Y", "%m/%d/%Y"),
    r"\d{1,2}-\d{1,2}-\d{4}": ("%d-%m-%Y", "%m-%d-%Y"),
    r"\d{4}[/.]\d{1,2}[/.]\d{1,2}": ("%Y/%m/%d",),
}
TIME_OF_DAY = r"\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?(?:\s*[AaPp][Mm])?"
ISO = re.compile(r"\d{4}-\d{2}-\d{2}([T ].*)?")
JOINED = "time_from_two_columns"
SECONDS = re.compile(r"(.*?)(secs?|seconds?)")
FRACTION = re.compile(r"(.*?)(nsecs?|nanosecs?|nanoseconds?|usecs?|microsecs?|microseconds?|msecs?|milliseconds?)")
PARTS = {"n": "ns", "u": "us", "mi": "us", "ms": "ms", "mil": "ms"}  # beginnings of words of parts of a second
Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class StampFormat:
    """How the stamps of a column are written. date: for pandas; None of a time of the day, `ISO8601` of that."""

    words: str
    date: str | None
    has_time: bool

    def parse(self, cells: Sequence[str]) -> Stamps:
        """Nanoseconds from 1970, or from midnight; NO_STAMP where a cell is none."""
        text = pd.Series(cells, dtype="str").str.strip()
        if self.date == "ISO8601":
            found = pd.to_datetime(text.str.replace(",", "."), format="ISO8601", utc=True, errors="coerce")
            return found.dt.tz_localize(None).to_numpy(dtype="datetime64[ns]").view(np.int64)
        day, time = np.zeros(len(text), dtype=np.int64), text
        if self.date is not None:
            parts = text.str.split(r"[ T_]+", n=1, expand=True, regex=True)
            whole = parts[0].str.replace(".", "/", regex=False) if self.date == "%Y/%m/%d" else parts[0]
            dates = pd.to_datetime(whole, format=self.date, errors="coerce")
            day = dates.to_numpy(dtype="datetime64[ns]").view(np.int64)
            time = parts[1] if self.has_time and 1 in parts else pd.Series("00:00:00", index=text.index)
        return np.where(day == NO_STAMP, NO_STAMP, _add(day, _time_of_day(time)))


def _add(day: Stamps, time: Stamps) -> Stamps:
    return np.where(time == NO_STAMP, NO_STAMP, day + time)


def _time_of_day(text: "pd.Series[str]") -> Stamps:
    half = text.str.extract(r"([AaPp])[Mm]$")[0].str.lower()
    clock = text.str.replace(r"\s*[AaPp][Mm]$", "", regex=True).str.replace(",", ".")
    found = pd.to_timedelta(clock, errors="coerce").to_numpy(dtype="timedelta64[ns]").view(np.int64)
    hours, noon = found // (3600 * 10**9), 12 * 3600 * 10**9
    late = np.where((half == "p").to_numpy() & (hours < 12), noon, 0)
    early = np.where((half == "a").to_numpy() & (hours == 12), noon, 0)
    return np.where(found == NO_STAMP, NO_STAMP, found + late - early)


def find_stamp_format(cells: Sequence[str]) -> StampFormat | None:
    """The format of most cells of a column; None where they are no stamps."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    if not filled:
        return None
    candidates = [StampFormat("ISO 8601", "ISO8601", True)] if ISO.fullmatch(filled[0]) else []
    if re.fullmatch(TIME_OF_DAY, filled[0]):
        candidates.append(StampFormat("time of the day", None, True))
    for pattern, formats in DATE_FORMATS.items():
        match = re.fullmatch(rf"{pattern}(?:[ T_]+({TIME_OF_DAY}))?", filled[0])
        if match is not None:
            words = "date and time" if match[1] else "date"
            candidates += [StampFormat(f"{words}, {each}", each, match[1] is not None) for each in formats]
    fitting = []
    for candidate in candidates:
        stamps = candidate.parse(filled)
        known = stamps[stamps != NO_STAMP]
        if len(known) >= MIN_STAMP_SHARE * len(filled):
            fitting.append((int(known.max() - known.min()), candidate))
    return min(fitting, key=lambda each: each[0])[1] if fitting else None


def seconds_of(stamps: Stamps) -> Array:
    """Seconds from the first stamp, NaN where there is none; a time of the day goes on after midnight."""
    known = np.flatnonzero(stamps != NO_STAMP)
    out = np.full(len(stamps), np.nan)
    if len(known):
        passed = stamps[known] - stamps[known[0]]
        midnights = np.cumsum(np.append(False, np.diff(passed) < -DAY_NS // 2)) if is_within_a_day(stamps[known]) else 0
        out[known] = (passed + DAY_NS * midnights) / 1e9
    return out


def is_within_a_day(stamps: Stamps) -> bool:
    """Whether stamps count from midnight."""
    return bool(stamps.min() >= 0 and stamps.max() < DAY_NS)


def find_two_columns(names: Sequence[str]) -> tuple[str, str] | None:
    """Columns of seconds and of a fraction of them, such as `header.stamp.sec` and `header.stamp.nanosec`."""
    whole = {match[1]: name for name in names if (match := SECONDS.fullmatch(name.lower()))}
    for name in names:
        match = FRACTION.fullmatch(name.lower())
        if match is not None and match[1] in whole:
            return whole[match[1]], name
    return None


def join_columns(table: Table, names: tuple[str, ...], unit: str | None) -> Table:
    """The table with one more column, JOINED, in seconds from the first row: the sum of two columns of time.

    unit: of the second column, where the file names it. Raises InputError where the second is no part of the first.
    """
    whole, part = (table.columns((name,), "time")[:, 0] for name in names)
    if not np.isfinite(whole).any() or not np.isfinite(part).any():
        raise InputError(f"--time {','.join(names)}: {table.file} has a column of these without any number or stamp")
    known = np.flatnonzero(np.isfinite(whole))
    seconds = whole - whole[known[0]] + _part_in_seconds(part, names[1], unit)
    return replace(table, names=(*table.names, JOINED), values=np.column_stack([table.values, seconds]))


def _part_in_seconds(part: Array, name: str, unit: str | None) -> Array:
    if unit == "s":  # a time of the day as text, from the first one
        return part
    match = FRACTION.fullmatch(name.lower())
    word = match[2] if match else ""
    unit = unit or next(
        (PARTS[start] for start in sorted(PARTS, key=len, reverse=True) if word.startswith(start)), None
    )
    largest = float(np.nanmax(part))
    unit = unit or next((each for each in ("ms", "us", "ns") if largest * TIME_UNITS[each].factor < 1), None)
    if unit is None or largest * TIME_UNITS[unit].factor > 1:
        raise InputError(
            f"--time: column {name} reaches {largest:.6g}, which is no part of a second in {unit or 'ns, us or ms'}: "
            "give the column of seconds, then that of their fraction"
        )
    return part * TIME_UNITS[unit].factor
