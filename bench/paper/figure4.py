"""Figure 4: a trajectory in Cartesian space, with the arm drawn at a few instants."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bench.figure import look, paint
from bench.paper.best_run import BestRun
from bench.paper.settings import Figure4Settings
from bench.printed import display_name
from problem.kinematics import body_points
from problem.trajectory import instants
from problem.transforms import Array

_ARM = "#555555"


def draw_figure4(settings: Figure4Settings, run: BestRun) -> dict[str, bytes]:
    """The tool point's path with its start, and the arm from base to tool; PNG and SVG bytes."""

    def fill(figure: Figure) -> None:
        axes: Any = figure.add_subplot(projection="3d")
        path = _points(run, instants(run.problem.duration, settings.samples))[:, -1]
        axes.plot(*path.T, color=look(0).color, linewidth=1.8, label="path of the tool point")
        axes.scatter(*path[0], color=look(1).color, s=40, marker="s", label="start and end", depthshade=False)
        for index, pose in enumerate(_points(run, np.array(settings.arm_at))):
            _draw_arm(axes, pose, label=index == 0)
        axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MaxNLocator(5))  # more would run into each other
        spans = np.ptp([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()], axis=1)
        axes.set_box_aspect(spans, zoom=0.95)  # one metre is as long along every axis
        axes.set_title(f"Best trajectory of {display_name(run.algorithm)}\n({run.title})", fontsize=9)
        axes.view_init(elev=24, azim=-58)
        figure.legend(loc="outside lower center", ncols=3)

    return paint((6.4, 5.2), fill)


def _points(run: BestRun, times: Array) -> Array:
    """Base, origins of the links' frames and tool point, (samples, joints + 2, 3), m."""
    tool = np.array(run.problem.constraints.workspace.tool)
    chain = body_points(run.problem.arm, run.motion(times).position, tool)
    return np.concatenate([np.zeros((len(times), 1, 3)), chain], axis=1)


def _draw_arm(axes: Any, pose: Array, label: bool) -> None:
    text = "arm, frames as dots" if label else None
    axes.plot(*pose.T, color=_ARM, linewidth=1.6, marker="o", markersize=3.0, alpha=0.75, label=text)
