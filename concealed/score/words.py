"""Answers and verdicts in words, side by side."""

from collections.abc import Sequence
from typing import Any

from concealed.score.matching import category
from concealed.score.reading import FAILED, Judged

LONGEST = 240  # letters kept of a text that is not ours


def hidden_words(case: Judged) -> str:
    """What was hidden, each effect with its law, place, size and parameters."""
    effects = [effect_words(each) for each in case.truth["injected"]]
    return "; ".join(effects) if effects else "nothing"


def hidden_names(case: Judged) -> str:
    """What was hidden, in a few words."""
    told = [f"{each['effect']}, {_size(each)}" for each in case.truth["injected"]]
    return "; ".join(told) if told else "nothing"


def said_names(case: Judged) -> str:
    """What was said beyond the background, in a few words."""
    if case.verdict["status"] == "invalid":
        return "no verdict"
    told = [(finding, category(case, finding)) for finding in case.findings]
    parts = [
        f"{each['effect']}, {place_words(each['joint'])}{_mark(what)}" for each, what in told if what != "background"
    ]
    parts += [f"unexplained, {place_words(each.get('joint'))}" for each in case.verdict["unexplained"]]
    beyond = " beyond the background" if told else ""
    return "; ".join(parts) if parts else f"nothing{beyond}"


def effect_words(effect: dict[str, Any]) -> str:
    """One hidden effect, as `backlash (gap), joint 1, 8.2 limits: gap = 0.00031 rad`."""
    law = "" if effect["outside"] else f" ({effect['form']})"
    sizes = [f"{name} = {_value(each)}" for name, each in effect["parameters"].items() if _short(each["value"])]
    return f"{effect['effect']}{law}, {_size(effect)}" + (f": {', '.join(sizes)}" if sizes else "")


def background_words(case: Judged) -> str:
    """What stands beside the hidden effects and is no mistake to find."""
    parts = []
    if case.truth["background"]:
        parts.append("friction on every joint")
    if case.truth["cad_errors"]:
        parts.append("links 3-10 % off")
    return ", ".join(parts)


def said_words(case: Judged) -> str:
    """What the verdict said; right findings of the background are counted, not listed."""
    if case.verdict["status"] == "invalid":
        return f"no verdict{_complaint(case)}"
    told = [(finding, category(case, finding)) for finding in case.findings]
    parts = [finding_words(finding, what) for finding, what in told if what != "background"]
    parts += [_unexplained(each) for each in case.verdict["unexplained"]]
    background = sum(what == "background" for _, what in told)
    if background:
        parts.append(f"{background} right finding{'s' * (background > 1)} of the background")
    if parts:
        return "; ".join(parts)
    return "nothing is missing" if case.verdict["status"] == "none" else str(case.verdict["status"])


def finding_words(finding: dict[str, Any], what: str) -> str:
    """One finding, its size with the interval, its rivals, and how it was counted."""
    sizes = [f"{name} = {_measured(each)}" for name, each in finding["parameters"].items() if _given(each)]
    rivals = [rival["effect"] for rival in finding["rivals"]]
    text = f"{finding['effect']}, {place_words(finding['joint'])}" + (f": {', '.join(sizes)}" if sizes else "")
    text += f" (or {', '.join(rivals)})" if rivals else ""
    return f"{text}{_mark(what)}"


def place_words(joint: Any) -> str:
    """A joint, or the whole arm."""
    return "whole arm" if joint is None else f"joint {int(joint)}"


def _size(effect: dict[str, Any]) -> str:
    return f"{place_words(effect['joint'])}, {effect['multiple']:.1f} limits"


def _mark(what: str) -> str:
    """How a claim was counted, where it is not simply right."""
    return f" [{what}]" if what in ("wrong", "misplaced", "identical") else ""


def _unexplained(part: dict[str, Any]) -> str:
    """Something that no name fits, and on what it depends."""
    depends = ", ".join(map(str, part.get("depends_on") or ()))
    return f"unexplained, {place_words(part.get('joint'))}" + (f" (by {depends})" if depends else "")


def _complaint(case: Judged) -> str:
    path = case.folder / FAILED
    text = " ".join(path.read_text(encoding="utf-8").split()) if path.is_file() else ""
    return f": {text[-LONGEST:]}" if text else ""


def _short(value: Any) -> bool:
    """True for a number; a link's ten parameters would fill the page."""
    return isinstance(value, int | float)


def _given(parameter: Any) -> bool:
    return isinstance(parameter, dict) and _short(parameter.get("value"))


def _value(parameter: dict[str, Any]) -> str:
    return f"{parameter['value']:.3g} {_unit(parameter)}".rstrip()


def _measured(parameter: dict[str, Any]) -> str:
    """A value, its interval and unit."""
    interval: Sequence[Any] = parameter.get("ci95") or ()
    ends = " to ".join(f"{end:.3g}" for end in interval if _short(end))
    return f"{parameter['value']:.3g}{f' ({ends})' if ends else ''} {_unit(parameter)}".rstrip()


def _unit(parameter: dict[str, Any]) -> str:
    unit = str(parameter.get("unit", ""))
    return "" if unit == "1" else unit.replace(".", " ")
