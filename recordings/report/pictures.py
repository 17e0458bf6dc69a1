"""Pictures of a run: its signals, its time stamps, and how the cut-off was chosen."""

import base64
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from problem.arm import Arm
from recordings.cutoff import CutoffChoice
from recordings.differentiate import Signals
from recordings.run import Array, Run

WIDTH, ROW_HEIGHT = 11.0, 1.5  # inches
RAW, FILTERED = "0.72", "tab:blue"


def png(figure: Figure) -> str:
    """A figure as the address of an embedded picture."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=90)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def signals_figure(signals: Signals, arm: Arm) -> Figure:
    """Position and torque of each joint over time, as recorded and filtered."""
    run = signals.run
    figure = Figure((WIDTH, ROW_HEIGHT * run.joints + 0.6), layout="constrained")
    axes = figure.subplots(run.joints, 2, sharex=True, squeeze=False)
    for joint, (left, right) in enumerate(axes):
        length, force = ("rad", "N m") if arm.joints[joint].kind == "revolute" else ("m", "N")
        left.plot(run.time, run.position[:, joint], color=FILTERED, linewidth=1)
        right.plot(run.time, run.torque[:, joint], color=RAW, linewidth=0.8, label="recorded")
        right.plot(signals.time, signals.torque[:, joint], color=FILTERED, linewidth=1, label="filtered")
        left.set_ylabel(f"{arm.joints[joint].name}\n{length}", fontsize=8)
        right.set_ylabel(force, fontsize=8)
        _show_limits(left, arm.joints[joint].limits.position, run.position[:, joint])
    axes[0, 0].set_title("position", fontsize=9)
    axes[0, 1].set_title("torque", fontsize=9)
    axes[0, 1].legend(fontsize=7, loc="upper right")
    for axis in axes[-1]:
        axis.set_xlabel("time, s", fontsize=8)
    _small_labels(axes)
    return figure


def _show_limits(axis: Axes, limits: tuple[float, float], position: Array) -> None:
    """Draws a limit that the position comes near to or passes."""
    span = float(np.ptp(position)) or 1.0
    for limit in limits:
        if position.min() - span / 4 < limit < position.max() + span / 4:
            axis.axhline(limit, color="tab:red", linewidth=0.8, linestyle="--")


def stamps_figure(run: Run) -> Figure:
    """Steps between the stamps of a run, as they are after the repairs."""
    figure = Figure((WIDTH / 2, 2.4), layout="constrained")
    axis = figure.subplots()
    axis.plot(run.time[1:], 1e3 * np.diff(run.time), ".", markersize=2, color=FILTERED)
    axis.set(xlabel="time, s", ylabel="step, ms", title="time between samples")
    axis.set_ylim(bottom=0)
    _small_labels(np.array([axis]))
    return figure


def cutoff_figure(choice: CutoffChoice, arm: Arm) -> Figure:
    """Spectra of the accelerations with their noise, and the estimated error over the cut-off."""
    figure = Figure((WIDTH, 2.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    inside = choice.frequency_hz > 0
    for joint in range(choice.spectrum.shape[1]):
        color = f"C{joint % 10}"
        spectrum = _smoothed(choice.spectrum[inside, joint])
        left.loglog(choice.frequency_hz[inside], spectrum, color=color, linewidth=0.8, label=arm.joints[joint].name)
        left.loglog(choice.frequency_hz[inside], choice.noise[inside, joint], ":", color=color, linewidth=0.8)
    left.set(
        xlabel="frequency, Hz", ylabel="power of acceleration", title="acceleration (solid), encoder noise (dotted)"
    )
    right.loglog(choice.candidates_hz, np.maximum(choice.risk, 1e-12), color="black", linewidth=1)
    right.set(xlabel="cut-off, Hz", ylabel="estimated error", title=f"cut-off {choice.cutoff_hz:.3g} Hz")
    for axis in (left, right):
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.axvline(choice.cutoff_hz, color="tab:red", linewidth=1)
    left.legend(fontsize=6, ncols=2)
    _small_labels(np.array([left, right]))
    return figure


def _smoothed(spectrum: Array) -> Array:
    """Running mean over nine frequencies, so that the picture shows levels rather than scatter."""
    if len(spectrum) < 9:
        return np.maximum(spectrum, 1e-30)
    return np.maximum(np.convolve(spectrum, np.ones(9) / 9, mode="same"), 1e-30)


def _small_labels(axes: np.ndarray) -> None:
    for axis in axes.flat:
        axis.tick_params(labelsize=7)
        axis.title.set_fontsize(9)
        axis.xaxis.label.set_fontsize(8)
        axis.yaxis.label.set_fontsize(8)
        axis.grid(alpha=0.25)
