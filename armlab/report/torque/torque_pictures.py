"""Pictures of torques and errors: error of each joint, torques over time, the evidence for each finding, and where
the error is.
"""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.charts import (
    CHART_WIDTH,
    FITTED_ROWS_LOOK,
    FLOOR_LOOK,
    FOUND_LOOK,
    GIVEN_LOOK,
    HELD_OUT_ROWS_LOOK,
    LAW_LOOK,
    LEFT_MARGIN,
    MEASURED_LOOK,
    PLAIN_LOOK,
    REFITTED_LOOK,
    RIGHT_MARGIN,
    SURROGATE_LOOK,
    Axis,
    Chart,
    Layer,
    Level,
    Line,
    Look,
    Points,
    draw_chart,
    fit_axis,
    shorten_text,
    svg_element,
    svg_picture,
    svg_text,
    text_width,
)
from armlab.common.report.wording import format_number
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.report.torque.residuals import ShownResiduals, bin_means, clearest_stretch, residual_without, space_rows
from armlab.report.words import claim_name, joint_unit, shorten_name
from problem.joint_words import joint_at_start, joint_in_words

STRETCH_SECONDS = 4.0
JOINT_ROW_HEIGHT = 26.0
MAX_NAMES_WIDTH = 150.0  # px: of the names of joints beside a plot; longer ones are cut
Series = list[tuple[Look, Array]]


def draw_errors_by_joint(diagnosis: Diagnosis, data: ShownResiduals) -> Markup:
    """Held-out error of each joint on a logarithmic axis: before, plain least squares, what was found, noise floor.

    Before: the simulation as given, else the refitted rigid body.
    """
    arm, joints = diagnosis.simulation.arm, [each.joint - 1 for each in diagnosis.fit]
    first = (REFITTED_LOOK, data.refit) if data.given is None else (GIVEN_LOOK, data.given)
    series: Series = [(look, data.held_out_rms(left)[joints]) for look, left in (first, (FOUND_LOOK, data.final))]
    plain = [each.plain for each in diagnosis.fit]
    if diagnosis.simulation.kind != "simulated" and None not in plain:
        series.insert(1, (PLAIN_LOOK, np.array(plain, dtype=float)))
    floors = np.array([each.noise_floor for each in diagnosis.fit])
    kinds = {joint_unit(arm, joint) for joint in joints}
    axis = fit_axis(f"rms error, {' or '.join(sorted(kinds))}", *(each for _, each in series), floors, log=True)
    names = [shorten_name(joint_in_words(arm, joint + 1)) for joint in joints]
    left = float(np.clip(max(map(text_width, names)) + 12, LEFT_MARGIN, MAX_NAMES_WIDTH))
    top = 62.0
    height = top + JOINT_ROW_HEIGHT * len(floors) + 42
    content = svg_text("Error on held-out data", 6, 14, 12, font_weight="600") + _draw_marks_legend(series)
    content += _draw_grid(axis, left, top, height)
    for row, name in enumerate(names):
        y = top + JOINT_ROW_HEIGHT * (row + 0.5)
        content += svg_text(shorten_text(name, left - 12), 6, y + 4, 11)
        content += _draw_joint_row(axis, left, y, [(look, float(each[row])) for look, each in series], floors[row])
    values = "; ".join(
        f"{name}: {', '.join(f'{look.name} {format_number(float(each[row]))}' for look, each in series)}"
        for row, name in enumerate(names)
    )
    return svg_picture(content, CHART_WIDTH, height, f"Held-out error by joint, logarithmic. {values}")


def _draw_marks_legend(series: Series) -> str:
    at, baseline, out = 6.0, 31.0, ""
    for look, _ in [*series, (FLOOR_LOOK, np.empty(0))]:
        width = text_width(look.name, 10.5) + 28
        if at > 6 and at + width > CHART_WIDTH:
            at, baseline = 6.0, baseline + 15
        out += _draw_mark(at + 7, baseline - 4, look) + svg_text(look.name, at + 17, baseline, 10.5)
        at += width
    return out


def _draw_grid(axis: Axis, left: float, top: float, height: float) -> str:
    """left: px, where the plot begins, behind the names."""
    out = ""
    for value, text in axis.ticks(6):
        x = _axis_position(axis, left, value)
        out += svg_element("line", x1=x, x2=x, y1=top, y2=height - 40, stroke=palette.GRID)
        out += svg_text(text, x, height - 25, 10.5, "middle", fill=palette.PALE)
    return out + svg_text(
        f"{axis.label} (logarithmic)", (left + CHART_WIDTH - RIGHT_MARGIN) / 2, height - 8, 11, "middle"
    )


def _draw_joint_row(axis: Axis, left: float, y: float, errors: Sequence[tuple[Look, float]], floor: float) -> str:
    places = [_axis_position(axis, left, value) for _, value in errors]
    out = svg_element("line", x1=min(places), x2=max(places), y1=y, y2=y, stroke=palette.STROKE, stroke_width=2)
    out += _draw_mark(_axis_position(axis, left, floor), y, FLOOR_LOOK)
    return out + "".join(_draw_mark(x, y, look) for x, (look, _) in zip(places, errors, strict=True))


