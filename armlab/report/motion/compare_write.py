"""Compares recordings of motion only and writes comparison.json and a page."""

from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path

from armlab.common.documents import ResultLines
from armlab.common.files import write_texts
from armlab.common.report.page import Table, render_page
from armlab.common.report.wording import format_unit, join_words
from armlab.diagnosis.formats import (
    COMPARISON_SCHEMA,
    ChangeEntry,
    ComparisonFile,
    DetectableEntry,
    FindingEntry,
    ParameterEntry,
    RivalEntry,
    kind_of_effect,
)
from armlab.diagnosis.motion.compare import MotionComparison, ServoChange, compare_motion
from armlab.diagnosis.motion.compare_load import compare_load
from armlab.diagnosis.motion.motion_tuning import DEFAULT
from armlab.effects.library import effect_named
from armlab.recordings.motion import load_motion_recording
from armlab.report.changes.comparison_report import comparison_command, write_comparison
from armlab.report.changes.trend_report import content_over_recordings, trend_part, trend_phrase
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words


def comparison_summary(comparison: MotionComparison) -> str:
    """What changed and by how much."""
    names = join_words(comparison.names)
    if comparison.reason:
        return f"{names} cannot be compared: {comparison.reason}."
    if not comparison.changed:
        return f"Nothing changed between {names} that the recordings show."
    phrases = "; ".join(change_phrase(comparison.arm, each) for each in comparison.changed)
    return f"Between {names} this changed: {phrases}. Nothing else changed."


def change_phrase(arm: Arm, change: ServoChange) -> str:
    """A change with its numbers."""
    unit, where = format_unit(change.parameter.unit), joint_in_words(arm, change.joint)
    words = f"{effect_named(change.parameter.effect).words} at {where} ({change.parameter.name} from "
    words += f"{' to '.join(f'{each:.4g}' for each in change.levels.values)} {unit}".rstrip()
    whole = "in all " if len(change.levels.values) > 2 else ""
    if change.ratio is not None:
        return f"{words}, {whole}a factor of {change.ratio[0]:.4g}, {change.ratio[1]:.4g} to {change.ratio[2]:.4g})"
    low, high = change.difference_interval
    return f"{words}, {whole}a change of {change.difference:.4g}, {low:.4g} to {high:.4g})"


def make_motion_comparison(comparison: MotionComparison) -> ComparisonFile:
    """The content of `comparison.json`. Errors are of positions, rad (m)."""
    more_than_two = content_over_recordings(comparison.names, comparison.trends, comparison.dates)
    return ComparisonFile(
        schema=COMPARISON_SCHEMA,
        status="inconclusive" if comparison.reason else "changed" if comparison.changed else "same",
        summary=comparison_summary(comparison),
        old=comparison.names[0],
        new=comparison.names[-1],
        recordings=comparison.names,
        level=DEFAULT.max_p_value,
        findings=tuple(_finding(each) for each in comparison.changed),
        changes=tuple(_entry(each) for each in comparison.changes),
        smallest_detectable=tuple(
            DetectableEntry(
                effect=each.parameter.effect,
                joint=each.joint,
                parameter=each.parameter.name,
                change=each.detectable,
                unit=each.parameter.unit,
                share=each.detectable / abs(each.old) if each.old else None,
            )
            for each in comparison.changes
            if each.is_told
        ),
        notes=comparison.notes,
        **more_than_two,
    )


def _entry(each: ServoChange) -> ChangeEntry:
    return ChangeEntry(
        effect=each.parameter.effect,
        joint=each.joint,
        joints=(each.joint,),
        parameter=each.parameter.name,
        old=each.old,
        new=each.new,
        difference=each.difference,
        difference_ci95=each.difference_interval,
        ratio=None if each.ratio is None else each.ratio[0],
        ratio_ci95=None if each.ratio is None else each.ratio[1:],
        unit=each.parameter.unit,
        p_value=each.p_value,
        changed=each.changed,
    )


def _finding(each: ServoChange) -> FindingEntry:
    parameter = ParameterEntry(value=each.difference, ci95=each.difference_interval, unit=each.parameter.unit)
    levels = " -> ".join(f"{level:.4g}" for level in each.levels.values)
    assert each.before is not None
    assert each.after is not None
    return FindingEntry(
        effect=each.parameter.effect,
        kind=kind_of_effect(effect_named(each.parameter.effect)),
        joint=each.joint,
        joints=(each.joint,),
        parameters={each.parameter.name: parameter},
        equation=each.parameter.equation.format(joint=each.joint, value=levels),
        heldout_rms_before=each.before,
        heldout_rms_after=each.after,
        p_value=each.p_value,
        rivals=tuple(RivalEntry(effect=rival, joint=each.joint) for rival in each.parameter.rivals),
    )


def comparison_page(comparison: MotionComparison, command: str) -> str:
    """HTML text of the page."""
    rows = [
        (
            joint_in_table(comparison.arm, each.joint),
            each.parameter.key,
            f"{each.old:.4g}",
            *(f"{level:.4g}" if each.changed else "unchanged" for level in each.levels.values[1:]),
            f"{each.difference_interval[0]:.3g} to {each.difference_interval[1]:.3g}" if each.is_told else "not told",
            f"{each.detectable:.3g}" if each.is_told else "not told",
            format_unit(each.parameter.unit),
        )
        for each in comparison.changes
    ]
    measures = ("change from first to last, 95 % interval", "smallest change seen", "unit")
    headings = ("joint", "number", *comparison.names, *measures)
    return render_page(
        __package__,
        "motion_comparison.html",
        f"Comparison of {join_words(comparison.names)}",
        status="inconclusive" if comparison.reason else "mismatch" if comparison.changed else "none",
        summary=comparison_summary(comparison),
        numbers=Table(headings, rows, (1, len(headings) - 1), stacked=True),
        trends=trend_part(comparison.arm, comparison.trends, comparison.names, comparison.dates),
        notes=comparison.notes,
        command=command,
    )


def compare_motion_recordings(
    folders: Sequence[Path],
    out: Path,
    dates: Sequence[date] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> ResultLines:
    """Compares recordings, writes comparison.json and comparison.html into `out`, and yields lines to print.

    folders, dates: as of `compare_recordings`. Raises InputError, in one line, for recordings that cannot be used.
    """
    recordings = [load_motion_recording(folder) for folder in folders]
    command = comparison_command(folders, out, dates)
    load = compare_load(*recordings, dates=dates)
    if load is not None:
        return (yield from write_comparison(load, out, command))
    comparison = compare_motion(*recordings, dates=dates, progress=progress)
    file = make_motion_comparison(comparison)
    texts = {"comparison.json": file.to_json(), "comparison.html": comparison_page(comparison, command)}
    written = write_texts(texts, out)
    yield f"{file.status.upper()}: {file.summary}"
    yield from (f"  {trend_phrase(comparison.arm, each, comparison.names)}" for each in comparison.trends)
    yield from (f"  {note}" for note in comparison.notes)
    yield f"wrote {out}: {', '.join(texts)}"
    return file.content() | {"files": written}
