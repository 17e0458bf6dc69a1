"""What a diagnosis of motion only says in words: the summary, and the lines on a terminal."""

import math
from collections.abc import Iterator, Mapping, Sequence
from textwrap import wrap

from armlab.common.report.wording import count_of, format_number, format_unit, join_words
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ReplayError, ServoFinding
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, PARAMETERS
from armlab.diagnosis.motion.witness import CurrentWitness
from armlab.diagnosis.torque.names.findings import FRICTION
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.recordings.check import signs_of_wrong_reading
from armlab.report.account.summary import MAX_FIRST_WORDS, MAX_WORDS
from armlab.report.motion.stated_numbers import StatedNumber, stated_causes, stated_numbers
from armlab.report.torque.torque_verdict import LINE_WIDTH
from armlab.report.words import LESS_MASS, SOMETHING_UNKNOWN, format_chance, how_it_falls
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words

# of an effect that has several numbers, by the name of each
NUMBER_WORDS = {
    "kp": " kp",
    "kd": " kd",
    "ki": " ki",
    "ki_speed": " of the velocity's integral",
    "integral_limit": " of the integral",
    "limit_slope": " (falls with speed)",
    "static_excess": " (more at rest)",
}
MADE_BY = " of the replay error that can be explained is made by"
SHOWN_RISE = 1.02  # of a replay error: a smaller one is none
MAX_WARNINGS = 3
MAX_FIGURES = 2  # of the second sentence


def summary_of(diagnosis: MotionDiagnosis) -> str:
    """At most three sentences and MAX_WORDS words; the first has at most MAX_FIRST_WORDS."""
    if diagnosis.status == "inconclusive":
        return f"Nothing can be said: {diagnosis.reason}."
    stated = [each for each in stated_numbers(diagnosis) if not each.minor]
    if diagnosis.status == "none":
        first = "The simulation replays the held-out commands as well as any servo of this law."
    elif not stated:
        first = "Nothing of practical size is missing: no number changes the replay by 5 %."
    else:
        first = _where(diagnosis, stated)
    last = _replay_sentence(diagnosis)
    left = MAX_WORDS - len(first.split()) - len(last.split())
    shown = list[str]()
    for cause in stated_causes(stated)[:MAX_FIGURES]:
        largest = max((stated[at] for at in cause.findings), key=lambda each: each.share)
        phrase = _figure_at_place(diagnosis.simulation.arm, largest.finding)
        if len("; ".join([*shown, phrase]).split()) > left:
            break
        shown.append(phrase)
    sizes = "; ".join(shown)
    middle = f"{sizes[0].upper()}{sizes[1:]}." if sizes else ""
    return " ".join(each for each in (first, middle, last) if each)


def _where(diagnosis: MotionDiagnosis, stated: Sequence[StatedNumber]) -> str:
    """The causes with their shares of the replay error, the largest first."""
    arm, shown = diagnosis.simulation.arm, list[str]()
    causes = stated_causes(stated)
    for each in causes:
        own = [stated[at] for at in each.findings]
        names = list(dict.fromkeys(finding_name(one.finding) for one in own))
        name = each.cause if each.cause == FRICTION and len(names) > 1 else join_words(names)
        name = SOMETHING_UNKNOWN if each.cause == UNKNOWN.id else name
        doubt = " (not certain)" if all(one.statement.kind == "cause" for one in own) else ""
        places = join_words(list(dict.fromkeys(_places(arm, [one.finding]) for one in own)))
        places = places if "tool" in places else _places(arm, [one.finding for one in own])
        share = f"{max(min(round(100 * each.share), 99 if len(causes) > 1 else 100), 1)} %"
        part = f"{share}{MADE_BY if not shown else ' by'} {name}{doubt} at {places}"
        if shown and len(", ".join([*shown, part]).split()) > MAX_FIRST_WORDS:
            break
        shown.append(part)
    return f"{', '.join(shown)}."


def finding_name(finding: ServoFinding) -> str:
    """The name of a finding, `perhaps` before one that may be nothing; a load below zero is less mass than modelled."""
    is_lighter = finding.parameter.key == "payload" and finding.value < 0
    name = LESS_MASS if is_lighter else effect_named(finding.effect).words
    return f"perhaps {name}" if is_doubtful(finding) else name


def is_doubtful(finding: ServoFinding) -> bool:
    """Whether the interval of a number reaches that of the simulation, or zero where the simulation has none."""
    low, high = finding.interval
    return low <= (0.0 if math.isnan(finding.nominal) else finding.nominal) <= high


