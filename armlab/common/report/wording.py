"""Numbers, units and lists as people write them."""

import math
from collections.abc import Sequence


def format_number(value: float, digits: int = 3) -> str:
    """A number with `digits` significant digits, and with an exponent only where it is very large or small."""
    if not math.isfinite(value):
        return "none" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    size = abs(value)
    text = f"{value:.{digits}g}"
    if 10**digits <= size < 1e6:
        text = f"{value:.0f}"
    elif "e" in text and 1 <= size < 1e6:  # what is rounded up to the next power of ten
        text = f"{float(text):.0f}"
    elif size >= 1e6 or 0 < size < 1e-4:
        text = f"{value:.{digits - 1}e}"
    return text.replace("-", "−")


def format_unit(text: str) -> str:
    """A unit as people write it: N m s/rad, kg m²."""
    return "" if text == "1" else text.replace("m2", "m²").replace("s2", "s²").replace(".", " ")


def count_of(number: int, what: str) -> str:
    """`1 joint`, `2 joints`."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def join_words(parts: Sequence[str], last: str = "and") -> str:
    """a, b and c."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {last} {parts[-1]}"
