"""What the closed loop showed, counted: one row a case and motion, shares with intervals, and motion against motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from scipy.stats import binomtest

from concealed.loop.case import KINDS
from concealed.score.measures import wilson

ENDS = ("right", "wrong", "open")
EXPECTED = tuple(f"expected {end}" for end in ENDS)
COLUMNS = ["case", "start", "tier", "hidden", "beside", "multiple", "motion", "end", "suspected", *EXPECTED]


def rows(found: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row a case and kind of second motion; cases in which a simulation ran away are left out whole."""
    whole = [each for each in found if each["ends"] and set(each["ends"].values()) <= set(ENDS)]
    return pd.DataFrame([_row(each, kind) for each in whole for kind in KINDS], columns=COLUMNS)


def _row(case: dict[str, Any], kind: str) -> dict[str, Any]:
    expected = case["forecast"].get(kind, [float("nan")] * len(ENDS))
    return {
        "case": case["name"], "start": case["start"], "tier": case["tier"], "hidden": case["pair"][0],
        "beside": case["pair"][1], "multiple": case["multiple"], "motion": kind, "end": case["ends"][kind],
        "suspected": " ".join(f"{name}@{joint or 'robot'}" for name, joint in case["suspected"]),
        **dict(zip(EXPECTED, expected, strict=True)),
    }  # fmt: skip


@dataclass(frozen=True)
class Share:
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
        return wilson(self.hits, self.cases)

    def __str__(self) -> str:
        """`71 % (56-83)`."""
        low, high = self.interval
        return f"{100 * self.value:.0f} % ({100 * low:.0f}-{100 * high:.0f})" if self.cases else "-"


Shares = dict[tuple[str, str], Share]


def shares(table: pd.DataFrame, start: str | None = None) -> Shares:
    """By kind of motion and end, of the cases that began in one way, or of all."""
    part = table if start is None else table[table["start"] == start]
    out: Shares = {}
    for kind in KINDS:
        own = part[part["motion"] == kind]["end"].tolist()
        out |= {(kind, end): Share(own.count(end), len(own)) for end in ENDS}
    return out


@dataclass(frozen=True)
class Versus:
    """Cases that only one of two motions ended in a way. p_value: exact McNemar test, both alike."""

    ours: int
    theirs: int

    @property
    def p_value(self) -> float:
        """Two-sided (McNemar 1947, in its exact binomial form)."""
        both = self.ours + self.theirs
        return float(binomtest(self.ours, both).pvalue) if both else 1.0


def versus(table: pd.DataFrame, other: str, end: str = "right") -> Versus:
    """The designed motion against another kind."""
    wide = table.pivot(index="case", columns="motion", values="end") == end
    if wide.empty:
        return Versus(0, 0)
    ours, theirs = wide["designed"], wide[other]
    return Versus(int((ours & ~theirs).sum()), int((theirs & ~ours).sum()))