def _places(arm: Arm, findings: Sequence[ServoFinding]) -> str:
    if findings[0].parameter.key == "payload":
        return "the tool"
    return joints_in_words(arm, sorted({each.joint for each in findings}))


def _replay_sentence(diagnosis: MotionDiagnosis) -> str:
    """The joint whose replay error falls by most, or is largest where there is nothing to compare with."""
    if not diagnosis.errors:
        return ""
    arm = diagnosis.simulation.arm
    if any(each.replay_before is None for each in diagnosis.errors):
        worst = max(diagnosis.errors, key=lambda each: each.replay_after / max(each.spread, 1e-300))
        left = f"{1e3 * worst.replay_after:.3g} mrad, {_share_of_motion(worst)}"
        return f"With what was found the replay error of {joint_in_words(arm, worst.joint)} is {left} of its motion."
    if diagnosis.status == "none":
        worst = max(diagnosis.errors, key=lambda each: each.replay_after)
        return f"Its largest replay error is {1e3 * worst.replay_after:.3g} mrad ({joint_in_words(arm, worst.joint)})."
    best = max(diagnosis.errors, key=lambda each: (each.replay_before or 0.0) - each.replay_after)
    before, after = 1e3 * (best.replay_before or 0.0), 1e3 * best.replay_after
    falls = how_it_falls(arm, best.joint, after < before)
    return (
        f"On held-out runs the replay error {falls}: from {before:.3g} mrad to {after:.3g} mrad, "
        f"{_share_of_motion(best)} of its motion."
    )


def _share_of_motion(error: ReplayError) -> str:
    return f"{format_number(100 * error.replay_after / max(error.spread, 1e-300), 2)} %"


def remarks(diagnosis: MotionDiagnosis) -> list[str]:
    """Signs of a wrong reading, joints of which nothing can be said, and stretches that something else moves."""
    signs = [f"Warning: {each.text}" for each in signs_of_wrong_reading(diagnosis.recording)[:MAX_WARNINGS]]
    return [*signs, *(each for each in (_silent_sentence(diagnosis), _odd_sentence(diagnosis)) if each)]


def _silent_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.silent:
        return ""
    joints = joints_in_words(diagnosis.simulation.arm, diagnosis.silent)
    stands = "it stands still or follows" if len(diagnosis.silent) == 1 else "they stand still or follow"
    return f"Of {joints} nothing can be said: {stands} no servo."


def _odd_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.odd:
        return ""
    shown = ", ".join(f"{run} {start:.0f} to {end:.0f} s" for run, start, end in diagnosis.odd[:3])
    more = f" and {len(diagnosis.odd) - 3} more" if len(diagnosis.odd) > 3 else ""
    return f"No servo of this law moves as in {shown}{more}: contact, late commands, or physics that is missing."


def motion_lines(diagnosis: MotionDiagnosis, verbose: bool = False) -> Iterator[str]:
    """The verdict, each finding with its interval, the simulation's number and rivals, and the errors of each joint.

    verbose: minor findings, what the motion does not tell, and what the currents of the joints say, too.
    """
    arm = diagnosis.simulation.arm
    yield from wrap(f"{diagnosis.status.upper()}: {summary_of(diagnosis)}", LINE_WIDTH)
    yield from (f"  {line}" for each in remarks(diagnosis) for line in wrap(each, LINE_WIDTH - 2))
    yield from (f"  {each}" for each in finding_phrases(diagnosis, minor=False))
    minor = finding_phrases(diagnosis, minor=True)
    if verbose:
        yield from (f"  small: {each}" for each in minor)
    elif minor:
        yield f"  {count_of(len(minor), 'small difference')} more, in verdict.json and on the page"
    for error in diagnosis.errors:
        yield f"  {error_phrase(arm, error)}"
    for row, rivals in enumerate(diagnosis.rivals if verbose else ()):
        joint = joint_in_words(arm, diagnosis.simulation.number_of(row))
        yield from (f"  not told at {joint}: {each} from {others}" for each, others in untold_numbers(rivals))
    for current in diagnosis.currents if verbose else ():
        yield f"  {current_phrase(arm, current)}"


