"""Tidy rows of a scored set: one for each effect, each claim, each parameter and each case."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from armlab.proof.blind.formats import InjectedEffect, TrueEffect
from armlab.proof.blind.score.cases import (
    RIGHT_CATEGORIES,
    UNKNOWN_NAME,
    JudgedCase,
    categorize_finding,
    is_same_effect,
)
from armlab.proof.blind.score.held_out import measure_gap_closed

MAX_CLASS_SIZE = 4
MIN_UNKNOWN_PROBABILITY = 0.5  # of a finding that is counted as one without a name
KEY_COLUMNS = ["case", "tier", "engine", "kind"]
GAP_COLUMNS = ["gap_closed", "gap_closed_beyond_friction", "gap_source"]
CASE_COLUMNS = [*KEY_COLUMNS, "arm", "noise", "status", "false_claims", "false_unknown", *GAP_COLUMNS, "seconds"]
EFFECT_COLUMNS = [
    *KEY_COLUMNS,
    "arm",
    "effect",
    "form",
    "obvious_form",
    "joint",
    "outside",
    "multiple",
    "named_first",
    "named_class",
    "class_size",
    "right_joint",
    "answered",
    "told_as_left",
]
CLAIM_COLUMNS = [*KEY_COLUMNS, "effect", "joint", "category", "class_size", "class_right", "probability"]
COMPARISON_COLUMNS = ["parameter", "truth", "value", "relative_error", "covered"]
PARAMETER_COLUMNS = ["case", "tier", "effect", "joint", "hidden_as", *COMPARISON_COLUMNS]


Name = tuple[str, int | None]  # effect, and joint from 1 or None for the whole robot


@dataclass(frozen=True, eq=False)
class ScoreRows:
    """Data frames over all cases of a set."""

    cases: pd.DataFrame
    effects: pd.DataFrame
    claims: pd.DataFrame
    parameters: pd.DataFrame


def read_table(path: Path) -> pd.DataFrame:
    """A table of a score; `null` is a kind of cases, not a missing number."""
    return pd.read_csv(path, dtype={"case": str}, keep_default_na=False, na_values=[""])


def make_rows(cases: list[JudgedCase]) -> ScoreRows:
    """The rows of judged cases."""
    effects = [row for case in cases for row in _effect_rows(case)]
    claims = [row for case in cases for row in _claim_rows(case)]
    parameters = [row for case in cases for row in _parameter_rows(case)]
    return ScoreRows(
        cases=pd.DataFrame([_case_row(case) for case in cases], columns=CASE_COLUMNS),
        effects=pd.DataFrame(effects, columns=EFFECT_COLUMNS),
        claims=pd.DataFrame(claims, columns=CLAIM_COLUMNS),
        parameters=pd.DataFrame(parameters, columns=PARAMETER_COLUMNS),
    )


def to_records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a frame, each by the names of its columns."""
    return [dict(zip(map(str, frame.columns), row, strict=True)) for row in frame.itertuples(index=False)]


def _key_values(case: JudgedCase) -> dict[str, Any]:
    return {"case": case.name, "tier": case.truth.tier, "engine": case.truth.engine, "kind": case.truth.kind}


def _case_row(case: JudgedCase) -> dict[str, Any]:
    claims = list(_claim_rows(case))
    gap = measure_gap_closed(case)
    return _key_values(case) | {
        "arm": case.truth.arm,
        "noise": case.truth.noise.kind,
        "status": case.verdict["status"],
        "false_claims": sum(not row["class_right"] for row in claims),
        "false_unknown": case.says_unknown and not case.truth.injected,
        "gap_closed": gap.closed,
        "gap_closed_beyond_friction": gap.beyond,
        "gap_source": gap.source,
        "seconds": case.seconds,
    }


