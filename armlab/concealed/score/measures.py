"""The measures of a set with their intervals, and the tables: detection by size, by effect, by arm, and confusion."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pandas as pd

from armlab.common.statistics import wilson_interval
from armlab.concealed.score.rows import ScoreRows

CONFIDENCE_LEVEL = 0.95
MIN_NAMED_MULTIPLE = 3.0  # detection limits: what is expected to be named
WANTED_BOUNDS = {
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
    def is_met(self) -> bool | None:
        """Whether the figure is as wanted; None where nothing is wanted, or nothing was counted."""
        if not self.wanted or self.value is None:
            return None
        least, most = WANTED_BOUNDS[self.wanted]
        return least <= self.value <= most

    @property
    def is_certain(self) -> bool:
        """True where the whole interval agrees with what `met` says of the figure."""
        if not self.wanted or self.low is None or self.high is None or self.wanted == "none":
            return True
        least, most = WANTED_BOUNDS[self.wanted]
        return least <= self.low and self.high <= most if self.is_met else self.high < least or self.low > most


def compute_measures(rows: ScoreRows, tier: str) -> list[Measure]:
    """All measures of one tier."""
    cases, claims, parameters = (frame[frame["tier"] == tier] for frame in (rows.cases, rows.claims, rows.parameters))
    nulls, decoys = (cases[cases["kind"] == kind] for kind in ("null", "decoy"))
    inside, outside = split_tier(rows.effects, tier)
    large, unknown = (each[each["multiple"] > MIN_NAMED_MULTIPLE] for each in (inside, outside))
    named = inside[inside["named_first"].astype(bool)]
    classed = inside[inside["named_class"].astype(bool)]
    beyond = claims[~claims["category"].isin(["background"])]
    covered = parameters["covered"].dropna()
    return [
        share_measure("false claims on nulls", nulls["false_claims"] > 0, "at most 2 %"),
        share_measure("false claims on decoys", decoys["false_claims"] > 0, "at most 2 %"),
        share_measure("unknown said on nulls and decoys", pd.concat([nulls, decoys])["false_unknown"], ""),
        share_measure("wrong names among claims", claims["category"].isin(["wrong"]), "at most 5 %"),
        share_measure("wrong names among claims beyond background", beyond["category"].isin(["wrong"]), ""),
        share_measure("misplaced among claims", claims["category"].isin(["misplaced"]), ""),
        share_measure(
            f"right name or class of four, above {MIN_NAMED_MULTIPLE:g} limits", large["named_class"], "at least 90 %"
        ),
        share_measure(f"right first name, above {MIN_NAMED_MULTIPLE:g} limits", large["named_first"], ""),
        share_measure("right first name, all sizes", inside["named_first"], ""),
        share_measure("right joint, given a right name", named["right_joint"], "at least 98 %"),
        _middle_measure("class size where the class is right (mean)", classed["class_size"], "", np.mean),
        _middle_measure("gap closed on held-out runs (median)", cases["gap_closed"], "at least 0.9"),
        _middle_measure("gap closed beyond plain friction (median)", cases["gap_closed_beyond_friction"], ""),
        share_measure(
            f"unknown on effects outside, above {MIN_NAMED_MULTIPLE:g} limits", unknown["named_first"], "at least 80 %"
        ),
        share_measure("95 % intervals that hold the truth", covered, "90-98 %"),
        _middle_measure("relative parameter error (median)", parameters["relative_error"], ""),
        replace(_middle_measure("seconds a case (median)", cases["seconds"], ""), unit="s"),
        _longest_measure("seconds a case (longest)", cases["seconds"]),
        share_measure("missing or invalid verdicts", cases["status"] == "invalid", "none"),
    ]


def split_tier(effects: pd.DataFrame, tier: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Hidden effects of the library in a tier, and those outside."""
    own = effects[effects["tier"] == tier]
    outside = own["outside"].astype(bool)
    return own[~outside], own[outside]


def share_measure(name: str, flags: "pd.Series[Any]", wanted: str) -> Measure:
    """A share with Wilson's interval."""
    hits, number = int(flags.astype(bool).sum()), len(flags)
    if not number:
        return Measure(name, None, None, None, 0, wanted, "share")
    return Measure(name, hits / number, *wilson_interval(hits, number, CONFIDENCE_LEVEL), number, wanted, "share")


def _middle_measure(name: str, values: "pd.Series[float]", wanted: str, middle: Any = np.median) -> Measure:
    """A median or mean with a bootstrap interval."""
    numbers = values.dropna().to_numpy(dtype=np.float64)
    if not len(numbers):
        return Measure(name, None, None, None, 0, wanted)
    draws = np.random.default_rng(0).choice(numbers, (1000, len(numbers)))
    ends = np.quantile(middle(draws, axis=1), [(1 - CONFIDENCE_LEVEL) / 2, (1 + CONFIDENCE_LEVEL) / 2])
    return Measure(name, float(middle(numbers)), float(ends[0]), float(ends[1]), len(numbers), wanted)


