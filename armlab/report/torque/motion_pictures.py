"""Pictures of motion: growth of the error in re-simulation, and the recorded differences between measured, reference
and simulated motion.
"""

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.charts import (
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
from armlab.common.report.wording import format_number, join_words
from armlab.diagnosis.result import Diagnosis
from armlab.recordings.recording import Run
from armlab.report.resimulate import WINDOW_SECONDS, NoInertiaError, Resimulation, resimulate
from armlab.report.words import shorten_name
from problem.joint_words import joint_at_start

MAX_DRAWN_WINDOWS = 3  # joints whose most telling window is drawn
MOTION_HEIGHT = 215.0
MILLI_PER_UNIT = 1e3  # mrad in a rad, mm in a m
MAX_ERROR_RATIO = 300.0  # of the error at the end: less is not drawn


def draw_motion(diagnosis: Diagnosis) -> tuple[list[Markup], str]:
    """Pictures, and what they show; no pictures, and why, where nothing can be simulated."""
    try:
        resimulation = resimulate(diagnosis)
    except (NoInertiaError, ValueError) as error:
        return [], f"The motion was not simulated anew: {error}."
    return _draw_windows(diagnosis, resimulation) + _draw_growths(diagnosis, resimulation), _motion_text(resimulation)


def _motion_text(resimulation: Resimulation) -> str:
    old = "the refitted rigid body" if resimulation.refitted else "the simulation as given"
    lost = ""
    if resimulation.old is None:
        lost = f" It cannot be done with {old}, whose links leave a joint without inertia."
    return (
        f"{len(resimulation.starts)} windows of {WINDOW_SECONDS:g} s of {resimulation.run}, "
        "which took no part in the fit, were simulated "
        "forward: each starts from the measured position and velocity, is driven by the measured torque, and has no "
        "controller that could hide an error. Friction and other terms act as the model has them for the measured "
        f"motion. Compared are {old} and the model with what was found.{lost}"
    )


def _position_unit(diagnosis: Diagnosis, joint: int) -> str:
    return "rad" if diagnosis.simulation.arm.joints[joint].kind == "revolute" else "m"


def _old_look(resimulation: Resimulation) -> Look:
    return REFITTED_LOOK if resimulation.refitted else GIVEN_LOOK


def _draw_growths(diagnosis: Diagnosis, resimulation: Resimulation) -> list[Markup]:
    out = []
    time = resimulation.time[1:]
    x = Axis("time since the start of a window, s", 0.0, float(time[-1]))
    for joint in range(resimulation.new.shape[2]):
        size = f"m{_position_unit(diagnosis, joint)}"
        lines = [
            Line(time, MILLI_PER_UNIT * resimulation.growth(model)[1:, joint], look)
            for model, look in ((resimulation.old, _old_look(resimulation)), (resimulation.new, FOUND_LOOK))
            if model is not None
        ]
        ends = [float(each.y[-1]) for each in lines]
        floor = max(min(ends) / MAX_ERROR_RATIO, 1e-12)
        y = fit_axis(f"rms error, {size} (log)", *(np.maximum(each.y, floor) for each in lines), log=True)
        title = f"{shorten_name(joint_at_start(diagnosis.simulation.arm, joint + 1))}: growth of the position error"
        about = (
            f"{title}; after {format_number(float(time[-1]))} s: "
            f"{join_words([format_number(end) for end in ends])} {size}"
        )
        out.append(draw_chart(title, x, y, lines, about, MOTION_HEIGHT))
    return out


def _draw_windows(diagnosis: Diagnosis, resimulation: Resimulation) -> list[Markup]:
    """The window of the worst old error, for the joints whose error falls most."""
    old = resimulation.new if resimulation.old is None else resimulation.old
    gain = resimulation.growth(old)[-1] / np.maximum(resimulation.growth(resimulation.new)[-1], 1e-300)
    out = []
    for joint in np.argsort(-gain)[:MAX_DRAWN_WINDOWS].tolist():
        window = int(np.argmax(np.abs(old - resimulation.measured)[:, -1, joint]))
        time = resimulation.starts[window] + resimulation.time
        lines: list[Layer] = [Line(time, resimulation.measured[window, :, joint], MEASURED_LOOK)]
        if resimulation.old is not None:
            lines.append(Line(time, resimulation.old[window, :, joint], _old_look(resimulation)))
        lines.append(Line(time, resimulation.new[window, :, joint], FOUND_LOOK))
        y = fit_axis(
            f"position, {_position_unit(diagnosis, joint)}", *(each.y for each in lines if isinstance(each, Line))
        )
        x = Axis(f"time in {shorten_name(resimulation.run)}, s", float(time[0]), float(time[-1]))
        title = f"{shorten_name(joint_at_start(diagnosis.simulation.arm, joint + 1))}: simulated motion"
        out.append(draw_chart(title, x, y, lines, height=MOTION_HEIGHT))
    return out


DIFFERENCE_HEIGHT = 205.0
REFERENCE_LOOK = Look("reference − measured", palette.BLUE, 1.2)
SIMULATED_LOOK = Look("simulated − measured", GIVEN_LOOK.color, 1.2, GIVEN_LOOK.dash)
DIFFERENCE_SIGNALS = (("reference_position", REFERENCE_LOOK), ("simulated_position", SIMULATED_LOOK))


def draw_motion_differences(diagnosis: Diagnosis) -> tuple[list[Markup], str]:
    """One picture a joint of the run that is shown elsewhere, and rms values of all runs; nothing to say without."""
    runs = diagnosis.recording.runs
    chosen = next((run for run in runs if run.role == "validate"), runs[0])
    differences = _recorded_differences(chosen)
    if not differences:
        return [], ""
    arm = diagnosis.simulation.arm
    pictures, sentences = [], []
    time = chosen.time - chosen.time[0]
    for joint in range(chosen.joints):
        size = "mrad" if arm.joints[joint].kind == "revolute" else "mm"
        lines: list[Layer] = [
            Line(time, MILLI_PER_UNIT * difference[:, joint], look) for look, difference in differences
        ]
        y = fit_axis(
            f"difference, {size}", *(MILLI_PER_UNIT * difference[:, joint] for _, difference in differences), zero=True
        )
        x = Axis(f"time in {shorten_name(chosen.name)}, s", float(time[0]), float(time[-1]))
        title = f"{shorten_name(joint_at_start(arm, joint + 1))}: difference of motion"
        pictures.append(draw_chart(title, x, y, lines, height=DIFFERENCE_HEIGHT))
    for look, difference in differences:
        sizes = [
            format_number(MILLI_PER_UNIT * float(np.sqrt(np.nanmean(difference[:, joint] ** 2))))
            for joint in range(chosen.joints)
        ]
        sentences.append(f"{look.name}: {join_words(sizes)} mrad (mm) rms by joint in {chosen.name}")
    return pictures, "Difference of motion as recorded. " + "; ".join(sentences) + "."


def _recorded_differences(run: Run) -> list[tuple[Look, Array]]:
    signals = run.signals
    pairs = [(look, signals[name] - run.position) for name, look in DIFFERENCE_SIGNALS if name in signals]
    return [(look, difference) for look, difference in pairs if np.isfinite(difference).any(axis=0).all()]
