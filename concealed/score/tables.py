"""Tables of a set: names against size and by effect, what was said of what was hidden, how each arm went."""

from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from concealed.score.measures import ABOVE, in_tier, share
from concealed.score.rows import Rows

BINS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, np.inf)  # detection limits
COARSE_BINS = (0.0, 1.0, 3.0, 10.0, np.inf)  # for the few cases that one effect has
NOTHING = "nothing"
SHOWN = ("name", "value", "low", "high", "number")


def detection(rows: Rows, tier: str) -> pd.DataFrame:
    """Share named against size, a row a bin: edges, number, shares and Wilson intervals.

    `named_first` and `named_class` are of the effects of the library, `called_unknown` of those outside.
    """
    inside, outside = in_tier(rows.effects, tier)
    curves = (("named_first", inside, "named_first"), ("named_class", inside, "named_class"))
    return _binned((*curves, ("called_unknown", outside, "named_first")), BINS)


def detection_by_effect(rows: Rows) -> pd.DataFrame:
    """The same for each effect, both tiers together, in wider bins: the right class, or `unknown` outside."""
    effects = rows.effects
    names = effects.sort_values(["outside", "effect"])["effect"].drop_duplicates()
    curves = [(str(name), effects[effects["effect"] == name], "named_class") for name in names]
    return _binned(curves, COARSE_BINS).rename(columns={"name": "effect"})


def _binned(curves: Sequence[tuple[str, pd.DataFrame, str]], bins: tuple[float, ...]) -> pd.DataFrame:
    """A row a bin and curve (its name, its effects, the flag that is counted)."""
    out: list[dict[str, Any]] = []
    for low, high in pairwise(bins):
        for name, effects, flag in curves:
            chosen = effects[(effects["multiple"] > low) & (effects["multiple"] <= high)]
            counted = asdict(share(name, chosen[flag], ""))
            out.append({"from": low, "to": high, **{key: counted[key] for key in SHOWN}})
    return pd.DataFrame(out, columns=["from", "to", *SHOWN])


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


def confusion(rows: Rows, tier: str, above: float = 0.0) -> pd.DataFrame:
    """Counts: what was hidden (rows) against what was said (columns); nulls and decoys in the last row.

    above: detection limits, of the effects that are counted.
    """
    effects = rows.effects[(rows.effects["tier"] == tier) & (rows.effects["multiple"] > above)]
    empty = rows.cases[(rows.cases["tier"] == tier) & rows.cases["kind"].isin(["null", "decoy"])]
    false = rows.claims[rows.claims["case"].isin(empty["case"]) & rows.claims["category"].isin(["wrong", "unknown"])]
    first = false.drop_duplicates("case").set_index("case")["effect"]
    silent = ["invalid" if status == "invalid" else "none" for status in empty["status"]]
    said = [str(first.get(case, what)) for case, what in zip(empty["case"], silent, strict=True)]
    hidden = [*effects["effect"], *[NOTHING] * len(said)]
    return pd.crosstab(pd.Series(hidden, name="hidden"), pd.Series([*effects["answered"], *said], name="said"))


def by_arm(rows: Rows) -> pd.DataFrame:
    """How each arm went: cases, effects of the library above three limits with the right class, false claims, time."""
    large = rows.effects[(rows.effects["multiple"] > ABOVE) & ~rows.effects["outside"].astype(bool)]
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
