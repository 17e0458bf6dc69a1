"""How a recording is to be read: the mistakes with their evidence, their rivals, and the recording as it should be."""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.reading.corrected import correct_recording
from armlab.recordings.reading.fit import Fitter
from armlab.recordings.reading.judge import Gain, Judge
from armlab.recordings.reading.reading import SPRING, Mistake, Reading, read_as_is
from armlab.recordings.reading.search import Found, find_mistakes
from armlab.recordings.reading.signals import thin_channels
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.reading.words import INERTIAL_ERROR, describe, measurement
from armlab.recordings.recording import Recording
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words, links_in_words
from problem.pseudo_inertia import are_bodies


@dataclass(frozen=True)
class Rival:
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
    rivals: tuple[Rival, ...]
    next_experiment: str | None

    @property
    def description(self) -> str:
        """What is wrong, in a clause."""
        return describe(self.mistake, self.arm)

    @property
    def text(self) -> str:
        """What is wrong, and the evidence."""
        worst = joint_in_words(self.arm, self.worst_joint)
        return (
            f"{self.description} (read so, links and usual friction fit {worst} with an error of "
            f"{100 * self.share_after:.0f} % of its torque, not {100 * self.share_before:.0f} %)"
        )


@dataclass(frozen=True, eq=False)
class Answer:
    """How a recording is to be read.

    findings: in the order in which they were found, none where it is read rightly. recording: as it should be read.
    share: held-out error of all joints as it is read, of the torque's scatter; near the simulation's links where there
    are findings. undecided: joints whose zero the data do not tell by quarters of a turn, where a zero is a finding.
    open: mistakes of which too many fit alike to correct one. beside_open: mistakes that are certain, beside them.
    doubted: mistakes that pass all tests, but leave too much of the torque to be corrected. tried: what was tried where
    the recording fits badly. looks: how many readings were compared, 0 where it is too short. share_after: of the
    recording as it should be read, or of the reading that is doubted.
    """

    findings: tuple[SetupFinding, ...]
    recording: Recording
    reading: Reading | None
    share: float = 0.0
    undecided: tuple[int, ...] = ()
    open: tuple[SetupFinding, ...] = ()
    beside_open: tuple[SetupFinding, ...] = ()
    doubted: tuple[str, ...] = ()
    tried: tuple[str, ...] = ()
    looks: int = 0
    share_after: float = 0.0

    @property
    def sentence(self) -> str:
        """The findings, or what is doubted, in a sentence; empty where there is neither."""
        if self.doubted:
            return (
                f"The recording may be read wrongly: {'; '.join(self.doubted)}. Read so, links and usual friction "
                f"leave {self.share_after:.0%} of the torque, not {self.share:.0%}: too much to correct it."
            )
        if not self.findings:
            return ""
        mistakes = "; ".join(each.description for each in self.findings)
        zeros = joints_in_words(self.recording.arm, self.undecided) if self.undecided else ""
        open_zeros = f" These data do not tell the zero of {zeros} by quarters of a turn." if zeros else ""
        return (
            f"The recording is read wrongly: {mistakes}. Read rightly, links and usual friction fit with an error of "
            f"{100 * self.share_after:.1f} % of the torque, not {100 * self.share:.1f} %.{open_zeros}"
        )

    def reason_inconclusive(self, tuning: ReadingTuning) -> str | None:
        """Why nothing can be said of the physics: readings that fit alike, or none that fits."""
        if self.open:
            questions = ". And: ".join(
                "; or ".join([each.description, *(rival.text for rival in each.rivals)]) for each in self.open
            )
            certain = "".join(f" This is certain: {each.description}." for each in self.beside_open)
            steps = list(dict.fromkeys(_measurement_for(each) for each in self.open))
            return (
                f"The recording is read wrongly, and these data do not tell how: {questions}.{certain} "
                f"To decide, {'; '.join(steps)}."
            )
        least = min(self.share, self.share_after) if self.doubted else self.share
        if not self.findings and least > tuning.max_unexplained:
            nearest = (
                f", however it is read (tried {self.looks} readings, nearest: {'; '.join(self.tried)})"
                if self.tried
                else ""
            )
            left = f"Rigid links with friction leave {least:.0%} of the recorded torque{nearest}"
            return f"{left}: another robot, or torque that is none? Move one joint alone and see which columns change."
        return None


def _measurement_for(finding: SetupFinding) -> str:
    """What decides between a mistake and its rivals."""
    return finding.next_experiment or measurement(finding.mistake.effect, finding.mistake.joint, finding.arm)


