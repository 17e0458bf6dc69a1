"""The measures of a set, each with how often it was counted and an interval."""

from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from concealed.score.rows import Rows

CONFIDENCE = 0.95
ABOVE = 3.0  # detection limits: what is expected to be named
BINS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, np.inf)


@dataclass(frozen=True)
class Measure:
    """A figure, its interval (None for a median without one), how many it was counted on, and what is wanted."""

    name: str
    value: float | None
    low: float | None
    high: float | None
    number: int
    wanted: str


def wilson(hits: int, number: int) -> tuple[float, float]:
    """Wilson's score interval of a share (1927)."""
    if number == 0:
        return 0.0, 1.0
    z = float(norm.ppf((1 + CONFIDENCE) / 2))
    share, spread = hits / number, z**2 / number
    middle = (share + spread / 2) / (1 + spread)
    half = z / (1 + spread) * np.sqrt(share * (1 - share) / number + spread / (4 * number))
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def measures(rows: Rows, tier: str) -> list[Measure]:
    """All measures of one tier."""
    cases, effects, claims, parameters = (
        frame[frame["tier"] == tier] for frame in (rows.cases, rows.effects, rows.claims, rows.parameters)
    )
    nulls, decoys = (cases[cases["kind"] == kind] for kind in ("null", "decoy"))
    inside, outside = effects[~effects["outside"].astype(bool)], effects[effects["outside"].astype(bool)]
    large, unknown = (each[each["multiple"] > ABOVE] for each in (inside, outside))
    named = inside[inside["named_first"].astype(bool)]
    classed = inside[inside["named_class"].astype(bool)]
    beyond = claims[~claims["category"].isin(["background"])]
    covered = parameters["covered"].dropna()
    return [
        _share("false claims on nulls", nulls["false_claims"] > 0, "at most 2 %"),
        _share("false claims on decoys", decoys["false_claims"] > 0, "at most 2 %"),
        _share("unknown said on nulls and decoys", pd.concat([nulls, decoys])["false_unknown"], ""),
        _share("wrong names among claims", claims["category"].isin(["wrong"]), "at most 5 %"),
        _share("wrong names among claims beyond background", beyond["category"].isin(["wrong"]), ""),
        _share("misplaced among claims", claims["category"].isin(["misplaced"]), ""),
        _share(f"right name or class of four, above {ABOVE:g} limits", large["named_class"], "at least 90 %"),
        _share(f"right first name, above {ABOVE:g} limits", large["named_first"], ""),
        _share("right first name, all sizes", inside["named_first"], ""),
        _share("right joint, given a right name", named["right_joint"], "at least 98 %"),
        _median("class size where the class is right (mean)", classed["class_size"], "", np.mean),
        _median("gap closed on held-out runs (median)", cases["gap_closed"].dropna(), "at least 0.9", np.median),
        _share(f"unknown on effects outside, above {ABOVE:g} limits", unknown["named_first"], "at least 80 %"),
        _share("95 % intervals that hold the truth", covered, "90-98 %"),
        _median("relative parameter error (median)", parameters["relative_error"].dropna(), "", np.median),
        _median("seconds a case (median)", cases["seconds"].dropna(), "", np.median),
        _share("missing or invalid verdicts", cases["status"] == "invalid", "none"),
    ]


def detection(rows: Rows, tier: str) -> pd.DataFrame:
    """Share named against size, a row a bin: edges, number, shares and Wilson intervals."""
    effects = rows.effects[(rows.effects["tier"] == tier) & ~rows.effects["outside"].astype(bool)]
    out: list[dict[str, Any]] = []
    for low, high in pairwise(BINS):
        chosen = effects[(effects["multiple"] > low) & (effects["multiple"] <= high)]
        for what in ("named_first", "named_class"):
            share = _share(what, chosen[what], "")
            out.append(
                {"from": low, "to": high, **{key: value for key, value in asdict(share).items() if key != "wanted"}}
            )
    return pd.DataFrame(out)


def by_effect(rows: Rows, tier: str) -> pd.DataFrame:
    """Share named above three limits and the number of wrong claims of each effect."""
    effects = rows.effects[rows.effects["tier"] == tier]
    wrong = rows.claims[(rows.claims["tier"] == tier) & rows.claims["category"].isin(["wrong", "misplaced"])]
    out = []
    for name in sorted(set(effects["effect"]) | set(wrong["effect"])):
        own = effects[effects["effect"] == name]
        large = own[own["multiple"] > ABOVE]
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


def confusion(rows: Rows, tier: str) -> pd.DataFrame:
    """Counts: what was hidden (rows) against what was said (columns); nulls and decoys in the last row."""
    effects = rows.effects[rows.effects["tier"] == tier]
    empty = rows.cases[(rows.cases["tier"] == tier) & rows.cases["kind"].isin(["null", "decoy"])]
    false = rows.claims[rows.claims["case"].isin(empty["case"]) & rows.claims["category"].isin(["wrong", "unknown"])]
    first = false.drop_duplicates("case").set_index("case")["effect"]
    said = [str(first.get(case, "none")) for case in empty["case"]]
    hidden = [*effects["effect"], *["nothing"] * len(said)]
    return pd.crosstab(pd.Series(hidden, name="hidden"), pd.Series([*effects["answered"], *said], name="said"))


def _share(name: str, flags: "pd.Series[Any]", wanted: str) -> Measure:
    hits, number = int(flags.astype(bool).sum()), len(flags)
    low, high = wilson(hits, number)
    return Measure(
        name, hits / number if number else None, low if number else None, high if number else None, number, wanted
    )


def _median(name: str, values: "pd.Series[float]", wanted: str, middle: Any) -> Measure:
    """A median or mean with a bootstrap interval."""
    numbers = np.asarray(values, dtype=np.float64)
    if not len(numbers):
        return Measure(name, None, None, None, 0, wanted)
    draws = np.random.default_rng(0).choice(numbers, (1000, len(numbers)))
    ends = np.quantile(middle(draws, axis=1), [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Measure(name, float(middle(numbers)), float(ends[0]), float(ends[1]), len(numbers), wanted)
