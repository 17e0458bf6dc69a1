"""How parameters move over more than two recordings, in words, pictures and entries of `comparison.json`."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np
from markupsafe import Markup

from armlab.common.report import palette
from armlab.common.report.charts import LAW_LOOK, Axis, Layer, Line, Look, Points, draw_chart, fit_axis
from armlab.common.report.wording import format_number, format_unit
from armlab.diagnosis.changes.trends import Trend
from armlab.diagnosis.formats import TrendEntry
from armlab.effects.words import place_in_words
from armlab.report.words import effect_in_words
from problem.arm import Arm

VALUE_LOOK = Look("value", LAW_LOOK.color, 4.0)
INTERVAL_LOOK = Look("95 % interval", palette.MIDDLE, 2.0)


@dataclass(frozen=True)
class TrendPart:
    """The parameters that move, in words and pictures. days: of the recordings."""

    texts: Sequence[str]
    pictures: Sequence[Markup]
    days: str


def content_over_recordings(
    names: Sequence[str], trends: Sequence[Trend], dates: Sequence[date | None]
) -> dict[str, Any]:
    """What `comparison.json` has of more than two recordings alone: their dates, and the parameters that move."""
    if len(names) < 3:
        return {}
    days = tuple(None if each is None else each.isoformat() for each in dates)
    return {"dates": days, "trends": tuple(_trend_entry(each) for each in trends)}


def _trend_entry(each: Trend) -> TrendEntry:
    own = each.movement
    return TrendEntry(
        effect=own.effect,
        joint=own.joint,
        joints=own.joints,
        parameter=own.parameter,
        unit=own.unit,
        values=tuple(each.values.tolist()),
        ci95=tuple((low, high) for low, high in each.intervals.tolist()),
        kind=each.kind,
        change_point=each.change_point,
        per_day=each.slope if each.per_day else None,
    )


def trend_part(
    arm: Arm, trends: Sequence[Trend], names: Sequence[str], dates: Sequence[date | None]
) -> TrendPart | None:
    """The part of a page on the parameters that move; None where there are none. dates: of the recordings."""
    if not trends:
        return None
    days = [f"{name}: {'no date' if day is None else day}" for name, day in zip(names, dates, strict=True)]
    return TrendPart(
        [trend_phrase(arm, each, names) for each in trends],
        [draw_trend(arm, each, names) for each in trends],
        "; ".join(days),
    )


def trend_phrase(arm: Arm, trend: Trend, names: Sequence[str]) -> str:
    """How a parameter moves over the recordings."""
    own, unit = trend.movement, format_unit(trend.movement.unit)
    what = (
        f"{own.parameter} of {effect_in_words(own.effect)} at {place_in_words(arm, own.effect, own.joint, own.joints)}"
    )
    values = " to ".join(format_number(float(each)) for each in (trend.values[0], trend.values[-1]))
    if trend.change_point is not None:
        return f"{what} changes once, at {names[trend.change_point]}: {values} {unit}".rstrip() + "."
    if trend.slope is not None:
        step = "day" if trend.per_day else "recording"
        return f"{what} moves steadily by {format_number(trend.slope)} {unit} a {step}: {values} {unit}".rstrip() + "."
    return f"{what} moves neither steadily nor by one step, between {format_number(float(trend.values.min()))} and " + (
        f"{format_number(float(trend.values.max()))} {unit}".rstrip() + "."
    )


def draw_trend(arm: Arm, trend: Trend, names: Sequence[str]) -> Markup:
    """Values of a parameter over the recordings with their 95 % intervals."""
    own, count = trend.movement, len(names)
    x = Axis("recording", 0.5, count + 0.5)
    y = fit_axis(f"{own.parameter}, {format_unit(own.unit)}", trend.intervals)
    layers: list[Layer] = [
        Line(np.full(2, number + 1.0), interval, INTERVAL_LOOK) for number, interval in enumerate(trend.intervals)
    ]
    layers.append(Points(np.arange(1.0, count + 1), trend.values, VALUE_LOOK))
    title = f"{effect_in_words(own.effect)} at {place_in_words(arm, own.effect, own.joint, own.joints)}"
    return draw_chart(title, x, y, layers, f"{own.parameter} of {title} in {count} recordings")
