"""The report on concealed effects in real recordings: concealed.md, concealed.csv and concealed.svg, and the command
that writes them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report import palette
from armlab.common.report.palette import svg_text
from armlab.common.report.wording import format_number, format_unit
from armlab.common.settings import suggest_name
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import EFFECT_IDS, effect_named
from armlab.proof.open.real_concealed.cases_of_recording import ConcealedStudy, study_recording
from armlab.proof.open.real_concealed.examine import ExaminedCase, ReportedFinding, open_outcomes
from armlab.proof.open.real_concealed.fixed_plan import INJECTED
from armlab.proof.open.real_concealed.judge import Answer, CaseVerdict, ComparedNumber, JudgedPart
from armlab.proof.open.real_identification.looks import LOOKS_FILE, Looks
from armlab.recordings.reading.words import NAMES as MISTAKE_NAMES
from armlab.report.words import effect_in_words

ANSWER_WORDS = {
    "named": "named at its place",
    "identical": "named as what no motion separates from it",
    "law": "another law named",
    "class": "among the rivals of a finding",
    "cancelled": "cancels what the control names, which is gone",
    "elsewhere": "named at another place",
    "missed": "missed",
}


def finding_in_words(finding: ReportedFinding) -> str:
    """A finding with its place, by number as the plan of the concealed effects."""
    place = "the whole robot"
    is_mistake = finding.effect in MISTAKE_NAMES and finding.effect not in EFFECT_IDS
    if finding.joints:
        kind = "link" if not is_mistake and effect_named(finding.effect).where == "link" else "joint"
        place = f"{kind} {' from joint '.join(map(str, finding.joints[:2]))}"
    words = MISTAKE_NAMES[finding.effect] if is_mistake else effect_in_words(finding.effect)
    return f"{words}, {place}"


def answer_in_words(part: JudgedPart) -> str:
    """The answer, and the finding where that is another."""
    words = ANSWER_WORDS[part.answer]
    return words if part.answer == "named" or part.finding is None else f"{words} ({finding_in_words(part.finding)})"


def sizes_in_words(part: JudgedPart) -> str:
    """True or reference's value -> found with interval, and whether they fit; the law where none is comparable."""
    law = "–" if part.finding is None else f"`{part.finding.equation}`"
    return "; ".join(_size_in_words(each) for each in part.numbers) or law


def _size_in_words(number: ComparedNumber) -> str:
    truth, span = number.truth[1], number.size.interval
    known = format_number(number.truth[0]) + (
        "" if truth is None else f" ({format_number(truth[0])} to {format_number(truth[1])})"
    )
    own = format_number(number.size.value) + (
        "" if span is None else f" ({format_number(span[0])} to {format_number(span[1])})"
    )
    fits = {True: "", False: ", **no**", None: ""}[number.holds]
    return f"{number.size.name} {known} → {own} {format_unit(number.size.unit)}".rstrip() + fits


def format_percent(outcome: ExaminedCase, errors: Sequence[float]) -> str:
    """Of the measured torque, over all joints."""
    return f"{100 * math.hypot(*errors) / math.hypot(*outcome.torque):.1f} %"


def format_share(value: float | None) -> str:
    """A share with two decimals."""
    return "–" if value is None else f"{value:.2f}".replace("-", "−")


def list_findings(findings: Sequence[ReportedFinding]) -> str:
    """Findings in a cell."""
    return "; ".join(finding_in_words(each) for each in findings) or "–"


CSV_COLUMNS = (
    "recording",
    "concealed",
    "way",
    "sought",
    "answer",
    "finding",
    "strength",
    "joint_shown",
    "error_handed_over",
    "error_reference",
    "error_found",
    "recovered",
    "gap_closed",
    "numbers",
    "numbers_that_fit",
    "others",
)


def studies_csv(studies: Sequence[ConcealedStudy]) -> str:
    """The table as text; errors are RMS in N m (N) at the joint shown."""
    rows = [row for study in studies for each in study.verdicts for row in _verdict_rows(study, each)]
    out = StringIO()
    pd.DataFrame(rows, columns=list(CSV_COLUMNS)).to_csv(out, index=False, float_format="%.4g", lineterminator="\n")
    return out.getvalue()


def _verdict_rows(study: ConcealedStudy, verdict: CaseVerdict) -> Iterator[tuple[Any, ...]]:
    outcome, joint = verdict.outcome, verdict.joint_shown - 1
    way = "withheld" if verdict.case.injected is None else "injected"
    for each in verdict.parts:
        yield (
            study.name,
            verdict.case.name,
            way,
            each.sought.label,
            each.answer,
            "" if each.finding is None else finding_in_words(each.finding),
            verdict.strength,
            verdict.joint_shown,
            outcome.given[joint],
            study.control.given[joint],
            outcome.found[joint],
            outcome.recovered,
            verdict.gap,
            _numbers_text(each),
            sum(bool(one.holds) for one in each.numbers),
            "; ".join(finding_in_words(one) for one in verdict.others),
        )


