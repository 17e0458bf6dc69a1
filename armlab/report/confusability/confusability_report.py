"""The confusability card as terminal lines, Markdown, CSV, JSON, heat maps and a page, and the function that writes
these files.
"""

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.documents import ResultLines
from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report import palette
from armlab.common.report.charts import shorten_text, svg_element, svg_picture, svg_text
from armlab.common.report.page import Table, render_page
from armlab.diagnosis.next.confusability import (
    CERTAIN_STANDARD_ERRORS,
    MIN_CONFUSED_COSINE,
    VIEWS,
    Card,
    CardEntry,
    confusability_card,
    read_planned_motions,
)
from armlab.effects.library import library
from armlab.effects.words import place_in_words
from armlab.report.words import effect_in_words
from problem.arm import Arm
from problem.joint_words import joint_at_start, joint_in_words
from problem.robot_file import load_arm

CONFUSABILITY_SCHEMA = "confusability/1"
MIN_HIDDEN_SHARE = 0.95  # share of an effect's power that a refit takes in: it hardly shows
MAX_SHOWN_RIVALS = 3  # rivals in a table
EXPLANATIONS = (
    f"Two names are one class where the cosine of an effect's columns to the other's span is {MIN_CONFUSED_COSINE:g} "
    "or more after what is free has been taken out: nothing in the nominal view, the base parameters in the refit "
    "view.",
    "Absorbed: the share of an effect's power that base parameters take in (of its most visible direction).",
    "Shows from, told from: rms torques in units of the noise, at which the effect, or its difference to the other, is "
    f"{CERTAIN_STANDARD_ERRORS:g} standard errors.",
)
CSV_HEADINGS = ("effect", "joint", "joints", "form", "absorbed_share", "shows_from", "rival", "cosine", "tells_from")


def explain_card(card: Card) -> str:
    """What the numbers mean."""
    return " ".join((_about_card(card), *EXPLANATIONS))


def _about_card(card: Card) -> str:
    noise = ", ".join(f"{value:.3g}" for value in card.noise)
    return (
        f"{card.trajectory} on {card.arm.name}: {len(card.entries)} effects and places. Noise of the filtered torque "
        f"{noise} N m (N) by joint."
    )


def card_lines(card: Card) -> Iterator[str]:
    """The meaning of the numbers, the effects that a refit hides, and those that cannot be separated, by view."""
    yield explain_card(card)
    hidden = [each for each in card.entries if each.absorbed["refit"] > MIN_HIDDEN_SHARE]
    if hidden:
        yield f"a refit hides {len(hidden)}: " + ", ".join(each.label for each in hidden)
    for view in VIEWS:
        mixed = [each for each in card.entries if each.rivals[view]]
        yield f"{view}: {len(mixed)} of {len(card.entries)} cannot be told from another"
        yield from (f"  {each.label:<44} {_rivals_text(card, each, view)}" for each in mixed)


def _rivals_text(card: Card, entry: CardEntry, view: str) -> str:
    names = [f"{card.entries[each.index].label} {each.cosine:.3f}" for each in entry.rivals[view][:MAX_SHOWN_RIVALS]]
    more = len(entry.rivals[view]) - MAX_SHOWN_RIVALS
    return "; ".join(names) + (f"; and {more} more" if more > 0 else "")


def card_markdown(card: Card) -> str:
    """One table a view."""
    headings = ("effect", "absorbed", "shows from", "not told from (cosine, told from)")
    parts = [explain_card(card)]
    for view in VIEWS:
        rows = [_markdown_row(card, each, view) for each in card.entries]
        parts += [f"## {view}", markdown_table(headings, rows, numbers=(1, 2))]
    return markdown_page("Confusability", *parts)


def _markdown_row(card: Card, entry: CardEntry, view: str) -> list[str]:
    rivals = [
        f"{card.entries[each.index].label} ({each.cosine:.3f}, {_size_text(each.separation)})"
        for each in entry.rivals[view][:MAX_SHOWN_RIVALS]
    ]
    shows = _size_text(entry.shows_from[view])
    return [entry.label, f"{100 * entry.absorbed[view]:.1f} %", shows, "; ".join(rivals) or "–"]


def _size_text(value: float) -> str:
    return "never" if math.isinf(value) else f"{value:.2g}"


