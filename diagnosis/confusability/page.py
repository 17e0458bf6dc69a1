"""The card as a page: heat maps, and tables of what cannot be told apart."""

from diagnosis.confusability.card import VIEWS, Card
from diagnosis.confusability.picture import heat_map
from diagnosis.confusability.tables import HIDDEN, MOST, told
from diagnosis.report.html import document, folded, paragraph, section, table

HEADINGS = ("effect", "absorbed", "shows from", "not told from", "cosine", "told from")
MEANING = {
    "nominal": "Against the simulation as it is given: nothing is free.",
    "refit": "After a refit: the base parameters of the rigid body are free, and take in what they can.",
}


def card_page(card: Card) -> str:
    """HTML text."""
    hidden = [each.label for each in card.entries if each.absorbed["refit"] > HIDDEN]
    parts = ["<h1>Confusability card</h1>", paragraph(told(card))]
    if hidden:
        parts.append(section("hidden", "What a refit hides", paragraph(", ".join(hidden) + ".")))
    for view in VIEWS:
        maps = [heat_map(card, view, joint) for joint in range(1, len(card.arm) + 1)]
        scrolled = "".join(f'<div class="map">{each}</div>' for each in maps)
        parts.append(section(view, view.capitalize(), paragraph(MEANING[view]), _classes(card, view), scrolled))
    return document(f"Confusability of {card.trajectory}", parts)


def _classes(card: Card, view: str) -> str:
    rows = []
    for each in card.entries:
        for place, rival in enumerate(each.rivals[view][:MOST]):
            own = (each.label, f"{100 * each.absorbed[view]:.1f} %", _size(each.shows_from[view]))
            beside = (card.entries[rival.index].label, f"{rival.cosine:.3f}", _size(rival.separation))
            rows.append([*(own if place == 0 else ("", "", "")), *beside])
    listed = table(HEADINGS, rows, (0, 3)) if rows else paragraph("Every effect can be told from every other.")
    return folded("What cannot be told apart", listed)


def _size(value: float) -> str:
    return "never" if value == float("inf") else f"{value:.2g}"
