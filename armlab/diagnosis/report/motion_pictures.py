"""Pictures of motion: growth of the error in re-simulation, and the recorded differences between measured, reference
and simulated motion.
"""

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.report.charts import (
    FOUND_LOOK,
    GIVEN_LOOK,
    MEASURED_LOOK,
    REFITTED_LOOK,
    Axis,
    Layer,
    Line,
    Look,
    draw_chart,
    fit_axis,
)
from armlab.diagnosis.report.words import format_number, join_words, shorten_name
from armlab.diagnosis.resimulate import WINDOW_SECONDS, NoInertiaError, Resimulation, resimulate
from armlab.diagnosis.result import Diagnosis
from armlab.recordings.recording import Run

MAX_DRAWN_WINDOWS = 3  # joints whose most telling window is drawn
MOTION_HEIGHT = 215.0
MILLI_PER_UNIT = 1e3  # mrad in a rad, mm in a m
MAX_ERROR_RATIO = 300.0  # of the error at the end: less is not drawn


def draw_motion(diagnosis: Diagnosis) -> tuple[list[str], str]:
    """Pictures, and what they show; no pictures, and why, where nothing can be simulated."""
    try:
        found = resimulate(diagnosis)
    except (NoInertiaError, ValueError) as error:
        return [], f"The motion was not simulated anew: {error}."
    return _draw_windows(diagnosis, found) + _draw_growths(diagnosis, found), _motion_text(found)


def _motion_text(found: Resimulation) -> str:
    old = "the refitted rigid body" if found.refitted else "the simulation as given"
    lost = "" if found.old is not None else f" It cannot be done with {old}, whose inertia matrix is not positive."
    return (
        f"{len(found.starts)} windows of {WINDOW_SECONDS:g} s of {found.run}, which took no part in the fit, "
        "were simulated "
        "forward: each starts from the measured position and velocity, is driven by the measured torque, and has no "
        "controller that could hide an error. Friction and other terms act as the model has them for the measured "
        f"motion. Compared are {old} and the model with what was found.{lost}"
    )


def _position_unit(diagnosis: Diagnosis, joint: int) -> str:
    return "rad" if diagnosis.simulation.arm.joints[joint].kind == "revolute" else "m"


def _old_look(found: Resimulation) -> Look:
    return REFITTED_LOOK if found.refitted else GIVEN_LOOK


def _draw_growths(diagnosis: Diagnosis, found: Resimulation) -> list[str]:
    out = []
    x = Axis("time since the start of a window, s", 0.0, float(found.time[-1]))
    for joint in range(found.new.shape[2]):
        size = f"m{_position_unit(diagnosis, joint)}"
        lines = [Line(found.time[1:], MILLI_PER_UNIT * found.growth(found.new)[1:, joint], FOUND_LOOK)]
        if found.old is not None:
            lines.insert(0, Line(found.time[1:], MILLI_PER_UNIT * found.growth(found.old)[1:, joint], _old_look(found)))
        ends = [float(each.y[-1]) for each in lines]
        floor = max(min(ends) / MAX_ERROR_RATIO, 1e-12)
        y = fit_axis(f"rms error, {size} (log)", *(np.maximum(each.y, floor) for each in lines), log=True)
        title = f"Joint {joint + 1}: growth of the position error"
        about = (
            f"{title}; after {format_number(float(found.time[-1]))} s: "
            f"{join_words([format_number(end) for end in ends])} {size}"
        )
        out.append(draw_chart(title, x, y, lines, about, MOTION_HEIGHT))
    return out


def _draw_windows(diagnosis: Diagnosis, found: Resimulation) -> list[str]:
    """The window of the worst old error, for the joints whose error falls most."""
    worse = found.new if found.old is None else found.old
    gain = found.growth(worse)[-1] / np.maximum(found.growth(found.new)[-1], 1e-300)
    out = []
    for joint in np.argsort(-gain)[:MAX_DRAWN_WINDOWS].tolist():
        window = int(np.argmax(np.abs(worse - found.measured)[:, -1, joint]))
        time = found.starts[window] + found.time
        lines: list[Layer] = [Line(time, found.measured[window, :, joint], MEASURED_LOOK)]
        if found.old is not None:
            lines.append(Line(time, found.old[window, :, joint], _old_look(found)))
        lines.append(Line(time, found.new[window, :, joint], FOUND_LOOK))
        y = fit_axis(
            f"position, {_position_unit(diagnosis, joint)}", *(each.y for each in lines if isinstance(each, Line))
        )
        x = Axis(f"time in {shorten_name(found.run)}, s", float(time[0]), float(time[-1]))
        out.append(draw_chart(f"Joint {joint + 1}: measured and simulated motion", x, y, lines, height=MOTION_HEIGHT))
    return out


DIFFERENCE_HEIGHT = 205.0
REFERENCE_LOOK = Look("reference − measured", "#0072b2", 1.2)
SIMULATED_LOOK = Look("simulated − measured", GIVEN_LOOK.color, 1.2, GIVEN_LOOK.dash)
DIFFERENCE_SIGNALS = (("reference_position", REFERENCE_LOOK), ("simulated_position", SIMULATED_LOOK))


def draw_motion_differences(diagnosis: Diagnosis) -> tuple[list[str], str]:
    """One picture a joint of the run that is shown elsewhere, and rms values of all runs; nothing to say without."""
    runs = diagnosis.recording.runs
    chosen = next((run for run in runs if run.role == "validate"), runs[0])
    found = _recorded_differences(chosen)
    if not found:
        return [], ""
    arm = diagnosis.simulation.arm
    pictures, told = [], []
    time = chosen.time - chosen.time[0]
    for joint in range(chosen.joints):
        size = "mrad" if arm.joints[joint].kind == "revolute" else "mm"
        lines: list[Layer] = [Line(time, MILLI_PER_UNIT * apart[:, joint], look) for look, apart in found]
        y = fit_axis(f"difference, {size}", *(MILLI_PER_UNIT * apart[:, joint] for _, apart in found), zero=True)
        x = Axis(f"time in {shorten_name(chosen.name)}, s", float(time[0]), float(time[-1]))
        pictures.append(draw_chart(f"Joint {joint + 1}: difference of motion", x, y, lines, height=DIFFERENCE_HEIGHT))
    for look, apart in found:
        sizes = [
            format_number(MILLI_PER_UNIT * float(np.sqrt(np.nanmean(apart[:, joint] ** 2))))
            for joint in range(chosen.joints)
        ]
        told.append(f"{look.name}: {join_words(sizes)} mrad (mm) rms by joint in {chosen.name}")
    return pictures, "Difference of motion as recorded. " + "; ".join(told) + "."


def _recorded_differences(run: Run) -> list[tuple[Look, Array]]:
    signals = run.signals
    pairs = [(look, signals[name] - run.position) for name, look in DIFFERENCE_SIGNALS if name in signals]
    return [(look, apart) for look, apart in pairs if np.isfinite(apart).any(axis=0).all()]