def finding_phrases(diagnosis: MotionDiagnosis, minor: bool) -> list[str]:
    """Each finding that is stated, or each minor one, in one line with the probability of its name."""
    stated = [each for each in stated_numbers(diagnosis) if each.minor == minor]
    return [_finding_phrase(diagnosis.simulation.arm, each) for each in stated]


def _finding_phrase(arm: Arm, stated: StatedNumber) -> str:
    finding = stated.finding
    also = f"; it could also be {_effects_in_words(finding.rivals)}" if finding.rivals else ""
    chance = format_chance(stated.statement.probability)
    return f"{_places(arm, [finding])}: {stated_with_numbers(stated)}; probability {chance}{also}"


def _effects_in_words(effects: Sequence[str]) -> str:
    return " or ".join(effect_named(each).words for each in effects)


def untold_numbers(rivals: Mapping[int, tuple[str, ...]]) -> list[tuple[str, str]]:
    """Each fitted number of a joint that the motion does not tell from other effects, and these effects, in words."""
    known = ((PARAMETERS[at], effects) for at, effects in rivals.items())
    return [
        (f"{effect_named(number.effect).words}{NUMBER_WORDS.get(number.name, '')}", _effects_in_words(effects))
        for number, effects in known
    ]


def stated_with_numbers(stated: StatedNumber) -> str:
    """What is wrong, by all names of its class: its number with the interval, and that of the simulation."""
    finding, statement = stated.finding, stated.statement
    others = [each for each in statement.effects if each != finding.effect] if statement.kind == "class" else []
    rivals = f" or {_effects_in_words(others)}" if others else ""
    doubt = " (not certain)" if statement.kind == "cause" else ""
    value, known = _figures(finding)
    return f"{_number_name(finding)}{rivals}{doubt}, {value}{f'; the simulation has {known}' if known else ''}"


def _figure_at_place(arm: Arm, finding: ServoFinding) -> str:
    """The same as part of a sentence: what is where how large, and what the simulation has there."""
    value, known = _figures(finding)
    where = f"{_number_name(finding)} at {_places(arm, [finding])}"
    return f"{where} is {value}{f', where the simulation has {known}' if known else ''}"


def _number_name(finding: ServoFinding) -> str:
    return f"{finding_name(finding)}{NUMBER_WORDS.get(finding.name, '')}"


def _figures(finding: ServoFinding) -> tuple[str, str]:
    """The number of a finding with its interval, and that of the simulation; nothing where it is not known."""
    factor, unit = (1e3, "ms") if finding.parameter.unit == "s" else (1.0, format_unit(finding.parameter.unit))
    low, high = finding.interval
    if finding.parameter.key == "payload" and finding.value < 0:
        return f"{-finding.value:.3g} {unit} ({-high:.3g} to {-low:.3g})", ""
    value = f"{factor * finding.value:.3g} {unit}".rstrip() + f" ({factor * low:.3g} to {factor * high:.3g})"
    if math.isnan(finding.nominal):
        return value, ""
    has_none = finding.nominal >= INFINITE_LIMIT or finding.nominal == 0
    return value, "none" if has_none else f"{factor * finding.nominal:.3g} {unit}".rstrip()


def current_phrase(arm: Arm, current: CurrentWitness) -> str:
    """What the current of a joint says in one line."""
    torque = {"signed": "the torque", "size": "the size of the torque", "squared": "the square of the torque"}
    start = f"{joint_in_words(arm, current.joint)}: correlation of the current with {torque[current.form]}"
    given = "" if current.given is None else f"{current.given:.2f} with the simulation's drive, "
    inside = "" if current.inside is None else f", {current.inside:.2f} if all its damping is in the drive"
    return f"{start}, held-out runs: {given}{current.found:.2f} with the one found{inside}"


def error_phrase(arm: Arm, error: ReplayError) -> str:
    """Replay errors of a joint in one line.

    Where the simulator, which lets joints creep that stick, replays a joint worse with what was found: what each joint
    replays alone.
    """
    before = "" if error.replay_before is None else f"{1e3 * error.replay_before:.3g} before, "
    numbers = f"{before}{1e3 * error.replay_after:.3g} after, {1e3 * error.command:.3g} of the command itself"
    rises = error.replay_before is not None and error.replay_after > SHOWN_RISE * error.replay_before
    if rises and error.before is not None:
        numbers += f"; of the joint alone {1e3 * error.before:.3g} before, {1e3 * error.after:.3g} after"
    return f"{joint_in_words(arm, error.joint)}: replay error on held-out runs, mrad: {numbers}"
