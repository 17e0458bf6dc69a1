"""The measures of a set with their intervals, and the tables: detection by size, by effect, by arm, and confusion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import fisher_exact

from armlab.common.arrays import Array
from armlab.common.statistics import wilson_interval
from armlab.proof.blind.score.cases import RIGHT_CATEGORIES, UNKNOWN_NAME
from armlab.proof.blind.score.rows import ScoreRows

CONFIDENCE_LEVEL = 0.95
MIN_NAMED_MULTIPLE = 3.0  # detection limits: what is expected to be named
WANTED_BOUNDS = {
    "at most 2 %": (0.0, 0.02),
    "at most 5 %": (0.0, 0.05),
    "at least 80 %": (0.8, 1.0),
    "at least 85 %": (0.85, 1.0),
    "at least 90 %": (0.9, 1.0),
    "at least 95 %": (0.95, 1.0),
    "at least 98 %": (0.98, 1.0),
    "90-98 %": (0.9, 0.98),
    "at least 0.9": (0.9, np.inf),
    "above 0": (0.0, np.inf),
    "none": (0.0, 0.0),
    "within 50-70 %": (0.5, 0.7),
    "within 70-90 %": (0.7, 0.9),
    "within 90-100 %": (0.9, 1.0),
}
NAMES_WANTED = {  # right name or class
    "clean": "at least 90 %",
    "realistic": "at least 85 %",
    "motion": "at least 85 %",
    "setup": "at least 95 %",
}
WITHIN = "within "  # of a bound that the interval of a figure has to reach
RELIABILITY_BINS = {  # of the stated probability: from, and below
    "right_when_doubtful": (0.5, 0.7),
    "right_when_likely": (0.7, 0.9),
    "right_when_sure": (0.9, np.inf),
}
Unit = Literal["share", "s", ""]


@dataclass(frozen=True)
class Measure:
    """A figure of a score.

    id: a key of `MEASURE_TEXTS`. low, high: its 95 % interval, None where it has none. number: how many items it was
    counted on. wanted: a key of `WANTED_BOUNDS`, empty where nothing is wanted.
    """

    id: str
    value: float | None
    low: float | None
    high: float | None
    number: int
    wanted: str
    unit: Unit = ""

    @property
    def title(self) -> str:
        """What pages print for the id."""
        return MEASURE_TEXTS[self.id].title

    @property
    def is_met(self) -> bool | None:
        """Whether the figure is as wanted; None where nothing is wanted, or nothing was counted."""
        if not self.wanted or self.value is None:
            return None
        least, most = WANTED_BOUNDS[self.wanted]
        if self.wanted.startswith(WITHIN) and self.low is not None and self.high is not None:
            return least <= self.high and self.low <= most
        return least <= self.value <= most

    @property
    def is_certain(self) -> bool:
        """True where the whole interval agrees with what `met` says of the figure."""
        if not self.wanted or self.low is None or self.high is None or self.wanted == "none":
            return True
        least, most = WANTED_BOUNDS[self.wanted]
        return least <= self.low and self.high <= most if self.is_met else self.high < least or self.low > most


@dataclass(frozen=True)
class MeasureText:
    """What pages print about a measure: its title, and what is wanted of it."""

    title: str
    wanted: str = ""


ABOVE = f"above {MIN_NAMED_MULTIPLE:g} limits"
MEASURE_TEXTS = {
    "false_claims_on_nulls": MeasureText("nulls with a false claim", "at most 2 %"),
    "false_claims_on_decoys": MeasureText("decoys with a false claim", "at most 2 %"),
    "false_unknown": MeasureText("nulls and decoys with something `unknown`"),
    "wrong_names": MeasureText("wrong names among claims"),
    "wrong_names_beyond_background": MeasureText("wrong names among claims beyond background", "at most 5 %"),
    "wrong_names_of_named": MeasureText("the same among those that have a name, not `unknown`"),
    "wrong_first_names": MeasureText("claims beyond background whose first name is wrong, classes included"),
    "false_of_any_kind": MeasureText("false claims beyond background, also `unknown` where everything has a name"),
    "parts_of_laws": MeasureText("names of a part of what is hidden, or of what no motion separates from it"),
    "right_when_doubtful": MeasureText("right among names of probability 0.5-0.7", "within 50-70 %"),
    "right_when_likely": MeasureText("right among names of probability 0.7-0.9", "within 70-90 %"),
    "right_when_sure": MeasureText("right among names of probability 0.9-1", "within 90-100 %"),
    "stated_when_sure": MeasureText("probability stated of these (mean)"),
    "brier_skill": MeasureText("Brier skill of probabilities", "above 0"),
    "log_skill": MeasureText("log skill of probabilities", "above 0"),
    "misplaced": MeasureText("misplaced among claims"),
    "right_name_or_class": MeasureText(f"right name or class of four, {ABOVE}", "at least 90 %"),
    "right_name": MeasureText(f"right first name, {ABOVE}"),
    "right_name_all_sizes": MeasureText("right first name, all sizes"),
    "right_joint": MeasureText("right joint, given a right name", "at least 98 %"),
    "class_size": MeasureText("class size where the class is right (mean)"),
    "gap_closed": MeasureText("gap closed on held-out runs (median)", "at least 0.9"),
    "gap_closed_beyond_friction": MeasureText("gap closed beyond plain friction (median)"),
    "unknown_outside": MeasureText(f"unknown on effects outside, {ABOVE}", "at least 80 %"),
    "left_outside": MeasureText("&nbsp;&nbsp;the same, or told as what is left at its joint"),
    "interval_coverage": MeasureText("95 % intervals that hold the truth", "90-98 %"),
    "interval_coverage_hidden": MeasureText("the same of hidden effects alone", "90-98 %"),
    "parameter_error": MeasureText("relative parameter error (median)"),
    "seconds_median": MeasureText("seconds a case (median)"),
    "seconds_longest": MeasureText("seconds a case (longest)"),
    "missing_verdicts": MeasureText("missing or invalid verdicts", "none"),
}


def compute_measures(rows: ScoreRows, tier: str) -> list[Measure]:
    """All measures of one tier, in the order of `MEASURE_TEXTS`."""
    cases = rows.cases[rows.cases["tier"] == tier]
    claims = rows.claims[rows.claims["tier"] == tier]
    parameters = rows.parameters[rows.parameters["tier"] == tier]
    nulls, decoys = cases[cases["kind"] == "null"], cases[cases["kind"] == "decoy"]
    inside, outside = split_tier(rows.effects, tier)
    large = inside[inside["multiple"] > MIN_NAMED_MULTIPLE]
    large_outside = outside[outside["multiple"] > MIN_NAMED_MULTIPLE]
    named = inside[inside["named_first"].astype(bool)]
    classed = inside[inside["named_class"].astype(bool)]
    wrong, beyond = is_wrong_name(claims), claims["category"] != "background"
    false_first, unneeded = is_wrong_first_name(claims), claims["category"] == "unknown"
    hidden = parameters[parameters["hidden_as"] == "injected"]
    return [
        share_measure("false_claims_on_nulls", nulls["false_claims"] > 0),
        share_measure("false_claims_on_decoys", decoys["false_claims"] > 0),
        share_measure("false_unknown", pd.concat([nulls, decoys])["false_unknown"]),
        share_measure("wrong_names", wrong),
        *wrong_name_measures(claims[beyond]),
        share_measure("wrong_first_names", false_first[beyond]),
        share_measure("false_of_any_kind", (false_first | unneeded)[beyond]),
        share_measure("parts_of_laws", (claims["category"] == "identical")[beyond]),
        *reliability_measures(claims[beyond]),
        share_measure("misplaced", claims["category"] == "misplaced"),
        replace(share_measure("right_name_or_class", large["named_class"]), wanted=NAMES_WANTED[tier]),
        share_measure("right_name", large["named_first"]),
        share_measure("right_name_all_sizes", inside["named_first"]),
        share_measure("right_joint", named["right_joint"]),
        middle_measure("class_size", classed["class_size"], np.mean),
        middle_measure("gap_closed", cases["gap_closed"]),
        middle_measure("gap_closed_beyond_friction", cases["gap_closed_beyond_friction"]),
        share_measure("unknown_outside", large_outside["named_first"]),
        share_measure("left_outside", large_outside["told_as_left"]),
        share_measure("interval_coverage", parameters["covered"].dropna()),
        share_measure("interval_coverage_hidden", hidden["covered"].dropna()),
        middle_measure("parameter_error", parameters["relative_error"]),
        replace(middle_measure("seconds_median", cases["seconds"]), unit="s"),
        longest_measure("seconds_longest", cases["seconds"]),
        share_measure("missing_verdicts", cases["status"] == "invalid"),
    ]


def is_wrong_name(claims: pd.DataFrame) -> "pd.Series[bool]":
    """Which claims are names, or classes of names, none of which is there."""
    return (claims["category"] == "wrong") & ~claims["class_right"].astype(bool)


def wrong_name_measures(claims: pd.DataFrame) -> list[Measure]:
    """Wrong names among claims beyond background, and among those of them that have a name."""
    wrong = is_wrong_name(claims)
    of_named = share_measure("wrong_names_of_named", wrong[claims["effect"] != UNKNOWN_NAME])
    return [share_measure("wrong_names_beyond_background", wrong), of_named]


def is_wrong_first_name(claims: pd.DataFrame) -> "pd.Series[bool]":
    """Which claims have a first name that is not there, or not at its place, though another one of the class may be."""
    return claims["category"].isin(["wrong", "misplaced"])


def is_right_name(claims: pd.DataFrame) -> "pd.Series[bool]":
    """Which claims have a first name that is there; `unknown` is right where an effect outside the library is."""
    return claims["category"].isin(RIGHT_CATEGORIES)


def reliability_measures(claims: pd.DataFrame) -> list[Measure]:
    """How often claims are right of which a probability says how often they should be; claims without one are left out.

    The base rate is the share of right names among the same claims.
    """
    stated = claims[claims["probability"].notna()]
    chances, right = stated["probability"].to_numpy(dtype=np.float64), is_right_name(stated)
    bins = RELIABILITY_BINS.items()
    out = [share_measure(id, right[(chances >= low) & (chances < high)]) for id, (low, high) in bins]
    hits = np.asarray(right, dtype=np.float64)
    base = np.full(len(hits), np.mean(hits)) if len(hits) else hits
    sure = pd.Series(chances[chances >= RELIABILITY_BINS["right_when_sure"][0]])
    out.append(middle_measure("stated_when_sure", sure, np.mean))
    brier = skill_measure("brier_skill", (chances - hits) ** 2, (base - hits) ** 2)
    return [*out, brier, skill_measure("log_skill", log_scores(chances, hits), log_scores(base, hits))]


def reliability_table(rows: ScoreRows, tier: str) -> pd.DataFrame:
    """A row a bin of the stated probability of claims beyond background: mean, share that is right, its interval."""
    claims = rows.claims[(rows.claims["tier"] == tier) & (rows.claims["category"] != "background")]
    stated = claims[claims["probability"].notna()]
    chances, right = stated["probability"].astype(float), is_right_name(stated)
    out = []
    for low, high in ((0.0, 0.5), *RELIABILITY_BINS.values()):
        own = (chances >= low) & (chances < high)
        number, hits = int(own.sum()), int(right[own].sum())
        if number:
            ends = wilson_interval(hits, number, CONFIDENCE_LEVEL)
            out.append((float(chances[own].mean()), hits / number, *ends, number))
    return pd.DataFrame(out, columns=["mean", "share", "low", "high", "number"])


LEAST_CHANCE = 1e-3  # of a log score: what never happened is no proof that it never will


def log_scores(chances: Array, hits: Array) -> Array:
    """The logarithm of the probability of what is true, negative, of each claim."""
    bounded = np.clip(chances, LEAST_CHANCE, 1 - LEAST_CHANCE)
    return np.asarray(-np.log(np.where(hits > 0, bounded, 1 - bounded)))


def skill_measure(id: str, scores: Array, base: Array) -> Measure:
    """The share by which the mean of scores, small ones good, is below that of a base; with a bootstrap interval."""
    wanted, count = MEASURE_TEXTS[id].wanted, len(scores)
    if not count or not np.any(base):
        return Measure(id, None, None, None, count, wanted)
    chosen = np.random.default_rng(0).integers(0, count, (1000, count))
    with np.errstate(divide="ignore", invalid="ignore"):
        skills = 1 - np.mean(scores[chosen], axis=1) / np.mean(base[chosen], axis=1)
    tail = (1 - CONFIDENCE_LEVEL) / 2
    low, high = np.quantile(skills[np.isfinite(skills)], [tail, 1 - tail])
    return Measure(id, float(1 - np.mean(scores) / np.mean(base)), float(low), float(high), count, wanted)


def split_tier(effects: pd.DataFrame, tier: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Hidden effects of the library in a tier, and those outside."""
    own = effects[effects["tier"] == tier]
    outside = own["outside"].astype(bool)
    return own[~outside], own[outside]


