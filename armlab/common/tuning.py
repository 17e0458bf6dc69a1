"""Tuning numbers: fields of a settings object that say their unit, their meaning, and where their value comes from."""

import math
from dataclasses import field
from typing import TypeVar

BY_EYE = "chosen by eye"
TuningValue = int | float | tuple[float, ...]
V = TypeVar("V", int, float, tuple[float, ...])


def tuned(
    value: V,
    meaning: str,
    unit: str = "",
    *,
    source: str = BY_EYE,
    least: float = 0.0,
    most: float = math.inf,
    count: int = 1,
) -> V:
    """The field of a tuning number. unit: empty for a pure number.

    least, most: bounds of what can be computed, of each value of a list. count: least length of a list.
    """
    note = {"unit": unit, "meaning": meaning, "source": source, "least": least, "most": most, "count": count}
    return field(default=value, metadata=note)
