"""What became of each hidden effect that should be named, of each case with nothing to name, and each wrong claim.

Every hidden effect above three detection limits is in exactly one of the groups `named`, `class`, `missed`, `unknown`
and `not unknown`, or, where its right name stands at a wrong joint, among the wrong claims. Every null and decoy is in
one of `silent`, `false claim`, `false unknown` and `no verdict`; there a false claim is an item of its own.
A class whose first name is wrong is a wrong claim too, as in the measures.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pandas as pd

from concealed.score.measures import ABOVE
from concealed.score.rows import Rows, records


@dataclass(frozen=True)
class Group:
    """One kind of outcome: its title in a page, and whether it is a success."""

    title: str
    success: bool


GROUPS = {
    "named": Group("Named at the right joint", True),
    "class": Group("Right name among at most four", True),
    "unknown": Group("Outside the library, and called unknown", True),
    "silent": Group("Nothing hidden, and nothing claimed", True),
    "missed": Group("Not named", False),
    "not unknown": Group("Outside the library, and not called unknown", False),
    "wrong claim": Group("Wrong claim beside something hidden", False),
    "false claim": Group("False claim where nothing is hidden", False),
    "false unknown": Group("Nothing hidden, and something left unexplained", False),
    "no verdict": Group("Nothing hidden, and no verdict", False),
}
COLUMNS = ["group", "case", "tier", "kind", "effect", "joint", "limits", "answered"]
FALSE = ("wrong", "misplaced", "unknown")


def outcomes(table: Rows) -> pd.DataFrame:
    """A row an item, in the order of the cases.

    joint: where to look, missing for the whole arm. limits: the size of a hidden effect. answered: what was said of it.
    """
    effects, claims = _by_case(table.effects), _by_case(table.claims)
    rows: list[dict[str, Any]] = []
    for case in records(table.cases):
        about = {key: case[key] for key in ("case", "tier", "kind")}
        own, false = effects.get(case["case"], []), [each for each in claims.get(case["case"], []) if _is_false(each)]
        rows += [about | item for item in (_with_hidden(own, false) if own else _with_nothing(case, false))]
    return pd.DataFrame(rows, columns=COLUMNS).astype({"joint": "Int64"})


def _by_case(frame: pd.DataFrame) -> dict[str, list[dict[str, Any]]]:
    return {str(case): records(own) for case, own in frame.groupby("case", sort=False)}


def _is_false(claim: dict[str, Any]) -> bool:
    return claim["category"] in FALSE


def _with_hidden(effects: list[dict[str, Any]], false: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for each in effects:
        group = _of_effect(each) if each["multiple"] > ABOVE else None
        if group:
            about = {"effect": each["effect"], "joint": _joint(each), "limits": each["multiple"]}
            yield {"group": group, "answered": each["answered"], **about}
    yield from (_claimed("wrong claim", each) for each in false)


def _of_effect(effect: dict[str, Any]) -> str | None:
    """The group of an effect; None where its right name stands at a wrong joint: a wrong claim then."""
    if effect["outside"]:
        return "unknown" if effect["named_first"] else "not unknown"
    if effect["named_first"]:
        return "named" if effect["right_joint"] else None
    return "class" if effect["named_class"] else "missed"


def _with_nothing(case: dict[str, Any], false: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    if false:
        yield from (_claimed("false claim", each) for each in false)
    else:
        kinds = {"no verdict": case["status"] == "invalid", "false unknown": case["false_unknown"]}
        group = next((kind for kind, holds in kinds.items() if holds), "silent")
        yield {"group": group, "answered": case["status"]}


def _claimed(group: str, claim: dict[str, Any]) -> dict[str, Any]:
    return {"group": group, "effect": claim["effect"], "joint": _joint(claim), "answered": claim["category"]}


def _joint(row: dict[str, Any]) -> Any:
    return None if pd.isna(row["joint"]) else int(row["joint"])
