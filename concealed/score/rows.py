"""Tidy rows: one an effect, one a claim, one a parameter, one a case."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pandas as pd

from concealed.score.gap import gap_closed
from concealed.score.matching import category, same
from concealed.score.reading import Judged

LARGEST_CLASS = 4
ABOUT = ["case", "tier", "kind"]
OF_GAP = ["gap_closed", "gap_closed_beyond_friction", "gap_source"]
CASE = [*ABOUT, "arm", "noise", "status", "false_claims", "false_unknown", *OF_GAP, "seconds"]
OF_EFFECT = ["effect", "form", "obvious_form", "joint", "outside", "multiple"]
EFFECT = [*ABOUT, "arm", *OF_EFFECT, "named_first", "named_class", "class_size", "right_joint", "answered"]
CLAIM = [*ABOUT, "effect", "joint", "category", "class_size"]
COMPARED = ["parameter", "truth", "value", "relative_error", "covered"]
PARAMETER = ["case", "tier", "effect", "joint", "hidden_as", *COMPARED]


@dataclass(frozen=True, eq=False)
class Rows:
    """Data frames over all cases of a set."""

    cases: pd.DataFrame
    effects: pd.DataFrame
    claims: pd.DataFrame
    parameters: pd.DataFrame


def rows(cases: list[Judged]) -> Rows:
    """The rows of judged cases."""
    frames = (
        [_case(case) for case in cases],
        [row for case in cases for row in _effects(case)],
        [row for case in cases for row in _claims(case)],
        [row for case in cases for row in _parameters(case)],
    )
    columns = (CASE, EFFECT, CLAIM, PARAMETER)
    return Rows(*(pd.DataFrame(each, columns=names) for each, names in zip(frames, columns, strict=True)))


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a frame, each by the names of its columns."""
    return [dict(zip(map(str, frame.columns), row, strict=True)) for row in frame.itertuples(index=False)]


def _about(case: Judged) -> dict[str, Any]:
    return {"case": case.name, "tier": case.truth["tier"], "kind": case.truth["kind"]}


def _case(case: Judged) -> dict[str, Any]:
    categories = [category(case, finding) for finding in case.findings]
    gap = gap_closed(case)
    return _about(case) | {
        "arm": case.truth["arm"],
        "noise": case.truth["noise"]["kind"],
        "status": case.verdict["status"],
        "false_claims": sum(each in ("wrong", "misplaced", "unknown") for each in categories),
        "false_unknown": case.says_unknown and not case.truth["injected"],
        "gap_closed": gap.closed,
        "gap_closed_beyond_friction": gap.beyond,
        "gap_source": gap.source,
        "seconds": case.seconds,
    }


def _effects(case: Judged) -> Iterator[dict[str, Any]]:
    for effect in case.truth["injected"]:
        outside = effect["outside"]
        named = [each for each in case.findings if each["effect"] == effect["effect"]] or _together(case, effect)
        in_class = [finding for finding in case.findings if _holds(finding, effect["effect"])]
        sizes = [1 + len(finding["rivals"]) for finding in in_class]
        yield _about(case) | {
            "arm": case.truth["arm"],
            **{key: effect[key] for key in OF_EFFECT},
            "named_first": case.says_unknown if outside else bool(named),
            "named_class": case.says_unknown if outside else bool(named or in_class),
            "class_size": min(sizes) if sizes else None,
            "right_joint": any(each["joint"] == effect["joint"] for each in named) if named and not outside else None,
            "answered": _answered(case, effect),
        }


def _together(case: Judged, effect: dict[str, Any]) -> list[dict[str, Any]]:
    """The findings at the effect's joint that together say the same, if all of them are there."""
    parts = [
        each for each in case.findings if each["joint"] == effect["joint"] and each["effect"] in effect["equivalent"]
    ]
    return parts if {each["effect"] for each in parts} == set(effect["equivalent"]) else []


def _holds(finding: dict[str, Any], effect: str) -> bool:
    """True for a class of at most four names with the right one among them."""
    names = [finding["effect"], *(rival["effect"] for rival in finding["rivals"])]
    return len(names) <= LARGEST_CLASS and effect in names


def _answered(case: Judged, effect: dict[str, Any]) -> str:
    """The column of the confusion matrix: the right name if it was said, else what was said instead."""
    if _together(case, effect) or any(finding["effect"] == effect["effect"] for finding in case.findings):
        return str(effect["effect"])
    wrong = [each for each in case.findings if category(case, each) in ("wrong", "misplaced", "identical")]
    at_joint = [finding for finding in wrong if finding["joint"] == effect["joint"]]
    if at_joint or wrong:
        return str((at_joint or wrong)[0]["effect"])
    if case.says_unknown:
        return "unknown"
    return "missed" if case.verdict["status"] == "mismatch" else str(case.verdict["status"])


def _claims(case: Judged) -> Iterator[dict[str, Any]]:
    for finding in case.findings:
        known = {"effect": finding["effect"], "joint": finding["joint"], "category": category(case, finding)}
        yield _about(case) | known | {"class_size": 1 + len(finding["rivals"])}


def _parameters(case: Judged) -> Iterator[dict[str, Any]]:
    about = {key: value for key, value in _about(case).items() if key != "kind"}
    for hidden_as in ("injected", "background"):
        for effect in case.truth[hidden_as]:
            for finding in (each for each in case.findings if same(each, effect)):
                for row in _compared(effect, finding):
                    yield about | {"effect": effect["effect"], "joint": effect["joint"], "hidden_as": hidden_as} | row


def _compared(effect: dict[str, Any], finding: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for name, known in effect["parameters"].items():
        found = finding["parameters"].get(name)
        if not known["comparable"] or not isinstance(found, dict) or not _number(found.get("value")):
            continue
        truth, value, interval = known["value"], found["value"], found.get("ci95")
        covered = bool(interval[0] <= truth <= interval[1]) if interval and _interval(interval) else None
        error = abs(value - truth) / max(abs(truth), 1e-12)
        yield {"parameter": name, "truth": truth, "value": value, "relative_error": error, "covered": covered}


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _interval(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(_number(end) for end in value)
