"""What the feasible search space gives up: the best known trajectory, moved into it and improved from there."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.streams import named_generator
from bench.studies.best_known.descent import descend, evaluate_point
from bench.studies.best_known.records import Record, build_excitation
from bench.studies.best_known.search import record_point
from problem.excitation import ExcitationProblem
from problem.feasible import FeasibleFourier
from problem.fitness import Criterion
from problem.presets import JointFourierSettings
from problem.registry import ProblemSettings
from problem.suite import InstanceSettings, definition_of
from problem.trajectories import sample_instants

RANDOM_POINTS = 2000
INSTANTS_BETWEEN = 20  # a sample: where excesses between samples are looked for


@dataclass(frozen=True)
class SpaceFigures:
    """One problem in both search spaces.

    feasible_points, feasible_points_of_space: shares of random points of the box that keep all limits. best_known: the
    record's condition number. excess: by which it breaks limits between its samples, summed over the limits, relative
    to each. moved: the condition number of the record on its way to the middle, where the space begins. improved: the
    best that a descent in the space finds from there. loss: improved / best_known - 1.
    """

    problem: str
    feasible_points: float
    feasible_points_of_space: float
    best_known: float
    excess: float
    moved: float
    improved: float

    @property
    def loss(self) -> float:
        """Relative excess of the improved trajectory over the record."""
        return self.improved / self.best_known - 1

    def row(self) -> dict[str, object]:
        """The figures by column."""
        return asdict(self) | {"loss": self.loss}


def measure_space(label: str, settings: ProblemSettings, record: Record) -> SpaceFigures:
    """The figures of a problem in joint space, in both search spaces; record: its best known trajectory.

    Raises InputError for settings that are no series in joint space.
    """
    plain, space = (_without_criterion(build_excitation(each, label)) for each in _both_spaces(label, settings))
    trajectory = space.trajectory
    if not isinstance(trajectory, FeasibleFourier):
        raise InputError(f"{label}: is no series in joint space")
    best = record_point(record)
    fine = sample_instants(plain.duration, INSTANTS_BETWEEN * (plain.samples - 1) + 1)
    excess = np.expm1(plain.constraints.violation(plain.trajectory.motions(best[None], fine))[0])
    moved = evaluate_point(space, trajectory.points(best[None])[0])
    return SpaceFigures(
        problem=label,
        feasible_points=_feasible_share(plain, label),
        feasible_points_of_space=_feasible_share(space, label),
        best_known=record.value,
        excess=float(excess),
        moved=moved.value,
        improved=descend(space, moved.point).value,
    )


def _both_spaces(label: str, settings: ProblemSettings) -> tuple[JointFourierSettings, JointFourierSettings]:
    definition = definition_of(settings.preset) if isinstance(settings, InstanceSettings) else settings
    if not isinstance(definition, JointFourierSettings):
        raise InputError(f"{label}: should be a series in joint space, not '{settings.preset}'")
    plain = definition.model_copy(update={"search_space": "coefficients", "frame_seed": None})
    return plain, plain.model_copy(update={"search_space": "feasible"})


def _without_criterion(problem: ExcitationProblem) -> ExcitationProblem:
    """The same problem, where the fitness is the condition number and the penalty alone."""
    return replace(problem, criterion=Criterion("eq44"))


def _feasible_share(problem: ExcitationProblem, label: str) -> float:
    rng = named_generator("search space", label)
    points: Array = rng.uniform(problem.lower, problem.upper, (RANDOM_POINTS, len(problem.lower)))
    return float((problem.constraints.violation(problem.trajectory.motions(points, problem.times)) == 0).mean())