def _effect_rows(case: JudgedCase) -> Iterator[dict[str, Any]]:
    says_unknown = case.unknown_probability >= MIN_UNKNOWN_PROBABILITY
    for effect in case.truth.injected:
        named = [each for each in case.findings if each["effect"] == effect.effect]
        named = named or _equivalent_findings(case, effect)
        in_class = [finding for finding in case.findings if _class_holds(finding, effect.effect)]
        sizes = [len(class_names(finding)) for finding in in_class]
        right_joint = any(each["joint"] == effect.joint for each in named)
        yield _key_values(case) | {
            "arm": case.truth.arm,
            "effect": effect.effect,
            "form": effect.form,
            "obvious_form": effect.obvious_form,
            "joint": effect.joint,
            "outside": effect.outside,
            "multiple": effect.multiple,
            "named_first": says_unknown if effect.outside else bool(named),
            "named_class": says_unknown if effect.outside else bool(named or in_class),
            "class_size": min(sizes) if sizes else None,
            "right_joint": right_joint if named and not effect.outside else None,
            "answered": _given_answer(case, effect),
            "told_as_left": says_unknown or any(each["joint"] == effect.joint for each in case.verdict["unexplained"]),
        }


def _equivalent_findings(case: JudgedCase, effect: InjectedEffect) -> list[dict[str, Any]]:
    """The findings at the effect's joint that together describe it, if all of them are there."""
    here = [finding for finding in case.findings if finding["joint"] == effect.joint]
    parts = [finding for finding in here if finding["effect"] in effect.equivalent]
    return parts if {each["effect"] for each in parts} == set(effect.equivalent) else []


def class_names(finding: dict[str, Any]) -> list[Name]:
    """The answers that a finding leaves open, its own first; that of a finding without a name is `unknown` alone."""
    if finding["effect"] == UNKNOWN_NAME:
        return [(UNKNOWN_NAME, finding["joint"])]
    members = [*(finding.get("class") or []), *finding["rivals"]]
    names = [(finding["effect"], finding["joint"]), *((each["effect"], each["joint"]) for each in members)]
    return list(dict.fromkeys(names))


def _class_holds(finding: dict[str, Any], effect: str) -> bool:
    """True for a class of at most four names with the right one among them."""
    names = class_names(finding)
    return len(names) <= MAX_CLASS_SIZE and effect in [name for name, _ in names]


def _given_answer(case: JudgedCase, effect: InjectedEffect) -> str:
    """The column of the confusion matrix: the right name if it was said, else what was said instead."""
    if _equivalent_findings(case, effect) or any(finding["effect"] == effect.effect for finding in case.findings):
        return effect.effect
    wrong = [each for each in case.findings if categorize_finding(case, each) in ("wrong", "misplaced", "identical")]
    at_joint = [finding for finding in wrong if finding["joint"] == effect.joint]
    if at_joint or wrong:
        return str((at_joint or wrong)[0]["effect"])
    if case.says_unknown:
        return "unknown"
    return "missed" if case.verdict["status"] == "mismatch" else str(case.verdict["status"])


def _claim_rows(case: JudgedCase) -> Iterator[dict[str, Any]]:
    for finding in case.findings:
        names = class_names(finding)
        categories = [categorize_finding(case, {"effect": name, "joint": joint}) for name, joint in names]
        yield _key_values(case) | {
            "effect": finding["effect"],
            "joint": finding["joint"],
            "category": categories[0],
            "class_size": len(names),
            "class_right": len(names) <= MAX_CLASS_SIZE and any(each in RIGHT_CATEGORIES for each in categories),
            "probability": finding.get("probability"),
        }


def _parameter_rows(case: JudgedCase) -> Iterator[dict[str, Any]]:
    about = {"case": case.name, "tier": case.truth.tier}
    hidden: dict[str, tuple[TrueEffect, ...]] = {
        "injected": case.truth.injected,
        "background": case.truth.background,
    }
    for hidden_as, effects in hidden.items():
        for effect in effects:
            for finding in (each for each in case.findings if is_same_effect(each, effect)):
                for row in _comparison_rows(effect, finding):
                    yield about | {"effect": effect.effect, "joint": effect.joint, "hidden_as": hidden_as} | row


def _comparison_rows(effect: TrueEffect, finding: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for name, known in effect.parameters.items():
        found = finding["parameters"].get(name)
        if not known.comparable or isinstance(known.value, tuple):
            continue
        if not isinstance(found, dict) or not _is_number(found.get("value")):
            continue
        truth, value, interval = known.value, found["value"], found.get("ci95")
        covered = bool(interval[0] <= truth <= interval[1]) if interval and _is_interval(interval) else None
        error = abs(value - truth) / max(abs(truth), 1e-12)
        yield {"parameter": name, "truth": truth, "value": value, "relative_error": error, "covered": covered}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_interval(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(_is_number(end) for end in value)
