"""`armlab bench published`: trajectories that others published with their coefficients, judged as the records are."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import Settings, read_yaml, validate
from bench.studies.best_known.records import build_excitation, known_values, read_search_plan
from bench.studies.best_known.records_table import RECORDS_PAGE, records_page
from bench.studies.best_known.search import CONFIG_FILE as PLAN_FILE
from bench.studies.best_known.verify import limit_use
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.registry import parse_problem
from problem.trajectories import fourier_terms, sample_instants

CONFIG_FILE = Path("configs/published.yaml")
PAGE_FILE = "published.md"
LIMIT_SAMPLES = 2001  # instants at which limits are checked

Rows = Annotated[tuple[tuple[float, ...], ...], Field(min_length=1)]
Columns = Literal["SI", "unit"]


class PublishedTrajectory(Settings):
    """A Fourier series with a polynomial in time, as configs/published.yaml states it.

    arm, source, licence, conversion: text. problems: by columns, the problem that judges it. same_family: by columns,
    the problem of configs/best_known.yaml with the same duration and harmonics. duration: s. sines, cosines: (joints,
    harmonics), rad/s. polynomial: (joints, terms), ascending powers of time. zero: (joints,), rad, added to positions.
    """

    arm: str
    source: str
    licence: str
    conversion: str
    problems: dict[Columns, str]
    same_family: dict[Columns, str]
    duration: Annotated[float, Field(gt=0)]
    sines: Rows
    cosines: Rows
    polynomial: Rows
    zero: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        series = {len(row) for row in (*self.sines, *self.cosines)}
        joints = {len(self.sines), len(self.cosines), len(self.polynomial), len(self.zero or self.sines)}
        if len(series) > 1 or len({len(row) for row in self.polynomial}) > 1 or len(joints) > 1:
            raise ValueError("sines, cosines, polynomial and zero should have one row a joint, all of one length")
        if self.problems.keys() != self.same_family.keys():
            raise ValueError("problems and same_family should have the same columns")
        return self

    def motion(self, samples: int) -> Motion:
        """The motion at evenly spaced instants, both ends included, (1, samples, joints)."""
        times = sample_instants(self.duration, samples)
        coefficients = np.hstack([np.array(self.sines), np.array(self.cosines)])
        position, velocity, acceleration = (
            terms @ coefficients.T + drift
            for terms, drift in zip(
                fourier_terms(times, self.duration, len(self.sines[0])), self._polynomials(times), strict=True
            )
        )
        return Motion(*(each[None] for each in (position + np.array(self.zero or 0.0), velocity, acceleration)))

    def _polynomials(self, times: Array) -> Array:
        """Values and first two derivatives at `times` (samples,), (3, samples, joints)."""
        rows = [np.polynomial.Polynomial(row) for row in self.polynomial]
        return np.stack(
            [np.column_stack([(row.deriv(order) if order else row)(times) for row in rows]) for order in range(3)]
        )


class PublishedFile(Settings):
    """All published trajectories by name."""

    trajectories: Annotated[dict[str, PublishedTrajectory], Field(min_length=1)]


@dataclass(frozen=True)
class Judgement:
    """A published trajectory on one problem.

    value: condition number at the problem's number of samples. best: of the problem, same_family: of the family of the
    same duration and harmonics, best known. limit_use: largest share of a limit that the motion uses, above 1 where it
    breaks one: half range from the middle, speed, acceleration.
    """

    name: str
    columns: Columns
    problem: str
    value: float
    best: float
    same_family: float
    limit_use: Mapping[str, float]


def judge_published(config: Path, plan: Path, records: Path) -> tuple[dict[str, PublishedTrajectory], list[Judgement]]:
    """The trajectories of a file, and each on its problems.

    plan: the file with the problems of the records. Raises InputError for a mistake in a file, a trajectory that does
    not fit its problem's arm, and a missing record.
    """
    trajectories = validate(PublishedFile, read_yaml(config), str(config)).trajectories
    family, settings = read_search_plan(plan), {}
    for name, trajectory in trajectories.items():
        for columns, problem in trajectory.problems.items():
            settings[problem] = parse_problem({"preset": problem}, f"{config}, '{name}'")
            settings[trajectory.same_family[columns]] = family.settings(trajectory.same_family[columns])
    known = known_values(settings, records)
    if missing := sorted(settings.keys() - known.keys()):
        raise InputError(f"{records}: has no record of '{missing[0]}'; `armlab bench best-known` makes it")
    return trajectories, [
        _judge(trajectory, name, columns, build_excitation(settings[problem], name), known)
        for name, trajectory in trajectories.items()
        for columns, problem in trajectory.problems.items()
    ]


def _judge(
    trajectory: PublishedTrajectory,
    name: str,
    columns: Columns,
    problem: ExcitationProblem,
    known: Mapping[str, float],
) -> Judgement:
    if len(trajectory.sines) != len(problem.arm):
        raise InputError(f"{name}: has {len(trajectory.sines)} joints, '{problem.arm.name}' has {len(problem.arm)}")
    motion = trajectory.motion(problem.samples)
    return Judgement(
        name=name,
        columns=columns,
        problem=trajectory.problems[columns],
        value=float(problem.spectrum(motion).condition_number[0]),
        best=known[trajectory.problems[columns]],
        same_family=known[trajectory.same_family[columns]],
        limit_use=limit_use(problem, trajectory.motion(LIMIT_SAMPLES)),
    )


def write_published(results: Path, records: Path, config: Path = CONFIG_FILE, plan: Path = PLAN_FILE) -> Iterator[Path]:
    """Write published.md into the folder `results`, beside the records of a file, and records.md; yields the files."""
    trajectories, judgements = judge_published(config, plan, records)
    page = markdown_page(
        "Published trajectories beside the best known",
        _INTRODUCTION,
        _table(judgements),
        *_notes(trajectories),
        _LOOKED_AT,
    )
    results.mkdir(parents=True, exist_ok=True)
    write_whole(results / PAGE_FILE, page)
    yield results / PAGE_FILE
    write_whole(results / RECORDS_PAGE, records_page(records))
    yield results / RECORDS_PAGE


_INTRODUCTION = """Excitation trajectories whose coefficients are public, recomputed under one convention: base
parameters by the later columns, the columns in SI units or of unit length, 100 instants over the duration, the limits
of the problem. *Best known*: the record of the problem (10 s, five harmonics). *Same family*: the record of a Fourier
series of the trajectory's own duration and number of harmonics; where the trajectory begins and ends at rest, so does
the series. Limits are checked at 2,001 instants; the table has the largest share that is used of each kind.

