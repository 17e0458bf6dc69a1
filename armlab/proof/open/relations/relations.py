"""The relations: what every diagnosis and every comparison has to keep, checked on a recording without its truth."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from armlab.common.errors import DataError
from armlab.diagnosis.changes.comparison import Comparison, compare_with
from armlab.diagnosis.changes.named import ONE_FACTOR
from armlab.diagnosis.changes.numbers import Change
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.predict.found_model import model_found
from armlab.identification.model_file import model_text
from armlab.proof.open.real_folders.consistency import contradictions
from armlab.proof.open.relations.variants import (
    delayed,
    every_other_second,
    fewer_rows,
    half,
    loaded_joint,
    one_run,
    parts_of,
    resampled,
    rewritten,
    scaled,
    spoilt,
    thinned,
    with_noise,
    with_viscous_friction,
)
from armlab.proof.open.stored import recording_digest
from armlab.recordings.plain_least_squares import SEEN_ERRORS, compare_plain
from armlab.recordings.recording import Recording
from armlab.report.verdict_files import make_verdict

STRETCH_S = (1.0, 2.0, 3.0)  # odd against even: the shortest stretches that can be filtered
MIRROR_TOLERANCE = 0.05  # of a change, between one direction and the other
NUMBER_TOLERANCE = 0.02  # of a parameter, between two ways to write one recording
SCALES = (0.5, 0.9, 2.0)  # by which torque is read
DELAYS_ROWS, DELAY_TOLERANCE = (2, 4), 0.25  # of torque against motion; of such a delay: jumps of friction hide some
ROUNDING = 1e-9


@dataclass(frozen=True)
class RelationOutcome:
    """holds: None where the recording allows no answer. detail: numbers, or what broke."""

    recording: str
    relation: str
    holds: bool | None
    detail: str


class Desk:
    """Diagnoses of one recording and its variants, each made once."""

    def __init__(self) -> None:
        self.known: dict[str, Diagnosis] = {}

    def diagnose(self, recording: Recording) -> Diagnosis:
        """The diagnosis with the usual baseline."""
        key = f"{recording_digest(recording)} {recording.simulation} {[each.name for each in recording.arm.joints]}"
        if key not in self.known:
            self.known[key] = diagnose(recording)
        return replace(self.known[key], recording=recording)

    def compare(self, old: Recording, new: Recording) -> Comparison:
        """What changed from one to the other."""
        both = old, replace(new, arm=old.arm, simulation=old.simulation)
        return compare_with(both, lambda: [self.diagnose(each) for each in both], None, (None, None))


Relation = Callable[[Recording, Desk], tuple[bool | None, str]]


def _no_change(found: Comparison) -> tuple[bool | None, str]:
    if found.doubtful is not None:
        return None, f"perhaps {found.doubtful.effect}@{found.doubtful.joint}: {found.reason}"
    if found.status == "inconclusive":
        return None, found.reason
    largest = max((abs(each.difference) / each.detectable for each in found.changes), default=0.0)
    names = [f"{each.effect}@{each.joint}" for each in found.findings]
    return not names, ", ".join(names) or f"largest difference {largest:.2g} of the smallest that is named"


def against_itself(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """A recording compared with itself has no change."""
    return _no_change(desk.compare(recording, recording))


def against_thinned(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """A recording compared with itself, one of five rows left out, has no change."""
    return _no_change(desk.compare(recording, thinned(recording)))


def against_resampled(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """A recording compared with itself at nine tenths of the rate has no change."""
    return _no_change(desk.compare(recording, resampled(recording)))


def against_noise(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """A recording compared with itself with noise of 1e-9 has no change."""
    return _no_change(desk.compare(recording, with_noise(recording)))


def odd_against_even(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """The odd seconds of a recording compared with the even ones have no change."""
    reason = "too short to be cut into seconds"
    for seconds in STRETCH_S:
        even, odd = (every_other_second(recording, first, seconds) for first in (0, 1))
        if min(len(even.runs), len(odd.runs)) < 2:
            continue
        holds, detail = _no_change_of_parts(even, odd, desk)
        if holds is not None:
            return holds, f"stretches of {seconds:g} s: {detail}"
        reason = detail
    return None, reason


def first_against_second_half(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """The first halves of all runs compared with the second ones have no change."""
    return _no_change_of_parts(half(recording, 0), half(recording, 1), desk)


def run_against_run(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Each run compared with each other one has no change: all are of one robot on one day."""
    alone = [one_run(recording, run) for run in recording.runs]
    pairs = list(combinations(alone, 2))
    if not pairs:
        return None, "one run"
    answers = [_no_change_of_parts(old, new, desk) for old, new in pairs]
    holds = [answer for answer, _ in answers if answer is not None]
    names = [f"{old.runs[0].name} to {new.runs[0].name}" for old, new in pairs]
    detail = "; ".join(f"{name}: {detail}" for name, (_, detail) in zip(names, answers, strict=True))
    return all(holds) if holds else None, detail


