"""Figures 4 and 5: the best trajectory in Cartesian space and in joint space."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from armlab.common.arrays import Array
from armlab.common.report import palette
from bench.figures import line_style, render_figure
from bench.printed import display_name
from bench.studies.paper.paper_settings import Figure4Settings, TrajectorySettings
from bench.studies.paper.simulated_identification import BestRun
from problem.arm import Limits, body_points
from problem.trajectories import sample_instants

_ARM_COLOR = palette.DIM


def draw_figure4(settings: Figure4Settings, run: BestRun) -> dict[str, bytes]:
    """The tool point's path with its start, and the arm from base to tool; SVG bytes."""

    def fill(figure: Figure) -> None:
        axes: Any = figure.add_subplot(projection="3d")
        path = _chain_points(run, sample_instants(run.problem.duration, settings.samples))[:, -1]
        axes.plot(*path.T, color=line_style(0).color, linewidth=1.8, label="path of the tool point")
        axes.scatter(*path[0], color=line_style(1).color, s=40, marker="s", label="start and end", depthshade=False)
        for index, pose in enumerate(_chain_points(run, np.array(settings.arm_at))):
            _draw_arm(axes, pose, label=index == 0)
        axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MaxNLocator(5))  # more would run into each other
        spans = np.ptp([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()], axis=1)
        axes.set_box_aspect(spans, zoom=0.95)  # one metre is as long along every axis
        axes.set_title(f"Best trajectory of {display_name(run.algorithm)}\n({run.title})", fontsize=9)
        axes.view_init(elev=24, azim=-58)
        figure.legend(loc="outside lower center", ncols=3)

    return render_figure((6.4, 5.2), fill)


def _chain_points(run: BestRun, times: Array) -> Array:
    """Base, origins of the links' frames and tool point, (samples, joints + 2, 3), m."""
    tool = np.array(run.problem.constraints.workspace.tool)
    chain = body_points(run.problem.arm, run.motion(times).position, tool)
    return np.concatenate([np.zeros((len(times), 1, 3)), chain], axis=1)


def _draw_arm(axes: Any, pose: Array, label: bool) -> None:
    text = "arm, frames as dots" if label else None
    axes.plot(*pose.T, color=_ARM_COLOR, linewidth=1.6, marker="o", markersize=3.0, alpha=0.75, label=text)


_MOTION_LABELS = {"position": "position (deg)", "velocity": "speed (deg/s)", "acceleration": "acceleration (deg/s²)"}


def draw_figure5(settings: TrajectorySettings, run: BestRun) -> dict[str, bytes]:
    """Positions, speeds and accelerations of the joints over time; SVG bytes."""
    times = sample_instants(run.problem.duration, settings.samples)
    motion, limits = run.motion(times), run.problem.constraints.limits

    def fill(figure: Figure) -> None:
        panels = figure.subplots(3, 1, sharex=True)
        for axes, (name, label) in zip(panels, _MOTION_LABELS.items(), strict=True):
            _draw_joints(axes, times, np.degrees(getattr(motion, name)))
            _draw_limits(axes, limits, name)
            axes.set_ylabel(label)
        panels[-1].set_xlabel("time (s)")
        panels[0].set_title(f"Best trajectory of {display_name(run.algorithm)} ({run.title})", fontsize=9)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)

    return render_figure((6.4, 7.0), fill)


def _draw_joints(axes: Axes, times: Array, values: Array) -> None:
    for joint, values_of_joint in enumerate(values.T):
        drawn = line_style(joint)
        axes.plot(times, values_of_joint, color=drawn.color, linestyle=drawn.linestyle, label=f"joint {joint + 1}")


def _draw_limits(axes: Axes, limits: tuple[Limits, ...], name: str) -> None:
    """Each distinct limit once: in the joint's colour, or black where all joints share it."""
    pairs = [_limit_pair(limit, name) for limit in limits]
    shared = len(set(pairs)) == 1
    for joint, pair in enumerate(pairs[:1] if shared else pairs):
        color = "black" if shared else line_style(joint).color
        for bound in pair:
            if np.isfinite(bound):
                axes.axhline(float(np.degrees(bound)), color=color, linewidth=0.8, linestyle=(0, (2, 2)))
    if name == "position":
        axes.plot([], [], color="black", linewidth=0.8, linestyle=(0, (2, 2)), label="limit, in the joint's colour")


def _limit_pair(limit: Limits, name: str) -> tuple[float, float]:
    if name == "position":
        return limit.position
    bound = getattr(limit, name)
    return -bound, bound
