"""Names that a verdict did not list, but that imitate a finding on the first recording: the whole library is asked."""

from collections.abc import Sequence

from armlab.effects.library import library
from diagnosis.next.asked import Asked
from diagnosis.next.prepare import Links, Prepared, prepare
from diagnosis.next.question import Name, Question
from diagnosis.next.sizes import BEYOND_NOISE, explained
from diagnosis.next.verdict_file import Finding, VerdictFile
from problem.arm import Arm
from problem.trajectory import Trajectory
from recordings.recording import Recording
from recordings.vocabulary import effect_named

UNSURE = 3.0  # standard errors: closer names are no more than guessed
MOST = 4  # names in a group
STRONGEST = 4  # findings that are asked about
SEARCHED = (
    "torque_ripple",
    "external_contact",
    "torque_saturation",
)  # found by looking at the residual, not by columns


def nearby(
    verdict: VerdictFile,
    arm: Arm,
    trajectory: Trajectory,
    duration: float,
    recording: Recording,
    links: Links,
    seed: int,
) -> tuple[Asked, ...]:
    """For each finding its name, the rivals of the verdict, and the names that come closest; lone names left out."""
    named = [each for each in verdict.findings if each.parameters and each.name.effect not in (*SEARCHED, "unknown")]
    out = []
    for finding in named[:STRONGEST]:
        pairs = tuple((finding.name, name) for name in _names(finding, verdict, arm))
        found = prepare(verdict, pairs, arm, trajectory, duration, recording, links, seed, lenient=True)
        near = sorted((told for each in found.questions if (told := _near(found, each)) is not None), key=_lead)
        group = dict.fromkeys((finding.name, *finding.rivals, *(name for name, _ in near)))
        out.append(tuple(group)[:MOST])
    return tuple(group for group in out if len(group) > 1)


def _lead(near: tuple[Name, float]) -> float:
    return near[1]


def _names(finding: Finding, verdict: VerdictFile, arm: Arm) -> list[Name]:
    """Everything of the library at the finding's joint, at its link, and of the whole robot."""
    joint = finding.name.joint
    joints: Sequence[int] = range(1, len(arm) + 1) if joint is None else (joint,)
    known = {each.name for each in verdict.findings}
    out = []
    for family in library():
        if family.effect not in SEARCHED:
            robot = effect_named(family.effect).where == "robot"
            out += [Name(family.effect, None)] if robot else [Name(family.effect, each) for each in joints]
    return [name for name in out if name not in known]


def _near(prepared: Prepared, question: Question) -> tuple[Name, float] | None:
    """The other name of a question and how much a search prefers the finding to it; None where there is no doubt.

    No rival is a name that physics refuses with the size that it would need, nor a larger law that holds the
    finding's as a part, unless it explains more by more than noise.
    """
    seen = prepared.known
    found, other = question.rivals
    law = other.laws[0]
    gain = explained(seen, question.free, law.columns) - explained(seen, question.free, found.laws[0].columns)
    larger = bool(question.blind[0, 1]) and law.freedom > found.laws[0].freedom
    needed = BEYOND_NOISE**2 if larger else -(UNSURE**2)
    if gain < needed or law.candidate.objection(other.values) is not None:
        return None
    return other.name, law.price(prepared.rows) - found.laws[0].price(prepared.rows) - 0.5 * gain
