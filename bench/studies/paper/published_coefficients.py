"""The published coefficients of the optimal trajectory, evaluated under every convention that the paper leaves open."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from bench.printed import PrintedOptimum
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.presets import PaperSettings
from problem.trajectories import CartesianFourier

DURATIONS = (0.5, 1.0, 2.0, 5.0, 2 * np.pi, 10.0)  # s; 2 pi makes the fundamental 1 rad/s
TOOLS = ((0.0, 0.0, 0.374), (0.0, 0.0, 0.302))  # flange and wrist, m beyond the elbow's offset
CENTRES = ((0.0, 0.0, 0.29), (0.0, 0.0, 0.0))  # shoulder and base, m
ColumnChoice = Literal["later_columns", "earlier_columns"]


@dataclass(frozen=True)
class PublishedReading:
    """space: whether eq. 45-47 give the tool point, as the text says, or the joint angles.

    overreach: m, how far the path leaves the reach; value: condition number, infinite out of reach.
    """

    space: Literal["Cartesian", "joint"]
    settings: PaperSettings
    overreach: float
    value: float

    def __str__(self) -> str:
        chosen = self.settings
        place = f", tool at {chosen.tool[2]:g} m, centre at {chosen.centre[2]:g} m, elbow {chosen.elbow}"
        scaling = "unit columns" if chosen.unit_columns else "SI columns"
        rest = "windowed to rest" if chosen.rest else "literal"
        where = place if self.space == "Cartesian" else ""
        return f"{self.space} space, {chosen.duration:.3g} s, {rest}{where}, {chosen.columns}, {scaling}"


def published_readings(optimum: PrintedOptimum) -> list[PublishedReading]:
    """The published coefficients under all conventions, each once."""
    point = np.array([*optimum.a, *optimum.b, optimum.c])
    return [_evaluate_reading(point, space, settings) for space, settings in _conventions()]


def _conventions() -> Iterator[tuple[Literal["Cartesian", "joint"], PaperSettings]]:
    columns: tuple[ColumnChoice, ...] = ("later_columns", "earlier_columns")
    for duration, rest, kept, unit in product(DURATIONS, (True, False), columns, (False, True)):
        shared = PaperSettings(duration=duration, rest=rest, columns=kept, unit_columns=unit)
        yield "joint", shared
        for tool, centre, elbow in product(TOOLS, CENTRES, ("up", "down")):
            yield "Cartesian", shared.model_copy(update={"tool": tool, "centre": centre, "elbow": elbow})


def _evaluate_reading(point: Array, space: Literal["Cartesian", "joint"], settings: PaperSettings) -> PublishedReading:
    problem = settings.build()
    assert isinstance(problem, ExcitationProblem)
    assert isinstance(problem.trajectory, CartesianFourier)
    if space == "joint":
        path = problem.trajectory.path(point[None], problem.times)
        motion = Motion(*(np.stack(part, axis=-1) for part in (path.position, path.velocity, path.acceleration)))
        return PublishedReading(space, settings, 0.0, _condition_number(problem, motion))
    excitation = problem.trajectory.motions(point[None], problem.times)
    overreach = float(excitation.overreach[0])
    value = np.inf if overreach > 0 else _condition_number(problem, excitation.motion)
    return PublishedReading(space, settings, overreach, value)


def _condition_number(problem: ExcitationProblem, motion: Motion) -> float:
    return float(problem.spectrum(motion).condition_number[0])
