"""Charts as SVG that stands in a page: elements, looks of lines, axes with round ticks, and charts of lines, points and
levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from textwrap import wrap

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.report import palette

FONT_FAMILY = "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"
LETTER_WIDTH = 0.56  # width of a letter over its size, about


def svg_element(name: str, /, inside: str = "", **attributes: str | float) -> str:
    """An element; `_` in an attribute's name stands for `-`, numbers have two decimals."""
    given = "".join(f' {key.replace("_", "-")}="{_attribute_value(value)}"' for key, value in attributes.items())
    return f"<{name}{given}>{inside}</{name}>" if inside else f"<{name}{given}/>"


def svg_text(
    text: str, x: float, y: float, size: float = 11.0, anchor: str = "start", **attributes: str | float
) -> str:
    """Text at a place, its baseline at y."""
    chosen: dict[str, str | float] = {"fill": palette.INK, "font_size": size, "text_anchor": anchor, **attributes}
    return svg_element("text", escape(text), x=x, y=y, **chosen)


def svg_picture(content: str, width: float, height: float, title: str) -> Markup:
    """A whole picture that scales with the page; title: what it shows, for those who do not see it."""
    frame = svg_element(
        "svg",
        svg_element("title", escape(title)) + content,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {width:g} {height:g}",
        role="img",
        aria_label=title,
        font_family=FONT_FAMILY,
    )
    return Markup(frame)


def shorten_text(text: str, width: float, size: float = 11.0) -> str:
    """A text that fits into a width, its end left out where it does not."""
    letters = _letters_in(width, size)
    return text if len(text) <= letters else text[: letters - 1].rstrip() + "…"


def wrap_text(text: str, width: float, size: float = 11.0) -> list[str]:
    """A text in lines that fit into a width; a word that is longer is shortened."""
    lines = wrap(text, _letters_in(width, size), break_long_words=False, break_on_hyphens=False)
    return [shorten_text(line, width, size) for line in lines]


def _letters_in(width: float, size: float) -> int:
    return max(int(width / (LETTER_WIDTH * size) + 1e-6), 4)  # a text fits into its own `text_width`


def text_width(text: str, size: float = 11.0) -> float:
    """How wide a text is, about."""
    return LETTER_WIDTH * size * len(text)


def _attribute_value(value: str | float) -> str:
    if isinstance(value, str):
        return escape(value)
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"


@dataclass(frozen=True)
class Look:
    """A line or mark with the name that the legend gives it."""

    name: str
    color: str
    width: float = 1.4
    dash: str = ""


MEASURED_LOOK = Look("measured", palette.MIDDLE, 2.8)
GIVEN_LOOK = Look("simulation as given", palette.AMBER, 1.3, "6 3")
REFITTED_LOOK = Look("rigid body refitted", palette.BLUE, 1.3, "2 2")
PLAIN_LOOK = Look("plain least squares", palette.MIDDLE, 1.3, "2 2")
FOUND_LOOK = Look("with what was found", palette.DARK_GREEN, 1.4)
FLOOR_LOOK = Look("noise floor", palette.PLUM, 1.4, "8 3 2 3")
LAW_LOOK = Look("fitted law", palette.DARK_VERMILION, 2.0)
SURROGATE_LOOK = Look("surrogate", palette.PURPLE, 2.0)
FITTED_ROWS_LOOK = Look("data of the fit", palette.SILVER, 2.6)
HELD_OUT_ROWS_LOOK = Look("held-out data", palette.BLUE, 2.6)


MIN_LOG_SPAN = 3.0  # factor below which a logarithmic axis is widened