def share_measure(id: str, flags: "pd.Series[Any]") -> Measure:
    """A share with Wilson's interval."""
    wanted, hits, number = MEASURE_TEXTS[id].wanted, int(flags.astype(bool).sum()), len(flags)
    if not number:
        return Measure(id, None, None, None, 0, wanted, "share")
    low, high = wilson_interval(hits, number, CONFIDENCE_LEVEL)
    return Measure(id, hits / number, low, high, number, wanted, "share")


def middle_measure(id: str, values: "pd.Series[float]", middle: Callable[..., Any] = np.median) -> Measure:
    """A median or mean with a bootstrap interval."""
    wanted, numbers = MEASURE_TEXTS[id].wanted, values.dropna().to_numpy(dtype=np.float64)
    if not len(numbers):
        return Measure(id, None, None, None, 0, wanted)
    draws = np.random.default_rng(0).choice(numbers, (1000, len(numbers)))
    ends = np.quantile(middle(draws, axis=1), [(1 - CONFIDENCE_LEVEL) / 2, (1 + CONFIDENCE_LEVEL) / 2])
    value = float(middle(numbers))
    return Measure(id, value, float(ends[0]), float(ends[1]), len(numbers), wanted)


def longest_measure(id: str, seconds: "pd.Series[float]") -> Measure:
    """The longest time, which has no interval."""
    wanted, known = MEASURE_TEXTS[id].wanted, seconds.dropna()
    longest = float(known.max()) if len(known) else None
    return Measure(id, longest, None, None, len(known), wanted, "s")


