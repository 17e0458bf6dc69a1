"""Where the error is: its size over each variable and over time, before and after, against the noise floor."""

import numpy as np

from armlab.diagnosis.result import Diagnosis
from diagnosis.report.axis import axis_for
from diagnosis.report.chart import Level, Line, chart
from diagnosis.report.evidence_picture import SPANS
from diagnosis.report.looks import FLOOR, FOUND, GIVEN, REFITTED
from diagnosis.report.rows import Shown, binned
from diagnosis.report.words import joint_unit
from recordings.run import Array

BINS = 24
HEIGHT = 205.0


def located_pictures(diagnosis: Diagnosis, data: Shown, joint: int) -> list[str]:
    """rms error of a joint (from 0) against its position, velocity, acceleration, and time."""
    arm = diagnosis.simulation.arm
    turns = arm.joints[joint].kind == "revolute"
    pictures = []
    for kind, (angle, length) in SPANS.items():
        label = f"{kind} of joint {joint + 1}, {angle if turns else length}"
        pictures.append(_against(diagnosis, data, joint, label, data.observed.kept(kind)[:, joint]))
    over_time = _against(diagnosis, data, joint, "time from the start of the run, s", data.observed.time)
    return [*pictures, over_time]


def _against(diagnosis: Diagnosis, data: Shown, joint: int, label: str, x: Array) -> str:
    start = REFITTED if data.given is None else GIVEN
    used, layers = data.used(joint), []
    for look, residual in ((start, data.before), (FOUND, data.final)):
        across, power, _ = binned(x[used], residual[used, joint] ** 2, BINS)
        layers.append(Line(across, np.sqrt(power), look))
    floor = diagnosis.fit[joint].noise_floor
    size = joint_unit(diagnosis.simulation.arm, joint)
    y = axis_for(f"rms error, {size}", *(layer.y for layer in layers), np.array([floor]), zero=True)
    quantity = label.split(",")[0].replace(f" of joint {joint + 1}", "")
    title = f"Joint {joint + 1}: error by {'time' if quantity.startswith('time') else quantity}"
    return chart(title, axis_for(label, x[used]), y, [*layers, Level(floor, FLOOR)], height=HEIGHT)
