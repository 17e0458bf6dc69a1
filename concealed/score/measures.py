"""The measures of a set, each with how often it was counted and an interval."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import norm

from concealed.score.rows import Rows

CONFIDENCE = 0.95
ABOVE = 3.0  # detection limits: what is expected to be named
BOUNDS = {
    "at most 2 %": (0.0, 0.02),
    "at most 5 %": (0.0, 0.05),
    "at least 80 %": (0.8, 1.0),
    "at least 90 %": (0.9, 1.0),
    "at least 98 %": (0.98, 1.0),
    "90-98 %": (0.9, 0.98),
    "at least 0.9": (0.9, np.inf),
    "none": (0.0, 0.0),
}
Unit = Literal["share", "s", ""]


@dataclass(frozen=True)
class Measure:
    """A figure, its interval (None where it has none), how many it was counted on, what is wanted, and its unit."""

    name: str
    value: float | None
    low: float | None
    high: float | None
    number: int
    wanted: str
    unit: Unit = ""

    @property
    def met(self) -> bool | None:
        """Whether the figure is as wanted; None where nothing is wanted, or nothing was counted."""
        if not self.wanted or self.value is None:
            return None
        least, most = BOUNDS[self.wanted]
        return least <= self.value <= most

    @property
    def sure(self) -> bool:
        """True where the whole interval agrees with what `met` says of the figure."""
        if not self.wanted or self.low is None or self.high is None or self.wanted == "none":
            return True
        least, most = BOUNDS[self.wanted]
        return least <= self.low and self.high <= most if self.met else self.high < least or self.low > most


def wilson(hits: int, number: int) -> tuple[float, float]:
    """Wilson's score interval of a share (1927)."""
    if number == 0:
        return 0.0, 1.0
    z = float(norm.ppf((1 + CONFIDENCE) / 2))
    seen, spread = hits / number, z**2 / number
    middle = (seen + spread / 2) / (1 + spread)
    half = z / (1 + spread) * np.sqrt(seen * (1 - seen) / number + spread / (4 * number))
    return (float(middle - half) if hits else 0.0), (float(middle + half) if hits < number else 1.0)


def measures(rows: Rows, tier: str) -> list[Measure]:
    """All measures of one tier."""
    cases, claims, parameters = (frame[frame["tier"] == tier] for frame in (rows.cases, rows.claims, rows.parameters))
    nulls, decoys = (cases[cases["kind"] == kind] for kind in ("null", "decoy"))
    inside, outside = in_tier(rows.effects, tier)
    large, unknown = (each[each["multiple"] > ABOVE] for each in (inside, outside))
    named = inside[inside["named_first"].astype(bool)]
    classed = inside[inside["named_class"].astype(bool)]
    beyond = claims[~claims["category"].isin(["background"])]
    covered = parameters["covered"].dropna()
    return [
        share("false claims on nulls", nulls["false_claims"] > 0, "at most 2 %"),
        share("false claims on decoys", decoys["false_claims"] > 0, "at most 2 %"),
        share("unknown said on nulls and decoys", pd.concat([nulls, decoys])["false_unknown"], ""),
        share("wrong names among claims", claims["category"].isin(["wrong"]), "at most 5 %"),
        share("wrong names among claims beyond background", beyond["category"].isin(["wrong"]), ""),
        share("misplaced among claims", claims["category"].isin(["misplaced"]), ""),
        share(f"right name or class of four, above {ABOVE:g} limits", large["named_class"], "at least 90 %"),
        share(f"right first name, above {ABOVE:g} limits", large["named_first"], ""),
        share("right first name, all sizes", inside["named_first"], ""),
        share("right joint, given a right name", named["right_joint"], "at least 98 %"),
        _middle("class size where the class is right (mean)", classed["class_size"], "", np.mean),
        _middle("gap closed on held-out runs (median)", cases["gap_closed"], "at least 0.9"),
        _middle("gap closed beyond plain friction (median)", cases["gap_closed_beyond_friction"], ""),
        share(f"unknown on effects outside, above {ABOVE:g} limits", unknown["named_first"], "at least 80 %"),
        share("95 % intervals that hold the truth", covered, "90-98 %"),
        _middle("relative parameter error (median)", parameters["relative_error"], ""),
        replace(_middle("seconds a case (median)", cases["seconds"], ""), unit="s"),
        _longest("seconds a case (longest)", cases["seconds"]),
        share("missing or invalid verdicts", cases["status"] == "invalid", "none"),
    ]


def in_tier(effects: pd.DataFrame, tier: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Hidden effects of the library in a tier, and those outside."""
    own = effects[effects["tier"] == tier]
    outside = own["outside"].astype(bool)
    return own[~outside], own[outside]


def share(name: str, flags: "pd.Series[Any]", wanted: str) -> Measure:
    """A share with Wilson's interval."""
    hits, number = int(flags.astype(bool).sum()), len(flags)
    if not number:
        return Measure(name, None, None, None, 0, wanted, "share")
    return Measure(name, hits / number, *wilson(hits, number), number, wanted, "share")


def _middle(name: str, values: "pd.Series[float]", wanted: str, middle: Any = np.median) -> Measure:
    """A median or mean with a bootstrap interval."""
    numbers = values.dropna().to_numpy(dtype=np.float64)
    if not len(numbers):
        return Measure(name, None, None, None, 0, wanted)
    draws = np.random.default_rng(0).choice(numbers, (1000, len(numbers)))
    ends = np.quantile(middle(draws, axis=1), [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Measure(name, float(middle(numbers)), float(ends[0]), float(ends[1]), len(numbers), wanted)


def _longest(name: str, seconds: "pd.Series[float]") -> Measure:
    known = seconds.dropna()
    return Measure(name, float(known.max()) if len(known) else None, None, None, len(known), "", "s")
