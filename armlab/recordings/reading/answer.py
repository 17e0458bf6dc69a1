"""How a recording is to be read: the mistakes with their evidence, their rivals, and the recording as it should be."""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.told import MAX_CLASS_NAMES, MIN_CAUSE_PROBABILITY
from armlab.recordings.dead_joints import NO_TORQUE
from armlab.recordings.reading.corrected import correct_recording
from armlab.recordings.reading.judge import ReadingJudge
from armlab.recordings.reading.reading import LINK_DATA, SPRING, Mistake, Reading, read_as_is
from armlab.recordings.reading.search import Found, find_mistakes
from armlab.recordings.reading.signs import has_no_sign
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.reading.words import INERTIAL_ERROR, describe, measurement
from armlab.recordings.recording import Finding, Recording
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words, links_in_words
from problem.pseudo_inertia import are_bodies


@dataclass(frozen=True)
class RivalReading:
    """What fits these data alike in the place of a mistake: another one, a spring of a joint, or links that are off."""

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    text: str
    probability: float


@dataclass(frozen=True)
class SetupFinding:
    """One mistake. worst_joint: from 1, where the errors fall most; rms_before, rms_after: there, N m (N).

    share_before, share_after: the same over the torque's scatter, without and with this one taken back. sigmas: of
    the fall between blocks of time. probability: of the name against its rivals, and against no name that was tried.
    arm: for the names of its joints.
    """

    mistake: Mistake
    arm: Arm
    worst_joint: int
    rms_before: float
    rms_after: float
    share_before: float
    share_after: float
    sigmas: float
    probability: float
    rivals: tuple[RivalReading, ...]
    next_experiment: str | None

    @property
    def of_class(self) -> float:
        """Probability of the name and of its rivals together."""
        return self.probability + sum(each.probability for each in self.rivals)

    @property
    def description(self) -> str:
        """What is wrong, in a clause."""
        return describe(self.mistake, self.arm)

    @property
    def text(self) -> str:
        """What is wrong, and the evidence."""
        if self.mistake.effect in (UNSIGNED, NO_TORQUE):
            return self.description
        worst = joint_in_words(self.arm, self.worst_joint)
        return (
            f"{self.description} (read so, links and usual friction fit {worst} with an error of "
            f"{100 * self.share_after:.0f} % of its torque, not {100 * self.share_before:.0f} %)"
        )


@dataclass(frozen=True)
class Doubt:
    """A mistake that is not named and that these data do not exclude. measurement: what decides."""

    effect: str
    joints: tuple[int, ...]
    text: str
    measurement: str

    @property
    def finding(self) -> Finding:
        """The same as a note about the recording."""
        joint = self.joints[0] if len(self.joints) == 1 else None
        return Finding("doubt", "note", f"not excluded: {self.text}; to tell, {self.measurement}", joint)


