"""Whether what was expected of second motions came true: expected chances beside what happened."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from concealed.loop.table import ENDS, Share

BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True)
class Bin:
    """Motions of which a right end was expected with a chance from low to high. expected: their mean chance."""

    low: float
    high: float
    expected: float
    came: Share


def reliability(table: pd.DataFrame) -> list[Bin]:
    """The bins that hold any motion of which something was expected."""
    known = table.dropna(subset=["expected right"])
    out = []
    for low, high in pairwise(BINS):
        chance = known["expected right"]
        own = known[(chance >= low) & ((chance < high) | (high == BINS[-1]))]
        if len(own):
            hits = int((own["end"] == "right").sum())
            out.append(Bin(low, high, float(own["expected right"].mean()), Share(hits, len(own))))
    return out


def on_average(table: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """For each end its mean expected chance and how often it came."""
    known = table.dropna(subset=["expected right"])
    return {end: (float(known[f"expected {end}"].mean()), float(np.mean(known["end"] == end))) for end in ENDS}


def brier(table: pd.DataFrame) -> tuple[float, float]:
    """Mean squared error of the expected chance of a right end, and that of always telling the share that came."""
    known = table.dropna(subset=["expected right"])
    came = (known["end"] == "right").to_numpy(dtype=np.float64)
    return float(np.mean((known["expected right"] - came) ** 2)), float(np.mean((came - came.mean()) ** 2))
