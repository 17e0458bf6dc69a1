"""The HTML page of `armlab recording check`: findings first, then each run with its pictures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from armlab.common.arrays import Array
from armlab.common.files import write_whole
from armlab.common.report import palette
from armlab.common.report.figures import ShownFigure
from armlab.common.report.page import png_address, render_page
from armlab.common.report.palette import figure_style, series_style
from armlab.common.report.wording import count_of
from armlab.recordings.check import CheckResult
from armlab.recordings.cutoff import CutoffChoice
from armlab.recordings.differentiate import Signals, differentiate
from armlab.recordings.motion import MotionRecording
from armlab.recordings.recording import ROLES, MotionRun, Recording, Run
from problem.arm import Arm

FIGURE_WIDTH_IN, ROW_HEIGHT_IN = 11.0, 1.5  # inches
RAW_COLOR, FILTERED_COLOR, LIMIT_COLOR = palette.STROKE, palette.BLUE, palette.VERMILION


def draw_signals(signals: Signals, arm: Arm) -> ShownFigure:
    """Position and torque of each joint over time, as recorded and filtered."""
    run = signals.run

    def draw(left: Axes, right: Axes, joint: int) -> None:
        left.plot(run.time, run.position[:, joint], color=FILTERED_COLOR, linewidth=1)
        right.plot(run.time, run.torque[:, joint], color=RAW_COLOR, linewidth=0.8, label="recorded")
        right.plot(signals.time, signals.torque[:, joint], color=FILTERED_COLOR, linewidth=1, label="filtered")
        right.set_ylabel("N m" if arm.joints[joint].kind == "revolute" else "N", fontsize=8)

    return _draw_joints(run, arm, ("position", "torque"), draw)


def draw_motion(run: MotionRun, arm: Arm) -> ShownFigure:
    """Position with the command, and their difference, of each joint over time."""
    command = run.reference_position
    assert command is not None

    def draw(left: Axes, right: Axes, joint: int) -> None:
        left.plot(run.time, command[:, joint], color=RAW_COLOR, linewidth=0.8, label="command")
        left.plot(run.time, run.position[:, joint], color=FILTERED_COLOR, linewidth=1, label="position")
        right.plot(run.time, command[:, joint] - run.position[:, joint], color=palette.INK, linewidth=0.8)
        right.set_ylabel(_unit_of(arm, joint), fontsize=8)

    return _draw_joints(run, arm, ("command and position", "command - position"), draw)


def _draw_joints(
    run: MotionRun, arm: Arm, titles: tuple[str, str], draw: Callable[[Axes, Axes, int], None]
) -> ShownFigure:
    """Two panels for each joint; draw: fills both of a joint, the left one with its positions."""
    figure = ShownFigure((FIGURE_WIDTH_IN, ROW_HEIGHT_IN * run.joints + 0.6), layout="constrained")
    axes = figure.subplots(run.joints, 2, sharex=True, squeeze=False)
    for joint, (left, right) in enumerate(axes):
        draw(left, right, joint)
        left.set_ylabel(f"{arm.joints[joint].name}\n{_unit_of(arm, joint)}", fontsize=8)
        _show_limits(left, arm.joints[joint].limits.position, run.position[:, joint])
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title, fontsize=9)
        if len(axis.get_legend_handles_labels()[0]) > 1:
            axis.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.2)
    for axis in axes[-1]:
        axis.set_xlabel("time, s", fontsize=8)
    _shrink_labels(axes)
    return figure


def _unit_of(arm: Arm, joint: int) -> str:
    return "rad" if arm.joints[joint].kind == "revolute" else "m"


def _show_limits(axis: Axes, limits: tuple[float, float], position: Array) -> None:
    """Draws a limit that the position comes near to or passes."""
    span = float(np.ptp(position)) or 1.0
    for limit in limits:
        if position.min() - span / 4 < limit < position.max() + span / 4:
            axis.axhline(limit, color=LIMIT_COLOR, linewidth=0.8, linestyle="--")


def draw_stamps(run: MotionRun) -> Figure:
    """Steps between the stamps of a run, as they are after the repairs."""
    figure = Figure((FIGURE_WIDTH_IN / 2, 2.4), layout="constrained")
    axis = figure.subplots()
    axis.plot(run.time[1:], 1e3 * np.diff(run.time), ".", markersize=2, color=FILTERED_COLOR)
    axis.set(xlabel="time, s", ylabel="step, ms", title="time between samples")
    axis.set_ylim(bottom=0)
    _shrink_labels(np.array([axis]))
    return figure


def draw_cutoff(choice: CutoffChoice, arm: Arm) -> Figure:
    """Spectra of the accelerations with their noise, and the estimated error over the cut-off."""
    figure = Figure((FIGURE_WIDTH_IN, 2.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    inside = choice.frequency_hz > 0
    for joint in range(choice.spectrum.shape[1]):
        color = series_style(joint).color
        spectrum = _smooth_spectrum(choice.spectrum[inside, joint])
        left.loglog(choice.frequency_hz[inside], spectrum, color=color, linewidth=0.8, label=arm.joints[joint].name)
        left.loglog(choice.frequency_hz[inside], choice.noise[inside, joint], ":", color=color, linewidth=0.8)
    left.set(
        xlabel="frequency, Hz", ylabel="power of acceleration", title="acceleration (solid), encoder noise (dotted)"
    )
    right.loglog(choice.candidates_hz, np.maximum(choice.risk, 1e-12), color=palette.INK, linewidth=1)
    right.set(xlabel="cut-off, Hz", ylabel="estimated error", title=f"cut-off {choice.cutoff_hz:.3g} Hz")
    for axis in (left, right):
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.axvline(choice.cutoff_hz, color=LIMIT_COLOR, linewidth=1)
    left.legend(fontsize=6, ncols=2)
    _shrink_labels(np.array([left, right]))
    return figure


def _smooth_spectrum(spectrum: Array) -> Array:
    """Running mean over nine frequencies, so that the picture shows levels rather than scatter."""
    if len(spectrum) < 9:
        return np.maximum(spectrum, 1e-30)
    return np.maximum(np.convolve(spectrum, np.ones(9) / 9, mode="same"), 1e-30)


def _shrink_labels(axes: np.ndarray) -> None:
    for axis in axes.flat:
        axis.tick_params(labelsize=7)
        axis.title.set_fontsize(9)
        axis.xaxis.label.set_fontsize(8)
        axis.yaxis.label.set_fontsize(8)
        axis.grid(alpha=0.25)


@dataclass(frozen=True)
class Picture:
    """A picture of a run. address: of its data. text: why it looks so, before it."""

    address: str
    about: str
    text: str = ""


@dataclass(frozen=True)
class RunPart:
    """What the page says of a run."""

    title: str
    facts: str
    pictures: Sequence[Picture]


def write_check_page(check: CheckResult, path: Path) -> Path:
    """Writes the page of a check and returns its path; InputError where it cannot be written."""
    recording = check.recording
    with figure_style():
        runs = [_run_part(run, recording) for run in recording.runs]
    page = render_page(
        "armlab.recordings",
        "check.html",
        f"Recording {recording.name}",
        summary=_summarize_recording(recording),
        findings=_finding_rows(check),
        runs=runs,
    )
    write_whole(path, page)
    return path


def _summarize_recording(recording: Recording | MotionRecording) -> str:
    roles = [f"{len(recording.with_role(role))} to {role}" for role in ROLES]
    seconds = sum(run.time[-1] - run.time[0] for run in recording.runs)
    arm = recording.arm
    nominal = "with" if arm.links is not None else "without"
    return (
        f"Robot {arm.name}, {count_of(len(arm), 'joint')}, {nominal} nominal inertial parameters. "
        f"{count_of(len(recording.runs), 'run')}, {seconds:.3g} s: {', '.join(roles)}."
    )


def _finding_rows(check: CheckResult) -> list[tuple[str, str, str, str]]:
    """Kind, run, joint and text of each finding, the worst first."""
    rows = [("refused", file, "", reason) for file, reason in check.refused]
    for run, finding in check.findings:
        rows.append((finding.severity, run, str(finding.joint or ""), finding.text))
    order = ("refused", "warning", "repaired", "note")
    return sorted(rows, key=lambda row: order.index(row[0]))


def _run_part(run: MotionRun, recording: Recording | MotionRecording) -> RunPart:
    pictures = []
    if isinstance(recording, MotionRecording):
        address = png_address(draw_motion(run, recording.recorded_arm))
        pictures.append(Picture(address, f"command and position of {run.name}"))
    elif isinstance(run, Run):
        pictures += _filter_pictures(run, recording.arm)
    if not run.even:
        pictures.append(Picture(png_address(draw_stamps(run)), f"time between the samples of {run.name}"))
    facts = f"{run.samples} samples at {run.rate_hz:.5g} Hz, {run.time[-1] - run.time[0]:.4g} s."
    return RunPart(f"{run.name} ({run.role})", facts, pictures)


def _filter_pictures(run: Run, arm: Arm) -> Iterator[Picture]:
    """Torque as recorded and filtered, and why the cut-off was chosen."""
    signals = differentiate(run)
    yield Picture(png_address(draw_signals(signals, arm)), f"position and torque of {run.name}")
    if signals.cutoff is not None:
        choice = signals.cutoff
        text = (
            f"Cut-off {choice.cutoff_hz:.3g} Hz: the least estimated error of the acceleration, at most ten times "
            f"the bandwidth of the motion ({choice.motion_hz:.2g} Hz)."
        )
        yield Picture(png_address(draw_cutoff(choice, arm)), f"choice of the cut-off for {run.name}", text)
