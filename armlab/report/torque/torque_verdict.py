"""The verdict for a reader in a hurry: the first screen of the page, and the lines for the terminal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from textwrap import wrap

from armlab.common.report.wording import count_of, format_number
from armlab.diagnosis.result import Claim, Diagnosis, JointFit
from armlab.diagnosis.torque.names.findings import FRICTION
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.links import PAYLOAD_FACTS
from armlab.recordings.reading.answer import SetupFinding
from armlab.report.account.account import Account, StatedFinding, account_of, finding_errors
from armlab.report.account.next_steps import next_steps
from armlab.report.account.summary import physics_in_words, reading_in_words, sentences_of, shorter_list
from armlab.report.torque.measured import NOTHING, doubt_in_words, friction_cell, law_in_words
from armlab.report.torque.residuals import select_residuals
from armlab.report.torque.sentences import claim_figures, model_in_words, simulated_figures
from armlab.report.words import (
    claim_name,
    effect_in_words,
    finding_in_words,
    format_gap,
    format_growth,
    format_percent,
    format_probability,
    is_excess,
    is_of_unknown_links,
    joint_unit,
    rival_in_words,
    shorten_name,
    stated_in_words,
    statement_in_words,
    survival_in_words,
    variables_in_words,
)
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words


def verdict_sentences(diagnosis: Diagnosis) -> tuple[str, str]:
    """The first sentence of the verdict, and the others: of a recording that is read wrongly, that first."""
    reading = reading_in_words(diagnosis)
    if reading:
        return reading, physics_in_words(diagnosis)
    if diagnosis.status == "inconclusive":
        return "These recordings allow no verdict.", physics_in_words(diagnosis)
    if not diagnosis.fit:  # physics was not asked
        return physics_in_words(diagnosis), ""
    if diagnosis.status == "none":
        worst, simulation = max(diagnosis.fit, key=lambda each: each.after), diagnosis.simulation
        size = _largest_error_text(worst, simulation.arm)
        left = f"The largest error on held-out data is {size}." if size else ""
        return f"Nothing is missing: {model_in_words(simulation)} explains the recordings down to their noise.", left
    first, *others = sentences_of(diagnosis)
    return first, " ".join(others)


@dataclass(frozen=True)
class FirstScreen:
    """What a reader sees first: a headline, paragraphs below it, and warnings about the recording."""

    headline: str
    paragraphs: tuple[str, ...]
    warnings: tuple[str, ...]


def first_screen(diagnosis: Diagnosis) -> FirstScreen:
    """A mistake of the reading first, else where the error comes from, else the verdict itself."""
    first, second = verdict_sentences(diagnosis)
    if diagnosis.setup is not None and diagnosis.setup.mistakes and diagnosis.claims:
        second = f"Of the recording read rightly: {second[0].lower()}{second[1:]}"
    warnings = [f"Warning: {each.text}." for each in diagnosis.signs if each.severity != "note"]
    return FirstScreen(first, (second,) if second else (), tuple(warnings[:MAX_WARNINGS]))


def _largest_error_text(worst: JointFit, arm: Arm) -> str:
    size = joint_unit(arm, worst.joint - 1)
    where, noise = joint_in_words(arm, worst.joint), format_number(worst.noise_floor)
    return f"{format_number(worst.after)} {size} ({where}, noise {noise} {size})"


LINE_WIDTH = 110  # letters in a line of the terminal
MAX_WARNINGS = 3  # lines; all of them are on the page
MIN_CELL, MAX_CELL_LINES = 24, 2  # letters and lines of the last column; all is on the page and with --verbose


def verdict_lines(diagnosis: Diagnosis, verbose: bool = False) -> Iterator[str]:
    """The verdict, how the recording is to be read, what differs at each joint, and what to do next.

    verbose: every finding with its evidence, what is left, and the errors of each joint, too.
    """
    first, second = verdict_sentences(diagnosis)
    arm, account = diagnosis.simulation.arm, account_of(diagnosis)
    yield from wrap(f"{diagnosis.status.upper()}: {first} {second}", LINE_WIDTH)
    signs = [each for each in diagnosis.signs if each.severity != "note"]
    warnings = [f"  {line}" for sign in signs for line in wrap(f"warning: {sign.text}", LINE_WIDTH - 2)]
    yield from warnings if verbose or len(warnings) <= MAX_WARNINGS else warnings[: MAX_WARNINGS - 1]
    if not verbose and len(warnings) > MAX_WARNINGS:
        yield f"  more warnings: --verbose, or the page ({count_of(len(signs), 'warning')})"
    setup = diagnosis.setup.findings if diagnosis.setup else ()
    for number, mistake in enumerate(setup, 1):
        yield from _setup_lines(number, mistake, arm)
    if diagnosis.claims:
        yield from _joint_lines(diagnosis, account)
    for each in account.findings:
        if each.claim.survival is not None and not verbose:
            text = f"{finding_in_words(arm, each.claim)}: {survival_in_words(each.claim.survival)}"
            yield from (f"  {line}" for line in wrap(text, LINE_WIDTH - 2))
    if account.minor:
        yield f"  {count_of(len(account.minor), 'small difference')} more, in verdict.json and folded on the page"
    if diagnosis.is_plain:
        yield "  model.yaml holds plain least squares: it predicts blocks of these runs better than the named effects;"
        yield "  it has no bodies that a simulator could load: `armlab identify --method physical` finds some"
    for number, step in enumerate(next_steps(diagnosis, account), 1):
        yield from (f"  {line}" for line in wrap(f"next {number}: {step}", LINE_WIDTH - 2))
    if verbose:
        yield from _detail_lines(diagnosis, account)


def _joint_lines(diagnosis: Diagnosis, account: Account) -> Iterator[str]:
    """A row a joint: all its friction, what was found by name, and what is left of the torque."""
    arm, joints = diagnosis.simulation.arm, range(1, len(diagnosis.simulation.arm) + 1)
    rows = [["joint", "friction", "left", "found"]]
    for joint in joints:
        own = [each for each in account.findings if each.claim.joint == joint]
        name = shorten_name(joint_in_table(arm, joint))
        left = next((format_percent(each.share_of_torque) for each in account.left if each.joint == joint), NOTHING)
        found = "no torque" if joint - 1 in arm.unmeasured else _found_in_words(own, diagnosis.simulation)
        rows.append([name, friction_cell(account, joint, arm), left, found])
    whole = [each for each in account.findings if each.claim.joint is None]
    if whole:
        rows.append(["robot", NOTHING, NOTHING, _found_in_words(whole, diagnosis.simulation)])
    rows = [[cell.replace("\N{NO-BREAK SPACE}", " ") for cell in row] for row in rows]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    for row in rows:
        start = "  ".join(cell.ljust(width) for cell, width in zip(row[:3], widths, strict=True)) + "  "
        width = max(LINE_WIDTH - len(start) - 2, MIN_CELL)
        lines = wrap(row[3], width, max_lines=MAX_CELL_LINES, placeholder=" …") or [NOTHING]
        yield f"  {start}{lines[0]}"
        yield from (f"  {' ' * len(start)}{line}" for line in lines[1:])


def _found_in_words(found: Sequence[StatedFinding], simulation: Simulation) -> str:
    """`Coulomb and viscous friction; torque offset 0.84 N m`: friction stands beside it with its size."""
    laws = [each for each in found if each.cause == FRICTION and each.statement.kind == "name"]
    laws = [each for each in laws if not each.claim.simulated]
    words = [shorter_list([effect_in_words(each.claim.effect) for each in laws])] if laws else []
    for each in found:
        if each.cause == FRICTION and each not in laws and not each.claim.simulated:
            words.append(law_in_words(each))
        elif each not in laws:
            numbers = claim_figures(_shorter(each.claim), simulation)
            links = " of the links, which is not certain" if is_of_unknown_links(each.claim) else ""
            present, size = simulated_figures(each.claim), f" {numbers}" if numbers else ""
            if present:
                size = (
                    f", {numbers.split(' ')[0]} of {present}" if is_excess(each.claim) else f"{size} beyond {present}"
                )
            words.append(f"{claim_name(each.claim)}{links}{size}{doubt_in_words(each)}")
    return "; ".join(words)


def _shorter(claim: Claim) -> Claim:
    """A finding whose numbers have no intervals; what the simulation has too much of, by how much."""
    sign = -1.0 if is_excess(claim) else 1.0
    numbers = (
        replace(one, interval=None, value=sign * one.value if isinstance(one.value, float) else one.value)
        for one in claim.parameters
    )
    return replace(claim, parameters=tuple(numbers))


def _detail_lines(diagnosis: Diagnosis, account: Account) -> Iterator[str]:
    for number, each in enumerate((*account.findings, *account.minor), 1):
        yield from _finding_lines(number, each, diagnosis.simulation)
    arm = diagnosis.simulation.arm
    for left in account.left:
        depends = f", depends on {variables_in_words(arm, left.depends_on)}" if left.depends_on else ""
        usual = "" if left.usual else ", more than real arms leave"
        yield f"  left at {joint_in_words(arm, left.joint)}: {left.share_of_torque:.1%} of the torque{depends}{usual}"
    yield from _error_lines(diagnosis)


def _error_lines(diagnosis: Diagnosis) -> Iterator[str]:
    """The table of held-out errors, with the number of each joint that the equations have."""
    fits, arm, data = diagnosis.fit, diagnosis.simulation.arm, select_residuals(diagnosis)
    if not fits:
        return
    given = None if data is None or data.given is None else data.held_out_rms(data.given).tolist()
    first = "" if given is None else f"{'as given':>11}"
    filtered = "" if data is None else f" of torque {data.filtered}"
    names = [shorten_name(joint_in_table(arm, fit.joint).replace("\N{NO-BREAK SPACE}", " ")) for fit in fits]
    width = max(len("joint"), *map(len, names))
    yield f"  errors on held-out data, rms{filtered}:"
    yield f"  {'joint':<{width}}{first}   refitted      plain      found      noise   gap closed"
    for name, fit in zip(names, fits, strict=True):
        closed = format_gap(fit.gap_closed)
        plain = float("nan") if fit.plain is None else fit.plain
        values = [*([] if given is None else [given[fit.joint - 1]]), fit.before, plain, fit.after, fit.noise_floor]
        errors = "".join(f"{format_number(value):>11}" for value in values)
        yield f"  {name:<{width}}{errors}{closed:>13}   {joint_unit(arm, fit.joint - 1)}"


def _setup_lines(number: int, finding: SetupFinding, arm: Arm) -> Iterator[str]:
    lines = wrap(f"setup: {finding.text}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    unit = joint_unit(arm, finding.worst_joint - 1)
    error = f"{format_number(finding.rms_before)} to {format_number(finding.rms_after)} {unit}"
    if finding.rms_before:
        yield f"     held-out error of {joint_in_words(arm, finding.worst_joint)}: {error}"
    for rival in finding.rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rival.text}", LINE_WIDTH - 5))
    if finding.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {finding.next_experiment}", LINE_WIDTH - 5))


def _finding_lines(number: int, finding: StatedFinding, simulation: Simulation) -> Iterator[str]:
    claim, arm = finding.claim, simulation.arm
    law = claim_figures(claim, simulation) if claim.effect == PAYLOAD_FACTS.id else claim.equation
    present = simulated_figures(claim)
    law = f"{law}; the simulation has {present}" if present else law
    small = "small: " if claim.minor else ""
    lines = wrap(f"{small}{stated_in_words(arm, claim, finding.statement)}: {law}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    where = joint_in_words(arm, (claim.removal or claim.evidence).joint + 1)
    growth, probability = format_growth(*finding_errors(claim)), format_probability(claim.evidence.corrected)
    gain = f"without it the held-out error of {where} is {growth}"
    whole = f"{gain}; p {probability}; {statement_in_words(finding.statement)}"
    if claim.survival is not None:
        whole += f"; {survival_in_words(claim.survival)}"
    yield from (f"     {line}" for line in wrap(whole, LINE_WIDTH - 5))
    same = ", ".join(rival_in_words(arm, each) for each in claim.rivals if each.identical)
    if same:
        yield from (f"     {line}" for line in wrap(f"no such motion tells it from {same}", LINE_WIDTH - 5))
