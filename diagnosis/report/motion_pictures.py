"""Re-simulated motion: how fast the error of old and new model grows, and the windows that tell most."""

import numpy as np

from armlab.diagnosis.result import Diagnosis
from diagnosis.report.axis import Axis, axis_for
from diagnosis.report.chart import Layer, Line, chart
from diagnosis.report.looks import FOUND, GIVEN, MEASURED, REFITTED, Look
from diagnosis.report.words import brief, joined, number
from diagnosis.resimulate.dynamics import NoInertiaError
from diagnosis.resimulate.windows import WINDOW_S, Resimulation, resimulate

MOST_WINDOWS = 3  # joints whose most telling window is drawn
HEIGHT = 215.0
MILLI = 1e3  # mrad in a rad
DECADES = 300.0  # of the error at the end: less is not drawn


def motion(diagnosis: Diagnosis) -> tuple[list[str], str]:
    """Pictures, and what they show; no pictures, and why, where nothing can be simulated."""
    try:
        found = resimulate(diagnosis)
    except (NoInertiaError, ValueError) as error:
        return [], f"The motion was not simulated anew: {error}."
    return _windows(diagnosis, found) + _growths(diagnosis, found), _text(found)


def _text(found: Resimulation) -> str:
    old = "the refitted rigid body" if found.refitted else "the simulation as given"
    lost = "" if found.old is not None else f" It cannot be done with {old}, whose inertia matrix is not positive."
    return (
        f"{len(found.starts)} windows of {WINDOW_S:g} s of {found.run}, which took no part in the fit, were simulated "
        "forward: each starts from the measured position and velocity, is driven by the measured torque, and has no "
        "controller that could hide an error. Friction and other terms act as the model has them for the measured "
        f"motion. Compared are {old} and the model with what was found.{lost}"
    )


def _angle(diagnosis: Diagnosis, joint: int) -> str:
    return "rad" if diagnosis.simulation.arm.joints[joint].kind == "revolute" else "m"


def _old_look(found: Resimulation) -> Look:
    return REFITTED if found.refitted else GIVEN


def _growths(diagnosis: Diagnosis, found: Resimulation) -> list[str]:
    out = []
    x = Axis("time since the start of a window, s", 0.0, float(found.time[-1]))
    for joint in range(found.new.shape[2]):
        size = f"m{_angle(diagnosis, joint)}"
        lines = [Line(found.time[1:], MILLI * found.growth(found.new)[1:, joint], FOUND)]
        if found.old is not None:
            lines.insert(0, Line(found.time[1:], MILLI * found.growth(found.old)[1:, joint], _old_look(found)))
        ends = [float(each.y[-1]) for each in lines]
        floor = max(min(ends) / DECADES, 1e-12)
        y = axis_for(f"rms error, {size} (log)", *(np.maximum(each.y, floor) for each in lines), log=True)
        title = f"Joint {joint + 1}: growth of the position error"
        about = f"{title}; after {number(float(found.time[-1]))} s: {joined([number(end) for end in ends])} {size}"
        out.append(chart(title, x, y, lines, about, HEIGHT))
    return out


def _windows(diagnosis: Diagnosis, found: Resimulation) -> list[str]:
    """The window of the worst old error, for the joints whose error falls most."""
    worse = found.new if found.old is None else found.old
    gain = found.growth(worse)[-1] / np.maximum(found.growth(found.new)[-1], 1e-300)
    out = []
    for joint in np.argsort(-gain)[:MOST_WINDOWS].tolist():
        window = int(np.argmax(np.abs(worse - found.measured)[:, -1, joint]))
        time = found.starts[window] + found.time
        lines: list[Layer] = [Line(time, found.measured[window, :, joint], MEASURED)]
        if found.old is not None:
            lines.append(Line(time, found.old[window, :, joint], _old_look(found)))
        lines.append(Line(time, found.new[window, :, joint], FOUND))
        y = axis_for(f"position, {_angle(diagnosis, joint)}", *(each.y for each in lines if isinstance(each, Line)))
        x = Axis(f"time in {brief(found.run)}, s", float(time[0]), float(time[-1]))
        out.append(chart(f"Joint {joint + 1}: measured and simulated motion", x, y, lines, height=HEIGHT))
    return out
