"""The sections and tables of the report page as HTML: verdict, errors before and after, findings, location, motion,
next steps, method and origin.
"""

from html import escape
from importlib.metadata import version

from armlab.diagnosis.report.gallery import Gallery
from armlab.diagnosis.report.html import bullets, figures, folded_details, html_table, paragraph, section
from armlab.diagnosis.report.residuals import ShownResiduals, correlation_seconds, filter_correlation_seconds, is_white
from armlab.diagnosis.report.words import (
    effect_in_words,
    finding_in_words,
    format_number,
    format_probability,
    join_words,
    joint_unit,
    parameter_rows,
    place_in_words,
    verdict_sentences,
)
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.story import story_sentence, tell_story
from armlab.effects.library import effect_named
from armlab.identification.export import has_place_in_simulator
from armlab.recordings.reading.corrected import CORRECTED_FOLDER
from armlab.recordings.reading.words import describe


def fit_table(diagnosis: Diagnosis, data: ShownResiduals) -> str:
    """Held-out errors by joint, the gap that is closed, and how long what is left remembers itself."""
    given = None if data.given is None else data.held_out_rms(data.given)
    headings = ["joint", *(["as given"] if given is not None else []), "refitted", "found", "noise floor", "gap closed"]
    rows = []
    for joint, each in enumerate(diagnosis.fit):
        size = joint_unit(diagnosis.simulation.arm, joint)
        first = [] if given is None else [f"{format_number(float(given[joint]))} {size}"]
        closed = "–" if each.gap_closed is None else f"{100 * each.gap_closed:.1f} %"
        errors = [f"{format_number(value)} {size}" for value in (each.before, each.after, each.noise_floor)]
        times = [
            1e3 * correlation_seconds(residual[:, joint], joint, data.observed) for residual in (data.refit, data.final)
        ]
        rows.append([str(each.joint), *first, *errors, closed, f"{times[0]:.0f} → {times[1]:.0f} ms"])
    headings.append(f"memory (filter {1e3 * filter_correlation_seconds(data.observed):.0f} ms)")
    return html_table(headings, rows)


def parameter_table(claim: Claim) -> str:
    """Named parameters of a finding with their intervals."""
    rows = [
        [each.name, each.value, each.interval, each.unit] for one in claim.parameters for each in parameter_rows(one)
    ]
    return html_table(["parameter", "value", "95 % interval", "unit"], rows, (0, 3)) if rows else ""


def located_table(diagnosis: Diagnosis) -> str:
    """Which joints carry the excess error, and in which regime."""
    rows = []
    for each in diagnosis.located:
        stretch = "" if each.time is None else f"{format_number(each.time[0])} to {format_number(each.time[1])} s"
        rows.append([str(each.joint), f"{100 * each.share:.1f} %", each.regime, ", ".join(each.runs), stretch])
    headings = ["joint", "share of the excess error", "where", "runs", "stretch of time"]
    return html_table(headings, rows, (2, 3, 4)) if rows else ""


def findings_table(diagnosis: Diagnosis) -> str:
    """All findings in a line each."""
    rows = []
    for claim in diagnosis.claims:
        evidence = claim.evidence
        size = joint_unit(diagnosis.simulation.arm, evidence.joint)
        rivals = ", ".join(
            f"{effect_in_words(each.effect)}, {place_in_words(each.effect, each.joint)}" for each in claim.rivals
        )
        error = (
            f"{format_number(evidence.rms_before)} → {format_number(evidence.rms_after)} {size} (joint "
            f"{evidence.joint + 1})"
        )
        where = place_in_words(claim.effect, claim.joint, claim.joints)
        rows.append([effect_in_words(claim.effect), where, claim.equation, error, rivals or "–"])
    headings = ["effect", "where", "equation", "held-out error without → with it", "fits as well"]
    return html_table(headings, rows, (1, 2, 3, 4)) if rows else ""


