"""How the figures of a score look: colours that everyone can tell apart, the same bytes for the same data."""

from pathlib import Path
from typing import Any

# Okabe and Ito 2008
BLACK, BLUE, ORANGE, SKY, GREEN = "#000000", "#0072B2", "#D55E00", "#56B4E9", "#009E73"
GREY, LIGHT = "0.6", "0.88"
COLOURS = {"clean": BLUE, "realistic": ORANGE}
MARKS = {"clean": "o", "realistic": "s"}


def figure_of(size: tuple[float, float], rows: int = 1, columns: int = 1, **shared: Any) -> tuple[Any, Any]:
    """A figure of that size, inches, without a window, and its axes: one, or an array of them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    together = {"sharex": True, **shared} if rows * columns > 1 else shared
    axes = figure.subplots(rows, columns, **together)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save(figure: Any, path: Path) -> Path:
    """Writes an SVG."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": path.stem}):
        figure.savefig(path, metadata={"Date": None})
    return path
