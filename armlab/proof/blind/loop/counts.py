"""Counts of the closed loop: rows, shares with intervals, comparisons, reliability of forecasts."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from armlab.common.statistics import wilson_interval
from armlab.proof.blind.loop.case import MOTION_KINDS

ENDS = ("right", "wrong", "open")
EXPECTED_COLUMNS = tuple(f"expected {end}" for end in ENDS)
TABLE_COLUMNS = [
    "case",
    "start",
    "tier",
    "hidden",
    "beside",
    "multiple",
    "motion",
    "end",
    "suspected",
    *EXPECTED_COLUMNS,
]


def make_table(found: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row a case and kind of second motion; cases in which a simulation ran away are left out whole."""
    whole = [each for each in found if each["ends"] and set(each["ends"].values()) <= set(ENDS)]
    return pd.DataFrame([_table_row(each, kind) for each in whole for kind in MOTION_KINDS], columns=TABLE_COLUMNS)


def _table_row(case: dict[str, Any], kind: str) -> dict[str, Any]:
    expected = case["forecast"].get(kind, [float("nan")] * len(ENDS))
    return {
        "case": case["name"],
        "start": case["start"],
        "tier": case["tier"],
        "hidden": case["pair"][0],
        "beside": case["pair"][1],
        "multiple": case["multiple"],
        "motion": kind,
        "end": case["ends"][kind],
        "suspected": " ".join(f"{name}@{joint or 'robot'}" for name, joint in case["suspected"]),
        **dict(zip(EXPECTED_COLUMNS, expected, strict=True)),
    }


@dataclass(frozen=True)
class LoopShare:
    """How often a kind of second motion ended in one way. hits: of `cases`."""

    hits: int
    cases: int

    @property
    def value(self) -> float:
        """The share, zero without cases."""
        return self.hits / max(self.cases, 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval at 95 %."""
        return wilson_interval(self.hits, self.cases)

    def __str__(self) -> str:
        """`71 % (56-83)`."""
        low, high = self.interval
        return f"{100 * self.value:.0f} % ({100 * low:.0f}-{100 * high:.0f})" if self.cases else "-"


Shares = dict[tuple[str, str], LoopShare]


def count_shares(table: pd.DataFrame, start: str | None = None) -> Shares:
    """By kind of motion and end, of the cases that began in one way, or of all."""
    part = table if start is None else table[table["start"] == start]
    out: Shares = {}
    for kind in MOTION_KINDS:
        own = part[part["motion"] == kind]["end"].tolist()
        out |= {(kind, end): LoopShare(own.count(end), len(own)) for end in ENDS}
    return out


@dataclass(frozen=True)
class MotionComparison:
    """Cases that only one of two motions ended in a way. p_value: exact McNemar test, both alike."""

    ours: int
    theirs: int

    @property
    def p_value(self) -> float:
        """Two-sided (McNemar 1947, in its exact binomial form)."""
        both = self.ours + self.theirs
        return float(binomtest(self.ours, both).pvalue) if both else 1.0


def compare_motions(table: pd.DataFrame, other: str, end: str = "right") -> MotionComparison:
    """The designed motion against another kind."""
    wide = table.pivot(index="case", columns="motion", values="end") == end
    if wide.empty:
        return MotionComparison(0, 0)
    ours, theirs = wide["designed"], wide[other]
    return MotionComparison(int((ours & ~theirs).sum()), int((theirs & ~ours).sum()))


CHANCE_BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True)
class ChanceBin:
    """Motions of which a right end was expected with a chance from low to high. expected: their mean chance."""

    low: float
    high: float
    expected: float
    observed: LoopShare


def reliability_bins(table: pd.DataFrame) -> list[ChanceBin]:
    """The bins that hold any motion of which something was expected."""
    known = table.dropna(subset=["expected right"])
    out = []
    for low, high in pairwise(CHANCE_BINS):
        chance = known["expected right"]
        own = known[(chance >= low) & ((chance < high) | (high == CHANCE_BINS[-1]))]
        if len(own):
            hits = int((own["end"] == "right").sum())
            out.append(ChanceBin(low, high, float(own["expected right"].mean()), LoopShare(hits, len(own))))
    return out


def mean_chances(table: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """For each end its mean expected chance and its observed share."""
    known = table.dropna(subset=["expected right"])
    return {end: (float(known[f"expected {end}"].mean()), float(np.mean(known["end"] == end))) for end in ENDS}


def brier_scores(table: pd.DataFrame) -> tuple[float, float]:
    """Mean squared error of the chance of a right end as expected, and as a constant equal to the observed share."""
    known = table.dropna(subset=["expected right"])
    came = (known["end"] == "right").to_numpy(dtype=np.float64)
    return float(np.mean((known["expected right"] - came) ** 2)), float(np.mean((came - came.mean()) ** 2))