def card_csv(card: Card) -> str:
    """One row an effect, view and rival; an empty rival where there is none."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("view", *CSV_HEADINGS))
    for view in VIEWS:
        for each in card.entries:
            place = (each.effect, "" if each.joint is None else each.joint, " ".join(map(str, each.joints)), each.form)
            own = (*place, f"{each.absorbed[view]:.6f}", f"{each.shows_from[view]:.6g}")
            rows = [(card.entries[r.index].label, f"{r.cosine:.6f}", f"{r.separation:.6g}") for r in each.rivals[view]]
            for rival in rows or [("", "", "")]:
                writer.writerow((view, *own, *rival))
    return out.getvalue()


def card_content(card: Card) -> dict[str, Any]:
    """The whole card as JSON; the size of an effect that no amount of torque shows is null."""
    return {
        "schema": CONFUSABILITY_SCHEMA,
        "robot": card.arm.name,
        "trajectory": card.trajectory,
        "noise": card.noise.tolist(),
        "independent_rows": card.rows,
        "alike": MIN_CONFUSED_COSINE,
        "effects": [_entry_content(card, each) for each in card.entries],
    }


def _entry_content(card: Card, entry: CardEntry) -> dict[str, Any]:
    views = {
        view: {
            "absorbed": round(entry.absorbed[view], 6),
            "shows_from": _finite_or_none(entry.shows_from[view]),
            "rivals": [
                {
                    "effect": card.entries[each.index].effect,
                    "joint": card.entries[each.index].joint,
                    "joints": list(card.entries[each.index].joints),
                    "form": card.entries[each.index].form,
                    "cosine": round(each.cosine, 6),
                    "told_from": _finite_or_none(each.separation),
                }
                for each in entry.rivals[view]
            ],
        }
        for view in VIEWS
    }
    place = {"effect": entry.effect, "joint": entry.joint, "joints": list(entry.joints), "form": entry.form}
    return {**place, **views}


def _finite_or_none(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


CELL_SIZE, LABEL_SIZE, NAMES_WIDTH, TOP_MARGIN = 12.0, 10.0, 288.0, 44.0
DARKEST_COLOR = (8, 48, 107)
MARK_COLOR = palette.DARK_VERMILION


def draw_heat_map(card: Card, view: str, joint: int) -> Markup:
    """Effects of one joint (from 1) and of the whole robot, each against the others."""
    chosen = [index for index, each in enumerate(card.entries) if each.joint in (joint, None)]
    count = len(chosen)
    width, height = NAMES_WIDTH + CELL_SIZE * count + 8, TOP_MARGIN + CELL_SIZE * count + 34
    title = f"{joint_at_start(card.arm, joint)}, {view}: can the column's effect imitate the row's?"
    out = svg_text(shorten_text(title, width - 12, 12), 6, 14, 12, font_weight="600")
    for place, index in enumerate(chosen):
        middle = CELL_SIZE * (place + 0.5)
        label = shorten_text(f"{place + 1}  {_words(card.arm, card.entries[index])}", NAMES_WIDTH - 8, LABEL_SIZE)
        out += svg_text(label, NAMES_WIDTH - 5, TOP_MARGIN + middle + 3.5, LABEL_SIZE, "end")
        out += svg_text(str(place + 1), NAMES_WIDTH + middle, TOP_MARGIN - 5, 8.5, "middle", fill=palette.PALE)
    cosines = card.cosines[view][np.ix_(chosen, chosen)]
    out += "".join(
        _draw_cell(row, column, float(cosines[row, column])) for row in range(count) for column in range(count)
    )
    about = f"Cosines between the effects of {joint_in_words(card.arm, joint)} of {card.arm.name} in the view {view}"
    return svg_picture(out + _draw_scale(TOP_MARGIN + CELL_SIZE * count + 8), width, height, about)


def _draw_cell(row: int, column: int, cosine: float) -> str:
    x, y = NAMES_WIDTH + CELL_SIZE * column, TOP_MARGIN + CELL_SIZE * row
    if row == column:
        return svg_element("rect", x=x, y=y, width=CELL_SIZE - 1, height=CELL_SIZE - 1, fill=palette.SHADE)
    out = svg_element("rect", x=x, y=y, width=CELL_SIZE - 1, height=CELL_SIZE - 1, fill=_cell_color(cosine))
    if cosine >= MIN_CONFUSED_COSINE:
        out += svg_element(
            "circle", cx=x + (CELL_SIZE - 1) / 2, cy=y + (CELL_SIZE - 1) / 2, r=3, fill=MARK_COLOR, stroke=palette.BACK
        )
    return out


def _cell_color(cosine: float) -> str:
    share = max(cosine, 0.0) ** 2
    red, green, blue = (round(255 - share * (255 - dark)) for dark in DARKEST_COLOR)
    return f"rgb({red},{green},{blue})"


def _draw_scale(y: float) -> str:
    out = svg_text("cosine", 6, y + 11, 10.5)
    for number, cosine in enumerate((0.0, 0.5, 0.7, 0.8, 0.9, 1.0)):
        x = 52 + 42 * number
        out += svg_element(
            "rect", x=x, y=y, width=14, height=14, fill=_cell_color(cosine), stroke=palette.STROKE, stroke_width=0.5
        )
        out += svg_text(f"{cosine:g}", x + 17, y + 11, 10)
    x = 52 + 42 * 6
    return (
        out
        + svg_element("circle", cx=x + 6, cy=y + 7, r=3.5, fill=MARK_COLOR)
        + svg_text("cannot be told", x + 14, y + 11, 10)
    )


PAGE_HEADINGS = ("effect", "absorbed", "shows from", "not told from", "cosine", "told from")
VIEW_MEANINGS = {
    "nominal": "Against the simulation as it is given: nothing is free.",
    "refit": "After a refit: the base parameters of the rigid body are free, and take in what they can.",
}


@dataclass(frozen=True)
class ViewPart:
    """What cannot be told apart in a view. maps: one a joint."""

    title: str
    meaning: str
    classes: Table
    maps: Sequence[Markup]


def card_page(card: Card) -> str:
    """HTML text."""
    views = [
        ViewPart(
            view.capitalize(),
            VIEW_MEANINGS[view],
            _classes_table(card, view),
            [draw_heat_map(card, view, joint) for joint in range(1, len(card.arm) + 1)],
        )
        for view in VIEWS
    ]
    return render_page(
        __package__,
        "card.html",
        f"Confusability of {card.trajectory}",
        verdict=_verdict(card),
        explanations=(_about_card(card), *EXPLANATIONS),
        hidden=[_words(card.arm, each) for each in card.entries if each.absorbed["refit"] > MIN_HIDDEN_SHARE],
        views=views,
    )


def _classes_table(card: Card, view: str) -> Table:
    rows = []
    for each in card.entries:
        for rival in each.rivals[view][:MAX_SHOWN_RIVALS]:
            own = (_words(card.arm, each), f"{100 * each.absorbed[view]:.1f} %", _size_text(each.shows_from[view]))
            beside = (_words(card.arm, card.entries[rival.index]), f"{rival.cosine:.3f}", _size_text(rival.separation))
            rows.append([*own, *beside])
    return Table(PAGE_HEADINGS, rows, (0, 3), stacked=True)


def _verdict(card: Card) -> str:
    """How many of the effects this motion cannot separate, in the nominal view and after a refit."""
    mixed = [sum(bool(each.rivals[view]) for each in card.entries) for view in VIEWS]
    return (
        f"Of {len(card.entries)} effects and places this motion cannot separate {mixed[0]} from another one; after a "
        f"refit, {mixed[1]}."
    )


def _words(arm: Arm, entry: CardEntry) -> str:
    """Effect, place and form as a person says them."""
    name = f"{effect_in_words(entry.effect)}, {place_in_words(arm, entry.effect, entry.joint, entry.joints)}"
    return f"{name} ({entry.form})" if entry.form else name


def write_card(
    robot: str, trajectory: str, joints: int | None, noise: tuple[float, ...], out: Path | None
) -> ResultLines:
    """Yields the lines of the card, and writes it as files where a folder is given.

    Raises InputError, in one line, for joints, a trajectory or a noise that do not fit the arm.
    """
    arm = load_arm(robot)
    if joints is not None:
        if joints > len(arm):
            raise InputError(f"--joints {joints}: {arm.name} has {len(arm)}")
        arm = arm.first(joints)
    motions = read_planned_motions(trajectory, arm)
    try:
        card = confusability_card(arm, motions, library(), _noise_by_joint(noise, arm))
    except DataError as error:
        raise InputError(f"{trajectory}: {error}") from None
    yield from card_lines(card)
    written: tuple[Path, ...] = ()
    if out is not None:
        maps: dict[str, str] = {
            f"figures/{view}_joint{joint}.svg": draw_heat_map(card, view, joint) + "\n"
            for view in VIEWS
            for joint in range(1, len(arm) + 1)
        }
        texts = {
            "confusability.html": card_page(card),
            "confusability.md": card_markdown(card),
            "confusability.csv": card_csv(card),
            "confusability.json": json.dumps(card_content(card), indent=1, allow_nan=False) + "\n",
        }
        written = write_texts(texts | maps, out)
        yield f"wrote {out}: {', '.join(texts)}, {len(maps)} pictures in figures"
    return card_content(card) | {"files": written}


def _noise_by_joint(given: tuple[float, ...], arm: Arm) -> Array | None:
    """One number for all joints, or one a joint; None for the default."""
    if not given:
        return None
    if len(given) not in (1, len(arm)):
        raise InputError(f"--noise takes one number or {len(arm)}, one a joint, not {len(given)}")
    if min(given) <= 0:
        raise InputError("--noise should be above zero, in N m (N)")
    return np.broadcast_to(np.array(given, dtype=float), (len(arm),)).copy()
