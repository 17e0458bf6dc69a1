"""What a diagnosis of motion only says in words: the summary, and the lines on a terminal."""

from collections.abc import Iterator
from itertools import groupby

from armlab.common.report.numbers import format_unit
from armlab.diagnosis.motion.diagnose import JointError, MotionDiagnosis, ServoFinding
from armlab.diagnosis.motion.servo import PARAMETERS
from armlab.effects.library import effect_named


def summary_of(diagnosis: MotionDiagnosis) -> str:
    """One paragraph; its first sentence has at most 30 words."""
    if diagnosis.status == "inconclusive":
        return f"Nothing can be said: {diagnosis.reason}."
    if diagnosis.status == "none":
        first = "The simulation replays the held-out commands as well as any servo of this law."
        return first + _replay_sentence(diagnosis)
    parts = [
        f"{effect_named(effect).words} at joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}"
        for effect, joints in findings_by_effect(diagnosis)
    ]
    listed = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
    if len(listed.split()) > 24:
        words = [effect_named(effect).words for effect, _ in findings_by_effect(diagnosis)]
        listed = f"{', '.join(words[:-1])} and {words[-1]}"
    first = f"The simulation differs from the arm in {listed}."
    return first + _replay_sentence(diagnosis) + _silent_sentence(diagnosis) + _odd_sentence(diagnosis)


def findings_by_effect(diagnosis: MotionDiagnosis) -> list[tuple[str, list[int]]]:
    """Effects with their joints, in the order of the law's parameters."""
    places = {parameter.effect: number for number, parameter in enumerate(PARAMETERS)}
    ordered = sorted(diagnosis.findings, key=lambda each: (places.get(each.effect, len(places)), each.joint))
    return [
        (effect, sorted({each.joint for each in group}))
        for effect, group in groupby(ordered, key=lambda each: each.effect)
    ]


def _replay_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.errors:
        return ""
    places = [(f"joint {each.joint}", each.replay_before, each.replay_after, "mrad") for each in diagnosis.errors]
    tool_before, tool_after = diagnosis.tool
    if tool_before is not None:
        places.append(("at the tool", tool_before, tool_after, "mm"))
    words = [
        f"{place} {'' if before is None else f'from {1e3 * before:.3g} to '}{1e3 * after:.3g} {unit}"
        for place, before, after, unit in places
    ]
    return f" Replay error of held-out runs: {', '.join(words)}."


def _silent_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.silent:
        return ""
    return (
        f" Of joint {', '.join(map(str, diagnosis.silent))} nothing can be said: it stands still or follows no servo."
    )


def _odd_sentence(diagnosis: MotionDiagnosis) -> str:
    if not diagnosis.odd:
        return ""
    stretches = sorted({(run, start, end) for _, run, start, end in diagnosis.odd})
    shown = ", ".join(f"{run} {start:.0f} to {end:.0f} s" for run, start, end in stretches[:3])
    more = f" and {len(stretches) - 3} more" if len(stretches) > 3 else ""
    return f" Something else than the servos moves the arm in {shown}{more}: contact, or commands that came late."


def motion_lines(diagnosis: MotionDiagnosis) -> Iterator[str]:
    """The verdict, each finding with its interval, the simulation's number and rivals, and the errors of each joint."""
    yield f"{diagnosis.status.upper()}: {summary_of(diagnosis)}"
    for each in diagnosis.findings:
        yield f"  {finding_phrase(each)}"
    for error in diagnosis.errors:
        yield f"  {error_phrase(error)}"


def finding_phrase(finding: ServoFinding) -> str:
    """A finding in one line."""
    low, high = finding.interval
    unit = format_unit(finding.parameter.unit)
    words = f"joint {finding.joint}: {effect_named(finding.effect).words}, {finding.name} {finding.value:.4g} "
    words += f"({low:.4g} to {high:.4g}){f' {unit}' if unit else ''}"
    known = f"; the simulation has {finding.nominal:.4g}" if finding.nominal == finding.nominal else ""
    rivals = " or ".join(effect_named(each).words for each in finding.rivals)
    return f"{words}{known}{f'; it could also be {rivals}' if rivals else ''}"


def error_phrase(error: JointError) -> str:
    """Replay errors of a joint in one line."""
    before = "" if error.replay_before is None else f"{1e3 * error.replay_before:.3g} before, "
    numbers = f"{before}{1e3 * error.replay_after:.3g} after, {1e3 * error.command:.3g} of the command itself"
    return f"joint {error.joint}: replay error on held-out runs, mrad: {numbers}"