def _axis_position(axis: Axis, left: float, value: float) -> float:
    return float(left + 4 + (CHART_WIDTH - left - RIGHT_MARGIN - 8) * np.clip(axis.at(value), 0, 1))


def _draw_mark(x: float, y: float, look: Look) -> str:
    """A shape of its own for each series: square, ring, disc, bar."""
    if look in (GIVEN_LOOK, REFITTED_LOOK):
        return svg_element("rect", x=x - 7, y=y - 7, width=14, height=14, fill=look.color)
    if look is PLAIN_LOOK:
        return svg_element("circle", cx=x, cy=y, r=4.6, fill=palette.BACK, stroke=look.color, stroke_width=2.2)
    if look is FOUND_LOOK:
        return svg_element("circle", cx=x, cy=y, r=5, fill=look.color)
    return svg_element("path", d=f"M{x:.1f} {y - 9:.1f}v18", stroke=look.color, stroke_width=2.4)


def torque_charts(diagnosis: Diagnosis, data: ShownResiduals) -> list[Chart]:
    """One chart a joint: measured torque and that of each model, where the held-out error falls most."""
    segment, rows = clearest_stretch(data, STRETCH_SECONDS)
    time, torque = data.observed.time[rows], data.observed.torque
    run = data.observed.names[segment.run]
    models: Series = [(REFITTED_LOOK, data.refit), (FOUND_LOOK, data.final)]
    if data.given is not None:
        models.insert(0, (GIVEN_LOOK, data.given))
    out = []
    for joint in range(torque.shape[1]):
        measured = torque[rows, joint]
        lines = [Line(time, measured, MEASURED_LOOK)]
        lines += [Line(time, measured - left[rows, joint], look) for look, left in models]
        size = joint_unit(diagnosis.simulation.arm, joint)
        y = fit_axis(f"{'torque' if size == 'N m' else 'force'}, {size}", *(each.y for each in lines))
        x = Axis(f"time in {shorten_name(run)}, s", float(time[0]), float(time[-1]))
        title = f"{shorten_name(joint_at_start(diagnosis.simulation.arm, joint + 1))}: measured and predicted"
        out.append(Chart(title, x, y, lines))
    return out


def draw_errors(diagnosis: Diagnosis, data: ShownResiduals) -> list[Markup]:
    """One picture a joint: the residual of each model over a whole held-out run, with the noise floor."""
    segment, _ = clearest_stretch(data, STRETCH_SECONDS)
    rows = slice(segment.start, segment.stop)
    time, run = data.observed.time[rows], data.observed.names[segment.run]
    models: Series = [(REFITTED_LOOK, data.refit), (FOUND_LOOK, data.final)]
    if data.given is not None:
        models.insert(0, (GIVEN_LOOK, data.given))
    out = []
    for fit in diagnosis.fit:
        joint = fit.joint - 1
        size = joint_unit(diagnosis.simulation.arm, joint)
        lines: list[Layer] = [Line(time, left[rows, joint], look) for look, left in models]
        lines += [Level(sign * fit.noise_floor, FLOOR_LOOK) for sign in (1, -1)]
        y = fit_axis(f"measured − predicted, {size}", *(left[rows, joint] for _, left in models), zero=True)
        x = Axis(f"time in {shorten_name(run)}, s", float(time[0]), float(time[-1]))
        title = f"{shorten_name(joint_at_start(diagnosis.simulation.arm, joint + 1))}: error"
        out.append(draw_chart(title, x, y, lines, f"{title} over {run}, measured less predicted, with the noise floor"))
    return out


MAX_DOTS = 700
LAW_BINS = 48
MAX_LAW_SCATTER = 0.2  # of the law's own range: a law that scatters less about its mean in a bin is drawn as a line
FULL_TURN = 2 * np.pi
MOTION_UNITS = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "acceleration": ("rad/s²", "m/s²")}


