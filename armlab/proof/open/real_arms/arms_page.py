"""The page and the table of all arms: `arms.md` and `arms.csv`."""

from collections.abc import Iterator, Sequence
from io import StringIO

import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report.wording import format_number
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.springs import CABLE_STIFFNESS, GRAVITY_COMPENSATOR
from armlab.effects.words import place_in_words
from armlab.proof.open.real_arms.arms_figure import MODEL_STYLES, PICTURE_NAME
from armlab.proof.open.real_arms.checks import MIN_FRICTION_SHARE, Check, mass_agreement, mass_claims, named_mass
from armlab.proof.open.real_arms.checks import numbers_in_words as claim_numbers
from armlab.proof.open.real_arms.direct_reading import MIDDLE
from armlab.proof.open.real_arms.one_arm import AloneStudy, ArmStudy, ModelLine, ModelName
from armlab.proof.open.real_identification.identify_recording import describe_study
from armlab.proof.open.real_identification.looks import LOOKS_FILE
from armlab.report.torque.torque_verdict import verdict_sentences
from armlab.report.words import (
    effect_in_words,
    finding_in_words,
    joint_unit,
    rival_in_words,
    variables_in_words,
)
from problem.joint_words import joint_in_words

PAGE_NAME, TABLE_NAME = "arms.md", "arms.csv"
MODELS: tuple[ModelName, ...] = tuple(MODEL_STYLES)
COUNTERBALANCE_EFFECTS = (GRAVITY_COMPENSATOR.effect, CABLE_STIFFNESS.effect)  # names for the counterbalance of the arm
INTRODUCTION = f"""\
Percent: `||tau - tau_hat|| / ||tau||` over all joints on runs that validate, of the torque as recorded / of the
filtered torque. Torque and predictions of a line pass one low-pass, at the cut-off that the positions of the
identification runs suggest; each model smooths positions in its own way to predict every sample.

*Rigid as given*: the links that the source publishes. *Rigid refitted*, *plain friction* (Coulomb, viscous, offset,
rotor) and *identify*: fitted to the identification runs, with filters that `identify` chooses inside them; *identify*
has components and prior of that choice, too. *Named*: what `diagnose` names, refitted, and nothing else. *Diagnose*:
its whole model. *Best known*: percent of filtered torque that a published or hand-made model reaches, by the filter of
its source. *Share*: (rigid refitted - named) / (rigid refitted - diagnose). *Time*: seconds of `diagnose` over those
of `identify`, one after the other in one process. *Reading*: seconds in which `diagnose` asks how the recording is to
be read over those of what follows.

`identify` sees no run that validates. `diagnose` fits nothing to them, but tests its names there. The runs are not
untouched: bounds and forms of both procedures were chosen after earlier looks, each of which is in `{LOOKS_FILE}`.
What judges the diagnosis on data that nobody had seen is `results/proof/`.

![Errors of all models]({PICTURE_NAME})"""
CHECKS_TEXT = f"""\
*Friction*: a joint where the error of `identify` on the runs that validate grows by {100 * MIN_FRICTION_SHARE:.0f} % or
more when the friction of that joint is left out and the rest is fitted again. *Level of friction in the force itself*:
the median of |force| while the position is between {100 * MIDDLE[0]:.0f} and {100 * MIDDLE[1]:.0f} % of a stroke, for
each stroke by direction and run: median (lowest to highest) over strokes. A level agrees where its interval overlaps
the range from lowest to highest, over all runs, of its direction."""


def lines_csv(studies: Sequence[ArmStudy]) -> str:
    """The table as text: errors in percent, times in s."""
    frame = pd.DataFrame([_csv_row(line) for study in studies for line in study.lines])
    out = StringIO()
    frame.to_csv(out, index=False, float_format="%.4g", lineterminator="\n")
    return out.getvalue()


def _csv_row(line: ModelLine) -> dict[str, object]:
    row: dict[str, object] = {"arm": line.arm, "baseline": line.baseline, "run": line.run, "cutoff_hz": line.cutoff_hz}
    for name in MODELS:
        error = line.errors.get(name)
        row[f"{name}_recorded"] = None if error is None else error.recorded
        row[f"{name}_filtered"] = None if error is None else error.filtered
    return row | {
        "best_known": line.best_known,
        "named_share_recorded": line.named_share("recorded"),
        "named_share_filtered": line.named_share("filtered"),
        "identify_seconds": line.identify_seconds,
        "diagnose_seconds": line.diagnose_seconds,
        "time_ratio": line.time_ratio,
        "reading_ratio": line.reading_ratio,
        "looks": line.looks,
    }


def studies_markdown(studies: Sequence[ArmStudy], checks: Sequence[Check]) -> str:
    """The whole page."""
    parts = [INTRODUCTION, lines_table([line for study in studies for line in study.lines])]
    for study in studies:
        parts += _study_parts(study)
    parts += ["## What users ask", CHECKS_TEXT, checks_table(checks)]
    return markdown_page("Real arms", *parts)


