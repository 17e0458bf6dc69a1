"""One case: conceal, diagnose, measure the remaining error on the validation runs, and store the outcome so that an
interrupted command continues.

An outcome is stored under what it follows from: the code, the recording and the case. The reference model is not
part of the key: its last digits differ from run to run with the memory layout of arrays.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.data import rows_in
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.real_concealed.conceal import (
    Reference,
    SoughtEffect,
    add_disturbance,
    sought_of_disturbance,
    sought_of_pieces,
    withhold_pieces,
)
from armlab.diagnosis.real_concealed.plan import Case
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.stored import code_digest, recording_digest
from armlab.effects.contract import UNKNOWN
from armlab.identification.model_file import write_model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import Recording

Span = tuple[float, float]


@dataclass(frozen=True)
class ParameterSize:
    """A parameter with one number, and its 95 % interval."""

    name: str
    value: float
    interval: Span | None
    unit: str


@dataclass(frozen=True)
class Rival:
    """A name that fits these data as well."""

    effect: str
    joints: tuple[int, ...]


@dataclass(frozen=True)
class ReportedFinding:
    """A finding. joints: as in `SoughtEffect`."""

    effect: str
    joints: tuple[int, ...]
    equation: str
    sizes: tuple[ParameterSize, ...]
    rivals: tuple[Rival, ...]


@dataclass(frozen=True)
class Outcome:
    """The outcome of one case: findings, and the RMS of each joint in N m (N), on the runs that took no part.

    given: of the error of the simulation that was handed over. named: of the error with every named finding. found: of
    the error with the surrogates of unknown structure, too. hidden: of the torque that is concealed. torque: of the
    filtered torque as measured. recovered: share of the hidden torque that the findings sought explain; None in a
    control.
    """

    case: str
    findings: tuple[ReportedFinding, ...]
    given: tuple[float, ...]
    named: tuple[float, ...]
    found: tuple[float, ...]
    hidden: tuple[float, ...]
    torque: tuple[float, ...]
    recovered: float | None
    seconds: float


def summarise_claim(claim: Claim) -> ReportedFinding:
    """A claim without its arrays."""
    sizes = []
    for each in claim.parameters:
        if isinstance(each.value, tuple):
            continue
        span = each.interval
        pair = (float(span[0]), float(span[1])) if span and not isinstance(span[0], tuple) else None
        sizes.append(ParameterSize(each.name, float(each.value), pair, each.unit))
    rivals = tuple(Rival(each.effect, _joints_of(each.joint, each.joints)) for each in claim.rivals)
    return ReportedFinding(claim.effect, _joints_of(claim.joint, claim.joints), claim.equation, tuple(sizes), rivals)


def _joints_of(joint: int | None, joints: tuple[int, ...]) -> tuple[int, ...]:
    if joint is None:
        return ()
    return joints if len(joints) > 1 else (joint,)


def examine_case(reference: Reference, case: Case, path: Path, progress: Callable[[str], None]) -> Outcome:
    """The outcome of a case. path: where the simulation that is handed over is written."""
    recording, handed = reference.recording, withhold_pieces(reference.model, case.withheld)
    write_model(handed, path)
    added: list[Array] | None = None
    runs = recording.runs
    if case.injected is not None:
        pairs = [add_disturbance(run, recording.arm, case.injected) for run in runs]
        runs, added = tuple(run for run, _ in pairs), [torque for _, torque in pairs]
    diagnosis = diagnose(replace(recording, runs=runs, simulation=path), "nominal", progress=progress)
    return _measure_outcome(
        case, diagnosis, _concealed_torque(diagnosis, reference.model, handed, added), sought_in_case(reference, case)
    )


def sought_in_case(reference: Reference, case: Case) -> tuple[SoughtEffect, ...]:
    """What should be named."""
    if case.injected is not None:
        return (sought_of_disturbance(case.injected, len(reference.recording.arm)),)
    return sought_of_pieces(reference.model, case.withheld)


def _concealed_torque(
    diagnosis: Diagnosis, whole: TorqueModel, handed: TorqueModel, added: Sequence[Array] | None
) -> Array:
    """Torque of what is concealed at the kept rows, (rows, joints)."""
    if diagnosis.observed is None:
        raise InputError(f"{diagnosis.recording.name}: {diagnosis.summary}")
    signals = diagnosis.observed.signals
    if added is None:
        parts = [whole.filtered_torque(each) - handed.filtered_torque(each) for each in signals]
    else:
        parts = [np.asarray(each.filter(torque)) for each, torque in zip(signals, added, strict=True)]
    return np.concatenate(parts)


def _measure_outcome(case: Case, diagnosis: Diagnosis, hidden: Array, wanted: tuple[SoughtEffect, ...]) -> Outcome:
    assert diagnosis.observed is not None
    assert diagnosis.nominal is not None
    assert diagnosis.final is not None
    rows = rows_in(diagnosis.observed.of_role("validate"), diagnosis.observed.rows)
    named = diagnosis.final + sum(
        (each.prediction for each in diagnosis.claims if each.effect == UNKNOWN.id), np.zeros(1)
    )
    predictions = [each.prediction for each in diagnosis.claims if is_sought_kind(each, wanted)]
    left = hidden[rows] - sum((each[rows] for each in predictions), np.zeros(1))
    power = float(np.sum(hidden[rows] ** 2))
    return Outcome(
        case=case.name,
        findings=tuple(summarise_claim(each) for each in diagnosis.claims),
        given=_rms(diagnosis.nominal[rows]),
        named=_rms(named[rows]),
        found=_rms(diagnosis.final[rows]),
        hidden=_rms(hidden[rows]),
        torque=_rms(diagnosis.observed.torque[rows]),
        recovered=1 - float(np.sum(left**2)) / power if power > 0 else None,
        seconds=diagnosis.seconds,
    )


def is_sought_kind(claim: Claim, wanted: tuple[SoughtEffect, ...]) -> bool:
    """Whether a claim has a name that is sought, or one of its kind, wherever it is."""
    return any(claim.effect in (*each.effects, *each.identical, *each.laws) for each in wanted)


def _rms(values: Array) -> tuple[float, ...]:
    return tuple(np.sqrt(np.mean(values**2, axis=0)).tolist())


OUTCOME_ADAPTER = TypeAdapter(Outcome)


@dataclass(frozen=True)
class OutcomeStore:
    """A folder of outcomes. code: SHA-256 of everything that an outcome follows from but data."""

    folder: Path
    code: str

    def place(self, case: Case, recording: Recording) -> Path:
        """The file of an outcome."""
        key = hashlib.sha256(f"{self.code} {case!r} {recording_digest(recording)}".encode())
        return self.folder / f"{case.recording}-{key.hexdigest()[:20]}.json"

    def read(self, case: Case, recording: Recording) -> Outcome | None:
        """The stored outcome; None where there is none or its file is damaged."""
        try:
            return OUTCOME_ADAPTER.validate_json(self.place(case, recording).read_bytes())
        except (FileNotFoundError, ValidationError):
            return None

    def write(self, case: Case, recording: Recording, outcome: Outcome) -> None:
        """Keeps an outcome."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.place(case, recording).write_bytes(OUTCOME_ADAPTER.dump_json(outcome))


def open_outcomes(folder: Path) -> OutcomeStore:
    """Outcomes of the code as it stands."""
    return OutcomeStore(folder, code_digest(*Path(__file__).parent.glob("*.py")))
