"""A comparison as sentences, terminal lines, JSON (schema comparison/1) and a page, and the function that writes
these files.
"""

import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import wrap
from typing import get_args

import numpy as np

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.diagnosis.compare.comparison import Comparison, compare
from armlab.diagnosis.compare.structure import BASE_PARAMETER, SIGNIFICANCE_LEVEL, Change
from armlab.diagnosis.formats import COMPARISON_SCHEMA, ChangeEntry, ComparisonFile
from armlab.diagnosis.report import sections
from armlab.diagnosis.report.charts import (
    FOUND_LOOK,
    GIVEN_LOOK,
    PALE_COLOR,
    shorten_text,
    svg_element,
    svg_picture,
    svg_text,
)
from armlab.diagnosis.report.gallery import draw_gallery
from armlab.diagnosis.report.html import figures, folded_details, html_document, html_table, paragraph, section
from armlab.diagnosis.report.residuals import select_residuals
from armlab.diagnosis.report.sections import findings_section
from armlab.diagnosis.report.words import (
    LINE_WIDTH,
    PARAMETER_DIGITS,
    effect_in_words,
    finding_in_words,
    format_number,
    format_probability,
    format_unit,
    gain_sentence,
    join_words,
    place_in_words,
)
from armlab.diagnosis.settings import Baseline
from armlab.diagnosis.verdict_files import check_output_folder, make_verdict
from armlab.recordings.load import load_recording

MAX_NAMED_CHANGES = 3


def comparison_sentences(comparison: Comparison) -> tuple[str, str]:
    """What changed by name, and which numbers."""
    names = f"{comparison.old.recording.name} and {comparison.new.recording.name}"
    if comparison.status == "inconclusive":
        return f"{names} cannot be compared.", comparison.reason
    changed = [each for each in comparison.changes if each.changed and each.effect != BASE_PARAMETER]
    more = f", and {len(changed) - MAX_NAMED_CHANGES} more" if len(changed) > MAX_NAMED_CHANGES else ""
    numbers = join_words([change_phrase(each) for each in changed[:MAX_NAMED_CHANGES]]) + more if changed else ""
    if comparison.status == "same":
        small = f"Differences too small to matter for the torque: {numbers}." if numbers else ""
        return f"Nothing changed between {names} that the recordings show.", small
    assert comparison.against is not None
    claims = join_words([finding_in_words(each) for each in comparison.against.claims[:MAX_NAMED_CHANGES]])
    in_numbers = f"In numbers: {numbers}. " if numbers else ""
    return f"Between {names} this changed: {claims}.", in_numbers + gain_sentence(comparison.against)


def change_phrase(change: Change) -> str:
    """A changed parameter with both values."""
    name = (
        change.parameter
        if change.effect == BASE_PARAMETER
        else (
            f"{change.parameter} of {effect_in_words(change.effect)} at "
            f"{place_in_words(change.effect, change.joint, change.joints)}"
        )
    )
    old, new = format_number(change.old, PARAMETER_DIGITS), format_number(change.new, PARAMETER_DIGITS)
    return f"{name} from {old} to {new} {format_unit(change.unit)}".rstrip()


def comparison_lines(comparison: Comparison) -> Iterator[str]:
    """The verdict, then each parameter that changed with its interval."""
    first, second = comparison_sentences(comparison)
    yield from wrap(f"{comparison.status.upper()}: {first} {second}", LINE_WIDTH)
    if comparison.against is not None:
        for claim in comparison.against.claims:
            yield from wrap(
                f"{finding_in_words(claim)}: {claim.equation}",
                LINE_WIDTH,
                initial_indent="  ",
                subsequent_indent="    ",
            )
    changed = [each for each in comparison.changes if each.changed]
    for each in changed:
        low, high = (format_number(value, PARAMETER_DIGITS) for value in each.interval)
        yield f"  {change_phrase(each)}: difference {low} to {high} (95 %), p {format_probability(each.p_value)}"
    if comparison.changes:
        all_changes = len(comparison.changes)
        yield f"  {all_changes - len(changed)} of {all_changes} parameters show no change (1 %, Holm)"


