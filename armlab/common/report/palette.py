"""The colours of all pages and figures, and the style of those that matplotlib draws.

Colours that any colour vision tells apart (Okabe and Ito 2008, without yellow; then Tol's muted ones). Lines and marks
that stand side by side differ by dash or shape too, so that a grey print is read as well.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from typing import Any, NamedTuple

INK, PALE, RULE, GRID, BACK, SHADE = "#1b1f24", "#5b6570", "#d5dae0", "#e6e9ed", "#ffffff", "#f3f5f7"
STROKE, MIDDLE, SILVER = "#c4cad1", "#8b929b", "#a9b0b8"  # quiet lines and dots, from light to dark: for context
DIM = "#555555"  # the arm among lines in colour
LINK = "#0b5cad"

BLUE, VERMILION, GREEN, PINK, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
BLACK, GREY, WINE, OLIVE, INDIGO, MAGENTA = "#000000", "#999999", "#882255", "#999933", "#332288", "#AA4499"

# Darker ones of the same hues, for words and thin lines on white: a contrast of 4.5 or more, of 3.5 for amber.
DARK_VERMILION, DARK_GREEN, AMBER, PLUM, PURPLE, RED = "#c44e00", "#007a58", "#b87800", "#9c4a7e", "#7b3294", "#b00020"

SERIES = (BLUE, VERMILION, GREEN, PINK, ORANGE, SKY, BLACK, GREY, WINE, OLIVE, INDIGO, MAGENTA)
DASHES = ("", "6 3", "2 2", "8 3 2 3", "12 3", "4 2 1 2", "1 3", "10 2 2 2 2 2", "3 6")

BEFORE, AFTER, NOISE = AMBER, BLUE, STROKE
GOOD, BAD, OPEN = BLUE, VERMILION, STROKE


class SeriesStyle(NamedTuple):
    """Colour, and dashes as SVG writes them."""

    color: str
    dash: str


def series_style(index: int) -> SeriesStyle:
    """The style of the index-th series; where the colours repeat, the dashes differ."""
    turn, place = divmod(index, len(SERIES))
    return SeriesStyle(SERIES[place], DASHES[(place + turn) % len(DASHES)])


@contextmanager
def figure_style() -> Iterator[None]:
    """The style of matplotlib figures, while they are drawn and saved."""
    import matplotlib
    from cycler import cycler

    settings: dict[Any, Any] = {
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.labelsize": 8,
        "xtick.labelsize": 7,
        "ytick.labelsize": 7,
        "legend.fontsize": 8,
        "legend.frameon": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": GRID,
        "axes.edgecolor": PALE,
        "text.color": INK,
        "axes.labelcolor": INK,
        "svg.fonttype": "none",
        "axes.prop_cycle": cycler(color=SERIES),
    }
    with matplotlib.rc_context(settings):
        yield


def svg_text(figure: Any, name: str) -> str:
    """A matplotlib figure as SVG, words as text; the same drawing gives the same. name: where its ids begin from."""
    import matplotlib

    out = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
