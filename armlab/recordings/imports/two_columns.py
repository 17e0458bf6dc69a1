"""Time in two columns: seconds and a fraction, or date and time of the day. They become one column of seconds."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.imports.sources import Source
from armlab.recordings.units import TIME_UNITS

JOINED = "time_from_two_columns"
SECONDS = re.compile(r"(.*?)(secs?|seconds?)")
FRACTION = re.compile(r"(.*?)(nsecs?|nanosecs?|nanoseconds?|usecs?|microsecs?|microseconds?|msecs?|milliseconds?)")
PARTS = {"n": "ns", "u": "us", "mi": "us", "ms": "ms", "mil": "ms"}  # beginnings of words of parts of a second


def find_two_columns(names: Sequence[str]) -> tuple[str, str] | None:
    """Columns of seconds and of a fraction of them, such as `header.stamp.sec` and `header.stamp.nanosec`."""
    whole = {match[1]: name for name in names if (match := SECONDS.fullmatch(name.lower()))}
    for name in names:
        match = FRACTION.fullmatch(name.lower())
        if match is not None and match[1] in whole:
            return whole[match[1]], name
    return None


def join_columns(source: Source, names: tuple[str, ...]) -> Source:
    """The source with one more column, JOINED, in seconds from the first row: the sum of two columns of time.

    Raises InputError where the second is no part of the first.
    """
    table = source.table
    whole, part = (table.columns((name,), "time")[:, 0] for name in names)
    if not np.isfinite(whole).any() or not np.isfinite(part).any():
        raise InputError(f"--time {','.join(names)}: {table.file} has a column of these without any number or stamp")
    known = np.flatnonzero(np.isfinite(whole))
    seconds = whole - whole[known[0]] + _in_seconds(source, names[1], part)
    joined = replace(table, names=(*table.names, JOINED), values=np.column_stack([table.values, seconds]))
    return replace(source, table=joined, units={**source.units, JOINED: "s"})


def join_all(sources: Mapping[str, Source], names: tuple[str, ...]) -> dict[str, Source]:
    """Every source with its time in one column."""
    return {path: join_columns(source, names) for path, source in sources.items()}


def _in_seconds(source: Source, name: str, part: Array) -> Array:
    unit = source.units.get(name)
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
