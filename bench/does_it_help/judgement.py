"""What the criteria promise of a trajectory, and what identification from it gives."""

from dataclasses import dataclass

import numpy as np

from bench.does_it_help.identification import KINDS, identify
from bench.does_it_help.trajectories import Specimen, random_feasible
from bench.seeds import named_generator
from problem.excitation_problem import ExcitationProblem
from problem.fitness import Criterion, condition_number, singular_values
from problem.regressor import observation_matrix
from problem.transforms import Array

CRITERIA = ("cond", "cond_unit_columns", "d_optimality", "e_optimality", "eq44")  # the smaller, the better
ERRORS = ("prediction", "parameters", "parameters_si")
HALVES = ("first", "second")  # of the repetitions: how far two samples of them agree
OTHERS = 20  # independent trajectories, on which torques are predicted
WEIGHT = 0.01  # both of eq. 44, as the presets have them


@dataclass(frozen=True, eq=False)
class Jury:
    """Independent trajectories as the Gram matrix of their observation matrices, per row, (base, base)."""

    gram: Array

    def errors(self, deviations: Array) -> dict[str, float]:
        """Root mean squares of deviations (repetitions, base) of the base parameters.

        prediction: of the torque on the independent trajectories, N m. parameters: each deviation times the
        torque that its column gives there, averaged over parameters, N m. parameters_si: their length in SI units.
        """
        powers = np.einsum("ri,ij,rj->r", deviations, self.gram, deviations)
        relevance = np.diagonal(self.gram)
        return {
            "prediction": float(np.sqrt(powers.mean())),
            "parameters": float(np.sqrt((deviations**2 * relevance).mean())),
            "parameters_si": float(np.sqrt((deviations**2).sum(axis=1).mean())),
        }


def jury(problem: ExcitationProblem, seed: int) -> Jury:
    """Random feasible trajectories of a seed of their own."""
    streams = (named_generator("does it help", "independent", seed, number) for number in range(OTHERS))
    points = np.array([random_feasible(problem, rng) for rng in streams])
    motions = problem.trajectory.motions(points, problem.times).motion
    matrix = observation_matrix(problem.arm, motions)[..., problem.base.columns]
    rows = matrix.reshape(-1, len(problem.base))
    return Jury(rows.T @ rows / len(rows))


def judged(specimen: Specimen, panel: Jury, seed: int, repetitions: int) -> dict[str, str | float]:
    """One row of the table: where the trajectory is from, its criteria, and the errors under each kind of noise."""
    problem, point = specimen.problem, specimen.point

    def streams(repetition: int) -> np.random.Generator:
        return named_generator("does it help", "noise", seed, repetition)

    row: dict[str, str | float] = {"source": specimen.source, "group": specimen.group, **criteria(problem, point)}
    for kind, noise in KINDS.items():
        deviations = identify(problem, point, noise, streams, repetitions)
        row |= {f"{kind}_{error}": value for error, value in panel.errors(deviations).items()}
        for half, part in zip(HALVES, np.array_split(deviations, len(HALVES)), strict=True):
            row |= {f"{kind}_{error}_{half}": value for error, value in panel.errors(part).items()}
    return row


def criteria(problem: ExcitationProblem, point: Array) -> dict[str, float]:
    """Every criterion of a point (dimension,)."""
    motion = problem.trajectory.motions(point[None], problem.times).motion
    plain, unit = (singular_values(problem.arm, motion, problem.base.columns, scaled) for scaled in (False, True))
    values = (
        condition_number(plain),
        condition_number(unit),
        Criterion("d_optimality").value(plain),
        Criterion("e_optimality").value(plain),
        Criterion("eq44", WEIGHT, WEIGHT).value(plain),
    )
    return {name: float(value[0]) for name, value in zip(CRITERIA, values, strict=True)}
