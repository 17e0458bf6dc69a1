"""Before and after: errors by joint against the noise floor, and torques and errors over time on held-out data."""

import numpy as np

from armlab.diagnosis.result import Diagnosis
from diagnosis.report.axis import Axis, axis_for
from diagnosis.report.chart import LEFT, RIGHT, WIDTH, Layer, Level, Line, chart
from diagnosis.report.looks import FLOOR, FOUND, GIVEN, MEASURED, REFITTED, Look
from diagnosis.report.rows import Shown, telling_stretch
from diagnosis.report.svg import PALE, picture, tag, text_width, words
from diagnosis.report.words import brief, joint_unit, number
from recordings.run import Array

STRETCH_S = 4.0
ROW = 26.0
Series = list[tuple[Look, Array]]


def errors_picture(diagnosis: Diagnosis, data: Shown) -> str:
    """Held-out error of each joint on a logarithmic axis: as given, refitted, with what was found, noise floor."""
    series: Series = [(REFITTED, data.held_out_rms(data.refit)), (FOUND, data.held_out_rms(data.final))]
    if data.given is not None:
        series.insert(0, (GIVEN, data.held_out_rms(data.given)))
    floors = np.array([each.noise_floor for each in diagnosis.fit])
    kinds = {joint_unit(diagnosis.simulation.arm, joint) for joint in range(len(floors))}
    axis = axis_for(f"rms error, {' or '.join(sorted(kinds))}", *(each for _, each in series), floors, log=True)
    top = 62.0
    height = top + ROW * len(floors) + 42
    content = words("Error on data that took no part", 6, 14, 12, font_weight="600") + _legend(series)
    content += _grid(axis, top, height)
    for joint in range(len(floors)):
        content += _joint_row(axis, top + ROW * (joint + 0.5), joint, series, float(floors[joint]))
    told = "; ".join(
        f"joint {joint + 1}: {', '.join(f'{look.name} {number(float(each[joint]))}' for look, each in series)}"
        for joint in range(len(floors))
    )
    return picture(content, WIDTH, height, f"Held-out error by joint, logarithmic. {told}")


def _legend(series: Series) -> str:
    at, baseline, out = 6.0, 31.0, ""
    for look, _ in [*series, (FLOOR, np.empty(0))]:
        width = text_width(look.name, 10.5) + 28
        if at > 6 and at + width > WIDTH:
            at, baseline = 6.0, baseline + 15
        out += _mark(at + 7, baseline - 4, look) + words(look.name, at + 17, baseline, 10.5)
        at += width
    return out


def _grid(axis: Axis, top: float, height: float) -> str:
    out = ""
    for value, text in axis.ticks(6):
        x = _across(axis, value)
        out += tag("line", x1=x, x2=x, y1=top, y2=height - 40, stroke="#e6e9ed")
        out += words(text, x, height - 25, 10.5, "middle", fill=PALE)
    return out + words(f"{axis.label} (logarithmic)", (LEFT + WIDTH - RIGHT) / 2, height - 8, 11, "middle")


def _joint_row(axis: Axis, y: float, joint: int, series: Series, floor: float) -> str:
    places = [_across(axis, float(each[joint])) for _, each in series]
    out = words(f"joint {joint + 1}", 6, y + 4, 11)
    out += tag("line", x1=min(places), x2=max(places), y1=y, y2=y, stroke="#c4cad1", stroke_width=2)
    out += _mark(_across(axis, floor), y, FLOOR)
    return out + "".join(_mark(x, y, look) for x, (look, _) in zip(places, series, strict=True))


def _across(axis: Axis, value: float) -> float:
    return float(LEFT + 4 + (WIDTH - LEFT - RIGHT - 8) * np.clip(axis.at(value), 0, 1))


def _mark(x: float, y: float, look: Look) -> str:
    """A shape of its own for each series: square, ring, disc, bar."""
    if look is GIVEN:
        return tag("rect", x=x - 4.5, y=y - 4.5, width=9, height=9, fill=look.color)
    if look is REFITTED:
        return tag("circle", cx=x, cy=y, r=4.6, fill="#fff", stroke=look.color, stroke_width=2.2)
    if look is FOUND:
        return tag("circle", cx=x, cy=y, r=5, fill=look.color)
    return tag("path", d=f"M{x:.1f} {y - 9:.1f}v18", stroke=look.color, stroke_width=2.4)


def torque_pictures(diagnosis: Diagnosis, data: Shown) -> list[str]:
    """One a joint: measured torque and the models' over the most telling stretch of held-out time."""
    segment, rows = telling_stretch(data, STRETCH_S)
    time, torque = data.observed.time[rows], data.observed.torque
    run = data.observed.names[segment.run]
    models: Series = [(REFITTED, data.refit), (FOUND, data.final)]
    if data.given is not None:
        models.insert(0, (GIVEN, data.given))
    out = []
    for joint in range(torque.shape[1]):
        measured = torque[rows, joint]
        lines: list[Layer] = [Line(time, measured, MEASURED)]
        lines += [Line(time, measured - left[rows, joint], look) for look, left in models]
        size = joint_unit(diagnosis.simulation.arm, joint)
        values = [each.y for each in lines if isinstance(each, Line)]
        y = axis_for(f"{'torque' if size == 'N m' else 'force'}, {size}", *values)
        x = Axis(f"time in {brief(run)}, s", float(time[0]), float(time[-1]))
        out.append(chart(f"Joint {joint + 1}: measured and predicted", x, y, lines))
    return out


def error_pictures(diagnosis: Diagnosis, data: Shown) -> list[str]:
    """One a joint: what each model leaves over a whole held-out run, with the noise floor."""
    segment, _ = telling_stretch(data, STRETCH_S)
    rows = slice(segment.start, segment.stop)
    time, run = data.observed.time[rows], data.observed.names[segment.run]
    models: Series = [(REFITTED, data.refit), (FOUND, data.final)]
    if data.given is not None:
        models.insert(0, (GIVEN, data.given))
    out = []
    for joint, fit in enumerate(diagnosis.fit):
        size = joint_unit(diagnosis.simulation.arm, joint)
        lines: list[Layer] = [Line(time, left[rows, joint], look) for look, left in models]
        lines += [Level(sign * fit.noise_floor, FLOOR) for sign in (1, -1)]
        y = axis_for(f"measured − predicted, {size}", *(left[rows, joint] for _, left in models), zero=True)
        x = Axis(f"time in {brief(run)}, s", float(time[0]), float(time[-1]))
        title = f"Joint {joint + 1}: error"
        out.append(chart(title, x, y, lines, f"{title} over {run}, measured less predicted, with the noise floor"))
    return out
