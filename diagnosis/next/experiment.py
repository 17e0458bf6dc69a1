"""The next experiment for a verdict, whole: the motion, what it separates, and how likely it decides."""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnosis.next.asked import Asked, asked_of
from diagnosis.next.chances import Chances, chances
from diagnosis.next.design import Budget, excitation, generator, limits_in_force, random_point, searched
from diagnosis.next.nearby import nearby
from diagnosis.next.prepare import Links, Prepared, prepare
from diagnosis.next.problem import TellApartProblem, tell_apart_problem
from diagnosis.next.question import Question
from diagnosis.next.remedies import Remedy, remedies
from diagnosis.next.verdict_file import VerdictFile, read_verdict
from problem.arm import Arm
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.robot_file import load_arm
from problem.transforms import Array
from recordings.load import load_recording
from recordings.recording import Recording

RANDOM = 20  # random motions that a design is compared with
LIBRARY = "library"  # in place of names: everything that comes near
WEAK = 4.0  # standard errors: below it other ways are told, too


@dataclass(frozen=True)
class Pair:
    """Two rivals of a question. before, random, after: standard errors between them with the first recording alone,
    with a random motion of the same limits (median), with the designed one. hopeless: no motion separates them.
    """

    question: int
    names: tuple[str, str]
    places: tuple[int, int]
    before: float
    random: float
    after: float
    hopeless: bool
    remedies: tuple[Remedy, ...] = ()


@dataclass(frozen=True, eq=False)
class Experiment:
    """point: (dimension,) of the designed motion, None where no motion helps. chances: one a question."""

    prepared: Prepared
    excitation: ExcitationProblem
    budget: Budget
    problem: TellApartProblem | None
    point: Array | None
    pairs: tuple[Pair, ...]
    chances: tuple[Chances | None, ...]
    seconds: float


def design(
    verdict: Path, robot: str, recording: Path | None, rivals: str | None, budget: Budget, links: Links | None
) -> Experiment:
    """Designs the next experiment; InputError, in one line, for anything that cannot be used."""
    began = time.perf_counter()
    arm = load_arm(robot)
    loaded = None if recording is None else load_recording(recording)
    prepared, plain = ready(verdict, arm, loaded, rivals, budget, links)
    problem = point = None
    if any(question.pairs for question in prepared.questions):
        problem = tell_apart_problem(prepared, plain)
        point = searched(problem, budget)
    pairs = _pairs(prepared, plain, problem, point, budget)
    decided = tuple(_chances(prepared, question, problem, point, budget) for question in prepared.questions)
    return Experiment(prepared, plain, budget, problem, point, pairs, decided, time.perf_counter() - began)


def ready(
    verdict: Path, arm: Arm, recording: Recording | None, rivals: str | None, budget: Budget, links: Links | None
) -> tuple[Prepared, ExcitationProblem]:
    """The questions of a verdict, and the motions that this arm may make."""
    read = read_verdict(verdict)
    if recording is not None and len(recording.arm) != len(arm):
        raise InputError(f"{recording.name} has {len(recording.arm)} joints, {arm.name} {len(arm)}")
    if len(read.noise) not in (0, len(arm)) or (not len(read.noise) and recording is None):
        raise InputError(f"{read.path} tells the noise of {len(read.noise)} joints, {arm.name} has {len(arm)}")
    limits = limits_in_force(arm, recording)
    plain = excitation(arm, limits, budget)
    kind = links or links_of(read, arm)
    groups = groups_of(read, arm, plain, recording, rivals, kind, budget)
    return prepare(read, groups, arm, plain.trajectory, budget.duration, recording, kind, budget.seed), plain


def links_of(verdict: VerdictFile, arm: Arm) -> Links:
    """How well links are known after a diagnosis: exactly where it left them as they were given."""
    if arm.links is None:
        return "free"
    return "exact" if np.allclose(verdict.inertial(arm), arm.parameters, rtol=1e-6, atol=1e-9) else "near"


def groups_of(
    verdict: VerdictFile,
    arm: Arm,
    plain: ExcitationProblem,
    recording: Recording | None,
    rivals: str | None,
    links: Links,
    budget: Budget,
) -> tuple[Asked, ...]:
    """Groups of names of which one is right: those of the verdict, named ones, or with `library` all that come near."""
    if rivals != LIBRARY:
        return asked_of(verdict, rivals)
    if recording is None:
        raise InputError("--rivals library: needs --recording, in which all names are compared")
    groups = nearby(verdict, arm, plain.trajectory, budget.duration, recording, links, budget.seed)
    if not groups:
        raise InputError(f"{verdict.path}: no name of the library comes near a finding, so nothing is to be decided")
    return groups


def _chances(
    prepared: Prepared, question: Question, problem: TellApartProblem | None, point: Array | None, budget: Budget
) -> Chances | None:
    if problem is None or point is None or not question.pairs:
        return None
    return chances(prepared, question, problem.moments(point).gram, problem.rows, generator("chances", budget))


def _pairs(
    prepared: Prepared, plain: ExcitationProblem, problem: TellApartProblem | None, point: Array | None, budget: Budget
) -> tuple[Pair, ...]:
    times = prepared.sampling.times(budget.duration)
    drawn = np.array([random_point(plain, _again(budget, number)) for number in range(RANDOM)])
    motions = plain.trajectory.motions(drawn, times).motion
    scenes = [prepared.present.scene(motions.select(np.intp(number)), times) for number in range(RANDOM)]
    others = [prepared.together(prepared.moments(scene).gram) for scene in scenes]
    before = prepared.before.gram + prepared.layout.prior
    after = before if problem is None or point is None else prepared.together(problem.moments(point).gram)
    out = []
    for number, question in enumerate(prepared.questions):
        for pair in sorted([*question.pairs, *question.hopeless]):
            hopeless = pair in question.hopeless
            near, far = question.separation(before, *pair), question.separation(after, *pair)
            middle = float(np.median([question.separation(each, *pair) for each in others]))
            weak = hopeless or far < WEAK
            elsewise = remedies(prepared, question, pair, scenes[0].motion, times) if weak else []
            names = (str(question.rivals[pair[0]].name), str(question.rivals[pair[1]].name))
            out.append(Pair(number, names, pair, near, middle, far, hopeless, tuple(elsewise)))
    return tuple(out)


def _again(budget: Budget, number: int) -> Budget:
    return Budget(budget.duration, budget.harmonics, budget.algorithm, budget.evaluations, budget.seed + 1000 + number)