def draw_evidence(diagnosis: Diagnosis, data: ShownResiduals, claim: Claim) -> Markup:
    """Dots: residual torque of the model without the finding. Line: torque of the finding."""
    joint = claim.evidence.joint
    label, x = evidence_variable(diagnosis, data, claim)
    left, law = residual_without(diagnosis, claim, joint), claim.prediction[:, joint]
    used, held = data.used(joint), data.held_out(joint)
    layers: list[Layer] = []
    for rows, look in ((used[~held[used]], FITTED_ROWS_LOOK), (used[held[used]], HELD_OUT_ROWS_LOOK)):
        chosen = space_rows(rows, MAX_DOTS // 2)
        layers.append(Points(x[chosen], left[chosen], look))
    layers += _law_layers(x[used], law[used], LAW_LOOK if claim.candidate else SURROGATE_LOOK)
    size = joint_unit(diagnosis.simulation.arm, joint)
    y = fit_axis(f"left without it, {size}", np.quantile(left[used], [0.002, 0.998]), law[used])
    name = claim_name(claim)
    title = f"{name[0].upper()}{name[1:]}, {shorten_name(joint_in_words(diagnosis.simulation.arm, joint + 1))}"
    return draw_chart(
        title, fit_axis(label, x[used]), y, layers, f"{title}: torque left without it against {label}, and its law"
    )


def evidence_variable(diagnosis: Diagnosis, data: ShownResiduals, claim: Claim) -> tuple[str, Array]:
    """Label and values (rows,) of the variable that the finding depends on; its own torque where there are several."""
    arm, observed = diagnosis.simulation.arm, data.observed
    joint = claim.evidence.joint
    moving = (claim.joints[1] if len(claim.joints) > 1 else claim.joint or 0) - 1
    axis = "" if claim.candidate is None else claim.candidate.facts.axis
    if axis in MOTION_UNITS and moving >= 0:
        return _motion_variable(diagnosis, data, axis, moving)
    if axis == "cycle" and moving >= 0:
        return _cycle_variable(diagnosis, data, claim, moving)
    if axis == "time" or claim.depends_on[:1] == ("time",):
        return "time from the start of the run, s", observed.time
    for name in claim.depends_on:
        kind, _, which = name.rpartition("_")
        if kind in MOTION_UNITS and which.isdigit():
            return _motion_variable(diagnosis, data, kind, int(which) - 1)
        if kind == "torque" and which.isdigit():
            return _load_variable(diagnosis, data, claim, int(which) - 1)
    return f"torque that it predicts, {joint_unit(arm, joint)}", claim.prediction[:, joint]


def _motion_variable(diagnosis: Diagnosis, data: ShownResiduals, kind: str, joint: int) -> tuple[str, Array]:
    units, arm = MOTION_UNITS[kind], diagnosis.simulation.arm
    unit = units[0] if arm.joints[joint].kind == "revolute" else units[1]
    return f"{kind} of {shorten_name(joint_in_words(arm, joint + 1))}, {unit}", data.observed.kept(kind)[:, joint]


def _load_variable(diagnosis: Diagnosis, data: ShownResiduals, claim: Claim, joint: int) -> tuple[str, Array]:
    """Torque of the model without the finding."""
    torque = data.observed.torque[:, joint] - data.final[:, joint] - claim.prediction[:, joint]
    arm = diagnosis.simulation.arm
    return f"torque of the model at {shorten_name(joint_in_words(arm, joint + 1))}, {joint_unit(arm, joint)}", torque


def _cycle_variable(diagnosis: Diagnosis, data: ShownResiduals, claim: Claim, joint: int) -> tuple[str, Array]:
    """Position within one wave; the parameter `order` of the effect counts the waves a turn."""
    order = next((each.value for each in claim.parameters if each.name == "order"), 1.0)
    waves = float(order) if isinstance(order, float) and order else 1.0
    position = data.observed.kept("position")[:, joint]
    where = shorten_name(joint_in_words(diagnosis.simulation.arm, joint + 1))
    return f"position of {where} within a wave of 1/{waves:.4g} turn, share", (position * waves / FULL_TURN) % 1.0


def _law_layers(x: Array, law: Array, look: Look) -> list[Layer]:
    """A line where the law is a function of this variable, dots where it is not."""
    across, height, scatter = bin_means(x, law, LAW_BINS)
    if np.ptp(law) > 0 and np.median(scatter) < MAX_LAW_SCATTER * np.std(law):
        return [Line(across, height, look)]
    chosen = space_rows(np.arange(len(x)), MAX_DOTS // 2)
    return [Points(x[chosen], law[chosen], look)]


LOCATED_BINS = 24
LOCATED_HEIGHT = 205.0


def draw_located_errors(diagnosis: Diagnosis, data: ShownResiduals, joint: int) -> list[Markup]:
    """rms error of a joint (from 0) against its position, velocity, acceleration, and time."""
    pictures = [
        _draw_error_against(diagnosis, data, joint, kind, _motion_variable(diagnosis, data, kind, joint))
        for kind in MOTION_UNITS
    ]
    time = "time from the start of the run, s", data.observed.time
    return [*pictures, _draw_error_against(diagnosis, data, joint, "time", time)]


def _draw_error_against(
    diagnosis: Diagnosis, data: ShownResiduals, joint: int, quantity: str, variable: tuple[str, Array]
) -> Markup:
    """variable: label and values (rows,) of the quantity."""
    label, x = variable
    start = REFITTED_LOOK if data.given is None else GIVEN_LOOK
    used, layers = data.used(joint), []
    for look, residual in ((start, data.before), (FOUND_LOOK, data.final)):
        across, power, _ = bin_means(x[used], residual[used, joint] ** 2, LOCATED_BINS)
        layers.append(Line(across, np.sqrt(power), look))
    floor = next(each.noise_floor for each in diagnosis.fit if each.joint == joint + 1)
    size = joint_unit(diagnosis.simulation.arm, joint)
    y = fit_axis(f"rms error, {size}", *(layer.y for layer in layers), np.array([floor]), zero=True)
    title = f"{shorten_name(joint_at_start(diagnosis.simulation.arm, joint + 1))}: error by {quantity}"
    return draw_chart(title, fit_axis(label, x[used]), y, [*layers, Level(floor, FLOOR_LOOK)], height=LOCATED_HEIGHT)