@dataclass(frozen=True)
class Axis:
    """An axis from low to high; log: logarithmic, for positive values. label: what it is, with its unit."""

    label: str
    low: float
    high: float
    log: bool = False

    def at(self, values: Array | float) -> Array:
        """Places between 0 (low) and 1 (high)."""
        if self.log:
            inside = np.log(np.maximum(np.asarray(values, dtype=float), 1e-300))
            low, high = np.log(self.low), np.log(self.high)
            return np.asarray((inside - low) / (high - low))
        return np.asarray((np.asarray(values, dtype=float) - self.low) / (self.high - self.low))

    def ticks(self, most: int = 6) -> list[tuple[float, str]]:
        """Round values inside the axis, and how they are written."""
        values = self._log_ticks(most) if self.log else _round_steps(self.low, self.high, most)
        return [(value, f"{value:.6g}".replace("-", "−")) for value in values]

    def _log_ticks(self, most: int) -> list[float]:
        decades = np.arange(np.floor(np.log10(self.low)), np.ceil(np.log10(self.high)) + 1)
        for mantissas in ((1, 2, 5), (1, 3), (1,)):
            values = [float(f"{m * 10.0**d:.3g}") for d in decades for m in mantissas]
            inside = [value for value in values if self.low <= value <= self.high]
            if len(inside) <= most:
                return inside
        return inside[:: max(len(inside) // most, 1)]


def fit_axis(label: str, *values: Array, zero: bool = False, log: bool = False) -> Axis:
    """An axis that holds all finite values with a little room; zero: it begins or ends at zero or beyond."""
    every = np.concatenate([np.ravel(np.asarray(each, dtype=float)) for each in values])
    every = every[np.isfinite(every) & ((every > 0) | (not log))]
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.1, 1.0)
    if log:
        middle = np.sqrt(low * high)
        low, high = min(low, middle / MIN_LOG_SPAN**0.5), max(high, middle * MIN_LOG_SPAN**0.5)
        return Axis(label, low / 1.3, high * 1.3, log=True)
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
    return Axis(label, low - room * (low != 0 or not zero), high + room * (high != 0 or not zero))


def _round_steps(low: float, high: float, most: int) -> list[float]:
    rough = (high - low) / most
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [float(f"{number * step:.12g}") for number in range(first, last + 1)]


CHART_WIDTH, CHART_HEIGHT = 372.0, 250.0
LEFT_MARGIN, RIGHT_MARGIN, BOTTOM_MARGIN = 52.0, 10.0, 40.0
LEGEND_LINE_LENGTH = 20.0  # px: length of the line in the legend
MAX_LINE_COLUMNS = 300  # a line with more points shows the lowest and highest in each of so many columns
LABEL_SIZE = 11.0


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


@dataclass(frozen=True, eq=False)
class Chart:
    """What a chart shows, however it is drawn."""

    title: str
    x: Axis
    y: Axis
    layers: Sequence[Layer]


def draw_chart(
    title: str, x: Axis, y: Axis, layers: Sequence[Layer], about: str = "", height: float = CHART_HEIGHT
) -> Markup:
    """The chart as SVG. about: what it shows in a sentence, the title if left out."""
    entries = list(dict.fromkeys((layer.look, isinstance(layer, Points)) for layer in layers))
    legend, top = _draw_legend(entries)
    frame = _PlotFrame(top, height, x, y)
    heading = svg_text(shorten_text(title, CHART_WIDTH - 12, 12), 6, 14, 12, font_weight="600")
    content = heading + legend + frame.axes() + "".join(frame.draw_layer(layer) for layer in layers)
    return svg_picture(content, CHART_WIDTH, height, about or title)


def _draw_legend(entries: Sequence[tuple[Look, bool]]) -> tuple[str, float]:
    """Samples and names, in as many rows as they need, and where the plot may begin."""
    at, baseline, out = 6.0, 31.0, ""
    for look, dots in entries:
        width = LEGEND_LINE_LENGTH + 5 + text_width(look.name, 10.5) + 10
        if at > 6 and at + width > CHART_WIDTH:
            at, baseline = 6.0, baseline + 15
        middle = baseline - 4
        if dots:
            out += svg_element(
                "circle", cx=at + LEGEND_LINE_LENGTH / 2, cy=middle, r=max(look.width, 2.2), fill=look.color
            )
        else:
            out += _draw_stroke(f"M{at:.1f} {middle:.1f}h{LEGEND_LINE_LENGTH:.1f}", look)
        out += svg_text(look.name, at + LEGEND_LINE_LENGTH + 5, baseline, 10.5)
        at += width
    return out, baseline + 9


@dataclass(frozen=True)
class _PlotFrame:
    """The plot's rectangle and its two axes."""

    top: float
    height: float
    x: Axis
    y: Axis

    @property
    def bottom(self) -> float:
        return self.height - BOTTOM_MARGIN

    def place(self, x: Array, y: Array) -> tuple[Array, Array]:
        across = LEFT_MARGIN + (CHART_WIDTH - LEFT_MARGIN - RIGHT_MARGIN) * self.x.at(x)
        return across, self.bottom - (self.bottom - self.top) * np.clip(self.y.at(y), -0.02, 1.02)

    def axes(self) -> str:
        out = ""
        for value, text in self.y.ticks(5):
            height = float(self.place(np.array(self.x.low), np.array(value))[1])
            out += svg_element(
                "line", x1=LEFT_MARGIN, x2=CHART_WIDTH - RIGHT_MARGIN, y1=height, y2=height, stroke=palette.GRID
            )
            out += svg_text(text, LEFT_MARGIN - 5, height + 4, 10.5, "end", fill=palette.PALE)
        for value, text in self.x.ticks(6):
            across = float(self.place(np.array(value), np.array(self.y.low))[0])
            out += svg_element("line", x1=across, x2=across, y1=self.bottom, y2=self.bottom + 4, stroke=palette.PALE)
            out += svg_text(text, across, self.bottom + 16, 10.5, "middle", fill=palette.PALE)
        out += svg_element(
            "path",
            d=f"M{LEFT_MARGIN} {self.top:.1f}V{self.bottom:.1f}H{CHART_WIDTH - RIGHT_MARGIN}",
            fill="none",
            stroke=palette.RULE,
        )
        middle = (self.top + self.bottom) / 2
        label = shorten_text(self.y.label, self.bottom - self.top + 20, 10.5)
        out += svg_text(label, 11, middle, 10.5, "middle", transform=f"rotate(-90 11 {middle:.1f})")
        return out + svg_text(
            shorten_text(self.x.label, CHART_WIDTH - LEFT_MARGIN, LABEL_SIZE),
            (LEFT_MARGIN + CHART_WIDTH - RIGHT_MARGIN) / 2,
            self.height - 7,
            LABEL_SIZE,
            "middle",
        )

    def draw_layer(self, layer: Layer) -> str:
        if isinstance(layer, Level):
            return _draw_stroke(
                _path_data(*self.place(np.array([self.x.low, self.x.high]), np.full(2, layer.y))), layer.look
            )
        if isinstance(layer, Points):
            across, height = self.place(layer.x, layer.y)
            dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(across, height, strict=True) if np.isfinite(a + b))
            return svg_element(
                "path",
                d=dots or "M0 0",
                fill="none",
                stroke=layer.look.color,
                stroke_width=layer.look.width,
                stroke_linecap="round",
            )
        return _draw_stroke(_path_data(*self.place(*_thin_line(layer.x, layer.y))), layer.look)


