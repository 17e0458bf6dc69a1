"""A comparison as a page: what changed by name and in numbers, then the evidence against the old one's model."""

import numpy as np

from diagnosis.compare.changes import Change
from diagnosis.compare.compare import Comparison
from diagnosis.compare.tell import sentences
from diagnosis.report import sections
from diagnosis.report.findings import findings
from diagnosis.report.gallery import gallery
from diagnosis.report.html import document, figures, folded, paragraph, section, table
from diagnosis.report.looks import FOUND, GIVEN
from diagnosis.report.rows import shown
from diagnosis.report.svg import PALE, picture, shortened, tag, words
from diagnosis.report.words import DIGITS, number, place, plain, probability, unit

HEADINGS = ("parameter", "where", "old", "new", "difference, 95 %", "unit", "p (Holm)")
WIDTH, ROW, NAMES = 372.0, 22.0, 178.0
MOST = 24


def comparison_page(found: Comparison, command: str) -> str:
    """HTML text."""
    first, second = sentences(found)
    kind = {"changed": "mismatch", "same": "none", "inconclusive": "inconclusive"}[found.status]
    title = f"What changed between {found.old.recording.name} and {found.new.recording.name}"
    parts = [sections.header(title, kind, first, second)]
    if found.changes:
        parts.append(_numbers(found))
    if found.against is not None:
        data = shown(found.against)
        if data is not None:
            drawn = gallery(found.against, data)
            text = (
                f"Below, {found.new.recording.name} is diagnosed with the model of {found.old.recording.name} as its "
                "simulation: “as given” is what the old model predicts. Signs are free: friction may have fallen."
            )
            parts += [
                section("against", "The new recording against the old model", paragraph(text)),
                sections.before_after(found.against, drawn),
                findings(found.against, drawn),
                sections.where(found.against, drawn),
            ]
    parts.append(sections.origin(found.new, command))
    return document(title, parts)


def _numbers(found: Comparison) -> str:
    text = (
        "Both recordings are fitted in one structure: the base parameters and every effect that was found in either, "
        "nonlinear parameters held. Intervals are robust against errors that are tied within a second; p-values are "
        "corrected over all parameters (Holm)."
    )
    changed = [each for each in found.changes if each.changed]
    rest = [each for each in found.changes if not each.changed]
    first = _table(changed) if changed else ""
    return section(
        "numbers", "In numbers", figures([changes_picture(found.changes)]), first, paragraph(text, "pale"),
        folded(f"{len(rest)} parameters that show no change", _table(rest)),
    )  # fmt: skip


def _table(changes: list[Change]) -> str:
    return table(HEADINGS, [_row(each) for each in changes], (0, 1, 5))


def _name(change: Change) -> str:
    if change.effect == "base_parameter":
        return change.parameter
    return f"{change.parameter}, {plain(change.effect)}"


def _row(change: Change) -> list[str]:
    where = "links" if change.effect == "base_parameter" else place(change.effect, change.joint, change.joints)
    low, high = (number(value, DIGITS) for value in change.interval)
    values = (number(change.old, DIGITS), number(change.new, DIGITS))
    return [_name(change), where, *values, f"{low} to {high}", unit(change.unit), probability(change.p_value)]


def changes_picture(changes: tuple[Change, ...]) -> str:
    """Differences in units of half their own 95 % interval: within one of zero is no change."""
    chosen = sorted(changes, key=lambda each: each.p_value)[:MOST]
    height = 58 + ROW * len(chosen) + 34
    largest = max(4.0, *(abs(_score(each)) for each in chosen)) if chosen else 4.0
    out = words("Differences in units of half their 95 % interval", 6, 14, 12, font_weight="600")
    out += tag("rect", x=6, y=24, width=9, height=9, fill=GIVEN.color) + words("changed", 19, 33, 10.5)
    out += tag("circle", cx=86, cy=28.5, r=4.5, fill=FOUND.color) + words("no change shown", 95, 33, 10.5)
    for value, text in ((-largest, f"{-largest:.0f}"), (0.0, "0"), (largest, f"{largest:.0f}")):
        x = _across(value, largest)
        out += tag("line", x1=x, x2=x, y1=44, y2=height - 28, stroke="#c4cad1" if value == 0 else "#e6e9ed")
        out += words(text.replace("-", "−"), x, height - 12, 10.5, "middle", fill=PALE)
    for number_, each in enumerate(chosen):
        y = 58 + ROW * number_
        where = "" if each.joint is None else f", {each.joint}"
        out += words(shortened(f"{_name(each)}{where}", NAMES - 12, 10.5), NAMES - 8, y + 4, 10.5, "end")
        x = _across(_score(each), largest)
        out += tag("line", x1=_across(0.0, largest), x2=x, y1=y, y2=y, stroke="#c4cad1", stroke_width=2)
        out += (
            tag("rect", x=x - 4.5, y=y - 4.5, width=9, height=9, fill=GIVEN.color)
            if each.changed
            else tag("circle", cx=x, cy=y, r=4.5, fill=FOUND.color)
        )
    return picture(out, WIDTH, height, "Differences of all parameters between the recordings")


def _score(change: Change) -> float:
    low, high = change.interval
    return (low + high) / max(high - low, 1e-300)


def _across(score: float, largest: float) -> float:
    """Linear up to one half interval, then as the logarithm: differences reach from none to hundreds."""
    own, most = (float(np.arcsinh(value)) for value in (score, largest))
    return NAMES + (WIDTH - NAMES - 14) * (own + most) / (2 * most)
