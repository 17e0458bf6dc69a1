"""The gallery: pictures of cases, successes and failures alike, chosen by a fixed rule.

Of each group of outcomes and each tier the first cases in the order of the manifest are shown. Names are random, so
this order is independent of the diagnosis. The number of cases in each group stands beside the pictures.
"""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.cases import JudgedCase
from armlab.proof.blind.score.figures import BLACK, BLUE, GREY, ORANGE, SKY, make_figure
from armlab.proof.blind.score.held_out import SCORE_CUTOFF_HZ, HeldOut, filter_held_out_run, rms
from armlab.proof.blind.score.outcomes import OUTCOME_GROUPS, list_outcomes
from armlab.proof.blind.score.rows import ScoreRows, to_records
from armlab.proof.blind.score.words import (
    describe_background,
    describe_hidden,
    describe_place,
    describe_said,
    name_hidden,
    name_said,
)

PICTURE_SIZE_IN, PICTURE_DPI = (7.8, 4.9), 100
PALETTE_SIZE = 48  # colours of a picture: a file of about 30 kB without a visible difference
FLOOR_BAND = 2  # times the noise floor


def choose_joint(run: HeldOut, joint: int | None) -> int:
    """The joint to draw, from 0: the given one, else that with the largest error of the simulation in noise floors."""
    return int(np.argmax(rms(run.given) / rms(run.floor))) if joint is None else joint - 1


def draw_residuals(run: HeldOut, joint: int, title: str, with_friction: bool, path: Path) -> None:
    """Writes the picture of one joint, from 0, as a small PNG.

    with_friction: also what rigid links and plain friction, refitted, leave: where friction is in the background it
    hides all else.
    """
    figure, (above, middle, below) = make_figure(PICTURE_SIZE_IN, rows=3)
    time, floor = run.time, float(rms(run.floor)[joint])
    above.plot(time, run.torque[:, joint], color=BLACK, lw=1.1, label="measured")
    above.plot(time, (run.torque - run.given)[:, joint], color=ORANGE, lw=1.0, ls="--", label="simulation as given")
    _draw_residual(middle, time, run.given[:, joint], ORANGE, "simulation as given")
    _draw_residual(middle, time, run.refit[:, joint], BLUE, "rigid links refitted", "--")
    if with_friction:
        _draw_residual(below, time, run.friction[:, joint], SKY, "before: rigid links and\nplain friction refitted")
    if run.after is not None:
        _draw_residual(below, time, run.after[:, joint], BLACK, "after: model of the verdict")
    else:
        below.text(0.5, 0.8, "the verdict came without a prediction", transform=below.transAxes, ha="center")
    for axes in (middle, below):
        axes.axhspan(-FLOOR_BAND * floor, FLOOR_BAND * floor, color=GREY, alpha=0.45, lw=0, zorder=0)
    below.fill_between(
        [], [], color=GREY, alpha=0.45, lw=0, label=f"noise floor, ±{FLOOR_BAND} rms of\nthe true model's {floor:.3g}"
    )
    figure.suptitle(title, fontsize=8, x=0.01, ha="left")
    for axes, what in ((above, "torque"), (middle, "left before"), (below, "left after")):
        axes.set_ylabel(f"{what}, N m", fontsize=8)
        axes.tick_params(labelsize=7.5)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7, frameon=False)
        axes.set_xlim(time[0], time[-1])
    below.set_xlabel(f"time in the held-out run, s (all low-passed at {SCORE_CUTOFF_HZ:g} Hz)", fontsize=8)
    figure.align_ylabels()
    _write_png(figure, path)


def _draw_residual(axes: Any, time: Array, residual: Array, colour: str, what: str, line: str = "-") -> None:
    error = float(np.sqrt(np.mean(residual**2)))
    axes.plot(time, residual, color=colour, lw=1.0, ls=line, label=f"{what},\nrms {error:.3g}")


def _write_png(figure: Any, path: Path) -> None:
    """Writes few colours and no date, so that the file is small and always the same."""
    from PIL import Image

    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=PICTURE_DPI, metadata={"Software": None})
    drawn.seek(0)
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(PALETTE_SIZE, dither=Image.Dither.NONE).save(path, optimize=True)


GALLERY_FOLDER, GALLERY_PAGE = "gallery", "gallery.md"
CASES_PER_GROUP = 2  # pictures a group and tier
SELECTION_RULE = (
    f"Each group and tier shows its first {CASES_PER_GROUP} cases in the order of the manifest; names are random. "
    "A picture shows the joint of the hidden effect or of the claim; for the whole arm, and where nothing is hidden, "
    "it shows the joint with the largest error of the simulation as given, in noise floors. All torques are of the "
    f"held-out run, low-passed at {SCORE_CUTOFF_HZ:g} Hz. Grey: ±{FLOOR_BAND} rms of what the true torque leaves. "
    "Sizes are in detection limits; groups of effects hold those above three. *Said* leaves out right findings of the "
    "background."
)


