"""A chart: axes with units, a legend that wraps, and layers of lines, points, levels and spans."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.report.axis import Axis
from diagnosis.report.looks import Look
from diagnosis.report.svg import INK, LINE, PALE, picture, shortened, tag, text_width, words
from recordings.run import Array

WIDTH, HEIGHT = 372.0, 250.0
LEFT, RIGHT, BOTTOM = 52.0, 10.0, 40.0
SAMPLE = 20.0  # px: length of the line in the legend
COLUMNS = 300  # a line with more points shows the lowest and highest in each of so many columns
SIZE = 11.0


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points; NaN breaks it."""

    x: Array
    y: Array
    look: Look


@dataclass(frozen=True, eq=False)
class Points:
    """Dots, in the look's colour and width."""

    x: Array
    y: Array
    look: Look


@dataclass(frozen=True)
class Level:
    """A horizontal line."""

    y: float
    look: Look


Layer = Line | Points | Level


def chart(title: str, x: Axis, y: Axis, layers: Sequence[Layer], told: str = "", height: float = HEIGHT) -> str:
    """The chart as SVG. told: what it shows in a sentence, the title if left out."""
    entries = list(dict.fromkeys((layer.look, isinstance(layer, Points)) for layer in layers))
    legend, top = _legend(entries)
    frame = _Frame(top, height, x, y)
    heading = words(shortened(title, WIDTH - 12, 12), 6, 14, 12, font_weight="600")
    content = heading + legend + frame.axes() + "".join(frame.drawn(layer) for layer in layers)
    return picture(content, WIDTH, height, told or title)


def _legend(entries: Sequence[tuple[Look, bool]]) -> tuple[str, float]:
    """Samples and names, in as many rows as they need, and where the plot may begin."""
    at, baseline, out = 6.0, 31.0, ""
    for look, dots in entries:
        width = SAMPLE + 5 + text_width(look.name, 10.5) + 10
        if at > 6 and at + width > WIDTH:
            at, baseline = 6.0, baseline + 15
        middle = baseline - 4
        if dots:
            out += tag("circle", cx=at + SAMPLE / 2, cy=middle, r=max(look.width, 2.2), fill=look.color)
        else:
            out += _stroke(f"M{at:.1f} {middle:.1f}h{SAMPLE:.1f}", look)
        out += words(look.name, at + SAMPLE + 5, baseline, 10.5)
        at += width
    return out, baseline + 9


@dataclass(frozen=True)
class _Frame:
    """The plot's rectangle and its two axes."""

    top: float
    height: float
    x: Axis
    y: Axis

    @property
    def bottom(self) -> float:
        return self.height - BOTTOM

    def place(self, x: Array, y: Array) -> tuple[Array, Array]:
        across = LEFT + (WIDTH - LEFT - RIGHT) * self.x.at(x)
        return across, self.bottom - (self.bottom - self.top) * np.clip(self.y.at(y), -0.02, 1.02)

    def axes(self) -> str:
        out = ""
        for value, text in self.y.ticks(5):
            height = float(self.place(np.array(self.x.low), np.array(value))[1])
            out += tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=height, y2=height, stroke="#e6e9ed")
            out += words(text, LEFT - 5, height + 4, 10.5, "end", fill=PALE)
        for value, text in self.x.ticks(6):
            across = float(self.place(np.array(value), np.array(self.y.low))[0])
            out += tag("line", x1=across, x2=across, y1=self.bottom, y2=self.bottom + 4, stroke=PALE)
            out += words(text, across, self.bottom + 16, 10.5, "middle", fill=PALE)
        out += tag("path", d=f"M{LEFT} {self.top:.1f}V{self.bottom:.1f}H{WIDTH - RIGHT}", fill="none", stroke=LINE)
        middle = (self.top + self.bottom) / 2
        label = shortened(self.y.label, self.bottom - self.top + 20, 10.5)
        out += words(label, 11, middle, 10.5, "middle", transform=f"rotate(-90 11 {middle:.1f})")
        return out + words(
            shortened(self.x.label, WIDTH - LEFT, SIZE), (LEFT + WIDTH - RIGHT) / 2, self.height - 7, SIZE, "middle"
        )

    def drawn(self, layer: Layer) -> str:
        if isinstance(layer, Level):
            return _stroke(_path(*self.place(np.array([self.x.low, self.x.high]), np.full(2, layer.y))), layer.look)
        if isinstance(layer, Points):
            across, height = self.place(layer.x, layer.y)
            dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(across, height, strict=True) if np.isfinite(a + b))
            return tag("path", d=dots or "M0 0", fill="none", stroke=layer.look.color, stroke_width=layer.look.width,
                       stroke_linecap="round")  # fmt: skip
        return _stroke(_path(*self.place(*_thinned(layer.x, layer.y))), layer.look)


def _thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """The lowest and the highest point in each column, in their order."""
    if len(x) <= 2 * COLUMNS:
        return x, y
    parts = np.array_split(np.arange(len(x)), COLUMNS)
    chosen = [np.unique([part[np.nanargmin(y[part])], part[np.nanargmax(y[part])]]) for part in parts]
    rows = np.concatenate(chosen)
    return x[rows], y[rows]


def _path(across: Array, height: Array) -> str:
    out, pen = [], "M"
    for a, b in zip(across, height, strict=True):
        if not np.isfinite(a + b):
            pen = "M"
            continue
        out.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(out) or "M0 0"


def _stroke(path: str, look: Look) -> str:
    chosen = {"stroke_dasharray": look.dash} if look.dash else {}
    return tag("path", d=path, fill="none", stroke=look.color or INK, stroke_width=look.width,
               stroke_linejoin="round", **chosen)  # fmt: skip