The sources planned for their own cells, limits and criteria; these records know no obstacles and no collisions of the
arm with itself (those of suite 4 do: records.md). The ratios say what these limits leave possible, not who searched
better."""

_LOOKED_AT = """## Looked at, and not recomputed

For the LBR iiwa, the Stäubli TX40, the KUKA KR300 and the ABB IRB 120 no coefficients were found as text.
github.com/halpersim/parameter_identification (iiwa) has its coefficients in MATLAB files, which could not be read here.
github.com/nepfaff/robot_payload_id (iiwa 7) and github.com/TUM-ICS/BIRDy (TX40) have programs that compute some,
github.com/JonasWeigand/Robot_Identification (KR300) has samples of motions. The log src/record.txt of
github.com/lbr-stack/dynamic_parameter_identification (LBR Med 7, with collisions; arXiv 2401.16566) has coefficients of
a few runs. The bounds that they touch say that their base frequency is 0.1 Hz, as in its program, which adds the sines
alone; about which position the joints move is not written. github.com/thanhndv212/figaroh-examples has points of a
spline for a simulated UR10. So no published motion that keeps off itself could be recomputed."""


def _table(judgements: list[Judgement]) -> str:
    headings = ["trajectory", "problem", "columns", "cond", "best known", "same family", "limits", "use"]
    return markdown_table(headings, [_row(each) for each in judgements], numbers={3, 4, 5})


def _row(judgement: Judgement) -> list[str]:
    use = {name: share for name, share in judgement.limit_use.items() if share > 0}
    return [
        judgement.name,
        judgement.problem,
        judgement.columns,
        f"{judgement.value:.4g}",
        f"{judgement.best:.4g} ({judgement.value / judgement.best:.2f} times)",
        f"{judgement.same_family:.4g} ({judgement.value / judgement.same_family:.2f} times)",
        "broken" if max(use.values()) > 1 else "kept",
        ", ".join(f"{name} {share:.0%}" for name, share in use.items()),
    ]


def _notes(trajectories: Mapping[str, PublishedTrajectory]) -> Iterator[str]:
    for name, trajectory in trajectories.items():
        yield f"## {name}"
        yield (
            f"{trajectory.arm}; {len(trajectory.sines[0])} harmonics in {trajectory.duration:.4g} s. "
            f"{trajectory.conversion.strip()}"
        )
        yield f"Source: {trajectory.source}. Licence: {trajectory.licence}."