def make_comparison_file(comparison: Comparison) -> ComparisonFile:
    """The content of `comparison.json`."""
    return ComparisonFile(
        schema=COMPARISON_SCHEMA,
        status=comparison.status,
        summary=" ".join(comparison_sentences(comparison)).strip(),
        old=comparison.old.recording.name,
        new=comparison.new.recording.name,
        level=SIGNIFICANCE_LEVEL,
        changes=tuple(_change_entry(each) for each in comparison.changes),
        against=None if comparison.against is None else make_verdict(comparison.against),
    )


def _change_entry(each: Change) -> ChangeEntry:
    return ChangeEntry(
        effect=each.effect,
        joint=each.joint,
        joints=each.joints,
        parameter=each.parameter,
        old=each.old,
        new=each.new,
        difference_ci95=each.interval,
        unit=each.unit,
        p_value=each.p_value,
        changed=each.changed,
    )


TABLE_HEADINGS = ("parameter", "where", "old", "new", "difference, 95 %", "unit", "p (Holm)")
PICTURE_WIDTH, ROW_HEIGHT, NAMES_WIDTH = 372.0, 22.0, 178.0
MAX_DRAWN_CHANGES = 24


def comparison_page(comparison: Comparison, command: str) -> str:
    """HTML text."""
    first, second = comparison_sentences(comparison)
    kind = {"changed": "mismatch", "same": "none", "inconclusive": "inconclusive"}[comparison.status]
    title = f"What changed between {comparison.old.recording.name} and {comparison.new.recording.name}"
    parts = [sections.page_header(title, kind, first, second)]
    if comparison.changes:
        parts.append(_numbers_section(comparison))
    if comparison.against is not None:
        data = select_residuals(comparison.against)
        if data is not None:
            drawn = draw_gallery(comparison.against, data)
            text = (
                f"Below, {comparison.new.recording.name} is diagnosed with the model of "
                f"{comparison.old.recording.name} as its simulation: “as given” is what the old model "
                "predicts. Signs are free: friction may have fallen."
            )
            parts += [
                section("against", "The new recording against the old model", paragraph(text)),
                sections.before_after_section(comparison.against, drawn),
                findings_section(comparison.against, drawn),
                sections.location_section(comparison.against, drawn),
            ]
    parts.append(sections.origin_section(comparison.new, command))
    return html_document(title, parts)


def _numbers_section(comparison: Comparison) -> str:
    text = (
        "Both recordings are fitted in one structure: the base parameters and every effect that was found in either, "
        "nonlinear parameters held. Intervals are robust against errors that are tied within a second; p-values are "
        "corrected over all parameters (Holm)."
    )
    changed = [each for each in comparison.changes if each.changed]
    rest = [each for each in comparison.changes if not each.changed]
    first = _changes_table(changed) if changed else ""
    return section(
        "numbers",
        "In numbers",
        figures([draw_changes(comparison.changes)]),
        first,
        paragraph(text, "pale"),
        folded_details(f"{len(rest)} parameters that show no change", _changes_table(rest)),
    )


def _changes_table(changes: list[Change]) -> str:
    return html_table(TABLE_HEADINGS, [_change_row(each) for each in changes], (0, 1, 5))


def _change_name(change: Change) -> str:
    if change.effect == BASE_PARAMETER:
        return change.parameter
    return f"{change.parameter}, {effect_in_words(change.effect)}"


def _change_row(change: Change) -> list[str]:
    where = "links" if change.effect == BASE_PARAMETER else place_in_words(change.effect, change.joint, change.joints)
    low, high = (format_number(value, PARAMETER_DIGITS) for value in change.interval)
    values = (format_number(change.old, PARAMETER_DIGITS), format_number(change.new, PARAMETER_DIGITS))
    return [
        _change_name(change),
        where,
        *values,
        f"{low} to {high}",
        format_unit(change.unit),
        format_probability(change.p_value),
    ]


