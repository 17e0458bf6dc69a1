"""What a diagnosis of motion only says in words: the summary, and the lines on a terminal."""

import math
from collections.abc import Iterator, Sequence
from textwrap import wrap

from armlab.common.report.wording import format_unit, join_words
from armlab.diagnosis.motion.diagnose import JointError, MotionDiagnosis, ServoFinding
from armlab.diagnosis.motion.naming import servo_naming
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, PARAMETERS
from armlab.diagnosis.motion.witness import CurrentWitness
from armlab.diagnosis.report.verdict import LINE_WIDTH
from armlab.diagnosis.report.words import LESS_MASS, format_chance
from armlab.effects.library import effect_named
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
SHOWN_RISE = 1.02  # of a replay error: a smaller one is none
MAX_LISTED_WORDS = 24  # of the findings with their places in the first sentence; more are named without


def summary_of(diagnosis: MotionDiagnosis) -> str:
    """One paragraph; its first sentence has at most 30 words."""
    if diagnosis.status == "inconclusive":
        return f"Nothing can be said: {diagnosis.reason}."
    if diagnosis.status == "none":
        first = "The simulation replays the held-out commands as well as any servo of this law."
        return first + _replay_sentence(diagnosis)
    arm = diagnosis.simulation.arm
    found = findings_by_name(diagnosis)
    listed = join_words([f"{name} at {_places(arm, own)}" for name, own in found.items()])
    if len(listed.split()) > MAX_LISTED_WORDS:
        listed = join_words(list(found))
    first = f"The simulation differs from the arm in {listed}."
    return first + _replay_sentence(diagnosis) + _silent_sentence(diagnosis) + _odd_sentence(diagnosis)


def findings_by_name(diagnosis: MotionDiagnosis) -> dict[str, list[ServoFinding]]:
    """The findings of each name, in the order of the law's parameters; those that may be nothing at the end."""
    places = {parameter.effect: number for number, parameter in enumerate(PARAMETERS)}
    ordered = sorted(
        diagnosis.findings, key=lambda each: (is_doubtful(each), places.get(each.effect, len(places)), each.joint)
    )
    found: dict[str, list[ServoFinding]] = {}
    for each in ordered:
        found.setdefault(finding_name(each), []).append(each)
    return found


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
    if not diagnosis.errors:
        return ""
    arm = diagnosis.simulation.arm
    places = [
        (joint_in_words(arm, each.joint), each.replay_before, each.replay_after, "mrad") for each in diagnosis.errors
    ]
    tool_before, tool_after = diagnosis.tool
    if tool_before is not None:
        places.append(("at the tool", tool_before, tool_after, "mm"))
    words = [
        f"{place} {'' if before is None else f'from {1e3 * before:.3g} to '}{1e3 * after:.3g} {unit}"
        for place, before, after, unit in places
    ]
    known = all(before is not None for _, before, _, _ in places)
    start = "with the simulation as given and with what was found" if known else "with what was found"
    text = f" Replay error, rms of the position over held-out runs, {start}: {', '.join(words)}."
    return text if known else f"{text} The simulation as given has no drive to replay with."


def _silent_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.silent:
        return ""
    joints = joints_in_words(diagnosis.simulation.arm, diagnosis.silent)
    stands = "it stands still or follows" if len(diagnosis.silent) == 1 else "they stand still or follow"
    return f" Of {joints} nothing can be said: {stands} no servo."


def _odd_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.odd:
        return ""
    shown = ", ".join(f"{run} {start:.0f} to {end:.0f} s" for run, start, end in diagnosis.odd[:3])
    more = f" and {len(diagnosis.odd) - 3} more" if len(diagnosis.odd) > 3 else ""
    return f" Something else than the servos moves the arm in {shown}{more}: contact, or commands that came late."


def motion_lines(diagnosis: MotionDiagnosis, verbose: bool = False) -> Iterator[str]:
    """The verdict, each finding with its interval, the simulation's number and rivals, and the errors of each joint.

    verbose: what the currents of the joints say, too.
    """
    arm = diagnosis.simulation.arm
    yield from wrap(f"{diagnosis.status.upper()}: {summary_of(diagnosis)}", LINE_WIDTH)
    yield from (f"  {each}" for each in finding_phrases(diagnosis))
    for error in diagnosis.errors:
        yield f"  {error_phrase(arm, error)}"
    for current in diagnosis.currents if verbose else ():
        yield f"  {current_phrase(arm, current)}"


def finding_phrases(diagnosis: MotionDiagnosis) -> list[str]:
    """Each finding in one line, with the probability of its name."""
    arm, last = diagnosis.simulation.arm, diagnosis.simulation.last_link
    return [_finding_phrase(arm, each, last) for each in diagnosis.findings]


def _finding_phrase(arm: Arm, finding: ServoFinding, last: int) -> str:
    rivals = " or ".join(effect_named(each).words for each in finding.rivals)
    also = f"; it could also be {rivals}" if rivals else ""
    chance = format_chance(servo_naming(finding, last).probability_of(finding.effect, finding.joint))
    return f"{_places(arm, [finding])}: {finding_with_numbers(finding)}; probability of the name {chance}{also}"


def finding_with_numbers(finding: ServoFinding) -> str:
    """The name of a finding, its number with the interval, and that of the simulation."""
    low, high = finding.interval
    factor, unit = (1e3, "ms") if finding.parameter.unit == "s" else (1.0, format_unit(finding.parameter.unit))
    if finding.parameter.key == "payload" and finding.value < 0:
        return f"{finding_name(finding)}, {-finding.value:.4g} {unit} ({-high:.4g} to {-low:.4g})"
    value = f"{factor * finding.value:.4g} {unit}".rstrip()
    given = "none" if finding.nominal >= INFINITE_LIMIT else f"{factor * finding.nominal:.4g}"
    known = "" if math.isnan(finding.nominal) else f"; the simulation has {given}"
    name = f"{finding_name(finding)}{NUMBER_WORDS.get(finding.name, '')}"
    return f"{name}, {value} ({factor * low:.4g} to {factor * high:.4g}){known}"


def current_phrase(arm: Arm, current: CurrentWitness) -> str:
    """What the current of a joint says in one line."""
    torque = {"signed": "the torque", "size": "the size of the torque", "squared": "the square of the torque"}
    start = f"{joint_in_words(arm, current.joint)}: correlation of the current with {torque[current.form]}"
    given = "" if current.given is None else f"{current.given:.2f} with the simulation's drive, "
    inside = "" if current.inside is None else f", {current.inside:.2f} if all its damping is in the drive"
    return f"{start}, held-out runs: {given}{current.found:.2f} with the one found{inside}"


def error_phrase(arm: Arm, error: JointError) -> str:
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
