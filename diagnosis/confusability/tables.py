"""The card as lines for the terminal, Markdown, CSV and JSON."""

import csv
import io
import math
from collections.abc import Iterator
from typing import Any

from diagnosis.confusability.card import ALIKE, SURE, VIEWS, Card, Entry

SCHEMA = "confusability/1"
HIDDEN = 0.95  # share of an effect's power that a refit takes in: it hardly shows
MOST = 3  # rivals in a table
HEADINGS = ("effect", "joint", "joints", "form", "absorbed_share", "shows_from", "rival", "cosine", "tells_from")


def told(card: Card) -> str:
    """What the numbers mean."""
    noise = ", ".join(f"{value:.3g}" for value in card.noise)
    return (
        f"{card.trajectory} on {card.arm.name}: {len(card.entries)} effects and places. Noise of the filtered torque "
        f"{noise} N m (N) by joint. Two names are one class where the cosine of an effect's columns to the other's "
        f"span is {ALIKE:g} or more after what is free has been taken out: nothing in the nominal view, the base "
        f"parameters in the refit view. Absorbed: the share of an effect's power that base parameters take in (of "
        f"its most visible direction). Sizes are rms torques in units of the noise at which a difference is {SURE:g} "
        "standard errors."
    )


def terminal_lines(card: Card) -> Iterator[str]:
    """What a refit hides, and the classes of each view."""
    yield told(card)
    hidden = [each for each in card.entries if each.absorbed["refit"] > HIDDEN]
    if hidden:
        yield f"a refit hides {len(hidden)}: " + ", ".join(each.label for each in hidden)
    for view in VIEWS:
        mixed = [each for each in card.entries if each.rivals[view]]
        yield f"{view}: {len(mixed)} of {len(card.entries)} cannot be told from another"
        yield from (f"  {each.label:<44} {_rivals(card, each, view)}" for each in mixed)


def _rivals(card: Card, entry: Entry, view: str) -> str:
    names = [f"{card.entries[each.index].label} {each.cosine:.3f}" for each in entry.rivals[view][:MOST]]
    more = len(entry.rivals[view]) - MOST
    return "; ".join(names) + (f"; and {more} more" if more > 0 else "")


def markdown(card: Card) -> str:
    """One table a view."""
    lines = ["# Confusability", "", told(card)]
    for view in VIEWS:
        lines += ["", f"## {view}", "", "| effect | absorbed | shows from | not told from (cosine, told from) |"]
        lines.append("|---|---:|---:|---|")
        lines += [_row(card, each, view) for each in card.entries]
    return "\n".join(lines) + "\n"


def _row(card: Card, entry: Entry, view: str) -> str:
    rivals = [
        f"{card.entries[each.index].label} ({each.cosine:.3f}, {_size(each.separation)})"
        for each in entry.rivals[view][:MOST]
    ]
    shares = f"{100 * entry.absorbed[view]:.1f} % | {_size(entry.shows_from[view])}"
    return f"| {entry.label} | {shares} | {'; '.join(rivals) or '–'} |"


def _size(value: float) -> str:
    return "never" if math.isinf(value) else f"{value:.2g}"


def as_csv(card: Card) -> str:
    """One row an effect, view and rival; an empty rival where there is none."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("view", *HEADINGS))
    for view in VIEWS:
        for each in card.entries:
            place = (each.effect, "" if each.joint is None else each.joint, " ".join(map(str, each.joints)), each.form)
            own = (*place, f"{each.absorbed[view]:.6f}", f"{each.shows_from[view]:.6g}")
            rows = [(card.entries[r.index].label, f"{r.cosine:.6f}", f"{r.separation:.6g}") for r in each.rivals[view]]
            for rival in rows or [("", "", "")]:
                writer.writerow((view, *own, *rival))
    return out.getvalue()


def as_json(card: Card) -> dict[str, Any]:
    """Everything; a size that no amount of torque reaches is null."""
    return {
        "schema": SCHEMA,
        "robot": card.arm.name,
        "trajectory": card.trajectory,
        "noise": card.noise.tolist(),
        "independent_rows": card.rows,
        "alike": ALIKE,
        "effects": [_entry(card, each) for each in card.entries],
    }


def _entry(card: Card, entry: Entry) -> dict[str, Any]:
    views = {
        view: {
            "absorbed": round(entry.absorbed[view], 6),
            "shows_from": _finite(entry.shows_from[view]),
            "rivals": [
                {
                    "effect": card.entries[each.index].effect,
                    "joint": card.entries[each.index].joint,
                    "joints": list(card.entries[each.index].joints),
                    "form": card.entries[each.index].form,
                    "cosine": round(each.cosine, 6),
                    "told_from": _finite(each.separation),
                }
                for each in entry.rivals[view]
            ],
        }
        for view in VIEWS
    }
    place = {"effect": entry.effect, "joint": entry.joint, "joints": list(entry.joints), "form": entry.form}
    return {**place, **views}


def _finite(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None