@dataclass(frozen=True, eq=False)
class Answer:
    """How a recording is to be read.

    findings: joints without torque, which are left out, then what is read wrongly, in the order in which it was found;
    none where it is read rightly. recording: as it should be read.
    share: held-out error of all joints as it is read, of the torque's scatter. share_after: of the recording as it
    should be read. undecided: joints whose zero the data do not tell by quarters of a turn, where a zero is a finding.
    doubts: what is not named and not excluded. looks: how many readings were compared, 0 where it is too short.
    """

    findings: tuple[SetupFinding, ...]
    recording: Recording
    reading: Reading | None
    share: float = 0.0
    share_after: float = 0.0
    undecided: tuple[int, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    looks: int = 0

    @property
    def is_lost(self) -> bool:
        """Whether there is a mistake that nothing takes back: physics cannot be told from what was recorded."""
        return any(each.mistake.effect == UNSIGNED for each in self.findings)

    @property
    def mistakes(self) -> tuple[SetupFinding, ...]:
        """What is read wrongly: the findings but joints that are left out."""
        return tuple(each for each in self.findings if each.mistake.effect != NO_TORQUE)

    @property
    def sentence(self) -> str:
        """The findings in words; empty where there is none."""
        return " ".join(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong, why it is believed, what was left out and what stays open; the most important first."""
        absent = "; ".join(each.description for each in self.findings if each.mistake.effect == NO_TORQUE)
        left_out = (f"Left out: {absent}.",) if absent else ()
        if not self.mistakes:
            return left_out
        wrong = f"The recording is read wrongly: {'; '.join(each.description for each in self.mistakes)}."
        if self.is_lost:
            return wrong, "Links and friction cannot be told from it.", *left_out
        error, before = 100 * self.share_after, 100 * self.share
        rightly = (
            f"Read rightly, links and usual friction fit with an error of {error:.1f} % of the torque, "
            f"not {before:.1f} %."
        )
        zeros = joints_in_words(self.recording.arm, self.undecided) if self.undecided else ""
        open_zeros = (f"These data do not tell the zero of {zeros} by quarters of a turn.",) if zeros else ()
        return wrong, rightly, *left_out, *open_zeros


def read_rightly(recording: Recording, inertial: Array | None, tuning: ReadingTuning) -> Answer:
    """How a recording is to be read.

    inertial: (10 * joints,) of the links of the simulation, None without one. Base parameters alone are no links.
    """
    return with_joints_left_out(_find_answer(recording, inertial, tuning), recording)


def with_joints_left_out(answer: Answer, recording: Recording) -> Answer:
    """The answer, and which joints have no torque in the recording as it is."""
    dead = [each for each in recording.findings if each.kind == NO_TORQUE]
    if not dead:
        return answer
    found = tuple(_left_out(each, recording.arm) for each in dead)
    reading = answer.reading or read_as_is(recording, None)
    return replace(answer, findings=(*found, *answer.findings), reading=reading)


def _left_out(finding: Finding, arm: Arm) -> SetupFinding:
    joint = finding.joint or 1
    mistake = Mistake(NO_TORQUE, joint)
    return SetupFinding(mistake, arm, joint, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0, (), measurement(NO_TORQUE, joint, arm))


def _find_answer(recording: Recording, inertial: Array | None, tuning: ReadingTuning) -> Answer:
    if has_no_sign(recording):
        return Answer((_unsigned(recording),), recording, None)
    inertial = inertial if inertial is not None and are_bodies(inertial) else None
    judge = ReadingJudge.of(recording, tuning)
    if judge is None:
        return Answer((), recording, None)
    start = judge.trial(read_as_is(recording, inertial))
    found = find_mistakes(judge, start)
    share = judge.overall_error(start)
    doubts = tuple(_doubt(each.reading.mistakes[-1], recording.arm) for each in found.doubts)
    mistakes = found.best.reading.mistakes
    findings = tuple(_finding(judge, found, place) for place, each in enumerate(mistakes) if each.effect != SPRING)
    if any(len(each.rivals) >= MAX_CLASS_NAMES or each.of_class < MIN_CAUSE_PROBABILITY for each in findings):
        doubts += tuple(_doubt(each.mistake, recording.arm) for each in findings)
        return Answer((), recording, None, share, share, doubts=doubts, looks=found.looks)
    after = judge.overall_error(found.best)
    if not findings:  # or springs alone: the recording is read rightly
        return Answer((), recording, None, after, after, doubts=doubts, looks=found.looks)
    zeros = found.undecided if any(each.mistake.effect == "encoder_offset" for each in findings) else ()
    corrected = correct_recording(recording, found.best.reading)
    return Answer(findings, corrected, found.best.reading, share, after, zeros, doubts, found.looks)


def _unsigned(recording: Recording) -> SetupFinding:
    """The finding that a current has no sign. Its errors are the torque itself: nothing is fitted to it."""
    size = float(np.sqrt(np.mean(np.concatenate([run.torque[:, 0] for run in recording.runs]) ** 2)))
    mistake = Mistake(UNSIGNED, form="magnitude")
    measure = measurement(UNSIGNED, None, recording.arm)
    return SetupFinding(mistake, recording.arm, 1, size, size, 1.0, 1.0, np.inf, 1.0, (), measure)


def _doubt(mistake: Mistake, arm: Arm) -> Doubt:
    joints = mistake.joints or (() if mistake.joint is None else (mistake.joint,))
    return Doubt(mistake.effect, joints, describe(mistake, arm), measurement(mistake.effect, mistake.joint, arm))


UNSIGNED = "unsigned_current"
SMALLEST_SHARE = 1e-9  # of a joint that stands still


def _finding(judge: ReadingJudge, found: Found, place: int) -> SetupFinding:
    """The mistake at a place, judged against the reading that leaves it in."""
    without, best = found.without[place], found.best
    mistake, reading = best.reading.mistakes[place], best.reading
    before, after = (np.maximum(judge.errors(each.reading)[0].errors, SMALLEST_SHARE) for each in (without, best))
    rms_before, rms_after = (
        share * np.std(judge.fitter.channels.read_torque(each.reading), axis=0)
        for share, each in ((before, without), (after, best))
    )
    worst = int(np.argmax(np.log(before) - np.log(after)))
    if mistake.joint is not None and mistake.effect != LINK_DATA:
        worst = mistake.joint - 1 if after[mistake.joint - 1] < before[mistake.joint - 1] else worst
    gain, arm = judge.gain(without, best), reading.arm
    rivals = [(each.reading.mistakes[-1], each.loss) for each in found.rivals[place]]
    weights = np.array([best.loss, *(loss for _, loss in rivals)])
    chances = np.exp(-judge.independent * (weights - weights.min()))
    by_links = best.near is not None and not judge.is_told_by_geometry(without, best, mistake)
    sigmas = gain.near.total_sigmas if by_links else gain.sigmas
    chances = np.append(chances, chances.max() * judge.tuning.other_links_chance if by_links else 0.0)
    chances = chances / chances.sum() * (1 - lapse(sigmas, found.margins[place], judge.tuning))
    listed = [
        RivalReading(each.effect, each.joint, each.joints, describe(each, arm), float(chance))
        for (each, _), chance in zip(rivals, chances[1:-1], strict=True)
    ]
    if by_links:
        link = len(arm) if mistake.joint is None else mistake.joint
        words = f"{links_in_words(arm, [link])} is not as simulated"
        listed.append(RivalReading(INERTIAL_ERROR, link, (), words, float(chances[-1])))
    measure = dict.fromkeys(
        measurement(effect, joint, arm)
        for effect, joint in ((mistake.effect, mistake.joint), *((each.effect, each.joint) for each in listed))
    )
    return SetupFinding(
        mistake,
        arm,
        worst + 1,
        float(rms_before[worst]),
        float(rms_after[worst]),
        float(before[worst]),
        float(after[worst]),
        gain.near.total_sigmas,
        float(chances[0]),
        tuple(listed),
        "; ".join(list(measure)[:2]) if listed else None,
    )


def lapse(sigmas: float, margin: float, tuning: ReadingTuning) -> float:
    """The probability that none of the names is right, k / (k + (s (1 + g))^2).

    s: sigmas by which the loss falls, in the view where it falls less surely of those that tell, 1 at least. margin: g,
    those by which the next best reading with another mistake in its place is worse, accepted or not.
    """
    strength = max(sigmas, 1.0) * (1 + margin)
    return tuning.lapse_odds / (tuning.lapse_odds + strength**2)
