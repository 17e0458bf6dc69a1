"""Where two verdicts differ."""

import math
from typing import Any

RELATIVE, ABSOLUTE = 1e-6, 1e-9  # differences of numbers that sums in another order make


def first_difference(before: Any, now: Any, place: str = "") -> str | None:
    """Where two documents differ first, and in what; None where they are equal, numbers within a millionth."""
    if isinstance(before, dict) and isinstance(now, dict):
        if before.keys() != now.keys():
            return f"{place or 'the document'} has {', '.join(sorted(before.keys() ^ now.keys()))} on one side only"
        pairs = [(f"{place}.{key}".removeprefix("."), before[key], now[key]) for key in before]
    elif isinstance(before, list) and isinstance(now, list):
        pairs = [(f"{place}[{row}]", *each) for row, each in enumerate(zip(before, now, strict=False))]
        pairs.append((f"length of {place}", len(before), len(now)))
    else:
        return None if _is_equal(before, now) else f"{place}: {before!r} before, {now!r} now"
    found = (first_difference(one, other, where) for where, one, other in pairs)
    return next((each for each in found if each is not None), None)


def _is_equal(before: Any, now: Any) -> bool:
    if _is_number(before) and _is_number(now):
        return math.isclose(before, now, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    return type(before) is type(now) and bool(before == now)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
