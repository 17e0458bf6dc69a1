"""Runs as a user of pandas and matplotlib looks at them: signals as frames, and the pictures of the check page."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.report.palette import figure_style
from armlab.common.settings import suggest_name
from armlab.recordings.differentiate import differentiate
from armlab.recordings.recording import AnyRun, MotionRun, Run
from armlab.recordings.units import SENSOR_SIGNALS
from problem.arm import Arm

if TYPE_CHECKING:
    from armlab.common.report.figures import ShownFigure


def signal_frame(runs: Sequence[MotionRun], arm: Arm, signal: str) -> pd.DataFrame:
    """A signal of all runs in SI units: a row an instant, by the name of the run and its time; a column a joint.

    Raises InputError for a signal that no run has.
    """
    known = list(dict.fromkeys(name for run in runs for name in run.signals))
    if signal not in known:
        raise InputError(f"no signal {signal!r} in this recording: {suggest_name(str(signal), known)}")
    joints = [joint.name for joint in arm.joints]
    frames = {}
    for run in (run for run in runs if signal in run.signals):
        values = run.signals[signal]
        names = joints
        if signal in SENSOR_SIGNALS:
            names = [f"sensor {number}" for number in range(1, values.shape[1] + 1)]
        frames[run.name] = pd.DataFrame(values, index=pd.Index(run.time, name="time"), columns=names)
    return pd.concat(frames, names=["run", "time"])


def run_named(runs: Sequence[AnyRun], name: str | None) -> AnyRun:
    """The run of that name, the first one if left out; InputError where there is none."""
    found = next((run for run in runs if name in (None, run.name)), None)
    if found is None:
        raise InputError(f"no run {name!r}: {suggest_name(str(name), [run.name for run in runs])}")
    return found


def plot_run(run: MotionRun, arm: Arm) -> "ShownFigure":
    """Position and torque of each joint, recorded and filtered; of motion only, command and position."""
    from armlab.recordings.check_report import draw_motion, draw_signals  # matplotlib is loaded by those who draw

    with figure_style():
        return draw_signals(differentiate(run), arm) if isinstance(run, Run) else draw_motion(run, arm)
