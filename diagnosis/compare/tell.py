"""A comparison as words, lines and JSON."""

from collections.abc import Iterator
from textwrap import wrap
from typing import Any

from armlab.diagnosis.verdict_files import verdict_content
from diagnosis.compare.changes import LEVEL, Change
from diagnosis.compare.compare import Comparison
from diagnosis.report.words import DIGITS, gain_sentence, joined, number, place, plain, probability, told, unit

SCHEMA = "comparison/1"
WIDTH = 110
NAMED = 3


def sentences(found: Comparison) -> tuple[str, str]:
    """What changed by name, and which numbers."""
    names = f"{found.old.recording.name} and {found.new.recording.name}"
    if found.status == "inconclusive":
        return f"{names} cannot be compared.", found.reason
    changed = [each for each in found.changes if each.changed and each.effect != "base_parameter"]
    more = f", and {len(changed) - NAMED} more" if len(changed) > NAMED else ""
    numbers = joined([phrase(each) for each in changed[:NAMED]]) + more if changed else ""
    if found.status == "same":
        small = f"Differences too small to matter for the torque: {numbers}." if numbers else ""
        return f"Nothing changed between {names} that the recordings show.", small
    assert found.against is not None
    claims = joined([told(each) for each in found.against.claims[:NAMED]])
    in_numbers = f"In numbers: {numbers}. " if numbers else ""
    return f"Between {names} this changed: {claims}.", in_numbers + gain_sentence(found.against)


def phrase(change: Change) -> str:
    """A changed parameter with both values."""
    name = change.parameter if change.effect == "base_parameter" else (
        f"{change.parameter} of {plain(change.effect)} at {place(change.effect, change.joint, change.joints)}"
    )  # fmt: skip
    return f"{name} from {number(change.old, DIGITS)} to {number(change.new, DIGITS)} {unit(change.unit)}".rstrip()


def terminal_lines(found: Comparison) -> Iterator[str]:
    """The verdict, then each parameter that changed with its interval."""
    first, second = sentences(found)
    yield from wrap(f"{found.status.upper()}: {first} {second}", WIDTH)
    if found.against is not None:
        for claim in found.against.claims:
            yield from wrap(f"{told(claim)}: {claim.equation}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    changed = [each for each in found.changes if each.changed]
    for each in changed:
        low, high = (number(value, DIGITS) for value in each.interval)
        yield f"  {phrase(each)}: difference {low} to {high} (95 %), p {probability(each.p_value)}"
    if found.changes:
        yield f"  {len(found.changes) - len(changed)} of {len(found.changes)} parameters show no change (1 %, Holm)"


def as_json(found: Comparison) -> dict[str, Any]:
    """comparison/1; `against` is the verdict on the new recording with the old one's model as its simulation."""
    return {
        "schema": SCHEMA,
        "status": found.status,
        "summary": " ".join(sentences(found)).strip(),
        "old": found.old.recording.name,
        "new": found.new.recording.name,
        "level": LEVEL,
        "changes": [_change(each) for each in found.changes],
        "against": None if found.against is None else verdict_content(found.against),
    }


def _change(each: Change) -> dict[str, Any]:
    return {
        "effect": each.effect,
        "joint": each.joint,
        "joints": list(each.joints),
        "parameter": each.parameter,
        "old": each.old,
        "new": each.new,
        "difference_ci95": list(each.interval),
        "unit": each.unit,
        "p_value": each.p_value,
        "changed": each.changed,
    }