def _no_change_of_parts(old: Recording, new: Recording, desk: Desk) -> tuple[bool | None, str]:
    try:
        return _no_change(desk.compare(old, new))
    except DataError as error:  # too short for a diagnosis
        return None, str(error)


def mirrored(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """What changes from A to B changes back from B to A."""
    changed = with_viscous_friction(recording, loaded_joint(recording))
    there, back = desk.compare(recording, changed), desk.compare(changed, recording)
    if "inconclusive" in (there.status, back.status):
        return None, there.reason or back.reason
    names = [[(each.effect, each.joint) for each in found.findings] for found in (there, back)]
    if sorted(names[0], key=str) != sorted(names[1], key=str):
        return False, f"{names[0]} there, {names[1]} back"
    apart = [
        abs(one.difference + two.difference) / max(abs(one.difference), abs(two.difference), 1e-300)
        for one, two in zip(_changed(there), _changed(back), strict=True)
    ]
    largest = max(apart, default=0.0)
    return largest < MIRROR_TOLERANCE, f"{len(names[0])} changes, apart by {100 * largest:.2g} % of themselves"


def _changed(found: Comparison) -> list[Change]:
    rows = [each for each in found.changes if each.changed]
    return sorted(rows, key=lambda each: (each.effect, str(each.joint), each.parameter))


def own_model_explains(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """The found model, handed back as the simulation, leaves nothing to name but what the verdict left open itself."""
    found = desk.diagnose(recording)
    if found.model is None:
        return None, found.reason
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(model_text(model_found(found), Path(folder)), encoding="utf-8")
        again = diagnose(replace(recording, simulation=path), "nominal")
    named = {name for name in _names(found) if name.startswith("unknown@")}
    left_open = named | {f"unknown@{each.joint}" for each in found.unexplained}
    new = [name for name in _names(again) if name not in left_open]
    return not new, ", ".join(new) or f"left open in both: {', '.join(_names(again)) or 'nothing'}"


def same_however_written(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Other units, another order of the runs, other names of the joints and another clock change nothing."""
    one, two = desk.diagnose(recording), desk.diagnose(rewritten(recording))
    if _names(one) != _names(two):
        return False, f"{_difference(_names(one), _names(two))}"
    apart = 0.0
    for first, second in zip(_claims(one), _claims(two), strict=True):
        for left, right in zip(first.parameters, second.parameters, strict=True):
            values = np.atleast_1d(left.value), np.atleast_1d(right.value)
            size = max(float(np.abs(values[0]).max()), 1e-300)
            apart = max(apart, float(np.abs(values[0] - values[1]).max()) / size)
    return apart < NUMBER_TOLERANCE, f"{len(_names(one))} names; numbers apart by {100 * apart:.2g} %"


def fewer_rows_replace_no_name(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Fewer rows may weaken a name and never replace it by another one."""
    whole, part = desk.diagnose(recording), desk.diagnose(fewer_rows(recording))
    if part.model is None:
        return None, part.reason
    known = set(_names(whole)) | {f"{each.effect}@{each.joint}" for claim in whole.claims for each in claim.rivals}
    new = [name for name in _names(part) if name not in known]
    return not new, f"new: {', '.join(new)}" if new else f"{len(_names(part))} of {len(_names(whole))} names stay"


def added_law_is_found(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """A torque added by a known law is found, and gone when it is taken off again."""
    joint = loaded_joint(recording)
    added = with_viscous_friction(recording, joint)
    found = desk.compare(recording, added)
    if found.status == "inconclusive":
        return None, found.reason
    classes = [(each.effect, each.joint) for each in found.findings]
    classes += [(rival.effect, rival.joint) for each in found.findings for rival in each.rivals]
    friction: set[tuple[str, int | None]] = {("viscous_friction", joint + 1)}
    friction |= {(each.effect, each.joint) for each in found.findings if each.form == ONE_FACTOR}
    taken_off = _taken_off(recording, added)
    rest = desk.compare(recording, taken_off)
    named = ", ".join(f"{each.effect}@{each.joint}" for each in found.findings) or "nothing"
    return bool(friction & set(classes)) and not rest.findings, f"viscous friction at joint {joint + 1}: {named} named"


def another_scale_is_a_gain(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Torque of a joint that is read by another scale has another gain, of that size, and nothing else has changed."""
    joint, holds, said = loaded_joint(recording), True, list[str]()
    for scale in SCALES:
        found = desk.compare(recording, scaled(recording, joint, scale))
        if found.status == "inconclusive":
            return None, found.reason
        gains = [each.ratio for each in found.changes if each.changed and each.parameter == "gain"]
        only = [(each.effect, each.joint) for each in found.findings] == [("torque_gain_error", joint + 1)]
        right = only and all(ratio is not None and ratio[1] <= scale <= ratio[2] for ratio in gains)
        holds &= right
        names = ", ".join(f"{each.effect}@{each.joint}" for each in found.findings) or "nothing"
        sizes = " ".join(f"{ratio[0]:.3g} ({ratio[1]:.3g} to {ratio[2]:.3g})" for ratio in gains if ratio is not None)
        said.append(f"times {scale:g}: {names} {sizes}".rstrip())
    return holds, "; ".join(said)


def late_torque_is_a_delay(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Torque that is recorded later by some rows has a delay of about that size, and nothing else has changed."""
    holds, said = True, list[str]()
    for rows in DELAYS_ROWS:
        late = rows / min(run.rate_hz for run in recording.runs)
        found = desk.compare(recording, delayed(recording, late))
        if found.status == "inconclusive":
            return None, found.reason
        delays = [each.difference for each in found.changes if each.changed and each.effect == "time_delay"]
        holds &= len(found.findings) == len(delays) == 1 and all(
            abs(each / late - 1) < DELAY_TOLERANCE for each in delays
        )
        names = ", ".join(f"{each.effect}@{each.joint}" for each in found.findings) or "nothing"
        said.append(f"{late:.3g} s: {names} {' '.join(f'{each:.3g}' for each in delays)}".rstrip())
    return holds, "; ".join(said)


def what_is_seen_plainly_is_named(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Where plain least squares sees a change, the comparison does not say "same"; where nothing changed, it sees none.

    Pairs: an added law, the seconds in turn, and both halves.
    """
    even, odd = (every_other_second(recording, first, STRETCH_S[-1]) for first in (0, 1))
    nulls = {"odd against even": (even, odd), "halves": (half(recording, 0), half(recording, 1))}
    changed = {"added law": (recording, with_viscous_friction(recording, loaded_joint(recording)))}
    said, broken = list[str](), list[str]()
    for name, (old, new) in {**changed, **nulls}.items():
        try:
            size = compare_plain(old.arm, old.runs, new.runs).largest
        except DataError:
            continue
        said.append(f"{name}: {size:.1f} standard errors")
        if size > SEEN_ERRORS and name in nulls:
            broken.append(f"{said[-1]}, no yardstick")
        elif size > SEEN_ERRORS and desk.compare(old, new).status == "same":
            broken.append(f'{said[-1]}, "same"')
    return not broken if said else None, "; ".join(broken or said) or "no run is long enough"


def _taken_off(recording: Recording, added: Recording) -> Recording:
    """The added torque taken off again, equal to the recording but for rounding."""
    runs = []
    for before, after in zip(recording.runs, added.runs, strict=True):
        runs.append(after.with_signals(after.time, {"torque": after.torque - (after.torque - before.torque)}))
    return replace(added, runs=tuple(runs))


def findings_help(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """No finding raises the held-out error."""
    found = desk.diagnose(recording)
    worse = [
        f"{each.effect}@{each.joint}"
        for each in found.claims
        if each.evidence.rms_after > (1 + ROUNDING) * each.evidence.rms_before
    ]
    return not worse, f"worse with {', '.join(worse)}" if worse else f"{len(found.claims)} findings"


def predicts_as_well_as_identification(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """The model predicts its own held-out rows at least as well as a plain identification."""
    found = desk.diagnose(recording)
    if not found.fit:
        return None, found.reason
    ours = float(np.sqrt(sum(each.recorded.after**2 for each in found.fit)))
    plain = float(np.sqrt(sum(each.recorded.identified**2 for each in found.fit)))
    return ours <= (1 + ROUNDING) * plain, f"{ours:.4g} against {plain:.4g} N m (N)"


def parts_agree_with_themselves(recording: Recording, desk: Desk) -> tuple[bool | None, str]:
    """Parts of a recording, and copies with wrong torque, are refused or get a verdict that contradicts nothing."""
    answers, wrong = 0, list[str]()
    for name, each in (*parts_of(recording), *spoilt(recording)):
        try:
            verdict = make_verdict(diagnose(each))
        except DataError:
            continue
        answers += 1
        wrong += [f"{name}: {what}" for what in contradictions(verdict)]
    if not answers:
        return None, "all parts are refused"
    return not wrong, "; ".join(wrong) or f"{answers} verdicts"


PARTS = "parts agree with themselves"
RELATIONS: dict[str, Relation] = {
    "X against X": against_itself,
    "X against X, rows thinned": against_thinned,
    "X against X, resampled": against_resampled,
    "X against X, noise of 1e-9": against_noise,
    "odd against even seconds": odd_against_even,
    "first against second half": first_against_second_half,
    "run against run": run_against_run,
    "A to B mirrors B to A": mirrored,
    "found model explains its recording": own_model_explains,
    "units, order, names, clock": same_however_written,
    "fewer rows replace no name": fewer_rows_replace_no_name,
    "added law found, and gone again": added_law_is_found,
    "torque of another scale is a gain": another_scale_is_a_gain,
    "late torque is a delay": late_torque_is_a_delay,
    "what is seen plainly is named": what_is_seen_plainly_is_named,
    "no finding raises the held-out error": findings_help,
    "predicts as well as identification": predicts_as_well_as_identification,
    PARTS: parts_agree_with_themselves,
}
NULL_PAIRS = ("odd against even seconds", "first against second half", "run against run")  # independent stretches
QUICK = (
    "X against X",
    "A to B mirrors B to A",
    "added law found, and gone again",
    "no finding raises the held-out error",
    "predicts as well as identification",
)


def check_relation(name: str, recording: Recording, desk: Desk) -> RelationOutcome:
    """The outcome of one relation on a recording."""
    holds, detail = RELATIONS[name](recording, desk)
    return RelationOutcome(recording.name, name, holds, detail)


def _names(found: Diagnosis) -> list[str]:
    return [f"{each.effect}@{each.joint}" for each in _claims(found)]


def _claims(found: Diagnosis) -> list[Claim]:
    return sorted(found.claims, key=lambda each: (each.effect, str(each.joint), each.joints))


def _difference(one: list[str], two: list[str]) -> str:
    gone = [each for each in one if each not in two]
    new = [each for each in two if each not in one]
    return f"gone: {', '.join(gone) or 'none'}; new: {', '.join(new) or 'none'}"
