"""Second motions for a recording: the designed one, a random one, and the one of the smallest condition number."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.verdict_files import verdict_texts, write_texts
from diagnosis.next.asked import Asked
from diagnosis.next.chances import Chances, chances
from diagnosis.next.design import Budget, excitation, generator, limits_in_force, random_point, searched
from diagnosis.next.experiment import LIBRARY, groups_of, links_of, ready
from diagnosis.next.problem import TellApartProblem, tell_apart_problem
from diagnosis.next.question import Name
from diagnosis.next.verdict_file import read_verdict
from problem.arm import Arm
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.robot_file import load_arm
from problem.trajectory import instants
from problem.transforms import Array
from recordings.load import load_recording
from recordings.recording import Recording

Kind = Literal["designed", "random", "condition"]
RATE_HZ = 250.0


@dataclass(frozen=True, eq=False)
class Second:
    """motion: (samples, 1 + joints), s and rad. expected: for each question its names and the chances."""

    motion: Array
    expected: tuple[tuple[tuple[Name, ...], Chances], ...]


def diagnosed(recording: Path, out: Path) -> None:
    """Writes the verdict about a recording and its model into `out`."""
    found = diagnose(load_recording(recording))
    write_texts(verdict_texts(found, out), out)


def suspected(verdict: Path, robot: Path, recording: Path) -> tuple[Asked, ...]:
    """Groups of names between which the recording leaves doubt, the whole library asked."""
    arm, loaded, budget = load_arm(str(robot)), load_recording(recording), Budget()
    plain = excitation(arm, limits_in_force(arm, loaded), budget)
    read = read_verdict(verdict)
    try:
        return groups_of(read, arm, plain, loaded, LIBRARY, links_of(read, arm), budget)
    except InputError:
        return ()


def second_motion(kind: Kind, verdict: Path, robot: Path, recording: Path, budget: Budget) -> Second | None:
    """A motion of that kind, and what it is expected to decide; None where no motion can be designed.

    All kinds share limits, duration, harmonics and number of evaluations.
    """
    arm, loaded = load_arm(str(robot)), load_recording(recording)
    plain = excitation(arm, limits_in_force(arm, loaded), budget)
    problem = _problem(verdict, arm, loaded, budget)
    if kind == "random":
        point = random_point(plain, budget)
    elif kind == "condition":
        point = searched(plain, budget)
    elif problem is None:
        return None
    else:
        point = searched(problem, budget)
    return Second(_sampled(plain, point), () if problem is None else _expected(problem, point, budget))


def _problem(verdict: Path, arm: Arm, recording: Recording, budget: Budget) -> TellApartProblem | None:
    """Between the rivals of the verdict, else between all names that come near; None where no motion helps."""
    for rivals in (None, LIBRARY):
        try:
            return tell_apart_problem(*ready(verdict, arm, recording, rivals, budget, None))
        except (InputError, ValueError):
            continue
    return None


def _expected(problem: TellApartProblem, point: Array, budget: Budget) -> tuple[tuple[tuple[Name, ...], Chances], ...]:
    gram, prepared = problem.moments(point).gram, problem.prepared
    return tuple(
        (
            tuple(each.name for each in question.rivals),
            chances(prepared, question, gram, problem.rows, generator("chances", budget)),
        )
        for question in prepared.questions
    )


def _sampled(plain: ExcitationProblem, point: Array) -> Array:
    times = instants(plain.duration, round(plain.duration * RATE_HZ) + 1)
    motion = plain.trajectory.motions(point[None], times).motion
    return np.column_stack([times, motion.position[0]])
