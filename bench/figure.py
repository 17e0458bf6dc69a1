"""How every figure looks and is written: one palette, one size, the same bytes for the same data."""

from collections.abc import Callable, Sequence
from io import BytesIO
from typing import NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito 2008: told apart by readers with any colour vision; yellow is left out, too pale for a line.
_PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_DASHES = ("solid", "dashed", "dashdot", "dotted", (0, (5, 1)), (0, (3, 1, 1, 1, 1, 1)), (0, (1, 1)))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
Draw = Callable[[Sequence[Axes]], None]


class Look(NamedTuple):
    """How one algorithm is drawn, in all panels of a figure."""

    color: str
    linestyle: str | tuple[int, tuple[int, ...]]
    marker: str


def look(index: int) -> Look:
    """The look of the index-th algorithm."""
    place = index % len(_PALETTE)
    return Look(_PALETTE[place], _DASHES[place], _MARKERS[place])


def render(panels: int, draw: Draw) -> dict[str, bytes]:
    """The figure that `draw` makes on a row of axes, as PNG and SVG bytes, a legend below."""

    def fill(figure: Figure) -> None:
        axes = list(figure.subplots(1, panels, squeeze=False, sharey=True)[0])
        draw(axes)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4 * panels - 2)

    return paint((2 + 3.6 * panels, 3.8), fill)


def paint(size: tuple[float, float], fill: Callable[[Figure], None]) -> dict[str, bytes]:
    """The figure of that size, inches, that `fill` makes, as PNG and SVG bytes."""
    with matplotlib.rc_context():
        _set_style()
        figure = Figure(figsize=size, layout="constrained")
        fill(figure)
        return {suffix: _bytes(figure, suffix) for suffix in ("png", "svg")}


def _set_style() -> None:
    matplotlib.rcdefaults()  # a user's own style would change the bytes
    matplotlib.rc("figure", dpi=150)
    matplotlib.rc("font", size=9)
    matplotlib.rc("axes", grid=True)
    matplotlib.rc("axes.spines", top=False, right=False)
    matplotlib.rc("grid", alpha=0.3)
    matplotlib.rc("legend", frameon=False)
    matplotlib.rc("svg", hashsalt="armlab")  # else every SVG has random ids


def _bytes(figure: Figure, suffix: str) -> bytes:
    buffer = BytesIO()
    unsigned = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}[suffix]
    figure.savefig(buffer, format=suffix, metadata=unsigned)
    return buffer.getvalue()