def draw_changes(changes: tuple[Change, ...]) -> str:
    """Differences in units of half their own 95 % interval: within one of zero is no change."""
    chosen = sorted(changes, key=lambda each: each.p_value)[:MAX_DRAWN_CHANGES]
    height = 58 + ROW_HEIGHT * len(chosen) + 34
    largest = max(4.0, *(abs(_score(each)) for each in chosen)) if chosen else 4.0
    out = svg_text("Differences in units of half their 95 % interval", 6, 14, 12, font_weight="600")
    out += svg_element("rect", x=6, y=24, width=9, height=9, fill=GIVEN_LOOK.color) + svg_text("changed", 19, 33, 10.5)
    out += svg_element("circle", cx=86, cy=28.5, r=4.5, fill=FOUND_LOOK.color) + svg_text(
        "no change shown", 95, 33, 10.5
    )
    for value, text in ((-largest, f"{-largest:.0f}"), (0.0, "0"), (largest, f"{largest:.0f}")):
        x = _score_position(value, largest)
        out += svg_element("line", x1=x, x2=x, y1=44, y2=height - 28, stroke="#c4cad1" if value == 0 else "#e6e9ed")
        out += svg_text(text.replace("-", "−"), x, height - 12, 10.5, "middle", fill=PALE_COLOR)
    for number, each in enumerate(chosen):
        y = 58 + ROW_HEIGHT * number
        where = "" if each.joint is None else f", {each.joint}"
        out += svg_text(
            shorten_text(f"{_change_name(each)}{where}", NAMES_WIDTH - 12, 10.5), NAMES_WIDTH - 8, y + 4, 10.5, "end"
        )
        x = _score_position(_score(each), largest)
        out += svg_element("line", x1=_score_position(0.0, largest), x2=x, y1=y, y2=y, stroke="#c4cad1", stroke_width=2)
        out += (
            svg_element("rect", x=x - 4.5, y=y - 4.5, width=9, height=9, fill=GIVEN_LOOK.color)
            if each.changed
            else svg_element("circle", cx=x, cy=y, r=4.5, fill=FOUND_LOOK.color)
        )
    return svg_picture(out, PICTURE_WIDTH, height, "Differences of all parameters between the recordings")


def _score(change: Change) -> float:
    low, high = change.interval
    return (low + high) / max(high - low, 1e-300)


def _score_position(score: float, largest: float) -> float:
    """Linear up to one half interval, then as the logarithm: differences reach from none to hundreds."""
    own, most = float(np.arcsinh(score)), float(np.arcsinh(largest))
    return NAMES_WIDTH + (PICTURE_WIDTH - NAMES_WIDTH - 14) * (own + most) / (2 * most)


def compare_recordings(
    old: Path,
    new: Path,
    out: Path,
    baseline: str | None,
    seed: int,
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Compares, writes comparison.json and comparison.html into `out`, both or none, and yields lines to print.

    Raises InputError, in one line, for recordings that cannot be used or are not of one robot.
    """
    chosen: Baseline | None = next((each for each in get_args(Baseline) if each == baseline), None)
    recordings = load_recording(old), load_recording(new)
    check_output_folder(out, recordings[1])
    try:
        comparison = compare(*recordings, chosen, seed, progress)
    except ValueError as error:
        raise InputError(f"{old} and {new}: {error}") from None
    options = [*(["--baseline", baseline] if baseline else []), *(["--seed", str(seed)] if seed else [])]
    command = shlex.join(["armlab", "diagnose", "--compare", str(old), str(new), "--out", str(out), *options])
    texts = {
        "comparison.json": make_comparison_file(comparison).to_json(),
        "comparison.html": comparison_page(comparison, command),
    }
    write_texts(texts, out)
    yield from comparison_lines(comparison)
    yield f"wrote {out}: {', '.join(texts)}"
