"""Figure 5: a trajectory in joint space, with the limits that it keeps."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.figure import look, paint
from bench.paper.best_run import BestRun
from bench.paper.settings import TrajectorySettings
from bench.printed import display_name
from problem.arm import Limits
from problem.trajectory import instants
from problem.transforms import Array

_LABELS = {"position": "position (deg)", "velocity": "speed (deg/s)", "acceleration": "acceleration (deg/s²)"}


def draw_figure5(settings: TrajectorySettings, run: BestRun) -> dict[str, bytes]:
    """Positions, speeds and accelerations of the joints over time; PNG and SVG bytes."""
    times = instants(run.problem.duration, settings.samples)
    motion, limits = run.motion(times), run.problem.constraints.limits

    def fill(figure: Figure) -> None:
        panels = figure.subplots(3, 1, sharex=True)
        for axes, (name, label) in zip(panels, _LABELS.items(), strict=True):
            _draw(axes, times, np.degrees(getattr(motion, name)))
            _draw_limits(axes, limits, name)
            axes.set_ylabel(label)
        panels[-1].set_xlabel("time (s)")
        panels[0].set_title(f"Best trajectory of {display_name(run.algorithm)} ({run.title})", fontsize=9)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)

    return paint((6.4, 7.0), fill)


def _draw(axes: Axes, times: Array, values: Array) -> None:
    for joint, values_of_joint in enumerate(values.T):
        drawn = look(joint)
        axes.plot(times, values_of_joint, color=drawn.color, linestyle=drawn.linestyle, label=f"joint {joint + 1}")


def _draw_limits(axes: Axes, limits: tuple[Limits, ...], name: str) -> None:
    """Each distinct limit once: in the joint's colour, or black where all joints share it."""
    pairs = [_pair(limit, name) for limit in limits]
    shared = len(set(pairs)) == 1
    for joint, pair in enumerate(pairs[:1] if shared else pairs):
        color = "black" if shared else look(joint).color
        for bound in pair:
            if np.isfinite(bound):
                axes.axhline(float(np.degrees(bound)), color=color, linewidth=0.8, linestyle=(0, (2, 2)))
    if name == "position":
        axes.plot([], [], color="black", linewidth=0.8, linestyle=(0, (2, 2)), label="limit, in the joint's colour")


def _pair(limit: Limits, name: str) -> tuple[float, float]:
    if name == "position":
        return limit.position
    bound = getattr(limit, name)
    return -bound, bound