SIZE_BINS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, np.inf)  # detection limits
COARSE_SIZE_BINS = (0.0, 1.0, 3.0, 10.0, np.inf)  # for the few cases that one effect has
NOTHING_HIDDEN = "nothing"
SHARE_COLUMNS = ["from", "to", "name", "value", "low", "high", "number"]


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
            hits, number = int(chosen[flag].astype(bool).sum()), len(chosen)
            ends = wilson_interval(hits, number, CONFIDENCE_LEVEL) if number else (None, None)
            share = hits / number if number else None
            out.append(dict(zip(SHARE_COLUMNS, (low, high, name, share, *ends, number), strict=True)))
    return pd.DataFrame(out, columns=SHARE_COLUMNS)


def effect_table(rows: ScoreRows, tier: str) -> pd.DataFrame:
    """Share named above three limits and the number of wrong claims of each effect."""
    effects = rows.effects[rows.effects["tier"] == tier]
    false = rows.claims["category"].isin(["wrong", "misplaced"]) & ~rows.claims["class_right"].astype(bool)
    wrong = rows.claims[(rows.claims["tier"] == tier) & false]
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


EFFECTS_WITH_PARTS = ("joint_elasticity", "backlash", "flexible_base", "slosh")  # of the first engine alone


def engine_table(rows: ScoreRows) -> pd.DataFrame:
    """What is wanted, of each tier, by the second engine and by the first one; empty without a case of the second.

    Effects with parts of their own, and the cases that hide one, are left out.
    """
    if "engine" not in rows.cases or "sticking" not in set(rows.cases["engine"]):
        return pd.DataFrame()
    parted = rows.effects[rows.effects["effect"].isin(EFFECTS_WITH_PARTS)]["case"]
    cases, effects, claims = (each[~each["case"].isin(parted)] for each in (rows.cases, rows.effects, rows.claims))
    whole = replace(rows, cases=cases, effects=effects, claims=claims)
    out = []
    for tier in sorted(set(rows.cases["tier"])):
        for name, flags in _compared_flags(whole, tier).items():
            counts = [(int(each.astype(bool).sum()), len(each)) for each in (flags["sticking"], flags["mujoco"])]
            chance = float(fisher_exact([[hits, number - hits] for hits, number in counts]).pvalue)
            out.append([tier, name, *(f"{hits} of {number}" for hits, number in counts), chance])
    return pd.DataFrame(out, columns=["tier", "measure", "second engine", "MuJoCo", "by chance"])


