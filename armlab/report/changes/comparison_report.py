"""A comparison as sentences, terminal lines, JSON (schema comparison/1) and a page, and the function that writes
these files.
"""

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from textwrap import wrap
from typing import Any, get_args

import numpy as np
from markupsafe import Markup

from armlab.common.documents import ResultLines
from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.common.report import palette
from armlab.common.report.charts import (
    FOUND_LOOK,
    GIVEN_LOOK,
    shorten_text,
    svg_element,
    svg_picture,
    svg_text,
)
from armlab.common.report.page import Table, render_page
from armlab.common.report.wording import format_number, format_unit, join_words
from armlab.diagnosis.changes.comparison import Comparison, check_same_robot, compare
from armlab.diagnosis.changes.friction_level import ALL_FRICTION
from armlab.diagnosis.changes.named import ONE_FACTOR, NamedChange
from armlab.diagnosis.changes.numbers import Change
from armlab.diagnosis.formats import (
    COMPARISON_SCHEMA,
    ChangeEntry,
    ClassMember,
    ComparisonFile,
    DetectableEntry,
    FindingEntry,
    ParameterEntry,
    RivalEntry,
    kind_of_effect,
)
from armlab.diagnosis.settings import Baseline
from armlab.diagnosis.torque.names.findings import FRICTION
from armlab.diagnosis.tuning import ComparisonTuning
from armlab.effects.library import effect_named
from armlab.effects.timing import TIME_DELAY_FACTS
from armlab.effects.words import at_place, place_in_words
from armlab.recordings.identifiable import require_identifiable, require_possible
from armlab.recordings.load import load_recording
from armlab.report.account.summary import MAX_WORDS
from armlab.report.changes.trend_report import content_over_recordings, trend_part, trend_phrase
from armlab.report.torque.content import origin_of
from armlab.report.torque.sentences import number_in_words
from armlab.report.torque.torque_verdict import LINE_WIDTH
from armlab.report.verdict_files import check_output_folder
from armlab.report.words import (
    MAX_LENGTH_IN_MM,
    PARAMETER_DIGITS,
    effect_in_words,
    format_probability,
    member_in_words,
    parameter_rows,
    rival_in_words,
)
from problem.arm import Arm

MAX_NAMED_CHANGES = 3
NO_LEVEL = 5e-3  # of the first level: what is smaller has gone
MAX_RATIO_SPAN = 10.0  # highest over lowest end of an interval that is told in percent
NOTHING_ELSE = "No other change is sure."
SEEN_EFFECTS = ("coulomb_friction", "viscous_friction", "payload", "torque_gain_error", "encoder_offset", "time_delay")


def comparison_sentences(comparison: Comparison) -> tuple[str, str]:
    """What changed and by how much; and the smallest changes that would have been seen."""
    names = join_words(comparison.names)
    seen = detectable_sentence(comparison)
    if comparison.doubtful is not None:
        phrase = change_phrase(comparison, comparison.doubtful)
        return f"No change between {names} is sure.", f"Perhaps {phrase}. {comparison.reason} {seen}"
    if comparison.status == "inconclusive":
        return f"{names} cannot be compared.", comparison.reason
    if comparison.status == "same":
        return f"Nothing changed between {names} that the recordings show.", seen
    phrases = [_leading_phrase(comparison, each) for each in comparison.findings[:MAX_NAMED_CHANGES]]
    rest = len(comparison.findings) - len(phrases)
    more = f", and {rest} more" if rest else ""
    first = f"Between {names} this changed: {join_words(phrases)}{more}."
    left = MAX_WORDS - len(f"{first} {NOTHING_ELSE}".split())
    return first, f"{NOTHING_ELSE} {detectable_sentence(comparison, left)}".strip()


def _leading_phrase(comparison: Comparison, named: NamedChange) -> str:
    """A change with the number that is surest; of friction all laws of the joint together, where they are known."""
    where = _names_phrase(comparison.arm, named)
    whole = _all_friction(comparison, named)
    if whole is not None:
        return f"{where} ({whole})"
    if not named.changes:
        return f"{where}: {named.equation}"
    return f"{where} ({_amount(_surest_first(comparison, named)[0], short=True)})"