def _numbers_text(part: JudgedPart) -> str:
    return "; ".join(
        f"{one.effect} {one.size.name} {one.truth[0]:.4g} -> {one.size.value:.4g}"
        + ("" if one.size.interval is None else f" [{one.size.interval[0]:.4g} {one.size.interval[1]:.4g}]")
        for one in part.numbers
    )


PICTURE_NAME = "concealed.svg"
INTRODUCTION = f"""\
A complete model of each arm is identified from its identification runs (components and filters by cross-validation,
links that bodies can have). Either a part of that reference is withheld, or a known disturbance is added to the torque
of every run. The diagnosis gets the recording and the model, and has to say what is concealed. All errors are those of
the filtered torque on runs that took no part; every look at those is logged.

![What was found]({PICTURE_NAME})

*Strength*: RMS of the torque that is concealed over the error of the reference, at the joint where that is largest.
*Recovered*: share of the concealed torque that the findings sought hold. *Gap*: from the error of the model handed
over (0) to what is left of the untouched recording with the findings of the control (1), at that joint, by named
findings alone. *Others*: findings that are neither sought nor in the control. Where the control names the same effect
at the same place, its number is taken off (not from *recovered*), and it counts only beyond its interval. **no**: the
interval does not hold the truth, or does not overlap that of the reference; friction is so judged only where the very
laws are found that were withheld, for others share the same torque in other ways."""


def studies_markdown(studies: Sequence[ConcealedStudy]) -> str:
    """The whole page."""
    sections = (part for each in studies for part in _study_parts(each))
    counts = "\n".join(_all_count_lines(studies))
    return markdown_page("Real recordings with something concealed", INTRODUCTION, counts, *sections)


def count_lines(verdicts: Sequence[CaseVerdict], title: str) -> Iterator[str]:
    """What was sought and found, in lines."""
    if not verdicts:
        return
    answers = [each.answer for verdict in verdicts for each in verdict.parts]
    tally = ", ".join(f"{answers.count(name)} {words}" for name, words in ANSWER_WORDS.items() if name in answers)
    holds = [
        each.holds for verdict in verdicts for one in verdict.parts for each in one.numbers if each.holds is not None
    ]
    gaps = [verdict.gap for verdict in verdicts if verdict.gap is not None]
    named = [each for verdict in verdicts for each in verdict.others if each.effect != UNKNOWN.id]
    unknown = sum(len(verdict.others) for verdict in verdicts) - len(named)
    yield (
        f"- {title}: {len(verdicts)} cases, {len(answers)} things to name: {tally}. "
        f"{sum(holds)} of {len(holds)} intervals fit. Median gap closed {np.median(gaps):.2f}. "
        f"Other new findings: {len(named)} names, {unknown} unknown."
    )


def _all_count_lines(studies: Sequence[ConcealedStudy]) -> Iterator[str]:
    every = [each for one in studies for each in one.verdicts]
    yield from count_lines([each for each in every if each.case.injected is None], "Withheld")
    yield from count_lines([each for each in every if each.case.injected is not None], "Injected")
    for low, high in ((0.0, 1.0), (1.0, 3.0), (3.0, np.inf)):
        own = [each for each in every if each.case.injected is not None and low <= each.strength < high]
        upper = "" if np.isinf(high) else f" to {high:g}"
        yield from count_lines(own, f"Injected, strength {low:g}{upper}{' and more' if np.isinf(high) else ''}")


def _study_parts(study: ConcealedStudy) -> Iterator[str]:
    control = study.control
    yield f"## {study.name}"
    yield (
        f"Reference: {study.reference.description}. "
        f"Error {format_percent(control, control.given)}, {format_percent(control, control.found)} with the "
        "model that the control finds."
    )
    yield f"Control, nothing concealed: {'; '.join(map(finding_in_words, control.findings)) or 'nothing'}."
    withheld = [each for each in study.verdicts if each.case.injected is None]
    injected = [each for each in study.verdicts if each.case.injected is not None]
    yield markdown_table(WITHHELD_HEADINGS, [_withheld_row(each, study) for each in withheld], numbers=(1, 3, 4))
    sought = [
        (each.case.name, one.sought.label, answer_in_words(one), sizes_in_words(one))
        for each in withheld
        for one in each.parts
    ]
    yield markdown_table(("withheld", "sought", "answer", "reference → found"), sought)
    yield markdown_table(INJECTED_HEADINGS, map(_injected_row, injected), numbers=(1, 4, 5))


WITHHELD_HEADINGS = (
    "withheld",
    "strength",
    "error handed over / reference / found",
    "recovered",
    "gap",
    "further laws",
    "others",
)
INJECTED_HEADINGS = ("injected", "strength", "answer", "truth → found", "recovered", "gap", "others")


