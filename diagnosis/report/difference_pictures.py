"""The difference of motion: how far the measured one is from the reference, or from a simulated one, where recorded."""

import numpy as np

from armlab.diagnosis.result import Diagnosis
from diagnosis.report.axis import Axis, axis_for
from diagnosis.report.chart import Layer, Line, chart
from diagnosis.report.looks import GIVEN, Look
from diagnosis.report.words import brief, joined, number
from recordings.run import Array, Run

MILLI = 1e3  # mrad in a rad
HEIGHT = 205.0
REFERENCE = Look("reference − measured", "#0072b2", 1.2)
SIMULATED = Look("simulated − measured", GIVEN.color, 1.2, GIVEN.dash)
SIGNALS = (("reference_position", REFERENCE), ("simulated_position", SIMULATED))


def motion_differences(diagnosis: Diagnosis) -> tuple[list[str], str]:
    """One picture a joint of the run that is shown elsewhere, and rms values of all runs; nothing to say without."""
    runs = diagnosis.recording.runs
    chosen = next((run for run in runs if run.role == "validate"), runs[0])
    found = _differences(chosen)
    if not found:
        return [], ""
    arm = diagnosis.simulation.arm
    pictures, told = [], []
    time = chosen.time - chosen.time[0]
    for joint in range(chosen.joints):
        size = "mrad" if arm.joints[joint].kind == "revolute" else "mm"
        lines: list[Layer] = [Line(time, MILLI * apart[:, joint], look) for look, apart in found]
        y = axis_for(f"difference, {size}", *(MILLI * apart[:, joint] for _, apart in found), zero=True)
        x = Axis(f"time in {brief(chosen.name)}, s", float(time[0]), float(time[-1]))
        pictures.append(chart(f"Joint {joint + 1}: difference of motion", x, y, lines, height=HEIGHT))
    for look, apart in found:
        sizes = [number(MILLI * float(np.sqrt(np.nanmean(apart[:, joint] ** 2)))) for joint in range(chosen.joints)]
        told.append(f"{look.name}: {joined(sizes)} mrad (mm) rms by joint in {chosen.name}")
    return pictures, "Difference of motion as recorded. " + "; ".join(told) + "."


def _differences(run: Run) -> list[tuple[Look, Array]]:
    signals = run.signals
    pairs = [(look, signals[name] - run.position) for name, look in SIGNALS if name in signals]
    return [(look, apart) for look, apart in pairs if np.isfinite(apart).any(axis=0).all()]