def _surest_first(comparison: Comparison, named: NamedChange) -> list[Change]:
    """Its numbers, with the friction of the joint as a whole where the law of another cause holds it.

    Numbers that change by one factor are alike sure, and stay in the order of the law.
    """
    if named.form == ONE_FACTOR:
        return list(named.changes)
    own = (each for each in comparison.changes if each.parameter == ALL_FRICTION and each.effect == named.effect)
    whole = [each for each in own if each.joint == named.joint and effect_named(named.effect).cause != FRICTION]
    return sorted((*named.changes, *whole), key=_sureness, reverse=True)


def _all_friction(comparison: Comparison, named: NamedChange) -> str | None:
    """`all friction there +11 % (+2 to +22 %)` of a change of one law of friction, where that is known."""
    if effect_named(named.effect).cause != FRICTION or named.form == ONE_FACTOR:
        return None
    there = (each for each in comparison.changes if each.parameter == ALL_FRICTION and each.joint == named.joint)
    ratio = next((each.ratio for each in there), None)
    return None if ratio is None else f"all friction there {_percents(ratio)}"


def change_phrase(comparison: Comparison, named: NamedChange) -> str:
    """A change with its numbers: in percent where there is a level, else in units."""
    where, parts = _names_phrase(comparison.arm, named), _amounts(comparison, named)
    return f"{where} ({', '.join(parts)})" if parts else f"{where}: {named.equation}"


def _amounts(comparison: Comparison, named: NamedChange) -> list[str]:
    whole = _all_friction(comparison, named)
    return [*([] if whole is None else [whole]), *map(_amount, _surest_first(comparison, named))]


def _sureness(change: Change) -> float:
    """How large a difference is beside its interval: a law may have numbers that did not change."""
    low, high = change.interval
    return abs(change.difference) / max(high - low, 1e-300)


def _names_phrase(arm: Arm, named: NamedChange) -> str:
    """Its name with its place, or the names of its class; a place that all of them share stands once."""
    places = [place_in_words(arm, each.effect, each.joint, each.joints) for each in named.told]
    if len(set(places)) > 1:
        return join_words([member_in_words(arm, each) for each in named.told], "or")
    names = join_words([effect_in_words(each.effect) for each in named.told], "or")
    return at_place(arm, names, named.effect, named.joint, named.joints)


def _amount(change: Change, short: bool = False) -> str:
    """A change of a number: in percent where that is well known, else in units. short: not beside both levels."""
    if change.effect == TIME_DELAY_FACTS.id and change.interval[0] * change.interval[1] > 0:
        return _shift(change)
    unit, scale = format_unit(change.unit), 1.0
    if change.unit == "m" and abs(change.difference) < MAX_LENGTH_IN_MM:
        unit, scale = "mm", 1e3
    name = number_in_words(change.parameter)
    low, high = (format_number(scale * value) for value in change.interval)
    difference = f"{format_number(scale * change.difference)} ({low} to {high}) {unit}".rstrip()
    if change.levels is not None:
        first, last = scale * change.levels[0], scale * change.levels[-1]
        both = f"{name} from {format_number(first)} to {_level(last, first)} {unit}".rstrip()
        if change.ratio is not None and _is_narrow(change.ratio):
            return f"{both}, {_percents(change.ratio)}"
        return both if short else f"{both}, a difference of {difference}"
    if change.ratio is not None:
        return f"{name} {_percents(change.ratio)}"
    return f"{name} changes by {difference}"


def _shift(change: Change) -> str:
    """By how much torque is recorded later, or earlier, than it was."""
    size, *ends = (abs(1e3 * value) for value in (change.difference, *change.interval))
    low, high = sorted(ends)
    when = "later" if change.difference > 0 else "earlier"
    return f"{format_number(size)} ({format_number(low)} to {format_number(high)}) ms {when}"


def _level(value: float, first: float) -> str:
    """A level in the digits that the first one has."""
    return "0" if abs(value) < NO_LEVEL * abs(first) else format_number(value)


def _is_narrow(ratio: tuple[float, float, float]) -> bool:
    """Whether a ratio is known well enough to be told in percent."""
    _, low, high = ratio
    return 0 < high < MAX_RATIO_SPAN * low


def _percents(ratio: tuple[float, float, float]) -> str:
    value, low, high = (_signed(100 * (each - 1)) for each in ratio)
    return f"{value} % ({low} to {high} %)"


def _signed(percent: float) -> str:
    return f"{'+' if percent > 0 else ''}{format_number(percent, 2)}"


