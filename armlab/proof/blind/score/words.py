"""Answers and verdicts in words, side by side."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from armlab.proof.blind.formats import InjectedEffect
from armlab.proof.blind.score.cases import STEPS_FILE, JudgedCase, categorize_finding, read_complaint


def describe_hidden(case: JudgedCase) -> str:
    """What was hidden, each effect with its law, place, size and parameters."""
    effects = [describe_hidden_effect(each) for each in case.truth.injected]
    return "; ".join(effects) if effects else "nothing"


def name_hidden(case: JudgedCase) -> str:
    """What was hidden, in a few words."""
    told = [f"{each.effect}, {_describe_size(each)}" for each in case.truth.injected]
    return "; ".join(told) if told else "nothing"


def name_said(case: JudgedCase) -> str:
    """What was said beyond the background, in a few words."""
    if case.verdict["status"] == "invalid":
        return "no verdict"
    told = [(finding, categorize_finding(case, finding)) for finding in case.findings]
    parts = [
        f"{each['effect']}, {describe_place(each['joint'])}{_category_mark(what)}"
        for each, what in told
        if what != "background"
    ]
    parts += [f"unexplained, {describe_place(each.get('joint'))}" for each in case.verdict["unexplained"]]
    beyond = " beyond the background" if told else ""
    return "; ".join(parts) if parts else f"nothing{beyond}"


def describe_hidden_effect(effect: InjectedEffect) -> str:
    """One hidden effect, as `backlash (gap), joint 1, 8.2 limits: gap = 0.00031 rad`."""
    law = "" if effect.outside else f" ({effect.form})"
    sizes = [
        f"{name} = {each.value:.3g} {_format_unit(each.unit)}".rstrip()
        for name, each in effect.parameters.items()
        if not isinstance(each.value, tuple)
    ]
    return f"{effect.effect}{law}, {_describe_size(effect)}" + (f": {', '.join(sizes)}" if sizes else "")


def describe_background(case: JudgedCase) -> str:
    """What stands beside the hidden effects and is no mistake to find."""
    parts = []
    if case.truth.background:
        parts.append("friction on every joint")
    if case.truth.cad_errors:
        parts.append("links 3-10 % off")
    return ", ".join(parts)


def describe_said(case: JudgedCase) -> str:
    """What the verdict said; right findings of the background are counted, not listed."""
    if case.verdict["status"] == "invalid":
        complaint = read_complaint(case.folder)
        return f"no verdict: {complaint}" if complaint else "no verdict"
    told = [(finding, categorize_finding(case, finding)) for finding in case.findings]
    parts = [describe_finding(finding, what) for finding, what in told if what != "background"]
    parts += [_describe_unexplained(each) for each in case.verdict["unexplained"]]
    background = sum(what == "background" for _, what in told)
    if background:
        parts.append(f"{background} right finding{'s' * (background > 1)} of the background")
    if parts:
        return "; ".join(parts)
    return "nothing is missing" if case.verdict["status"] == "none" else str(case.verdict["status"])


def describe_finding(finding: dict[str, Any], what: str) -> str:
    """One finding, its size with the interval, its rivals, and how it was counted."""
    sizes = [f"{name} = {_format_estimate(each)}" for name, each in finding["parameters"].items() if _has_number(each)]
    rivals = [rival["effect"] for rival in finding["rivals"]]
    text = f"{finding['effect']}, {describe_place(finding['joint'])}" + (f": {', '.join(sizes)}" if sizes else "")
    text += f" (or {', '.join(rivals)})" if rivals else ""
    return f"{text}{_category_mark(what)}"


def describe_miss(case: JudgedCase, effect: str, joint: Any) -> str:
    """What the diagnosis did with an effect that it does not name: the last step that speaks of it at its joint."""
    place = "" if pd.isna(joint) else f" {int(joint)}"
    about = re.compile(rf"\b{effect}{place}\b")
    steps = [each["what"] for each in _read_steps(case.folder) if about.search(each["what"])]
    if not steps:
        return "never in a model"
    last = str(steps[-1])
    if last.startswith(("+", "-")):
        return "in the model, not told" if last.startswith("+") else "taken out by the search"
    if " -> " in last:
        after = last.partition(" -> ")[2]
        return "in the model, not told" if about.search(after) else f"{after} took its place"
    return last.partition(": ")[2].partition(": ")[2] or last


def _read_steps(folder: Path) -> list[dict[str, Any]]:
    """The moves and tests of a diagnosis, none where it failed."""
    path = folder / STEPS_FILE
    return list(json.loads(path.read_text(encoding="utf-8"))["steps"]) if path.is_file() else []


def describe_place(joint: Any) -> str:
    """A joint, or the whole arm."""
    return "whole arm" if joint is None else f"joint {int(joint)}"


def _describe_size(effect: InjectedEffect) -> str:
    return f"{describe_place(effect.joint)}, {effect.multiple:.1f} limits"


def _category_mark(what: str) -> str:
    """How a claim was counted, where it is not simply right."""
    return f" [{what}]" if what in ("wrong", "misplaced", "identical") else ""


def _describe_unexplained(part: dict[str, Any]) -> str:
    """Something that no name fits, and on what it depends."""
    depends = ", ".join(map(str, part.get("depends_on") or ()))
    return f"unexplained, {describe_place(part.get('joint'))}" + (f" (by {depends})" if depends else "")


def _is_number(value: Any) -> bool:
    """True for a number; lists, as the ten parameters of a link, are left out of the words."""
    return isinstance(value, int | float)


def _has_number(parameter: Any) -> bool:
    return isinstance(parameter, dict) and _is_number(parameter.get("value"))


def _format_estimate(parameter: dict[str, Any]) -> str:
    """A value, its interval and unit."""
    interval: Sequence[Any] = parameter.get("ci95") or ()
    ends = " to ".join(f"{end:.3g}" for end in interval if _is_number(end))
    unit = _format_unit(str(parameter.get("unit", "")))
    return f"{parameter['value']:.3g}{f' ({ends})' if ends else ''} {unit}".rstrip()


def _format_unit(unit: str) -> str:
    return "" if unit == "1" else unit.replace(".", " ")
