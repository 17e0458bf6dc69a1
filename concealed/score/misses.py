"""Misses, one by one: every effect that should have been named and was not, and every wrong claim."""

from collections.abc import Sequence

import pandas as pd

from concealed.score.outcomes import GROUPS, outcomes
from concealed.score.reading import Judged
from concealed.score.rows import Rows
from concealed.score.words import hidden_names, hidden_words, said_names, said_words

COLUMNS = ["miss", "case", "tier", "kind", "arm", "rate_hz", "noise", "effect", "law", "joint", "limits", "answered"]

GAPS = ["gap_closed", "gap_closed_beyond_friction"]

IN_WORDS = {"hidden": hidden_names, "said": said_names, "hidden_in_full": hidden_words, "said_in_full": said_words}


def misses(cases: Sequence[Judged], table: Rows) -> pd.DataFrame:
    """A row a miss, in the order of the groups, then of the cases.

    effect, joint: what was missed, or what was wrongly claimed. law: of a missed effect. answered: what was said of a
    missed effect, or how a wrong claim was counted. hidden, said: of the whole case, in words. Gaps: see `gap`.
    """
    found = outcomes(table)
    failures = [group for group, about in GROUPS.items() if not about.success]
    found = found[found["group"].isin(failures)].rename(columns={"group": "miss"})
    found["miss"] = pd.Categorical(found["miss"], failures)
    found = found.sort_values("miss", kind="stable").astype({"miss": str})
    known = {case.name: case for case in cases}
    own = [known[name] for name in found["case"]]
    found["rate_hz"] = [case.truth.get("rate_hz") for case in own]
    for column, words in IN_WORDS.items():
        found[column] = [words(case) for case in own]
    found["law"] = [_law(case, effect) for case, effect in zip(own, found["effect"], strict=True)]
    found = found.merge(table.cases[["case", "arm", "noise", *GAPS]], on="case", how="left")
    return found[[*COLUMNS, *GAPS, *IN_WORDS]]


def _law(case: Judged, effect: str) -> str:
    """The law behind a hidden effect; empty for a claim of something that is not there."""
    return next((str(each["form"]) for each in case.truth["injected"] if each["effect"] == effect), "")
