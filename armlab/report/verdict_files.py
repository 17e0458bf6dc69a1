"""The files of a verdict: verdict.json, model.yaml and the predicted torque, all written or none."""

import math
import os
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.diagnosis.formats import (
    VERDICT_SCHEMA,
    ClassMember,
    DoubtEntry,
    FindingEntry,
    FitEntry,
    FrictionEntry,
    LeftEntry,
    LocatedEntry,
    ParameterEntry,
    RecordedEntry,
    RivalEntry,
    StoryEntry,
    SurvivalEntry,
    UnexplainedEntry,
    VerdictFile,
    WhereEntry,
    kind_of_effect,
)
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Located, Unexplained
from armlab.diagnosis.torque.names.findings import StatedCause, finding_shares
from armlab.diagnosis.torque.predict.found_model import model_found
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue
from armlab.identification.model_file import model_text
from armlab.recordings.differentiate import Signals
from armlab.recordings.reading.answer import Doubt, SetupFinding
from armlab.recordings.reading.corrected import CORRECTED_FOLDER, corrected_texts
from armlab.recordings.recording import Recording
from armlab.report.account.account import account_of, finding_errors
from armlab.report.account.summary import summary_of

MODEL = "model.yaml"


def verdict_texts(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """verdict.json and, where something was fitted, model.yaml, as they are to stand in a folder.

    Beside them `corrected/`, the recording as it should be read, where it is read wrongly.
    """
    texts = {"verdict.json": make_verdict(diagnosis).to_json()}
    setup = diagnosis.setup
    if setup is not None and setup.findings and setup.reading is not None:
        own = corrected_texts(diagnosis.recording.folder, setup.reading, folder / CORRECTED_FOLDER)
        texts |= {f"{CORRECTED_FOLDER}/{name}": text for name, text in own.items()}
    if diagnosis.inertial is not None:
        model = model_found(diagnosis)
        robot = f"{CORRECTED_FOLDER}/robot.yaml"
        texts[MODEL] = model_text(replace(model, robot=str(folder / robot)) if robot in texts else model, folder)
    return texts


def write_verdict(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Writes verdict.json and, where something was fitted, model.yaml; InputError where that cannot be done."""
    return write_texts(verdict_texts(diagnosis, folder), folder)


def check_output_folder(folder: Path, recording: Recording) -> None:
    """Makes sure, before any work, that the files of a verdict may stand there; InputError where they may not."""
    check_can_be_written(folder)
    if recording.simulation is not None and recording.simulation.resolve() == (folder / MODEL).resolve():
        raise InputError(f"--out {folder} holds {MODEL}, the simulation of {recording.name}: give another folder")


def check_can_be_written(folder: Path) -> None:
    """Makes sure that a folder is one or can be made; InputError where not."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder} is a file: give a folder")
    nearest = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        raise InputError(f"cannot write into {nearest}: give --out a folder that can be written")


def make_verdict(diagnosis: Diagnosis) -> VerdictFile:
    """The content of `verdict.json`."""
    account, shares = account_of(diagnosis), finding_shares(diagnosis.parts, len(diagnosis.claims))
    setup = tuple(_setup_entry(each) for each in (diagnosis.setup.findings if diagnosis.setup else ()))
    return VerdictFile(
        schema=VERDICT_SCHEMA,
        status=diagnosis.status,
        summary=summary_of(diagnosis),
        story=tuple(_story_entry(each, len(setup)) for each in account.groups),
        located=tuple(_located_entry(each) for each in diagnosis.located),
        findings=(*setup, *(_finding_entry(*each) for each in zip(diagnosis.claims, shares, strict=True))),
        unexplained=tuple(_unexplained_entry(each) for each in diagnosis.unexplained),
        friction=tuple(
            FrictionEntry(joint=each.joint, speeds=each.speeds, torque=each.torque, ci95=each.interval)
            for each in account.friction
        ),
        left=tuple(LeftEntry(**asdict(each)) for each in account.left),
        doubts=tuple(_doubt_entry(each) for each in (diagnosis.setup.doubts if diagnosis.setup else ())),
        fit=tuple(_fit_entry(each) for each in diagnosis.fit),
    )


def _doubt_entry(each: Doubt) -> DoubtEntry:
    return DoubtEntry(effect=each.effect, joints=each.joints, measurement=each.measurement)


def _located_entry(each: Located) -> LocatedEntry:
    where = WhereEntry(variable=each.variable, regime=each.regime, runs=each.runs, time=each.time)
    return LocatedEntry(joint=each.joint, share=each.share, where=where)


def _story_entry(each: StatedCause, setup: int) -> StoryEntry:
    places = tuple(setup + place for place in each.findings)
    return StoryEntry(cause=each.cause, joints=each.joints, share_of_gap=each.share, findings=places)


def _setup_entry(each: SetupFinding) -> FindingEntry:
    own = each.mistake
    members = [
        ClassMember(effect=own.effect, joint=own.joint, probability=each.probability),
        *(ClassMember(effect=rival.effect, joint=rival.joint, probability=rival.probability) for rival in each.rivals),
    ]
    entry = FindingEntry(
        effect=own.effect,
        kind="setup",
        joint=own.joint,
        joints=own.joints or (() if own.joint is None else (own.joint,)),
        form=own.form or None,
        parameters={name: ParameterEntry(value=value, ci95=None, unit=unit) for name, value, unit in own.parameters},
        equation=each.text,
        heldout_rms_before=each.rms_before,
        heldout_rms_after=each.rms_after,
        probability=each.probability,
        rivals=tuple(RivalEntry(effect=rival.effect, joint=rival.joint) for rival in each.rivals),
        next_experiment=each.next_experiment,
    )
    return entry.model_copy(update={"class_": tuple(members)}) if each.rivals else entry


def _finding_entry(claim: Claim, share: float) -> FindingEntry:
    effect = effect_named(claim.effect) if claim.candidate is None else claim.candidate.facts
    before, after = finding_errors(claim)
    entry = FindingEntry(
        effect=claim.effect,
        kind=kind_of_effect(effect),
        joint=claim.joint,
        joints=claim.joints,
        form=None if claim.candidate is None else claim.candidate.form or None,
        parameters={each.name: _finding_parameter(each, claim) for each in claim.parameters},
        equation=claim.equation,
        heldout_rms_before=before,
        heldout_rms_after=after,
        p_value=claim.evidence.corrected,
        share_of_gap=share,
        minor=claim.minor,
        probability=claim.probability,
        rivals=tuple(RivalEntry(effect=each.effect, joint=each.joint) for each in claim.rivals),
        next_experiment=claim.next_experiment,
    )
    members = tuple(
        ClassMember(effect=each.effect, joint=each.joint, probability=each.probability) for each in claim.members
    )
    more: dict[str, Any] = {"class_": members} if members else {}
    if claim.survival is not None:
        more["survival"] = SurvivalEntry(**asdict(claim.survival))
    return entry.model_copy(update=more)


def _finding_parameter(each: ParameterValue, claim: Claim) -> ParameterEntry:
    value = each.value if isinstance(each.value, tuple) else _finite(each.value)
    entry = ParameterEntry(value=value, ci95=each.interval, unit=each.unit)
    known = claim.simulated.get(each.name)
    return entry if known is None else entry.model_copy(update={"simulation": known})


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.copysign(1e300, value)  # JSON has no infinity


def _unexplained_entry(each: Unexplained) -> UnexplainedEntry:
    return UnexplainedEntry(joint=each.joint, share=each.share, depends_on=each.depends_on)


def _fit_entry(each: JointFit) -> FitEntry:
    return FitEntry(
        joint=each.joint,
        heldout_rms_before=each.filtered.before,
        heldout_rms_after=each.filtered.after,
        heldout_rms_named=each.filtered.named,
        heldout_rms_identify=each.filtered.identified,
        heldout_rms_plain=each.plain,
        noise_floor=each.noise_floor,
        gap_closed=each.gap_closed,
        recorded=RecordedEntry(
            heldout_rms_before=each.recorded.before,
            heldout_rms_after=each.recorded.after,
            heldout_rms_named=each.recorded.named,
            heldout_rms_identify=each.recorded.identified,
        ),
    )


PREDICTED_FOLDER = "predicted"


def predicted_texts(diagnosis: Diagnosis) -> dict[str, str]:
    """`predicted/RUN.csv` of each validation run: t in s, tau1, ... in N m (N).

    The torque passed the filter of the diagnosis, and stands at the run's own even stamps, ends left out.
    """
    observed, final = diagnosis.observed, diagnosis.final
    if observed is None or final is None:
        return {}
    rows = zip(observed.signals, _split_by_run(final, observed.signals), strict=True)
    return {
        f"{PREDICTED_FOLDER}/{Path(each.run.file).stem}.csv": _csv_text(each, each.torque - left)
        for each, left in rows
        if each.run.role == "validate" and not each.run.part
    }


def _split_by_run(stacked: Array, signals: tuple[Signals, ...]) -> Iterator[Array]:
    ends = np.cumsum([len(each.torque) for each in signals])
    return iter(np.split(stacked, ends[:-1]))


def _csv_text(signals: Signals, torque: Array) -> str:
    known, time = signals.time, signals.run.time
    inside = time[(time >= known[0]) & (time <= known[-1])]
    values = make_interp_spline(known, torque, k=3)(inside)
    head = ",".join(["t", *(f"tau{joint}" for joint in range(1, values.shape[1] + 1))])
    return "\n".join([head, *(",".join(f"{x:.6g}" for x in row) for row in np.column_stack([inside, values])), ""])
