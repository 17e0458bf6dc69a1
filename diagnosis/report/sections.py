"""The sections of the page, one function each, as HTML."""

from html import escape
from importlib.metadata import version

from armlab.diagnosis.result import Diagnosis
from diagnosis.export.simulator import without_place
from diagnosis.report.gallery import Gallery
from diagnosis.report.html import bullets, figures, folded, paragraph, section, table
from diagnosis.report.memory import filter_memory_seconds, memory_seconds, white
from diagnosis.report.rows import Shown
from diagnosis.report.tables import fit_table, located_table
from diagnosis.report.words import (
    joined,
    number,
    plain,
    told,
    verdict_sentences,
)

PARTS = {
    "before-after": "Before and after",
    "findings": "Findings",
    "where": "Where",
    "motion": "Motion",
    "next": "What to do next",
    "method": "Method",
    "origin": "Origin",
}


def head(diagnosis: Diagnosis) -> str:
    """The verdict in two sentences."""
    there = {name: title for name, title in PARTS.items() if name != "where" or diagnosis.located}
    links = "".join(f'<a href="#{name}">{escape(title)}</a>' for name, title in there.items())
    title = f"Diagnosis of {diagnosis.recording.name}"
    return header(title, diagnosis.status, *verdict_sentences(diagnosis), links if diagnosis.fit else "")


def header(title: str, status: str, first: str, second: str, links: str = "") -> str:
    """Title and verdict; links: HTML of the way through the page."""
    return (
        f'<header><h1>{escape(title)}</h1><p class="verdict {escape(status)}">{escape(first)} '
        f"<span>{escape(second)}</span></p></header>" + (f"<nav>{links}</nav>" if links else "")
    )


def before_after(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """The arm, the errors of each joint, and torques over time."""
    data = gallery.data
    text = (
        "Error: root mean square of measured less predicted torque on data that took no part in any fit. Refitted: the "
        "same rigid body with its inertial parameters fitted anew, no other physics. Gap closed is counted from there "
        "to the noise floor, so that a refit alone earns nothing. Memory: the time over which the error is tied to "
        "itself, before and after; white noise would have that of the filter."
    )
    return section(
        "before-after", PARTS["before-after"], figures([gallery.arm, gallery.errors_by_joint]), paragraph(text, "pale"),
        fit_table(diagnosis, data), paragraph(_left(diagnosis, data)), paragraph(
            "Below: the stretch of held-out time that tells most, joint by joint, and what each model leaves there."
        ),
        figures(gallery.torques), folded("Errors over the whole held-out run", figures(gallery.errors)),
    )  # fmt: skip


def _left(diagnosis: Diagnosis, data: Shown) -> str:
    """Whether what is left is noise: a floor that remembers itself holds structure too."""
    joints = [joint for joint in range(len(diagnosis.fit)) if not white(data.final[:, joint], joint, data.observed)]
    times = [1e3 * memory_seconds(data.final[:, joint], joint, data.observed) for joint in joints]
    tied = [f"{joint + 1} ({each:.0f} ms)" for joint, each in zip(joints, times, strict=True)]
    if not tied:
        return "What is left is as white as noise through this filter would be."
    filtered = 1e3 * filter_memory_seconds(data.observed)
    return (
        f"What is left is not white at joint {', '.join(tied)}: it is tied to itself for longer than noise through "
        f"this filter ({filtered:.0f} ms), so the noise floor there holds structure too."
    )


def where(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """In which joints and regimes the error is."""
    if not gallery.located:
        return ""
    (_, first), *others = gallery.located
    more = [folded(f"Joint {joint}", figures(pictures)) for joint, pictures in others]
    return section("where", PARTS["where"], located_table(diagnosis), figures(first), *more)


def motion(gallery: Gallery) -> str:
    """Re-simulated motion, or why there is none."""
    own = folded("Difference of motion as recorded", figures(gallery.differences)) if gallery.differences else ""
    return section(
        "motion", PARTS["motion"], paragraph(gallery.motion_text), figures(gallery.motions),
        paragraph(gallery.difference_text), own,
    )  # fmt: skip


def following(diagnosis: Diagnosis) -> str:
    """Which experiments would tell rivals apart, and what to do with the model."""
    asked = [
        f"{told(claim)[0].upper()}{told(claim)[1:]}: {claim.next_experiment}."
        for claim in diagnosis.claims
        if claim.next_experiment
    ]
    if any(claim.rivals for claim in diagnosis.claims):
        asked.append("`armlab next verdict.json --robot ROBOT` designs a motion that decides between rivals.")
    use = [
        "model.yaml beside this page holds the links and every named effect: `armlab predict model.yaml RECORDING` "
        "compares it with another recording.",
        _exported(diagnosis),
    ]
    return section("next", PARTS["next"], bullets(asked + use))


def _exported(diagnosis: Diagnosis) -> str:
    if diagnosis.simulation.inertial is None:
        return "It has base parameters, which simulators do not take: they need nominal `links` to start from."
    missing = without_place((claim.effect, frozenset(p.name for p in claim.parameters)) for claim in diagnosis.claims)
    lost = f" That has no place for {joined([plain(each) for each in missing])}." if missing else ""
    return f"Where a simulator needs it: `armlab export-model model.yaml model.xml` writes MJCF.{lost}"


def method(diagnosis: Diagnosis, held_out_blocks: bool) -> str:
    """How it was done, and what it cannot see, in a few sentences."""
    held = (
        "No run was kept for validation, so every third of six blocks of time was held out."
        if held_out_blocks
        else "Runs that validate took no part in any fit."
    )
    text = (
        f"{diagnosis.looks} candidates and shapes were compared in {len(diagnosis.steps)} moves. Torque and columns "
        f"passed the same filter ({number(float(diagnosis.settings.get('cutoff_hz', 0.0)))} Hz at most). Errors count "
        "as correlated in time; p-values are corrected for everything that was compared; a finding has to lower the "
        f"error on held-out data and to obey the signs of physics. No candidate is built from measured torque. {held}"
    )
    limits = (
        "What it cannot see: an effect whose torque rigid-body parameters can imitate shows against the simulation as "
        "given, not after a refit; an effect below the noise; an effect that this motion does not excite. An interval "
        "holds for the effects that are in the model; one that is missing biases the others."
    )
    return section("method", PARTS["method"], paragraph(text), paragraph(limits))


def origin(diagnosis: Diagnosis, command: str) -> str:
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
        ["armlab", version("armlab")],
    ]
    settings = [[key.replace("_", " "), str(value)] for key, value in diagnosis.settings.items()]
    return section(
        "origin", "Where this comes from, and how to repeat it", table(["", ""], rows, (0, 1)),
        f"<pre>{escape(command)}</pre>" if command else "",
        folded("Settings", table(["setting", "value"], settings, (0, 1))),
    )  # fmt: skip
