"""The outcome of each hidden effect, each case with nothing to name and each wrong claim; and the list of misses.

Every hidden effect above three detection limits is in exactly one of the groups `named`, `class`, `missed`,
`unknown` and `not unknown`, or, where its right name stands at a wrong joint, among the wrong claims. Every null and
decoy is in one of `silent`, `false claim`, `false unknown` and `no verdict`; there a false claim is an item of its
own. A class is a wrong claim where none of its names is there, as in the measures.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from armlab.proof.blind.score.cases import JudgedCase
from armlab.proof.blind.score.measures import MIN_NAMED_MULTIPLE
from armlab.proof.blind.score.rows import ScoreRows, to_records
from armlab.proof.blind.score.words import describe_hidden, describe_miss, describe_said, name_hidden, name_said


@dataclass(frozen=True)
class OutcomeGroup:
    """One kind of outcome: its title in a page, and whether it is a success."""

    title: str
    success: bool


OUTCOME_GROUPS = {
    "named": OutcomeGroup("Named at the right joint", True),
    "class": OutcomeGroup("Right name among at most four", True),
    "unknown": OutcomeGroup("Outside the library, and called unknown", True),
    "silent": OutcomeGroup("Nothing hidden, and nothing claimed", True),
    "missed": OutcomeGroup("Not named", False),
    "not unknown": OutcomeGroup("Outside the library, and not called unknown", False),
    "wrong claim": OutcomeGroup("Wrong, misplaced or needless claim beside something hidden", False),
    "false claim": OutcomeGroup("False claim where nothing is hidden", False),
    "false unknown": OutcomeGroup("Nothing hidden, and something left unexplained", False),
    "no verdict": OutcomeGroup("Nothing hidden, and no verdict", False),
}
OUTCOME_COLUMNS = ["group", "case", "tier", "kind", "effect", "joint", "limits", "answered"]


def list_outcomes(table: ScoreRows) -> pd.DataFrame:
    """A row an item, in the order of the cases.

    joint: where to look, missing for the whole arm. limits: the size of a hidden effect. answered: what was said of it.
    """
    effects, claims = _records_by_case(table.effects), _records_by_case(table.claims)
    rows: list[dict[str, Any]] = []
    for case in to_records(table.cases):
        about = {key: case[key] for key in ("case", "tier", "kind")}
        own = effects.get(case["case"], [])
        false = [each for each in claims.get(case["case"], []) if not each["class_right"]]
        items = _outcomes_with_hidden(own, false) if own else _outcomes_without_hidden(case, false)
        rows += [about | item for item in items]
    return pd.DataFrame(rows, columns=OUTCOME_COLUMNS).astype({"joint": "Int64"})


def _records_by_case(frame: pd.DataFrame) -> dict[str, list[dict[str, Any]]]:
    return {str(case): to_records(own) for case, own in frame.groupby("case", sort=False)}


def _outcomes_with_hidden(effects: list[dict[str, Any]], false: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for each in effects:
        group = _effect_group(each) if each["multiple"] > MIN_NAMED_MULTIPLE else None
        if group:
            about = {"effect": each["effect"], "joint": _joint_or_none(each), "limits": each["multiple"]}
            yield {"group": group, "answered": each["answered"], **about}
    yield from (_claim_item("wrong claim", each) for each in false)


def _effect_group(effect: dict[str, Any]) -> str | None:
    """The group of an effect; None where its right name stands at a wrong joint: a wrong claim then."""
    if effect["outside"]:
        return "unknown" if effect["named_first"] else "not unknown"
    if effect["named_first"]:
        return "named" if effect["right_joint"] else None
    return "class" if effect["named_class"] else "missed"


def _outcomes_without_hidden(case: dict[str, Any], false: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    if false:
        yield from (_claim_item("false claim", each) for each in false)
    else:
        kinds = {"no verdict": case["status"] == "invalid", "false unknown": case["false_unknown"]}
        group = next((kind for kind, holds in kinds.items() if holds), "silent")
        yield {"group": group, "answered": case["status"]}


def _claim_item(group: str, claim: dict[str, Any]) -> dict[str, Any]:
    return {"group": group, "effect": claim["effect"], "joint": _joint_or_none(claim), "answered": claim["category"]}


def _joint_or_none(row: dict[str, Any]) -> Any:
    return None if pd.isna(row["joint"]) else int(row["joint"])


MISS_COLUMNS = [
    "miss",
    "case",
    "tier",
    "kind",
    "arm",
    "rate_hz",
    "noise",
    "effect",
    "law",
    "joint",
    "limits",
    "answered",
    "why",
]

SHOWN_GAP_COLUMNS = ["gap_closed", "gap_closed_beyond_friction"]

WORD_COLUMNS = {
    "hidden": name_hidden,
    "said": name_said,
    "hidden_in_full": describe_hidden,
    "said_in_full": describe_said,
}


def list_misses(cases: Sequence[JudgedCase], table: ScoreRows) -> pd.DataFrame:
    """A row a miss, in the order of the groups, then of the cases.

    effect, joint: what was missed, or what was wrongly claimed. law: of a missed effect. answered: what was said of a
    missed effect, or how a wrong claim was counted. why: what the diagnosis did with a missed effect. hidden, said: of
    the whole case, in words. Gaps: see `gap`.
    """
    found = list_outcomes(table)
    failures = [group for group, about in OUTCOME_GROUPS.items() if not about.success]
    found = found[found["group"].isin(failures)].rename(columns={"group": "miss"})
    found["miss"] = pd.Categorical(found["miss"], failures)
    found = found.sort_values("miss", kind="stable").astype({"miss": str})
    known = {case.name: case for case in cases}
    own = [known[name] for name in found["case"]]
    found["rate_hz"] = [case.truth.rate_hz for case in own]
    for column, words in WORD_COLUMNS.items():
        found[column] = [words(case) for case in own]
    found["law"] = [_hidden_law(case, effect) for case, effect in zip(own, found["effect"], strict=True)]
    rows = zip(own, found["miss"], found["effect"], found["joint"], strict=True)
    found["why"] = [
        describe_miss(case, effect, joint) if miss == "missed" else "" for case, miss, effect, joint in rows
    ]
    found = found.merge(table.cases[["case", "arm", "noise", *SHOWN_GAP_COLUMNS]], on="case", how="left")
    return found[[*MISS_COLUMNS, *SHOWN_GAP_COLUMNS, *WORD_COLUMNS]]


def _hidden_law(case: JudgedCase, effect: str) -> str:
    """The law behind a hidden effect; empty for a claim of something that is not there."""
    return next((each.form for each in case.truth.injected if each.effect == effect), "")