def _withheld_row(verdict: CaseVerdict, study: ConcealedStudy) -> tuple[str, ...]:
    outcome = verdict.outcome
    errors = (outcome.given, study.control.given, outcome.found)
    return (
        verdict.case.name,
        f"{verdict.strength:.1f}",
        " / ".join(format_percent(outcome, each) for each in errors),
        format_share(outcome.recovered),
        format_share(verdict.gap),
        list_findings(verdict.laws),
        list_findings(verdict.others),
    )


def _injected_row(verdict: CaseVerdict) -> tuple[str, ...]:
    (one,) = verdict.parts
    return (
        verdict.case.name,
        f"{verdict.strength:.1f}",
        answer_in_words(one),
        sizes_in_words(one),
        format_share(verdict.outcome.recovered),
        format_share(verdict.gap),
        list_findings(verdict.others),
    )


# Okabe and Ito 2008, with a shape each: told apart by everyone, in grey too
ANSWER_STYLES: dict[Answer, tuple[str, str, str]] = {
    "named": (palette.BLUE, "o", "named at its place"),
    "identical": (palette.SKY, "s", "named as what no motion separates from it"),
    "law": (palette.GREEN, "v", "another law named"),
    "class": (palette.ORANGE, "D", "among the rivals of a finding"),
    "cancelled": (palette.GREY, "P", "cancels what the control names"),
    "elsewhere": (palette.PINK, "^", "named at another place"),
    "missed": (palette.BLACK, "x", "missed"),
}
ROW_INCHES = 0.24  # inches


def draw_studies(studies: Sequence[ConcealedStudy]) -> Any:
    """The picture: a panel a recording, a row a case."""
    from matplotlib.figure import Figure

    rows = [len(each.verdicts) for each in studies]
    figure = Figure(figsize=(9.5, 1.6 + ROW_INCHES * (sum(rows) + 2 * len(rows))), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=[count + 1 for count in rows])[
        :, 0
    ]
    for panel, each in zip(panels, studies, strict=True):
        _draw_panel(panel, each)
    panels[-1].set_xlabel("strength: RMS of the concealed torque over the error of the reference model")
    handles = [
        panels[0].plot([], [], mark, color=colour, label=text)[0] for colour, mark, text in ANSWER_STYLES.values()
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    return figure


def _draw_panel(panel: Any, study: ConcealedStudy) -> None:
    verdicts = study.verdicts
    for row, verdict in enumerate(verdicts):
        counts = _answer_counts(verdict)
        for place, (answer, count) in enumerate(counts):
            colour, mark, _ = ANSWER_STYLES[answer]
            at = verdict.strength * 1.13**place
            panel.plot(at, row, mark, color=colour, markersize=6.5, markeredgewidth=2 if mark == "x" else 1)
            if len(verdict.parts) > 1:
                panel.annotate(str(count), (at, row), (0, 5), textcoords="offset points", fontsize=6, ha="center")
        words = [] if verdict.gap is None else [f"gap {verdict.gap:.2f}"]
        words += [f"{len(verdict.others)} others"] if verdict.others else []
        panel.annotate(", ".join(words), (1.01, row), xycoords=("axes fraction", "data"), fontsize=7, va="center")
    panel.set_yticks(range(len(verdicts)), [each.case.name for each in verdicts], fontsize=7.5)
    panel.set(xscale="log", xlim=(0.2, 30), ylim=(len(verdicts) - 0.3, -0.7))
    panel.set_xticks([0.3, 1, 3, 10, 30], ["0.3", "1", "3", "10", "30"])
    panel.set_xticks([], minor=True)
    panel.axvline(1, color="0.6", linestyle=":", linewidth=1, zorder=0)
    panel.grid(axis="y", color="0.92")
    panel.set_axisbelow(True)
    panel.set_title(study.name, loc="left", fontsize=9)


def _answer_counts(verdict: CaseVerdict) -> list[tuple[Answer, int]]:
    answers = np.array([each.answer for each in verdict.parts])
    return [(answer, int(np.sum(answers == answer))) for answer in ANSWER_STYLES if np.any(answers == answer)]


OUTCOMES_FOLDER = ".concealed"


def conceal_in_recordings(
    results: Path, recordings: Path, only: Sequence[str] = (), progress: Callable[[str], None] = lambda message: None
) -> Iterator[str]:
    """Lines that tell what was found and written; InputError for an unknown name.

    Table, page and picture hold the recordings of this call. What is interrupted goes on.
    """
    names = list(INJECTED)
    for name in only:
        if name not in names:
            raise InputError(f"unknown recording '{name}': {suggest_name(name, names)}")
    kept, looks, studies = open_outcomes(recordings / OUTCOMES_FOLDER), Looks(results / LOOKS_FILE), []
    for name in (each for each in names if not only or each in only):
        studies.append(study_recording(name, recordings, kept, looks, progress))
        yield from count_lines(studies[-1].verdicts, name)
    texts = {
        "concealed.md": studies_markdown(studies),
        "concealed.csv": studies_csv(studies),
        PICTURE_NAME: svg_text(draw_studies(studies), "concealed"),
    }
    yield from (str(path) for path in write_texts(texts, results))
