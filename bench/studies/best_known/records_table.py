"""The table of records: what trajectories reach, and what they keep at every instant."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.markdown import markdown_page, markdown_table
from bench.studies.best_known.records import (
    Record,
    build_excitation,
    is_d_optimal,
    parse_record,
    read_records,
    record_key,
)
from bench.studies.best_known.search import record_point
from bench.studies.best_known.verify import Verification, limit_use_of_point, verify_motion
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.registry import ProblemSettings
from problem.safe_motion import SafeConstraints
from problem.trajectories import JointFourier

RECORDS_PAGE = "records.md"
HEADINGS = ("problem", "cond", "det", "least det", "position", "speed", "acceleration", "itself", "floor", "by")
_NUMBERS = range(1, 9)


def record_cells(
    name: str, problem: ExcitationProblem, point: Array, verified: Verification, least_determinant: float | None
) -> list[str]:
    """The row of a trajectory without its author. least_determinant: of the problem, best known."""
    spectrum = problem.spectrum(problem.trajectory.motions(point[None], problem.times).motion)
    determinant = float(np.exp(Criterion("d_optimality").value(spectrum)[0]))
    least = verified.safety.least if verified.safety is not None else {}
    distances = (least.get(kind) for kind in ("the arm itself", "the floor"))
    return [
        name,
        f"{spectrum.condition_number[0]:.4g}",
        f"{determinant:.4g}",
        "-" if least_determinant is None else f"{least_determinant:.4g}",
        *(f"{verified.limit_use[kind]:.1%}" for kind in ("position", "speed", "acceleration")),
        *("-" if distance is None else f"{1000 * distance:.0f} mm" for distance in distances),
    ]


def least_determinants(records: Mapping[str, Record], path: Path) -> dict[str, float]:
    """Least det(W'W)^(-1/n) known, by the key of the problem."""
    parsed = {name: parse_record(record, name, path) for name, record in records.items()}
    return {record_key(parsed[name]): record.value for name, record in records.items() if is_d_optimal(parsed[name])}


def records_page(path: Path) -> str:
    """The page of all records of Fourier series in joint space."""
    return markdown_page("Best known trajectories", _INTRODUCTION, markdown_table(HEADINGS, _rows(path), _NUMBERS))


def _rows(path: Path) -> Iterator[list[str]]:
    records = read_records(path)
    determinants = least_determinants(records, path)
    for name, record in records.items():
        settings: ProblemSettings = parse_record(record, name, path)
        problem, point = build_excitation(settings, name), record_point(record)
        if not (problem.spectral and isinstance(problem.trajectory, JointFourier)):
            continue
        if isinstance(problem.constraints, SafeConstraints):
            verified = verify_motion(problem, point, name)
        else:
            verified = Verification(limit_use_of_point(problem, point), None)
        cells = record_cells(name, problem, point, verified, determinants.get(record_key(settings)))
        yield [*cells, f"armlab ({record.method})"]


_INTRODUCTION = """The records of `results/best_known.json` whose motions are Fourier series in joint space. *cond*:
the condition number of the observation matrix W. *det*: det(W'W)^(-1/n) for n columns, what D-optimality makes small;
*least det*: the least one known under the same limits, of the record whose name ends in `-d`. *position*, *speed*,
*acceleration*: the largest share of the limit that is used at any instant, by the bound of Ehlich and Zeller 1964.
Records of suites 2 and 3 keep the limits at their samples, so that a little more may be used between them; those of
suite 4 keep everything at every instant. *itself*, *floor*: the least distance of links two or more joints apart, and
of links from the floor, at the poses of a proof that 19 mm are kept at every instant (conservative advancement,
Mirtich 1996, distances by MuJoCo); "-" where collisions are not looked at. A test holds the same distances beside
those of Pinocchio and Coal.

`armlab bench submit trajectory.yaml` recomputes a trajectory of yours for any of these problems, refuses it where it
breaks a limit or collides at any instant, and prints its row."""