def detectable_sentence(comparison: Comparison, words: int = MAX_WORDS) -> str:
    """The smallest changes that would have been named, of the usual kinds: the middle one of the joints.

    A level that would have to change by more than itself is told as a multiple. words: no more than these.
    """
    parts = []
    for effect in SEEN_EFFECTS:
        rows = [each for each in comparison.changes if each.effect == effect and not each.changed]
        names = [each.parameter for each in rows]
        first = next((each.name for each in effect_named(effect).parameters if each.name in names), "")
        sizes = sorted((each.detectable, each) for each in rows if each.parameter == first)
        if not sizes:
            continue
        middle = sizes[len(sizes) // 2][1]
        share = detectable_share(middle)
        size = f"{format_number(middle.detectable, 2)} {format_unit(middle.unit)}"
        size = size if share is None else f"{format_number(100 * share, 2)} %"
        size = size if share is None or share <= 1 else f"{format_number(1 + share, 2)}-fold"
        parts.append(f"{effect_in_words(effect)} {size}")
    while parts:
        sentence = f"Smaller changes than these would not have been seen (middle of all joints): {', '.join(parts)}."
        if len(sentence.split()) <= words:
            return sentence
        parts.pop()
    return ""


def detectable_share(change: Change) -> float | None:
    """The smallest change as a share of the level; of a gain, of the torque."""
    if change.parameter == "gain":
        return change.detectable
    if change.levels is None or not np.mean(change.levels):
        return None
    return change.detectable / abs(float(np.mean(change.levels)))


def comparison_lines(comparison: Comparison) -> Iterator[str]:
    """The verdict, then each change with its rivals and how sure it is."""
    first, second = comparison_sentences(comparison)
    yield from wrap(f"{comparison.status.upper()}: {first} {second}", LINE_WIDTH)
    for each in comparison.findings:
        rivals = [rival_in_words(comparison.arm, rival) for rival in each.not_told]
        also = f"; it could also be {join_words(rivals)}" if rivals else ""
        text = f"{change_phrase(comparison, each)}: {each.equation}, p {format_probability(each.p_value)}{also}"
        yield from wrap(text, LINE_WIDTH, initial_indent="  ", subsequent_indent="    ")
    for step in deciding_steps(comparison):
        yield from wrap(f"next: {step}", LINE_WIDTH, initial_indent="  ", subsequent_indent="    ")
    for trend in comparison.trends:
        yield from wrap(
            trend_phrase(comparison.arm, trend, comparison.names),
            LINE_WIDTH,
            initial_indent="  ",
            subsequent_indent="    ",
        )
    for note in comparison.notes:
        yield from wrap(note, LINE_WIDTH, initial_indent="  ", subsequent_indent="  ")
    if comparison.changes:
        changed = sum(each.changed for each in comparison.changes)
        yield f"  {len(comparison.changes) - changed} of {len(comparison.changes)} parameters show no change"


def make_comparison_file(comparison: Comparison) -> ComparisonFile:
    """The content of `comparison.json`."""
    more_than_two = content_over_recordings(comparison.names, comparison.trends, comparison.dates)
    return ComparisonFile(
        schema=COMPARISON_SCHEMA,
        status=comparison.status,
        summary=" ".join(comparison_sentences(comparison)).strip(),
        old=comparison.names[0],
        new=comparison.names[-1],
        recordings=comparison.names,
        level=ComparisonTuning().level,
        findings=tuple(_finding_entry(each) for each in comparison.findings),
        doubtful=None if comparison.doubtful is None else _finding_entry(comparison.doubtful),
        changes=tuple(_change_entry(each) for each in comparison.changes),
        smallest_detectable=tuple(_detectable_entry(each) for each in comparison.changes),
        notes=comparison.notes,
        **more_than_two,
    )


def _finding_entry(each: NamedChange) -> FindingEntry:
    members = [ClassMember(effect=one.effect, joint=one.joint, probability=one.probability) for one in each.members]
    own_class: dict[str, Any] = {"class": tuple(members)}
    return FindingEntry(
        effect=each.effect,
        kind=kind_of_effect(effect_named(each.effect)),
        joint=each.joint,
        joints=each.joints,
        form=each.form or None,
        parameters={
            one.name: ParameterEntry(value=one.value, ci95=one.interval, unit=one.unit) for one in each.parameters
        },
        equation=each.equation,
        heldout_rms_before=each.rms_before,
        heldout_rms_after=each.rms_after,
        p_value=each.p_value,
        probability=each.probability,
        rivals=tuple(RivalEntry(effect=rival.effect, joint=rival.joint) for rival in each.rivals),
        **own_class,
    )


def _change_entry(each: Change) -> ChangeEntry:
    return ChangeEntry(
        effect=each.effect,
        joint=each.joint,
        joints=each.joints,
        parameter=each.parameter,
        old=each.old,
        new=each.new,
        difference=each.difference,
        difference_ci95=each.interval,
        ratio=None if each.ratio is None else each.ratio[0],
        ratio_ci95=None if each.ratio is None else each.ratio[1:],
        unit=each.unit,
        p_value=each.p_value,
        changed=each.changed,
    )


def _detectable_entry(each: Change) -> DetectableEntry:
    return DetectableEntry(
        effect=each.effect,
        joint=each.joint,
        parameter=each.parameter,
        change=each.detectable,
        unit=each.unit,
        share=detectable_share(each),
    )


TABLE_HEADINGS = ("parameter", "where", "old", "new", "difference, 95 %", "unit", "p", "smallest seen")
PICTURE_WIDTH, ROW_HEIGHT, NAMES_WIDTH = 372.0, 28.0, 208.0
MAX_DRAWN_CHANGES = 24


@dataclass(frozen=True)
class ChangeCard:
    """A named change: numbers, what it explains, and what else it could be."""

    title: str
    texts: Sequence[str]
    numbers: Table


def comparison_page(comparison: Comparison, command: str) -> str:
    """HTML text."""
    kind = {"changed": "mismatch", "same": "none", "inconclusive": "inconclusive"}[comparison.status]
    changes = comparison.changes
    return render_page(
        __package__,
        "comparison.html",
        f"What changed between {join_words(comparison.names)}",
        status=kind,
        verdict=comparison_sentences(comparison),
        steps=list(deciding_steps(comparison)),
        changed=_named_table(comparison) if comparison.findings else None,
        cards=[_card(comparison.arm, each, comparison.names) for each in comparison.findings],
        trends=trend_part(comparison.arm, comparison.trends, comparison.names, comparison.dates),
        picture=draw_changes(comparison.arm, changes) if changes else None,
        moved=_changes_table(comparison.arm, [each for each in changes if each.changed]),
        still=_changes_table(comparison.arm, [each for each in changes if not each.changed]),
        notes=comparison.notes,
        origin=origin_of(comparison.recordings[-1], comparison.simulation, command),
    )


def deciding_steps(comparison: Comparison) -> Iterator[str]:
    """What would tell each change from what else it could be, where any motion does."""
    for each in comparison.findings:
        own = {(each.effect, each.joint)}
        others = [one for one in each.rivals if not one.identical and (one.effect, one.joint) not in own]
        if others:
            names = join_words([rival_in_words(comparison.arm, one) for one in others], "or")
            where = at_place(comparison.arm, effect_in_words(each.effect), each.effect, each.joint, each.joints)
            yield f"To tell {where} from {names}: {effect_named(each.effect).experiment}."


def _named_table(comparison: Comparison) -> Table:
    """What changed, where and by how much, and what else it could be."""
    rows = []
    for each in comparison.findings:
        amounts = "; ".join(_amounts(comparison, each)) or each.equation
        where = place_in_words(comparison.arm, each.effect, each.joint, each.joints)
        rivals = (
            join_words([rival_in_words(comparison.arm, rival) for rival in each.rivals], "or") if each.rivals else "–"
        )
        rows.append([effect_in_words(each.effect), where, amounts, rivals])
    return Table(["what", "where", "change, 95 % interval", "it could also be"], rows, (1, 2, 3), stacked=True)


def _card(arm: Arm, named: NamedChange, names: Sequence[str]) -> ChangeCard:
    rows = [[one.name, one.value, one.interval, one.unit] for each in named.parameters for one in parameter_rows(each)]
    factors = [f"{format_number(1 + gain)} times in {name}" for name, gain in zip(names, named.gains, strict=True)]
    rivals = [rival_in_words(arm, each) for each in named.not_told]
    alone = "Nothing else" if len(named.told) == 1 else "Nothing but these"
    texts = (
        f"{named.equation}. Log evidence {named.evidence:.0f}, p-value {format_probability(named.p_value)}.",
        f"Without this change the squared held-out error is larger: {join_words(factors)}.",
        f"It could also be {join_words(rivals)}." if rivals else f"{alone} explains it nearly as well.",
    )
    numbers = Table(["change of", "value", "95 % interval", "unit"], rows, (0, 3), stacked=True)
    title = _names_phrase(arm, named)
    return ChangeCard(f"{title[0].upper()}{title[1:]}", texts, numbers)


def _changes_table(arm: Arm, changes: Sequence[Change]) -> Table:
    return Table(TABLE_HEADINGS, [_change_row(arm, each) for each in changes], (0, 1, 5), stacked=True)


def _change_name(change: Change) -> str:
    return f"{number_in_words(change.parameter)}, {effect_in_words(change.effect)}"


def _change_row(arm: Arm, change: Change) -> list[str]:
    low, high = (format_number(value, PARAMETER_DIGITS) for value in change.interval)
    levels = ["–" if value is None else format_number(value, PARAMETER_DIGITS) for value in (change.old, change.new)]
    return [
        _change_name(change),
        place_in_words(arm, change.effect, change.joint, change.joints),
        *levels,
        f"{low} to {high}",
        format_unit(change.unit),
        format_probability(change.p_value),
        format_number(change.detectable),
    ]


def draw_changes(arm: Arm, changes: Sequence[Change]) -> Markup:
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
        out += svg_element(
            "line", x1=x, x2=x, y1=44, y2=height - 28, stroke=palette.STROKE if value == 0 else palette.GRID
        )
        out += svg_text(text.replace("-", "−"), x, height - 12, 10.5, "middle", fill=palette.PALE)
    for number, each in enumerate(chosen):
        y = 58 + ROW_HEIGHT * number
        where = place_in_words(arm, each.effect, each.joint, each.joints)
        out += svg_text(shorten_text(_change_name(each), NAMES_WIDTH - 12, 10.5), NAMES_WIDTH - 8, y - 2, 10.5, "end")
        out += svg_text(
            shorten_text(where, NAMES_WIDTH - 12, 9.5), NAMES_WIDTH - 8, y + 10, 9.5, "end", fill=palette.PALE
        )
        x = _score_position(_score(each), largest)
        out += svg_element(
            "line", x1=_score_position(0.0, largest), x2=x, y1=y, y2=y, stroke=palette.STROKE, stroke_width=2
        )
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
    folders: Sequence[Path],
    out: Path,
    baseline: str | None,
    seed: int,
    dates: Sequence[date] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> ResultLines:
    """Compares, writes comparison.json and comparison.html into `out`, both or none, and yields lines to print.

    The document is the content of comparison.json, with the written files beside it.

    folders: of the recordings, the oldest first. dates: of each; those of their files if left out. Raises InputError,
    in one line, for recordings that cannot be used or are not of one robot.
    """
    chosen: Baseline | None = next((each for each in get_args(Baseline) if each == baseline), None)
    first, second, *more = (load_recording(each) for each in folders)
    check_output_folder(out, second)
    for each in (second, *more):
        check_same_robot(first, each)
    require_identifiable(first, second, *more)
    require_possible(first, second, *more)
    try:
        comparison = compare(first, second, *more, baseline=chosen, seed=seed, dates=dates, progress=progress)
    except DataError as error:
        raise InputError(f"{' and '.join(map(str, folders))}: {error}") from None
    options = [*(["--baseline", baseline] if baseline else []), *(["--seed", str(seed)] if seed else [])]
    command = comparison_command(folders, out, dates, options)
    return (yield from write_comparison(comparison, out, command))


def comparison_command(folders: Sequence[Path], out: Path, dates: Sequence[date], options: Sequence[str] = ()) -> str:
    """The command that makes a comparison anew."""
    days = ["--dates", ",".join(each.isoformat() for each in dates)] if dates else []
    return shlex.join(["armlab", "diagnose", "--compare", *map(str, folders), "--out", str(out), *options, *days])


def write_comparison(comparison: Comparison, out: Path, command: str) -> ResultLines:
    """Writes comparison.json and comparison.html into `out`, both or none, and yields lines to print."""
    file = make_comparison_file(comparison)
    texts = {"comparison.json": file.to_json(), "comparison.html": comparison_page(comparison, command)}
    written = write_texts(texts, out)
    yield from comparison_lines(comparison)
    yield f"wrote {out}: {', '.join(texts)}"
    return file.content() | {"files": written}
