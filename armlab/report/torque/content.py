"""What the report page says, as plain data for its template: the first screen, what to do next, then the details."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

from markupsafe import Markup

from armlab.common.errors import InputError
from armlab.common.report.page import Table
from armlab.common.report.wording import count_of, format_number, join_words
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.torque.names.findings import FRICTION, STATED_SHARE, StatedCause
from armlab.diagnosis.torque.predict.parts import LINKS
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.library import effect_named
from armlab.identification.export import bodies, build_simulator_model, has_place_in_simulator
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.reading.corrected import CORRECTED_FOLDER
from armlab.recordings.recording import Recording
from armlab.report.account.account import StatedFinding, account_of, finding_errors
from armlab.report.account.summary import cause_name, cause_place, friction_sizes, open_share
from armlab.report.torque.gallery import Gallery
from armlab.report.torque.residuals import ShownResiduals, correlation_seconds, filter_correlation_seconds, is_white
from armlab.report.torque.sentences import claim_figures
from armlab.report.words import (
    PARAMETER_DIGITS,
    compared_in_words,
    effect_in_words,
    format_chance,
    format_gap,
    format_growth,
    format_probability,
    format_share,
    joint_unit,
    member_in_words,
    parameter_rows,
    rival_in_words,
    stated_in_words,
    statement_in_words,
    survival_in_words,
    variable_in_words,
    variables_in_words,
)
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words, links_in_words


@dataclass(frozen=True)
class Origin:
    """Where a page comes from. table: recording, robot, runs, versions. command: that repeats it."""

    table: Table
    settings: Table
    command: str


@dataclass(frozen=True)
class FindingDetail:
    """One finding. picture: its evidence. chance: how sure it is."""

    title: str
    error: str
    about: str
    equation: str
    picture: Markup
    numbers: Table
    gain: str
    chance: str
    rivals: Sequence[str]
    next_experiment: str


@dataclass(frozen=True)
class SetupPart:
    """How the recording is to be read."""

    text: str
    table: Table


def error_note(diagnosis: Diagnosis, data: ShownResiduals) -> str:
    """What the shares and errors of the first screen are of."""
    errors = f"Errors are root mean squares of measured less predicted torque at one joint, both {data.filtered}."
    if not diagnosis.claims:
        return f"{errors} On held-out data."
    return (
        "Shares are of the squared error above the noise, of all joints together, each in units of its own torque. "
        "How sure: probability of the name, or of the few names, of each finding. "
        f"{errors} All on held-out data."
    )


def cause_table(diagnosis: Diagnosis) -> Table | None:
    """The causes that are told, the largest first: where, how large, of the error, how sure; None without any."""
    account = account_of(diagnosis)
    if not account.told:
        return None
    rows = []
    for each in account.told:
        own = account.findings_of(each)
        place = cause_place(diagnosis, each, own) or _place_of_whole_arm(diagnosis, each, own)
        share, size = format_share(each.share), _cause_size(diagnosis, each)
        rows.append([cause_name(each, own), place, size, share, _how_sure(own)])
    if open_share(account) > 1 - STATED_SHARE:
        rows.append(["cannot be named", "", "", format_share(open_share(account)), ""])
    return Table(["cause", "where", "how large", "share of error", "how sure"], rows, (0, 1, 2, 4), stacked=True)


def _place_of_whole_arm(diagnosis: Diagnosis, cause: StatedCause, own: Sequence[StatedFinding]) -> str:
    """Where a cause without joints acts. Links that are off show most at one link, which may be right itself."""
    joint = own[0].claim.joint
    if cause.cause != LINKS or joint is None:
        return "the whole arm"
    return f"missed most at {links_in_words(diagnosis.simulation.arm, [joint])}, these data do not tell which is off"


def _cause_size(diagnosis: Diagnosis, cause: StatedCause) -> str:
    """The friction of a cause at its joints, then the numbers of what else it has."""
    account, arm = account_of(diagnosis), diagnosis.simulation.arm
    sizes, own = friction_sizes(diagnosis, account, cause), account.findings_of(cause)
    texts = [f"{' to '.join(sizes)}{' at higher speeds' if len(sizes) > 1 else ''}"] if sizes else []
    if cause.cause == FRICTION:
        return "".join(texts)
    texts = [f"friction {each}" for each in texts]
    places = {each.claim.joint for each in own}
    for each in sorted(own, key=lambda each: each.claim.joint or 0):
        if numbers := claim_figures(each.claim, diagnosis.simulation):
            joint = each.claim.joint
            texts.append(f"{joint_in_words(arm, joint)}: {numbers}" if joint and len(places) > 1 else numbers)
    return "; ".join(texts) or _size_by_removal(diagnosis, own)


def _size_by_removal(diagnosis: Diagnosis, own: Sequence[StatedFinding]) -> str:
    """What a cause without numbers is worth at the joint that misses it most."""
    missed = [(each.claim.removal, each.claim) for each in own if each.claim.removal is not None]
    if not missed:
        return ""
    (removal, claim), arm = max(missed, key=lambda each: each[0].growth), diagnosis.simulation.arm
    unit = joint_unit(arm, removal.joint)
    without, with_it = (f"{format_number(each)} {unit}" for each in finding_errors(claim))
    return f"error of {joint_in_words(arm, removal.joint + 1)}: {without} without, {with_it} with it"


def _how_sure(own: Sequence[StatedFinding]) -> str:
    """The probability of the least certain finding of a cause, and whether their names are certain."""
    chances = sorted(each.statement.probability for each in own)
    least, most = (format_chance(each) for each in (chances[0], chances[-1]))
    is_sure = all(each.statement.kind == "name" for each in own)
    what = "law" if own[0].is_friction else "name"
    doubt = "" if is_sure else f", {what} not certain" if len(own) == 1 else f", not each {what} certain"
    return f"{least}{'' if least == most else ' or more'}{doubt}"


def setup_part(diagnosis: Diagnosis) -> SetupPart | None:
    """How the recording is to be read, where it is read wrongly; None where it is not."""
    setup = diagnosis.setup
    if setup is None or not setup.findings:
        return None
    rows = []
    for each in setup.findings:
        size = joint_unit(diagnosis.simulation.arm, each.worst_joint - 1)
        error = (
            f"{format_number(each.rms_before)} → {format_number(each.rms_after)} {size} "
            f"({joint_in_words(diagnosis.simulation.arm, each.worst_joint)}); "
            f"{each.share_before:.0%} → {each.share_after:.0%} of its torque"
        )
        rivals = "; ".join(rival.text for rival in each.rivals)
        shown = error if each.rms_before else "–"
        rows.append([each.description, shown, rivals or "–", each.next_experiment or "–"])
    headings = ["read wrongly", "held-out error as it is → read rightly", "fits as well", "to tell"]
    text = (
        f"{setup.looks} readings of the recording and of the robot file were compared on blocks of time that were held "
        f"out of the runs that identify. {CORRECTED_FOLDER}/ beside this page holds both as they should be; all other "
        "numbers of this page are of the recording read rightly."
    )
    return SetupPart(text, Table(headings, rows, (0, 1, 2, 3), stacked=True))


def fit_table(diagnosis: Diagnosis, data: ShownResiduals) -> Table:
    """Held-out errors by joint, the gap that is closed, and how long what is left remembers itself."""
    given = None if data.given is None else data.held_out_rms(data.given)
    first = ["as given"] if given is not None else []
    headings = ["joint", *first, "refitted", "plain least squares", "found", "noise floor", "gap closed"]
    rows = []
    for each in diagnosis.fit:
        joint = each.joint - 1
        size = joint_unit(diagnosis.simulation.arm, joint)
        first = [] if given is None else [f"{format_number(float(given[joint]))} {size}"]
        values = (each.before, each.plain, each.after, each.noise_floor)
        errors = ["–" if value is None else f"{format_number(value)} {size}" for value in values]
        times = [
            1e3 * correlation_seconds(residual[:, joint], joint, data.observed) for residual in (data.refit, data.final)
        ]
        memory = f"{times[0]:.0f} → {times[1]:.0f} ms"
        rows.append(
            [joint_in_table(diagnosis.simulation.arm, each.joint), *first, *errors, format_gap(each.gap_closed), memory]
        )
    headings.append(f"memory (filter {1e3 * filter_correlation_seconds(data.observed):.0f} ms)")
    return Table(headings, rows, stacked=True)


def whiteness_text(diagnosis: Diagnosis, data: ShownResiduals) -> str:
    """Whether what is left changes as fast as noise does: a floor that remembers itself holds structure too."""
    fitted = [each.joint - 1 for each in diagnosis.fit]
    joints = [joint for joint in fitted if not is_white(data.final[:, joint], joint, data.observed)]
    times = [1e3 * correlation_seconds(data.final[:, joint], joint, data.observed) for joint in joints]
    arm = diagnosis.simulation.arm
    tied = [f"{joint_in_words(arm, joint + 1)} ({each:.0f} ms)" for joint, each in zip(joints, times, strict=True)]
    if not tied:
        return "What is left changes as fast as noise through the filter of the torque would."
    filtered = 1e3 * filter_correlation_seconds(data.observed)
    return (
        f"What is left at {join_words(tied)} changes more slowly than noise through the filter of the torque would "
        f"({filtered:.0f} ms): it holds something that these signals do not show, and so does the noise floor there."
    )


def finding_details(diagnosis: Diagnosis, gallery: Gallery, minor: bool = False) -> list[FindingDetail]:
    """Each finding that is told with its equation, numbers, evidence and rivals, the largest share of the error first.

    minor: those that are not told instead.
    """
    pictures, account = {id(claim): picture for claim, picture in gallery.evidence}, account_of(diagnosis)
    return [
        _finding_detail(diagnosis, each, pictures[id(each.claim)])
        for each in (account.minor if minor else account.findings)
    ]


def _finding_detail(diagnosis: Diagnosis, finding: StatedFinding, picture: Markup) -> FindingDetail:
    claim, arm = finding.claim, diagnosis.simulation.arm
    joint = (claim.removal or claim.evidence).joint
    size, where = joint_unit(arm, joint), joint_in_words(arm, joint + 1)
    before, after = finding_errors(claim)
    gain = (
        f"Held-out error of {where}: {format_number(before)} {size} without it, all others fitted anew, and "
        f"{format_number(after)} {size} with it. p-value {format_probability(claim.evidence.corrected)} after "
        "correction for everything that was compared."
    )
    title, chance = stated_in_words(arm, claim, finding.statement), statement_in_words(finding.statement)
    if claim.survival is not None:
        chance += f"; {survival_in_words(claim.survival)}"
    return FindingDetail(
        title=f"{title[0].upper()}{title[1:]}",
        error=f"without it the error of {where} is {format_growth(before, after)}",
        about=effect_named(claim.effect).meaning,
        equation=claim.equation,
        picture=picture,
        numbers=parameter_table(claim),
        gain=gain,
        chance=f"{chance[0].upper()}{chance[1:]}",
        rivals=_rival_texts(arm, claim),
        next_experiment=claim.next_experiment or "",
    )


def parameter_table(claim: Claim) -> Table:
    """Named parameters of a finding with their intervals, beside those of the simulation where it has such a law."""
    rows = [
        [each.name, each.value, each.interval, *_simulated_cell(claim, each.name), each.unit]
        for one in claim.parameters
        for each in parameter_rows(one)
    ]
    if not claim.simulated:
        return Table(["parameter", "value", "95 % interval", "unit"], rows, (0, 3))
    return Table(["parameter", "to be added", "95 % interval", "in the simulation", "unit"], rows, (0, 4))


def _simulated_cell(claim: Claim, name: str) -> list[str]:
    """The cell of a parameter as the simulation has it; none where it has no such law."""
    if not claim.simulated:
        return []
    return [format_number(claim.simulated[name], PARAMETER_DIGITS) if name in claim.simulated else "–"]


def _rival_texts(arm: Arm, claim: Claim) -> list[str]:
    """What else a finding may be, with probabilities, and what no motion tells from it."""
    same = [each for each in claim.rivals if each.identical]
    others = [each for each in claim.members if not each.is_of(claim.effect, claim.joint)]
    chances = [f"{member_in_words(arm, each)}: probability {each.probability:.2f}" for each in others]
    why = "no motion of that joint alone can tell the two apart; armlab next says whether one of the whole arm can"
    return [*chances, *(f"{rival_in_words(arm, each)}: {why}" for each in same)]


def left_table(diagnosis: Diagnosis) -> Table:
    """What is left at each joint: of its torque, beside the noise, and on what it depends most."""
    arm, rows = diagnosis.simulation.arm, []
    for each in account_of(diagnosis).left:
        size = joint_unit(arm, each.joint - 1)
        errors = [f"{format_number(value)} {size}" for value in (each.rms, each.noise)]
        depends = variables_in_words(arm, each.depends_on) if each.depends_on else "–"
        usual = "as real arms leave" if each.usual else "more than real arms leave"
        rows.append([joint_in_table(arm, each.joint), f"{each.share_of_torque:.1%}", *errors, depends, usual])
    return Table(["joint", "of the torque", "rms", "noise", "depends on", "usual"], rows, (4, 5), stacked=True)


def located_table(diagnosis: Diagnosis) -> Table:
    """Which joints carry the excess error, and in which regime."""
    rows, arm = [], diagnosis.simulation.arm
    for each in diagnosis.located:
        where = each.regime
        if each.variable is not None:
            where = variable_in_words(arm, each.variable) + each.regime.removeprefix(each.variable)
        stretch = "–" if each.time is None else f"{format_number(each.time[0])} to {format_number(each.time[1])} s"
        joint, runs = joint_in_table(arm, each.joint), ", ".join(each.runs) or "–"
        rows.append([joint, format_share(each.share), where, runs, stretch])
    headings = ["joint", "share of the excess error", "where", "runs", "stretch of time"]
    return Table(headings, rows, (2, 3, 4), stacked=True)


def uses(diagnosis: Diagnosis) -> list[str]:
    """What to do with the verdict and with the model."""
    if not diagnosis.fit:
        return []
    asked = list[str]()
    if any(_motion_may_tell(claim) for claim in diagnosis.claims):
        asked.append("`armlab next verdict.json --robot ROBOT` designs a motion that decides between rivals.")
    held = (
        "the links and every named effect, fitted beside what else helps to predict (its numbers may differ from those "
        "of the findings)"
    )
    if diagnosis.is_plain:
        held = "plain least squares, which predicts blocks of these runs better than a model with the named effects"
    use = [
        f"Take model.yaml beside this page, which holds {held}: `armlab predict model.yaml RECORDING` compares it with "
        "another recording.",
        _export_text(diagnosis),
    ]
    return asked + use


def _motion_may_tell(claim: Claim) -> bool:
    """Whether a motion may tell a claim from a rival; none tells a load from a link that is off."""
    of_link = effect_named(claim.effect).where == "link"
    return any(not of_link or effect_named(each.effect).where != "link" for each in claim.rivals)


def _export_text(diagnosis: Diagnosis) -> str:
    if diagnosis.simulation.inertial is None or diagnosis.is_plain:
        return (
            "A simulator needs masses, which these data alone do not tell: give the robot file nominal `links`, and "
            "diagnose again."
        )
    if diagnosis.model is not None and not _is_exportable(diagnosis.model):
        return (
            "A simulator needs links that are possible bodies. The links of this model are not: `armlab identify "
            "RECORDING --method physical` fits possible ones."
        )
    missing = dict.fromkeys(claim.effect for claim in diagnosis.claims if not _has_place_in_simulator(claim))
    lost = f" That has no place for {join_words([effect_in_words(each) for each in missing])}." if missing else ""
    return f"Where a simulator needs it: `armlab model export model.yaml model.xml` writes MJCF.{lost}"


def _is_exportable(model: TorqueModel) -> bool:
    """Whether a simulator takes its links."""
    try:
        bodies(build_simulator_model(model))
    except InputError:
        return False
    return True


def _has_place_in_simulator(claim: Claim) -> bool:
    if claim.candidate is None or claim.coefficients is None:
        return False
    return claim.in_links or has_place_in_simulator(claim.candidate, claim.coefficients)


def method_text(diagnosis: Diagnosis, held_out_blocks: bool) -> str:
    """How it was done, in a few sentences."""
    held = (
        "No run that validates is long enough, so every third block of time was held out, of at most six blocks a run."
        if held_out_blocks
        else "Runs that validate took no part in any fit."
    )
    return (
        f"{diagnosis.looks} candidates and shapes were compared in {len(diagnosis.steps)} moves. Torque and columns "
        f"passed the same filter ({format_number(float(diagnosis.settings.get('cutoff_hz', 0.0)))} Hz at most). Errors "
        "count as correlated in time; p-values are corrected for everything that was compared; a finding has to lower "
        "the error on held-out data and to obey the signs of physics. No candidate is built from measured torque. "
        f"{held}"
    )


def origin_of(recording: Recording, simulation: Simulation, command: str, diagnosis: Diagnosis | None = None) -> Origin:
    """Where the data come from, and the command that repeats it. diagnosis: whose settings and signs stand there."""
    name = recording.simulation.name if recording.simulation else f"links of {recording.robot}"
    rows = [
        ["recording", recording.name],
        ["robot", f"{simulation.arm.name}, {count_of(len(simulation.arm), 'joint')}"],
        ["compared with", compared_in_words(simulation) + (f" ({name})" if simulation.kind == "nominal" else "")],
        *(["run", f"{run.name}: {run.role}, {run.samples} samples at {run.rate_hz:.5g} Hz"] for run in recording.runs),
        *(["repaired", f"{run.name}: {each.text}"] for run in recording.runs for each in run.repairs),
        *([each.severity, each.text] for each in (() if diagnosis is None else diagnosis.signs)),
        ["armlab", version("armlab")],
    ]
    numbers = {} if diagnosis is None else diagnosis.settings
    settings = [[key.replace("_", " "), str(value)] for key, value in numbers.items()]
    return Origin(Table(["what", "of this page"], rows, (0, 1)), Table(["setting", "value"], settings, (0, 1)), command)
