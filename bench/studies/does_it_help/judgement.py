"""The criteria of a trajectory, the errors of identification from it, and the rank correlations between the two."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.statistics import spearman_correlations
from armlab.common.streams import named_generator
from bench.studies.does_it_help.noisy_identification import NOISE_KINDS, identification_errors
from bench.studies.does_it_help.trajectories import Specimen, random_feasible
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.regressor import observation_matrix
from problem.spectrum import find_spectrum

CRITERIA = ("cond", "cond_unit_columns", "d_optimality", "e_optimality", "eq44")  # the smaller, the better
ERRORS = ("prediction", "parameters", "parameters_si")
REPETITION_HALVES = ("first", "second")  # of the repetitions: how far two samples of them agree
JURY_SIZE = 20  # independent trajectories, on which torques are predicted
EQ44_WEIGHT = 0.01  # both of eq. 44, as the presets have them


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


def choose_jury(problem: ExcitationProblem, seed: int) -> Jury:
    """Random feasible trajectories from a seed of their own."""
    streams = (named_generator("does it help", "independent", seed, number) for number in range(JURY_SIZE))
    points = np.array([random_feasible(problem, rng) for rng in streams])
    motions = problem.trajectory.motions(points, problem.times).motion
    matrix = observation_matrix(problem.arm, motions)[..., problem.base.columns]
    rows = matrix.reshape(-1, len(problem.base))
    return Jury(rows.T @ rows / len(rows))


def judge_specimen(specimen: Specimen, panel: Jury, seed: int, repetitions: int) -> dict[str, str | float]:
    """One row of the table: the origin of the trajectory, its criteria, and the errors under each kind of noise."""
    problem, point = specimen.problem, specimen.point

    def streams(repetition: int) -> np.random.Generator:
        return named_generator("does it help", "noise", seed, repetition)

    row: dict[str, str | float] = {
        "source": specimen.source,
        "group": specimen.group,
        **criterion_values(problem, point),
    }
    for kind, noise in NOISE_KINDS.items():
        deviations = identification_errors(problem, point, noise, streams, repetitions)
        row |= {f"{kind}_{error}": value for error, value in panel.errors(deviations).items()}
        for half, part in zip(REPETITION_HALVES, np.array_split(deviations, len(REPETITION_HALVES)), strict=True):
            row |= {f"{kind}_{error}_{half}": value for error, value in panel.errors(part).items()}
    return row


def criterion_values(problem: ExcitationProblem, point: Array) -> dict[str, float]:
    """Every criterion of a point (dimension,)."""
    motion = problem.trajectory.motions(point[None], problem.times).motion
    plain = find_spectrum(problem.arm, motion, problem.base.columns, False)
    unit = find_spectrum(problem.arm, motion, problem.base.columns, True)
    values = (
        plain.condition_number,
        unit.condition_number,
        Criterion("d_optimality").value(plain),
        Criterion("e_optimality").value(plain),
        Criterion("eq44", EQ44_WEIGHT, EQ44_WEIGHT).value(plain),
    )
    return {name: float(value[0]) for name, value in zip(CRITERIA, values, strict=True)}


RESAMPLES = 1000
INTERVAL_LEVEL = 0.95
SUBSETS = MappingProxyType({"all": "all trajectories", "better_half": "the better half of the trajectories"})


def correlation_table(frame: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Spearman's correlation of each criterion with each error, with a bootstrap interval of 95 %.

    frame: one row a trajectory, as `judge_all` makes it. Whole groups are resampled, because the trajectories of one
    search are alike. Returns columns subset, noise, error, criterion, correlation, low, high, trajectories.
    """
    return pd.concat(
        [_subset_correlations(name, rows, seed) for name, rows in split_subsets(frame).items()], ignore_index=True
    )


def split_subsets(frame: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """All trajectories, and the half of them with the smaller condition numbers."""
    return dict(zip(SUBSETS, (frame, frame[frame["cond"] <= frame["cond"].median()]), strict=True))


def correlation_ceiling(frame: pd.DataFrame, kind: str, error: str) -> float:
    """Estimate of the correlation that a perfect criterion would have with an error, given the error's own noise.

    From the correlation r of two halves of the repetitions: 2 r / (1 + r) for all of them (Spearman and Brown 1910),
    and its root for the attenuation by one noisy side. 0 where the halves do not agree at all.
    """
    halves = (frame[[f"{kind}_{error}_{half}"]].to_numpy() for half in REPETITION_HALVES)
    agreement = max(float(spearman_correlations(*halves)[0, 0]), 0.0)
    return float(np.sqrt(2 * agreement / (1 + agreement)))


def group_resample(groups: Sequence[str], rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices of the members of groups that are drawn with replacement."""
    names = np.asarray(groups)
    members = [np.flatnonzero(names == name) for name in dict.fromkeys(groups)]
    return np.concatenate([members[index] for index in rng.integers(len(members), size=len(members))])


def _subset_correlations(subset: str, frame: pd.DataFrame, seed: int) -> pd.DataFrame:
    pairs = [(kind, error) for kind in NOISE_KINDS for error in ERRORS]
    promised = frame[list(CRITERIA)].to_numpy()
    given = frame[[f"{kind}_{error}" for kind, error in pairs]].to_numpy()
    rng = named_generator("does it help", "bootstrap", seed, subset)
    groups = frame["group"].tolist()
    picks = [group_resample(groups, rng) for _ in range(RESAMPLES)]
    low, high = np.quantile(
        [spearman_correlations(promised[pick], given[pick]) for pick in picks],
        [(1 - INTERVAL_LEVEL) / 2, (1 + INTERVAL_LEVEL) / 2],
        axis=0,
    )
    found = spearman_correlations(promised, given)
    rows = [
        (subset, *pair, criterion, found[c, e], low[c, e], high[c, e], len(frame))
        for e, pair in enumerate(pairs)
        for c, criterion in enumerate(CRITERIA)
    ]
    names = ["subset", "noise", "error", "criterion", "correlation", "low", "high", "trajectories"]
    return pd.DataFrame(rows, columns=names)