def choose_items(table: ScoreRows) -> pd.DataFrame:
    """The items to show: the first few different cases of each group and tier."""
    first = list_outcomes(table).drop_duplicates(["group", "tier", "case"])
    return first[first.groupby(["group", "tier"]).cumcount() < CASES_PER_GROUP]


def write_gallery(cases: Sequence[JudgedCase], table: ScoreRows, out: Path) -> frozenset[str]:
    """Writes gallery.md and the pictures that it shows, whose names it returns."""
    folder = out / GALLERY_FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    known, shown = {case.name: case for case in cases}, choose_items(table)
    files = [_draw_item(known[item["case"]], item, folder) for item in to_records(shown)]
    (out / GALLERY_PAGE).write_text(_render_gallery(known, table, shown.assign(file=files)), encoding="utf-8")
    return frozenset(files)


def remove_other_pictures(out: Path, shown: frozenset[str]) -> None:
    """Removes pictures of an earlier score that the gallery does not show."""
    for old in (out / GALLERY_FOLDER).glob("*-joint-*.png"):
        if old.name not in shown:
            old.unlink()


def tally_outcomes(table: ScoreRows) -> str:
    """How many items there are of each group and tier, as a Markdown table; a success and a failure each a row."""
    counts = list_outcomes(table).groupby(["group", "tier"]).size()
    tiers = sorted(set(table.cases["tier"]))
    rows = [
        (about.title, "success" if about.success else "failure", *(counts.get((group, tier), 0) for tier in tiers))
        for group, about in OUTCOME_GROUPS.items()
    ]
    return markdown_table(("outcome", "", *tiers), rows, numbers=range(2, 2 + len(tiers)))


def _draw_item(case: JudgedCase, item: dict[str, Any], folder: Path) -> str:
    """Name of the picture; a case that two groups show at one joint has one picture."""
    run = filter_held_out_run(case)
    joint = choose_joint(run, None if pd.isna(item["joint"]) else int(item["joint"]))
    file = f"{case.name}-joint-{joint + 1}.png"
    if not (folder / file).is_file():
        draw_residuals(run, joint, _picture_title(case, joint), bool(case.truth.background), folder / file)
    return file


def _picture_title(case: JudgedCase, joint: int) -> str:
    """Which case, what was hidden, what was said beyond the background: a line each."""
    about = f"joint {joint + 1} of {case.truth.arm}, {case.truth.tier} tier, case {case.name}"
    lines = (about, f"hidden: {name_hidden(case)}", f"said: {name_said(case)}")
    return "\n".join(shorten(line, 125, placeholder=" ...") for line in lines)


def _render_gallery(cases: dict[str, JudgedCase], table: ScoreRows, shown: pd.DataFrame) -> str:
    everything = list_outcomes(table)
    parts = [SELECTION_RULE, tally_outcomes(table)]
    for success, title in ((True, "Successes"), (False, "Failures")):
        parts.append(f"## {title}")
        for group, about in OUTCOME_GROUPS.items():
            if about.success == success:
                own, of = shown[shown["group"] == group], everything[everything["group"] == group]
                parts.append(f"### {about.title}: {_count_shown(own, of)}")
                parts += [_render_entry(cases[item["case"]], item) for item in to_records(own)]
    return markdown_page("Before and after", *parts)


def _count_shown(own: pd.DataFrame, of: pd.DataFrame) -> str:
    tiers = sorted(set(of["tier"]))
    told = [f"{(own['tier'] == tier).sum()} of {(of['tier'] == tier).sum()} {tier}" for tier in tiers]
    return ", ".join(told) if told else "none"


def _render_entry(case: JudgedCase, item: dict[str, Any]) -> str:
    beside = describe_background(case)
    hidden = describe_hidden(case) + (f" (beside {beside})" if beside else "")
    of = "" if pd.isna(item["limits"]) else f" - {item['effect']}, {item['limits']:.1f} limits"
    if item["group"] in ("wrong claim", "false claim"):
        place = describe_place(None if pd.isna(item["joint"]) else item["joint"])
        of = f" - {item['effect']} claimed, {place}, counted as {item['answered']}"
    head = f"**{case.name}**, {case.truth.arm}, {item['tier']} tier{of}"
    return (
        f"{head}<br>\n*hidden:* {hidden}<br>\n*said:* "
        f"{describe_said(case)}\n\n![{case.name}]({GALLERY_FOLDER}/{item['file']})"
    )