def _thin_line(x: Array, y: Array) -> tuple[Array, Array]:
    """The lowest and the highest point in each column, in their order."""
    if len(x) <= 2 * MAX_LINE_COLUMNS:
        return x, y
    width = -(-len(x) // MAX_LINE_COLUMNS)
    starts = np.arange(0, len(x), width)
    parts = np.pad(y, (0, len(starts) * width - len(y)), constant_values=np.nan).reshape(-1, width)
    lowest = np.argmin(np.where(np.isnan(parts), np.inf, parts), axis=1)
    highest = np.argmax(np.where(np.isnan(parts), -np.inf, parts), axis=1)
    rows = np.unique(np.concatenate([starts + lowest, starts + highest]))
    return x[rows], y[rows]


def _path_data(across: Array, height: Array) -> str:
    out, pen = [], "M"
    for a, b in zip(across, height, strict=True):
        if not np.isfinite(a + b):
            pen = "M"
            continue
        out.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(out) or "M0 0"


def _draw_stroke(path: str, look: Look) -> str:
    chosen = {"stroke_dasharray": look.dash} if look.dash else {}
    return svg_element(
        "path",
        d=path,
        fill="none",
        stroke=look.color or palette.INK,
        stroke_width=look.width,
        stroke_linejoin="round",
        **chosen,
    )