def _compared_flags(rows: ScoreRows, tier: str) -> dict[str, dict[str, "pd.Series[Any]"]]:
    """The flags behind each share that is compared, by engine."""
    cases, claims = (each[each["tier"] == tier] for each in (rows.cases, rows.claims))
    inside, outside = split_tier(rows.effects, tier)
    nulls, beyond = cases[cases["kind"] == "null"], claims[claims["category"] != "background"]
    large, large_outside = (each[each["multiple"] > MIN_NAMED_MULTIPLE] for each in (inside, outside))
    frames = {
        "false_claims_on_nulls": (nulls, nulls["false_claims"] > 0),
        "wrong_names_beyond_background": (beyond, is_wrong_name(beyond)),
        "right_name_or_class": (large, large["named_class"]),
        "unknown_outside": (large_outside, large_outside["named_class"]),
    }
    return {
        MEASURE_TEXTS[id].title: {engine: flags[frame["engine"] == engine] for engine in ("sticking", "mujoco")}
        for id, (frame, flags) in frames.items()
    }


def confusion_table(rows: ScoreRows, tier: str, above: float = 0.0) -> pd.DataFrame:
    """Counts: what was hidden (rows) against what was said (columns); nulls and decoys in the last row.

    above: detection limits, of the effects that are counted.
    """
    effects = rows.effects[(rows.effects["tier"] == tier) & (rows.effects["multiple"] > above)]
    empty = rows.cases[(rows.cases["tier"] == tier) & rows.cases["kind"].isin(["null", "decoy"])]
    wrong = rows.claims["category"].isin(["wrong", "unknown"]) & ~rows.claims["class_right"].astype(bool)
    false = rows.claims[rows.claims["case"].isin(empty["case"]) & wrong]
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