def setup_section(diagnosis: Diagnosis) -> str:
    """How the recording is to be read, where it is read wrongly; empty where it is not."""
    setup = diagnosis.setup
    if setup is None or not setup.findings:
        return ""
    rows = []
    for each in setup.findings:
        size = joint_unit(diagnosis.simulation.arm, each.worst_joint - 1)
        error = (
            f"{format_number(each.rms_before)} → {format_number(each.rms_after)} {size} (joint {each.worst_joint}); "
            f"{each.share_before:.0%} → {each.share_after:.0%} of its torque"
        )
        rivals = "; ".join(rival.text for rival in each.rivals)
        rows.append([describe(each.mistake), error, rivals or "–", each.next_experiment or "–"])
    headings = ["read wrongly", "held-out error as it is → read rightly", "fits as well", "to tell"]
    text = (
        f"{setup.looks} readings of the recording and of the robot file were compared on blocks of time that were held "
        f"out of the runs that identify. {CORRECTED_FOLDER}/ beside this page holds both as they should be; everything "
        "below is of the recording read rightly."
    )
    return section(
        "setup", "How the recording is to be read", paragraph(text), html_table(headings, rows, (0, 1, 2, 3))
    )


def findings_section(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """Each finding with its equation, numbers, evidence and rivals; then what stays unexplained."""
    if not diagnosis.claims:
        return section("findings", "Findings", paragraph("Nothing was found that these data ask for."))
    parts = [_finding_article(diagnosis, claim, picture) for claim, picture in gallery.evidence]
    listed = findings_table(diagnosis)
    return section("findings", "Findings", listed, *parts, _unexplained_list(diagnosis))


def _finding_article(diagnosis: Diagnosis, claim: Claim, picture: str) -> str:
    evidence = claim.evidence
    size = joint_unit(diagnosis.simulation.arm, evidence.joint)
    gain = (
        f"Joint {evidence.joint + 1} on held-out data: {format_number(evidence.rms_before)} {size} without it, "
        f"{format_number(evidence.rms_after)} {size} with it (whitened, its variance is "
        f"{format_number(1 + evidence.gain)} times as large without it). "
        f"p-value {format_probability(evidence.corrected)} after correction for everything that was compared."
    )
    title = finding_in_words(claim)
    about = effect_named(claim.effect).meaning
    return (
        f'<article class="finding"><h3>{escape(title[0].upper() + title[1:])}</h3>{paragraph(about, "pale")}'
        f"<p><code>{escape(claim.equation)}</code></p>"
        f'<div class="pair"><figure>{picture}</figure><div>{parameter_table(claim)}{paragraph(gain)}'
        f"{_rivals_list(claim)}{paragraph(_next_experiment(claim))}</div></div></article>"
    )


def _rivals_list(claim: Claim) -> str:
    if not claim.rivals:
        return paragraph("No other effect of the library fits these data as well.", "pale")
    lines = []
    for each in claim.rivals:
        why = (
            "no motion of this arm can tell the two apart"
            if each.identical
            else (f"on this very motion it fits as well ({format_number(each.deficit)} units of log likelihood worse)")
        )
        lines.append(f"{effect_in_words(each.effect)}, {place_in_words(each.effect, each.joint, each.joints)}: {why}")
    return paragraph("It could also be:") + bullets(lines)


def _next_experiment(claim: Claim) -> str:
    return f"To tell: {claim.next_experiment}." if claim.next_experiment else ""


def _unexplained_list(diagnosis: Diagnosis) -> str:
    if not diagnosis.unexplained:
        return paragraph("No structure is left that a flexible surrogate could predict.", "pale")
    lines = [
        f"Joint {each.joint}: {100 * each.share:.0f} % of the held-out error variance depends on "
        f"{', '.join(name.replace('_', ' of joint ') for name in each.depends_on)}, and no effect of the library has "
        "that form. A surrogate of these variables is in the errors above, not in model.yaml."
        for each in diagnosis.unexplained
    ]
    return f"<h3>Unexplained</h3>{bullets(lines)}"


SECTION_TITLES = {
    "before-after": "Before and after",
    "findings": "Findings",
    "where": "Where",
    "motion": "Motion",
    "next": "What to do next",
    "method": "Method",
    "origin": "Origin",
}


def verdict_section(diagnosis: Diagnosis) -> str:
    """The verdict in two sentences."""
    there = {name: title for name, title in SECTION_TITLES.items() if name != "where" or diagnosis.located}
    links = "".join(f'<a href="#{name}">{escape(title)}</a>' for name, title in there.items())
    title = f"Diagnosis of {diagnosis.recording.name}"
    header = page_header(title, diagnosis.status, *verdict_sentences(diagnosis), links if diagnosis.fit else "")
    return header + story_section(diagnosis)


def story_section(diagnosis: Diagnosis) -> str:
    """The causes of the error in a sentence, and each with its findings; empty without findings."""
    chapters = tell_story(diagnosis)
    if not chapters:
        return ""
    rows = []
    for each in chapters:
        names = dict.fromkeys(effect_in_words(diagnosis.claims[place].effect) for place in each.findings)
        joints = ", ".join(str(joint) for joint in each.joints) or "all"
        rows.append([each.cause, joints, f"{100 * each.share:.1f} %", join_words(list(names))])
    text = (
        "Share of the error: of the squared held-out error of all joints, each in units of its torque, from the model "
        "without findings down to the noise; causes are added in the order of their size."
    )
    table = html_table(["cause", "at", "share", "findings"], rows, (0, 1, 3))
    sentence = story_sentence(chapters, len(diagnosis.simulation.arm))
    return section("story", "In short", paragraph(sentence), table, paragraph(text, "pale"))


def page_header(title: str, status: str, first: str, second: str, links: str = "") -> str:
    """Title and verdict; links: HTML of the way through the page."""
    return (
        f'<header><h1>{escape(title)}</h1><p class="verdict {escape(status)}">{escape(first)} '
        f"<span>{escape(second)}</span></p></header>" + (f"<nav>{links}</nav>" if links else "")
    )


def before_after_section(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """The arm, the errors of each joint, and torques over time."""
    data = gallery.data
    text = (
        "Error: root mean square of measured less predicted torque on data that took no part in any fit. Refitted: the "
        "same rigid body with its inertial parameters fitted anew, no other physics. Gap closed is counted from there "
        "to the noise floor, so that a refit alone earns nothing. Memory: the time over which the error is tied to "
        "itself, before and after; white noise would have that of the filter."
    )
    return section(
        "before-after",
        SECTION_TITLES["before-after"],
        figures([gallery.arm, gallery.errors_by_joint]),
        paragraph(text, "pale"),
        fit_table(diagnosis, data),
        paragraph(_whiteness_text(diagnosis, data)),
        paragraph(
            "Below: the stretch of held-out time that tells most, joint by joint, and what each model leaves there."
        ),
        figures(gallery.torques),
        folded_details("Errors over the whole held-out run", figures(gallery.errors)),
    )


def _whiteness_text(diagnosis: Diagnosis, data: ShownResiduals) -> str:
    """Whether what is left is noise: a floor that remembers itself holds structure too."""
    joints = [joint for joint in range(len(diagnosis.fit)) if not is_white(data.final[:, joint], joint, data.observed)]
    times = [1e3 * correlation_seconds(data.final[:, joint], joint, data.observed) for joint in joints]
    tied = [f"{joint + 1} ({each:.0f} ms)" for joint, each in zip(joints, times, strict=True)]
    if not tied:
        return "What is left is as white as noise through this filter would be."
    filtered = 1e3 * filter_correlation_seconds(data.observed)
    return (
        f"What is left is not white at joint {', '.join(tied)}: it is tied to itself for longer than noise through "
        f"this filter ({filtered:.0f} ms), so the noise floor there holds structure too."
    )


def location_section(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """In which joints and regimes the error is."""
    if not gallery.located:
        return ""
    (_, first), *others = gallery.located
    more = [folded_details(f"Joint {joint}", figures(pictures)) for joint, pictures in others]
    return section("where", SECTION_TITLES["where"], located_table(diagnosis), figures(first), *more)


def motion_section(gallery: Gallery) -> str:
    """Re-simulated motion, or why there is none."""
    own = (
        folded_details("Difference of motion as recorded", figures(gallery.differences)) if gallery.differences else ""
    )
    return section(
        "motion",
        SECTION_TITLES["motion"],
        paragraph(gallery.motion_text),
        figures(gallery.motions),
        paragraph(gallery.difference_text),
        own,
    )


def next_steps_section(diagnosis: Diagnosis) -> str:
    """Which experiments would tell rivals apart, and what to do with the model."""
    asked = [
        f"{finding_in_words(claim)[0].upper()}{finding_in_words(claim)[1:]}: {claim.next_experiment}."
        for claim in diagnosis.claims
        if claim.next_experiment
    ]
    if any(claim.rivals for claim in diagnosis.claims):
        asked.append("`armlab next verdict.json --robot ROBOT` designs a motion that decides between rivals.")
    use = [
        "model.yaml beside this page holds the links and every named effect: `armlab predict model.yaml RECORDING` "
        "compares it with another recording.",
        _export_text(diagnosis),
    ]
    return section("next", SECTION_TITLES["next"], bullets(asked + use))


def _export_text(diagnosis: Diagnosis) -> str:
    if diagnosis.simulation.inertial is None:
        return "It has base parameters, which simulators do not take: they need nominal `links` to start from."
    missing = dict.fromkeys(claim.effect for claim in diagnosis.claims if not _has_place_in_simulator(claim))
    lost = f" That has no place for {join_words([effect_in_words(each) for each in missing])}." if missing else ""
    return f"Where a simulator needs it: `armlab export-model model.yaml model.xml` writes MJCF.{lost}"


def _has_place_in_simulator(claim: Claim) -> bool:
    if claim.candidate is None or claim.coefficients is None:
        return False
    return claim.in_links or has_place_in_simulator(claim.candidate, claim.coefficients)


def method_section(diagnosis: Diagnosis, held_out_blocks: bool) -> str:
    """How it was done, and what it cannot see, in a few sentences."""
    held = (
        "No run was kept for validation, so every third of six blocks of time was held out."
        if held_out_blocks
        else "Runs that validate took no part in any fit."
    )
    text = (
        f"{diagnosis.looks} candidates and shapes were compared in {len(diagnosis.steps)} moves. Torque and columns "
        f"passed the same filter ({format_number(float(diagnosis.settings.get('cutoff_hz', 0.0)))} Hz at most). "
        "Errors count "
        "as correlated in time; p-values are corrected for everything that was compared; a finding has to lower the "
        f"error on held-out data and to obey the signs of physics. No candidate is built from measured torque. {held}"
    )
    limits = (
        "What it cannot see: an effect whose torque rigid-body parameters can imitate shows against the simulation as "
        "given, not after a refit; an effect below the noise; an effect that this motion does not excite. An interval "
        "holds for the effects that are in the model; one that is missing biases the others."
    )
    return section("method", SECTION_TITLES["method"], paragraph(text), paragraph(limits))


def origin_section(diagnosis: Diagnosis, command: str) -> str:
    """Where the data come from, and the command that repeats it."""
    recording, simulation = diagnosis.recording, diagnosis.simulation
    compared = {
        "nominal": "simulation as given",
        "refit": "rigid body refitted",
        "simulated": "torque simulated elsewhere",
    }
    name = recording.simulation.name if recording.simulation else f"links of {recording.robot}"
    rows = [
        ["recording", recording.name],
        ["robot", f"{simulation.arm.name}, {len(simulation.arm)} joint(s)"],
        ["compared with", compared[simulation.kind] + (f" ({name})" if simulation.kind == "nominal" else "")],
        *(["run", f"{run.name}: {run.role}, {run.samples} samples at {run.rate_hz:.5g} Hz"] for run in recording.runs),
        *(["repaired", f"{run.name}: {each.text}"] for run in recording.runs for each in run.repairs),
        *(["warning", each.text] for each in diagnosis.signs),
        ["armlab", version("armlab")],
    ]
    settings = [[key.replace("_", " "), str(value)] for key, value in diagnosis.settings.items()]
    return section(
        "origin",
        "Where this comes from, and how to repeat it",
        html_table(["", ""], rows, (0, 1)),
        f"<pre>{escape(command)}</pre>" if command else "",
        folded_details("Settings", html_table(["setting", "value"], settings, (0, 1))),
    )