def lines_table(lines: Sequence[ModelLine]) -> str:
    """A row for each arm, baseline and run that validates."""
    heads = [
        MODEL_STYLES[name][2].removeprefix("diagnose, ").replace("named physics alone", "named") for name in MODELS
    ]
    headings = ["arm", "baseline", "run", "cut-off Hz", *heads, "best known", "share", "time", "reading"]
    return markdown_table(headings, [_table_row(line) for line in lines])


def _table_row(line: ModelLine) -> list[str]:
    share = line.named_share("filtered")
    return [
        line.arm,
        line.baseline,
        line.run,
        f"{line.cutoff_hz:.1f}",
        *(_errors_text(line, name) for name in MODELS),
        "–" if line.best_known is None else f"{line.best_known:.1f}",
        "–" if share is None else f"{share:.2f}",
        f"{line.time_ratio:.2f}",
        f"{line.reading_ratio:.2f}",
    ]


def _errors_text(line: ModelLine, name: ModelName) -> str:
    error = line.errors.get(name)
    return "–" if error is None else f"{error.recorded:.1f} / {error.filtered:.1f}"


def _study_parts(study: ArmStudy) -> Iterator[str]:
    yield f"## {study.name}"
    yield f"`identify` chose: {describe_study(study.identified).partition(': ')[2]}."
    counts = {line.run: line.looks for line in study.lines}
    yield "Looks until now: " + ", ".join(f"{run} {count}" for run, count in counts.items()) + "."
    for baseline, diagnosis in study.diagnoses.items():
        yield f"### {study.name}, {baseline}"
        yield " ".join(verdict_sentences(diagnosis))
        if diagnosis.claims:
            yield claims_table(diagnosis)
        for each in diagnosis.unexplained:
            arm, share = diagnosis.simulation.arm, f"{100 * each.share:.0f} %"
            depends = variables_in_words(arm, each.depends_on)
            yield f"Unexplained at {joint_in_words(arm, each.joint)}: {share} of the held-out variance, by {depends}."
    if study.alone:
        yield from _alone_parts(study)


def claims_table(diagnosis: Diagnosis) -> str:
    """A row a finding; held-out error of the joint that it concerns most."""
    headings = ["finding", "where", "law", "numbers (95 % interval)", "held-out error without, with", "fits as well"]
    return markdown_table(headings, [_claim_row(diagnosis, each) for each in diagnosis.claims])


def _claim_row(diagnosis: Diagnosis, claim: Claim) -> list[str]:
    evidence, arm = claim.evidence, diagnosis.simulation.arm
    unit = joint_unit(arm, evidence.joint)
    errors = f"{format_number(evidence.rms_before)}, {format_number(evidence.rms_after)} {unit}"
    return [
        effect_in_words(claim.effect),
        place_in_words(arm, claim.effect, claim.joint, claim.joints),
        f"`{claim.equation}`",
        claim_numbers(claim) or "–",
        f"{errors} ({joint_in_words(arm, evidence.joint + 1)})",
        "; ".join(rival_in_words(arm, each) for each in claim.rivals) or "–",
    ]


def _alone_parts(study: ArmStudy) -> Iterator[str]:
    """The diagnosis of each run alone, which should all find the same load, judged on the other runs."""
    yield f"### {study.name}, each run alone"
    yield markdown_table(
        ["run", "what it says of the links", "counterbalance", "errors on other runs: named, diagnose"],
        [_alone_row(each) for each in study.alone],
    )
    masses = [found.mass for each in study.alone for found in [named_mass(each.diagnosis)] if found is not None]
    yield mass_agreement(masses)[0]


def _alone_row(alone: AloneStudy) -> list[str]:
    claims, arm = mass_claims(alone.diagnosis), alone.diagnosis.simulation.arm
    springs = [each for each in alone.diagnosis.claims if each.effect in COUNTERBALANCE_EFFECTS]
    errors = [
        f"{run} " + ", ".join(f"{each.recorded:.1f} / {each.filtered:.1f}" for each in found.values())
        for run, found in alone.errors.items()
    ]
    return [
        alone.run,
        "; ".join(f"{finding_in_words(arm, each)}: {claim_numbers(each)}" for each in claims) or "nothing",
        "; ".join(finding_in_words(arm, each) for each in springs) or "–",
        "; ".join(errors) or "–",
    ]


ANSWER_WORDS = {True: "yes", False: "**no**", None: "open"}


def checks_table(checks: Sequence[Check]) -> str:
    """A row a question, and how many have the answer yes."""
    rows = [(each.arm, each.baseline, each.asked, ANSWER_WORDS[each.holds], each.found) for each in checks]
    table = markdown_table(["arm", "baseline", "question", "answer", "numbers"], rows)
    return f"{sum(each.holds is True for each in checks)} of {len(checks)} have the answer yes.\n\n{table}"
