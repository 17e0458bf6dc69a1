"""The features of one problem: all that `sampling`, `basins` and `curvature` measure, in their order."""

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from algorithms.contract import Box, uniform_points
from armlab.common.arrays import Array
from armlab.common.streams import named_generator
from bench.studies.landscape.basins import POLISH, End, Ends, find_end, find_symmetry, random_start
from bench.studies.landscape.curvature import Curvature, measure_curvature
from bench.studies.landscape.sampling import (
    SamplingSettings,
    distance_correlation,
    feasible_share,
    in_shares,
    log_fitness,
    measure_ruggedness,
)
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion

_NO_CURVATURE = Curvature(float("nan"), 0, 0, 0)


@dataclass(frozen=True)
class Effort:
    """sampling: of the points and walks. gradients: points with derivatives, after which no descent begins.

    descents: at least. symmetry_points: random points, among whose motions the symmetries are tried.
    """

    sampling: SamplingSettings = field(default_factory=SamplingSettings)
    gradients: int = 2_500
    descents: int = 5
    symmetry_points: int = 200


@dataclass(frozen=True)
class Landscape:
    """One problem; shares and correlations have no unit, values are condition numbers.

    dimension: numbers that are searched. feasible_share: of uniform points. distance_correlation: of log fitness with
    the distance to the best. walk_correlation, information: ruggedness. descents: from random starts, each with
    derivatives; feasible_ends: share of them that ends within all limits; basins: different ends up to symmetry;
    meeting_share: chance that two descents meet, meeting_half and meeting_double with half and twice the tolerances.
    end_spread: standard deviation of log10 of the ends. valley_correlation: of log value of the ends with their
    distance to the best. best: least value of an end, from_record if the best known trajectory led to it. condition,
    free, flat, negative: as `Curvature` has them.
    """

    dimension: int
    feasible_share: float
    distance_correlation: float
    walk_correlation: float
    information: float
    descents: int
    gradients: int
    feasible_ends: float
    basins: int
    meeting_share: float
    meeting_half: float
    meeting_double: float
    end_spread: float
    valley_correlation: float
    best: float
    from_record: bool
    condition: float
    free: int
    flat: int
    negative: int


def measure_landscape(
    problem: ExcitationProblem, name: str, effort: Effort, record: Array | None
) -> tuple[Landscape, list[End]]:
    """The features of a problem in its own coordinates, and the ends of the descents from random starts.

    name: decides the random numbers. record: the best known point (dimension,), where there is one.
    """
    plain = replace(problem, criterion=Criterion("eq44"))  # descents go after the condition number alone
    ends = _descend(plain, name, effort)
    polished = [] if record is None else [find_end(plain, record, POLISH)]
    found = _compare_ends(plain, name, effort, ends)
    feasible = [end for end in (*ends, *polished) if end.feasible]
    best = min(feasible, key=lambda end: end.value, default=None)
    return (
        Landscape(
            dimension=len(problem.lower),
            feasible_share=feasible_share(problem, effort.sampling.points, _stream("feasible", name)),
            distance_correlation=_correlate_distances(problem, name, effort, best),
            **asdict(measure_ruggedness(problem, effort.sampling, _stream("walks", name))),
            descents=len(ends),
            gradients=sum(end.gradients for end in ends),
            feasible_ends=float(np.mean([end.feasible for end in ends])),
            basins=found.count,
            meeting_share=found.meeting_share(),
            meeting_half=found.meeting_share(0.5),
            meeting_double=found.meeting_share(2.0),
            end_spread=float(np.log10(found.values).std(ddof=1)) if len(found.values) > 1 else float("nan"),
            valley_correlation=_correlate_ends(found),
            best=best.value if best else float("nan"),
            from_record=best in polished,
            **asdict(measure_curvature(plain, np.array(best.point)) if best else _NO_CURVATURE),
        ),
        ends,
    )


def _stream(*names: str) -> np.random.Generator:
    return named_generator("landscape", *names)


def _descend(plain: ExcitationProblem, name: str, effort: Effort) -> list[End]:
    ends: list[End] = []
    while len(ends) < effort.descents or sum(end.gradients for end in ends) < effort.gradients:
        ends.append(find_end(plain, random_start(plain, name, len(ends))))
    return ends


def _compare_ends(plain: ExcitationProblem, name: str, effort: Effort, ends: list[End]) -> Ends:
    tried = uniform_points(effort.symmetry_points, Box(plain.lower, plain.upper), _stream("symmetry", name))
    within_reach = [end.point for end in ends if end.feasible]
    return Ends.of(plain, ends, find_symmetry(plain, np.vstack([tried, *within_reach])))


def _correlate_distances(problem: ExcitationProblem, name: str, effort: Effort, best: End | None) -> float:
    if best is None:
        return float("nan")
    shares = _stream("distances", name).uniform(-1, 1, (effort.sampling.distances, len(problem.lower)))
    return distance_correlation(log_fitness(problem, shares), shares, in_shares(problem, np.array(best.point)))


def _correlate_ends(found: Ends) -> float:
    """Of log value with the distance to the best end, up to symmetry (Boese, Kahng and Muddu 1994).

    The best end is left out.
    """
    if len(found.values) < 4:
        return float("nan")
    best = int(np.argmin(found.values))
    others = np.delete(np.arange(len(found.values)), best)
    distances, values = found.distances[best, others], np.log(found.values[others])
    if np.ptp(distances) == 0 or np.ptp(values) == 0:
        return float("nan")
    return float(np.corrcoef(distances, values)[0, 1])