def read_rightly(recording: Recording, inertial: Array | None, tuning: ReadingTuning) -> Answer:
    """How a recording is to be read.

    inertial: (10 * joints,) of the links of the simulation, None without one. Base parameters alone are no links.
    """
    inertial = inertial if inertial is not None and are_bodies(inertial) else None
    channels = thin_channels(recording, tuning)
    if channels is None:
        return Answer((), recording, None)
    judge = Judge(Fitter(channels, tuning), recording)
    start = judge.trial(read_as_is(recording, inertial))
    found = find_mistakes(judge, start)
    share = overall_error(judge, start.reading, near=False)
    if found.best is found.start:
        tried = tuple(describe(mistake, recording.arm) for each in found.tried for mistake in each.reading.mistakes)
        return Answer((), recording, None, share, tried=tried, looks=found.looks)
    after = overall_error(judge, found.best.reading, near=True)
    if after > tuning.max_read_error:
        own = (each for each in found.best.reading.mistakes if each.effect != SPRING)
        doubted = tuple(describe(each, recording.arm) for each in own)
        free = overall_error(judge, found.best.reading, near=False)
        return Answer((), recording, None, share, doubted=doubted, tried=doubted, looks=found.looks, share_after=free)
    findings = tuple(
        _finding(judge, found, place) for place, each in enumerate(found.best.reading.mistakes) if each.effect != SPRING
    )
    if not findings:  # springs alone: the recording is read rightly
        return Answer((), recording, None, overall_error(judge, found.best.reading, near=False), looks=found.looks)
    open_ones = tuple(each for each in findings if len(each.rivals) >= tuning.max_class)
    if open_ones:
        beside = tuple(each for each in findings if each not in open_ones)
        return Answer((), recording, None, share, open=open_ones, beside_open=beside, looks=found.looks)
    zeros = found.undecided if any(each.mistake.effect == "encoder_offset" for each in findings) else ()
    corrected = correct_recording(recording, found.best.reading)
    before = overall_error(judge, start.reading, near=True)
    return Answer(findings, corrected, found.best.reading, before, zeros, looks=found.looks, share_after=after)


def overall_error(judge: Judge, reading: Reading, near: bool) -> float:
    """Held-out error, geometric mean over the joints, of the torque's scatter. near: links near the simulation's."""
    errors, _ = judge.errors(reading, near)
    return float(np.exp(np.mean(np.log(np.maximum(errors, 1e-6)))))


SMALLEST_SHARE = 1e-9  # of a joint that stands still


def _finding(judge: Judge, found: Found, place: int) -> SetupFinding:
    """The mistake at a place, judged against the reading that leaves it in."""
    without, best = found.without[place], found.best
    mistake = best.reading.mistakes[place]
    (before, rms_before), (after, rms_after) = (judge.errors(each.reading, near=True) for each in (without, best))
    before, after = np.maximum(before, SMALLEST_SHARE), np.maximum(after, SMALLEST_SHARE)
    worst = int(np.argmax(np.log(before) - np.log(after)))
    if mistake.joint is not None and mistake.effect != "link_data_error":
        worst = mistake.joint - 1 if after[mistake.joint - 1] < before[mistake.joint - 1] else worst
    gain, arm = Gain.between(without, best), best.reading.arm
    rivals = [(each.reading.mistakes[-1], each.loss) for each in found.rivals[place]]
    weights = np.array([best.loss, *(loss for _, loss in rivals)])
    chances = np.exp(-judge.fitter.channels.blocks * (weights - weights.min()))
    by_links = best.near is not None and not is_told_by_geometry(gain, judge.tuning)
    chances = np.append(chances, chances.max() * judge.tuning.other_links_chance if by_links else 0.0)
    chances = chances / chances.sum() * (1 - lapse(gain, found.margins[place], judge.tuning))
    listed = [
        Rival(each.effect, each.joint, each.joints, describe(each, arm), float(chance))
        for (each, _), chance in zip(rivals, chances[1:-1], strict=True)
    ]
    if by_links:
        link = len(arm) if mistake.joint is None else mistake.joint
        words = f"{links_in_words(arm, [link])} is not as simulated"
        listed.append(Rival(INERTIAL_ERROR, link, (), words, float(chances[-1])))
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
        gain.near_sigmas,
        float(chances[0]),
        tuple(listed),
        "; ".join(list(measure)[:2]) if listed else None,
    )


def lapse(gain: Gain, margin: float, tuning: ReadingTuning) -> float:
    """The probability that none of the names is right, k / (k + (s (1 + g))^2).

    s: standard errors by which the loss falls, in the view where it falls less surely, 1 at least. margin: g, those by
    which the next best reading with another mistake in its place is worse, accepted or not.
    """
    strength = max(min(gain.near_sigmas, gain.free_sigmas), 1.0) * (1 + margin)
    return tuning.lapse_odds / (tuning.lapse_odds + strength**2)


def is_told_by_geometry(gain: Gain, tuning: ReadingTuning) -> bool:
    """Whether no other links would explain what was recorded as well."""
    return gain.free >= tuning.min_free_gain and gain.free_sigmas >= tuning.min_sigmas
