"""The page of a score on real recordings, its figures, and the tables beside it."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report import palette
from armlab.common.report.palette import svg_text
from armlab.common.report.wording import count_of
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.real.real_score import (
    ANSWERS,
    CASES_TABLE,
    CLAIMS_TABLE,
    MIN_STRENGTH,
    RECORDINGS_TABLE,
    RealTables,
    answer_is_right,
    answer_table,
    kind_table,
    real_measures,
    recording_table,
    reliability_of,
)
from armlab.proof.blind.score.figures import make_figure
from armlab.proof.blind.score.score_page import format_measure, judge_measure

PAGE_FILE, RELIABILITY_FILE, STRENGTH_FILE = "real.md", "reliability.svg", "strength.svg"
INTRODUCTION = f"""\
A model of each real arm is identified from its identification runs. It stands for the simulation. Then something known
is concealed at random: a disturbance is added to the recorded torque of all runs, or a part of the model is withheld.
The diagnosis gets the recording and the model. Kind, place, numbers and size follow from the seed, and each kind comes
once before any comes twice. The control is the same recording with nothing concealed; what half of the cases of the
recording name, or more, each of which conceals something else, stands beside what it names. A claim is *new* where the
control does not name the effect there; of what is sought, where the control does not name that size.

*Strength* is the RMS of the concealed torque over the RMS error of the model on the identification runs, at the joint
where that is largest. Injected strengths are log-uniform from 0.3 to 8; those of withheld parts are what they are. A
strength of {MIN_STRENGTH:g} is no detection limit: the error of the model is physics that the model lacks, more than
noise. Therefore no share of names is wanted."""
HOW_TO_READ = """\
A *wrong name* is a new claim of which neither the first name nor its class of four at most is right. Names that no
motion separates count as one. Another law of friction, where friction is withheld, is neither right nor wrong: the
laws of the model are themselves a choice. What only takes away what the control names, or is held by a law that the
control names there (friction that differs by direction holds Coulomb friction, viscous friction and an offset), needs
no new name and is counted apart. What is `unknown` is no name. *Right among names*: new claims with a name, by the
probability that they state. The weights of the probabilities are learnt on simulated sets and on development cases of
the other real recordings: the one that is judged is left out. *Skill*: one less the score over that of one constant
probability, the share of right names; above 0 is better than this constant. Intervals are 95 %: Wilson's for shares,
as if claims were independent, and bootstrap for skills. *Met*: the figure is as wanted; of a bin, its interval
reaches it."""
RELIABILITY_CAPTION = """\
Share of new names that are right against the probability that they state. Bars: Wilson, 95 %; the number is that of the
claims; on the line, probabilities hold."""
STRENGTH_CAPTION = "Each thing that was sought, by recording and strength. Dotted: the strength that is expected."
ANSWER_STYLES = {  # Okabe and Ito 2008, with a shape each
    "named": (palette.BLUE, "o"),
    "class": (palette.SKY, "D"),
    "law": (palette.GREEN, "v"),
    "unknown": (palette.GREY, "s"),
    "another name": (palette.VERMILION, "^"),
    "missed": (palette.BLACK, "x"),
    "cancelled": (palette.ORANGE, "P"),
    "absorbed": (palette.PINK, "p"),
}


def write_score(seed: int, tables: RealTables, folder: Path) -> tuple[Path, ...]:
    """Writes page, tables and figures, all or none."""
    texts = {
        PAGE_FILE: render_page(seed, tables),
        CASES_TABLE: tables.cases.to_csv(index=False, lineterminator="\n"),
        CLAIMS_TABLE: tables.claims.to_csv(index=False, lineterminator="\n"),
        RECORDINGS_TABLE: tables.recordings.to_csv(index=False, lineterminator="\n"),
        RELIABILITY_FILE: svg_text(draw_reliability(tables), "reliability"),
        STRENGTH_FILE: svg_text(draw_strengths(tables), "strength"),
    }
    return write_texts(texts, folder)


def render_page(seed: int, tables: RealTables) -> str:
    """The page."""
    judged = seed not in DEVELOPMENT_SEEDS
    kind = "Judged set." if judged else "Development set, not judged."
    about = f"{kind} {count_of(tables.number, 'case')} of {count_of(len(tables.recordings), 'recording')}, seed {seed}."
    about += " All judged runs: [log](../log.md)." if judged else ""
    measured = [
        (
            each.title,
            each.measure.wanted or "-",
            format_measure(each.measure),
            each.measure.number,
            judge_measure(each.measure),
        )
        for each in real_measures(tables)
    ]
    return markdown_page(
        "Real recordings with something concealed at random",
        about,
        INTRODUCTION,
        "## Wanted and found",
        markdown_table(("measure", "wanted", "found", "of", ""), measured, numbers=(3,)),
        HOW_TO_READ,
        f"![Reliability]({RELIABILITY_FILE})",
        RELIABILITY_CAPTION,
        "## What became of each",
        _frame_table(answer_table(tables)),
        f"![Answers by strength]({STRENGTH_FILE})",
        STRENGTH_CAPTION,
        "## By recording",
        _frame_table(recording_table(tables)),
        "## By kind",
        _frame_table(kind_table(tables)),
        "## Wrong names, one by one",
        _rows_or_none(tables.claims[tables.claims["verdict"] == "wrong"], WRONG_COLUMNS),
        f"## Not named, strength {MIN_STRENGTH:g} and more",
        _rows_or_none(tables.strong[~answer_is_right(tables.strong)], MISS_COLUMNS),
        "## The models and their controls",
        _frame_table(tables.recordings),
        f"All cases: [{CASES_TABLE}]({CASES_TABLE}); all new claims: [{CLAIMS_TABLE}]({CLAIMS_TABLE}).",
    )


WRONG_COLUMNS = ["recording", "concealed", "strength", "claim", "probability"]
MISS_COLUMNS = ["recording", "sought", "concealed", "strength", "answer", "said"]


def _rows_or_none(frame: pd.DataFrame, columns: list[str]) -> str:
    return _frame_table(frame[columns]) if len(frame) else "None."


def _frame_table(frame: pd.DataFrame) -> str:
    numbers = [place for place, column in enumerate(frame.columns) if pd.api.types.is_numeric_dtype(frame[column])]
    rows = (tuple(map(_format_cell, row)) for row in frame.itertuples(index=False))
    return markdown_table(tuple(map(str, frame.columns)), rows, numbers=numbers)


def _format_cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def draw_reliability(tables: RealTables) -> Any:
    """Share of right names against the probability that they state, in bins."""
    figure, axes = make_figure((4.4, 4.0))
    table = reliability_of(tables)
    axes.plot([0, 1], [0, 1], color=palette.GREY, linestyle=":")
    axes.errorbar(
        table["mean"],
        table["share"],
        yerr=[table["share"] - table["low"], table["high"] - table["share"]],
        color=palette.BLUE,
        marker="o",
        linestyle="none",
        capsize=3,
    )
    for each in table.itertuples():
        axes.annotate(f"{each.number}", (each.mean, each.share), (6, -10), textcoords="offset points", fontsize=8)
    axes.set(
        xlim=(0, 1.02), ylim=(-0.06, 1.04), xlabel="stated probability, mean of a bin", ylabel="share that is right"
    )
    axes.set_title("real recordings", fontsize=9)
    return figure


def draw_strengths(tables: RealTables) -> Any:
    """A row a recording, a mark for each thing that was sought, by strength and answer."""
    names = list(tables.recordings["recording"])
    figure, axes = make_figure((7.5, 1.6 + 0.6 * len(names)))
    for answer, (colour, mark) in ANSWER_STYLES.items():
        own = tables.cases[tables.cases["answer"] == answer]
        heights = [names.index(each) for each in own["recording"]] + 0.5 * ((own["case"] * 0.618) % 1 - 0.5)
        axes.plot(own["strength"], heights, mark, color=colour, label=ANSWERS[answer], markersize=6)
    axes.axvline(MIN_STRENGTH, color=palette.GREY, linestyle=":")
    axes.set(xscale="log", xlabel="strength", ylim=(len(names) - 0.5, -0.5))
    axes.set_xticks([0.3, 1, 3, 10, 30], ["0.3", "1", "3", "10", "30"])
    axes.minorticks_off()
    axes.set_yticks(range(len(names)), names)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure
