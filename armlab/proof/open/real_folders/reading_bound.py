"""What a reading mistake has to explain: a bound learnt on recordings of real arms that are read rightly.

On each of them, and on each half of it, the best wrong reading explains something by chance, its evidence
(`Judge.evidence`): a shorter recording by more. The bound is the one-sided prediction limit of these best evidences for
one more recording of another arm (Hahn and Meeker 1991, section 4.8),

    bound = mean + t(1 - chance, arms - 1) sd sqrt(1 + 1 / arms).

Arms count alike in mean and sd, whatever the number of their recordings. The other class are mistakes: each reading
that was tried is taken for the right one in turn, and what the recording as it is explains beyond it is the evidence
for this mistake.

How far joints that turn travel in these recordings is learnt beside it: mean and standard deviation of a joint of one
more arm.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import t as student

from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.proof.open.likeness.real_arms import RealFolder
from armlab.proof.open.relations.variants import WHOLE, half, parts_of
from armlab.recordings.identifiable import reason_not_identifiable
from armlab.recordings.load import load_recording
from armlab.recordings.motion import is_motion_only
from armlab.recordings.reading.answer import read_rightly
from armlab.recordings.reading.judge import ReadingJudge, Trial
from armlab.recordings.reading.reading import SPRING, read_as_is
from armlab.recordings.reading.singles import search_singles
from armlab.recordings.reading.tuning import BOUND_FILE, BOUND_SCHEMA, ReadingTuning
from armlab.recordings.recording import Recording

CHANCE = 0.01  # of a wrong reading on one more arm
JUDGED = 25  # readings of a recording, the likeliest ones, that are judged by their evidence
MISTAKES = 30  # readings of a recording, spread over all that were tried, that are taken for the right one
SEEN_RATIO = 1.5  # of a joint's error with a mistake to that without: less is not seen
DIGITS = 3
PAGE_FILE = "reading_bound.md"


@dataclass(frozen=True)
class WrongReading:
    """The best wrong reading of a recording. folder: where it is; name: of the mistake that it would be.

    evidence: nats. mistakes: evidence for mistakes that can be seen, were they there. travels: of the joints that
    turn and do not stand, rad.
    """

    folder: RealFolder
    name: str
    evidence: float
    mistakes: tuple[float, ...]
    travels: tuple[float, ...]


@dataclass(frozen=True)
class ArmVerdict:
    """An arm judged without itself. nearest: its best wrong reading; bound: learnt on the others.

    named, named_without: mistakes that its recordings are said to have with the bound of all arms, and with this one.
    parts: of its recordings, the whole ones too (`parts_of`); read_wrongly: those that are said to hold mistakes, with
    this one.
    """

    arm: str
    licensed: bool
    nearest: WrongReading
    bound: float
    named: tuple[str, ...]
    named_without: tuple[str, ...]
    parts: int
    read_wrongly: tuple[str, ...]


def best_wrong_readings(folders: Sequence[RealFolder], tuning: ReadingTuning) -> Iterator[WrongReading]:
    """The best wrong reading of each recording with torque that is compared with links, and of each half of it."""
    for folder in folders:
        recording = _recording(folder)
        if recording is None:
            continue
        for each in (recording, half(recording, 0), half(recording, 1)):
            judge = None if reason_not_identifiable(each) else ReadingJudge.of(each, tuning)
            if judge is not None:
                yield _best_wrong_reading(folder, each, judge)


def _recording(folder: RealFolder) -> Recording | None:
    if is_motion_only(folder.path):
        return None
    try:
        recording = load_recording(folder.path)
    except (InputError, DataError):
        return None
    return None if read_simulation(recording, None).kind == "simulated" else recording


def _best_wrong_reading(folder: RealFolder, recording: Recording, judge: ReadingJudge) -> WrongReading:
    start = judge.trial(read_as_is(recording, read_simulation(recording, None).inertial))
    tried = [each for each in search_singles(judge, start) if each.reading.mistakes[-1].effect != SPRING]
    falling = [each for each in tried[:JUDGED] if _falls(judge, start, each)]
    judged = [(_evidence(judge, start, each, each), each) for each in falling or tried[:1]]
    evidence, best = max(judged, key=lambda pair: pair[0])
    evidence = max(evidence, -judge.improbability(best.reading))  # the recording as it is explains as much
    spread = tried[:: max(len(tried) // MISTAKES, 1)]
    mistakes = tuple(_evidence(judge, each, start, each) for each in spread if _is_seen(judge, each, start))
    travel = np.ptp(judge.judging.columns(start.reading).motion.position, axis=0)
    turning = np.array([joint.kind == "revolute" for joint in recording.arm.joints]) & (travel > 0)
    return WrongReading(folder, best.reading.mistakes[-1].label, evidence, mistakes, tuple(travel[turning].tolist()))


def _falls(judge: ReadingJudge, before: Trial, after: Trial) -> bool:
    mistake = after.reading.mistakes[-1]
    return judge.may_explain(*judge.compared(before, after, mistake), mistake, 0.0)


def _evidence(judge: ReadingJudge, before: Trial, after: Trial, wrong: Trial) -> float:
    mistake = wrong.reading.mistakes[-1]
    return judge.evidence(*judge.compared(before, after, mistake), mistake)


def _is_seen(judge: ReadingJudge, wrong: Trial, right: Trial) -> bool:
    """Whether a mistake makes the error of a joint so much larger than it is, or than what is usual."""
    pairs = zip(judge.errors(wrong.reading), judge.errors(right.reading), strict=True)
    usual = judge.tuning.usual_error
    return any(np.max(before.errors / np.maximum(after.errors, usual)) >= SEEN_RATIO for before, after in pairs)


def bound_of(readings: Sequence[WrongReading]) -> float:
    """The prediction limit of the best evidence of a recording of one more arm, nats.

    Raises InputError for less than three arms.
    """
    mean, deviation, arms = _of_one_more([(each.folder.arm, (each.evidence,)) for each in readings])
    return round(mean + float(student.ppf(1 - CHANCE, arms - 1)) * deviation, DIGITS)


def travel_of(readings: Sequence[WrongReading]) -> tuple[float, float]:
    """Geometric mean of the travel of joints that turn, rad, and the scatter of its logarithm for one more arm."""
    logs = [(each.folder.arm, np.log(each.travels).tolist()) for each in readings if each.travels]
    mean, deviation, _ = _of_one_more(logs)
    return round(float(np.exp(mean)), DIGITS), round(deviation, DIGITS)


def _of_one_more(values: Sequence[tuple[str, Sequence[float]]]) -> tuple[float, float, int]:
    """Mean and standard deviation of a value of one more arm, from those of some, and how many arms they are of."""
    arms = np.concatenate([[arm] * len(own) for arm, own in values])
    names, counts = np.unique(arms, return_counts=True)
    count = len(names)
    if count < 3:
        raise InputError(f"recordings of {count} arms: a bound needs those of three arms or more")
    every = np.concatenate([own for _, own in values])
    weight = 1 / (count * counts[np.searchsorted(names, arms)])
    mean = float(weight @ every)
    # of one more arm, with the error of the mean
    return mean, float(np.sqrt(weight @ (every - mean) ** 2 * (count + 1) / (count - 1))), count


def leave_each_arm_out(
    readings: Sequence[WrongReading], tuning: ReadingTuning, jobs: int, progress: Callable[[str], None]
) -> Iterator[ArmVerdict]:
    """The verdict of each arm with the bound of all, and with that of the other arms, also on parts of recordings."""
    for arm in sorted({each.folder.arm for each in readings}):
        progress(f"reading {arm} without itself")
        own = [each for each in readings if each.folder.arm == arm]
        folders = list({each.folder.name: each.folder for each in own}.values())
        others = [each for each in readings if each.folder.arm != arm]
        known, fewer = _learnt(tuning, readings), _learnt(tuning, others)
        named = [name for folder in folders for name in _named(load_recording(folder.path), folder.name, known)]
        jobs_of = (delayed(_named_in_parts)(folder, fewer) for folder in folders)
        read = dict(part for parts in Parallel(n_jobs=jobs)(jobs_of) for part in parts.items())
        whole = [name for (_, part), names in read.items() if part == WHOLE for name in names]
        wrong = tuple(f"{', '.join(names)} ({part})" for (_, part), names in read.items() if names)
        licensed, nearest = all(each.folder.licensed for each in own), max(own, key=lambda each: each.evidence)
        yield ArmVerdict(arm, licensed, nearest, fewer.least_evidence, tuple(named), tuple(whole), len(read), wrong)


def _learnt(tuning: ReadingTuning, readings: Sequence[WrongReading]) -> ReadingTuning:
    usual, scatter = travel_of(readings)
    return replace(tuning, least_evidence=bound_of(readings), usual_travel=usual, travel_scatter=scatter)


def _named(recording: Recording, name: str, tuning: ReadingTuning) -> tuple[str, ...]:
    answer = read_rightly(recording, read_simulation(recording, None).inertial, tuning)
    return tuple(f"{name}: {finding.mistake.label}" for finding in answer.mistakes)


def _named_in_parts(folder: RealFolder, tuning: ReadingTuning) -> dict[tuple[str, str], tuple[str, ...]]:
    """Mistakes that are said of each part of a recording that can be identified, by its name and the part's."""
    parts = parts_of(load_recording(folder.path))
    return {
        (folder.name, part): _named(each, folder.name, tuning)
        for part, each in parts
        if not reason_not_identifiable(each)
    }


def share_told(readings: Sequence[WrongReading], bound: float) -> tuple[int, int]:
    """How many mistakes that can be seen have so much evidence, and how many there are."""
    evidence = [value for each in readings for value in each.mistakes]
    return sum(value >= bound for value in evidence), len(evidence)


def count_parts(verdicts: Sequence[ArmVerdict]) -> tuple[int, int]:
    """Parts of recordings, and those that are said to hold mistakes."""
    return sum(each.parts for each in verdicts), sum(len(each.read_wrongly) for each in verdicts)


def bound_lines(verdicts: Sequence[ArmVerdict], bound: float) -> list[str]:
    """An arm a line: its best wrong reading, and what is said with the bound of all arms and that of the others."""
    return [
        f"{each.arm}: best wrong reading {each.nearest.name} ({each.nearest.folder.name}), evidence "
        f"{each.nearest.evidence:.2f} of {bound:.2f}, of {each.bound:.2f} without this arm; "
        f"said {', '.join(each.named) or 'nothing'}, without this arm {', '.join(each.named_without) or 'nothing'}; "
        f"of {each.parts} parts: {'; '.join(each.read_wrongly) or 'nothing'}"
        for each in verdicts
    ]


def write_bound(readings: Sequence[WrongReading], verdicts: Sequence[ArmVerdict], out: Path) -> tuple[Path, ...]:
    """Writes the bound, which the reading uses, and a page about it: of arms whose recordings have a licence."""
    bound, (told, count) = bound_of(readings), share_told(readings, bound_of(readings))
    travel, scatter = travel_of(readings)
    content = {
        "schema": BOUND_SCHEMA,
        "recordings": len(readings),
        "arms": len(verdicts),
        "chance": CHANCE,
        "mistakes_told": told,
        "mistakes_seen": count,
        "bound": bound,
        "usual_travel": travel,
        "travel_scatter": scatter,
    }
    hidden = sum(not each.licensed for each in verdicts)
    parts, false = count_parts(verdicts)
    page = markdown_page(
        "What a reading mistake has to explain",
        f"From {len(readings)} recordings and halves of {len(verdicts)} real arms, read rightly: the best wrong "
        f"reading of one more arm explains more than {bound:.2f} nats with a probability of {CHANCE:.0%}. Of {count} "
        f"mistakes that can be seen, were they there, {told} explain as much. Joints that turn travel {travel:.2g} "
        f"rad, by a factor of {np.exp(scatter):.2g} more or less.",
        f"Each arm with the bound that the others make: {false} of {parts} parts of recordings are said to "
        "hold mistakes (wholes, ends, halves, stretches, fewer rows), none of which is known to be read wrongly.",
        f"All arms but {hidden} whose recordings have no licence:",
        markdown_table(
            (
                "arm",
                "best wrong reading",
                "evidence",
                "bound without it",
                "share",
                "said",
                "said without it",
                "parts",
                "said of parts without it",
            ),
            [
                (
                    each.arm,
                    each.nearest.name,
                    f"{each.nearest.evidence:.2f}",
                    f"{each.bound:.2f}",
                    f"{each.nearest.evidence / each.bound:.2f}",
                    ", ".join(each.named) or "nothing",
                    ", ".join(each.named_without) or "nothing",
                    each.parts,
                    "; ".join(each.read_wrongly) or "nothing",
                )
                for each in verdicts
                if each.licensed
            ],
            numbers=(2, 3, 4, 7),
        ),
    )
    return write_texts({BOUND_FILE: json.dumps(content, indent=1) + "\n", PAGE_FILE: page}, out)
