"""Second motions for a recording: the designed one, a random one, and the one of the smallest condition number."""

from pathlib import Path
from typing import Literal

import numpy as np

from diagnosis.files import verdict_texts, write_texts
from diagnosis.next.asked import Asked
from diagnosis.next.design import Budget, excitation, limits_in_force, random_point, searched
from diagnosis.next.experiment import LIBRARY, groups_of, links_of, ready
from diagnosis.next.problem import tell_apart_problem
from diagnosis.next.verdict_file import read_verdict
from diagnosis.run import diagnose
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.robot_file import load_arm
from problem.trajectory import instants
from problem.transforms import Array
from recordings.load import load_recording

Kind = Literal["designed", "random", "condition"]
RATE_HZ = 250.0


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


def second_motion(kind: Kind, verdict: Path, robot: Path, recording: Path, budget: Budget) -> Array | None:
    """A motion of that kind, (samples, 1 + joints), s and rad; None where no motion can be designed.

    All kinds share limits, duration, harmonics and number of evaluations.
    """
    arm, loaded = load_arm(str(robot)), load_recording(recording)
    plain = excitation(arm, limits_in_force(arm, loaded), budget)
    if kind == "random":
        return _sampled(plain, random_point(plain, budget))
    if kind == "condition":
        return _sampled(plain, searched(plain, budget))
    for rivals in (None, LIBRARY):  # those of the verdict, else all that come near
        try:
            prepared, plain = ready(verdict, arm, loaded, rivals, budget, None)
            problem = tell_apart_problem(prepared, plain)
        except (InputError, ValueError):
            continue
        return _sampled(plain, searched(problem, budget))
    return None


def _sampled(plain: ExcitationProblem, point: Array) -> Array:
    times = instants(plain.duration, round(plain.duration * RATE_HZ) + 1)
    motion = plain.trajectory.motions(point[None], times).motion
    return np.column_stack([times, motion.position[0]])