def _longest_measure(name: str, seconds: "pd.Series[float]") -> Measure:
    known = seconds.dropna()
    return Measure(name, float(known.max()) if len(known) else None, None, None, len(known), "", "s")


SIZE_BINS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, np.inf)  # detection limits
COARSE_SIZE_BINS = (0.0, 1.0, 3.0, 10.0, np.inf)  # for the few cases that one effect has
NOTHING_HIDDEN = "nothing"
MEASURE_COLUMNS = ("name", "value", "low", "high", "number")


def detection_table(rows: ScoreRows, tier: str) -> pd.DataFrame:
    """Share named against size, a row a bin: edges, number, shares and Wilson intervals.

    `named_first` and `named_class` are of the effects of the library, `called_unknown` of those outside.
    """
    inside, outside = split_tier(rows.effects, tier)
    curves = (("named_first", inside, "named_first"), ("named_class", inside, "named_class"))
    return _bin_shares((*curves, ("called_unknown", outside, "named_first")), SIZE_BINS)


def detection_table_by_effect(rows: ScoreRows) -> pd.DataFrame:
    """The same for each effect, both tiers together, in wider bins: the right class, or `unknown` outside."""
    effects = rows.effects
    names = effects.sort_values(["outside", "effect"])["effect"].drop_duplicates()
    curves = [(str(name), effects[effects["effect"] == name], "named_class") for name in names]
    return _bin_shares(curves, COARSE_SIZE_BINS).rename(columns={"name": "effect"})


def _bin_shares(curves: Sequence[tuple[str, pd.DataFrame, str]], bins: tuple[float, ...]) -> pd.DataFrame:
    """A row a bin and curve (its name, its effects, the flag that is counted)."""
    out: list[dict[str, Any]] = []
    for low, high in pairwise(bins):
        for name, effects, flag in curves:
            chosen = effects[(effects["multiple"] > low) & (effects["multiple"] <= high)]
            counted = asdict(share_measure(name, chosen[flag], ""))
            out.append({"from": low, "to": high, **{key: counted[key] for key in MEASURE_COLUMNS}})
    return pd.DataFrame(out, columns=["from", "to", *MEASURE_COLUMNS])


def effect_table(rows: ScoreRows, tier: str) -> pd.DataFrame:
    """Share named above three limits and the number of wrong claims of each effect."""
    effects = rows.effects[rows.effects["tier"] == tier]
    wrong = rows.claims[(rows.claims["tier"] == tier) & rows.claims["category"].isin(["wrong", "misplaced"])]
    out = []
    for name in sorted(set(effects["effect"]) | set(wrong["effect"])):
        own = effects[effects["effect"] == name]
        large = own[own["multiple"] > MIN_NAMED_MULTIPLE]
        out.append(
            {
                "effect": name,
                "hidden": len(own),
                "above": len(large),
                "first": int(large["named_first"].astype(bool).sum()),
                "class": int(large["named_class"].astype(bool).sum()),
                "wrong_claims": int((wrong["effect"] == name).sum()),
            }
        )
    return pd.DataFrame(out, columns=["effect", "hidden", "above", "first", "class", "wrong_claims"])


def confusion_table(rows: ScoreRows, tier: str, above: float = 0.0) -> pd.DataFrame:
    """Counts: what was hidden (rows) against what was said (columns); nulls and decoys in the last row.

    above: detection limits, of the effects that are counted.
    """
    effects = rows.effects[(rows.effects["tier"] == tier) & (rows.effects["multiple"] > above)]
    empty = rows.cases[(rows.cases["tier"] == tier) & rows.cases["kind"].isin(["null", "decoy"])]
    false = rows.claims[rows.claims["case"].isin(empty["case"]) & rows.claims["category"].isin(["wrong", "unknown"])]
    first = false.drop_duplicates("case").set_index("case")["effect"]
    silent = ["invalid" if status == "invalid" else "none" for status in empty["status"]]
    said = [str(first.get(case, what)) for case, what in zip(empty["case"], silent, strict=True)]
    hidden = [*effects["effect"], *[NOTHING_HIDDEN] * len(said)]
    return pd.crosstab(pd.Series(hidden, name="hidden"), pd.Series([*effects["answered"], *said], name="said"))


def arm_table(rows: ScoreRows) -> pd.DataFrame:
    """How each arm went: cases, effects of the library above three limits with the right class, false claims, time."""
    large = rows.effects[(rows.effects["multiple"] > MIN_NAMED_MULTIPLE) & ~rows.effects["outside"].astype(bool)]
    out = []
    for arm, cases in rows.cases.groupby("arm", sort=True):
        own = large[large["arm"] == arm]
        seconds = cases["seconds"].dropna()
        out.append(
            {
                "arm": arm,
                "cases": len(cases),
                "effects above 3 limits": len(own),
                "right name or class": int(own["named_class"].astype(bool).sum()),
                "cases with a false claim": int((cases["false_claims"] > 0).sum()),
                "seconds, median": round(float(seconds.median()), 1) if len(seconds) else None,
                "seconds, longest": round(float(seconds.max()), 1) if len(seconds) else None,
            }
        )
    return pd.DataFrame(out)
