"""One case: conceal, diagnose, measure the remaining error on the validation runs, and store the outcome so that an
interrupted command continues.

An outcome is stored under what it follows from: the code, the recording and the case. The reference model is not
part of the key: its last digits differ from run to run with the memory layout of arrays.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydantic import TypeAdapter, ValidationError

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Diagnosis, Weighed
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.names.decide import calibrated_weights
from armlab.diagnosis.torque.rows.data import Observed, rows_in
from armlab.identification.model_file import write_model
from armlab.identification.torque_model import TorqueModel
from armlab.proof.open.real_concealed.conceal import (
    ReferenceModel,
    SoughtEffect,
    add_disturbance,
    sought_of_disturbance,
    sought_of_pieces,
    withhold_pieces,
)
from armlab.proof.open.real_concealed.fixed_plan import Case
from armlab.proof.open.real_identification.looks import Looks
from armlab.proof.open.stored import code_digest, recording_digest
from armlab.recordings.reading.answer import SetupFinding
from armlab.recordings.recording import Recording

Span = tuple[float, float]
TimedTorque = tuple[Array, Array]  # stamps (samples,), s, and torque (samples, joints), N m (N)


@dataclass(frozen=True)
class ParameterSize:
    """A parameter with one number, and its 95 % interval."""

    name: str
    value: float
    interval: Span | None
    unit: str


@dataclass(frozen=True)
class RivalName:
    """A name that fits these data as well."""

    effect: str
    joints: tuple[int, ...]


@dataclass(frozen=True)
class PossibleName:
    """A name that a finding may have, or `unknown` for none, with its probability."""

    effect: str
    joints: tuple[int, ...]
    probability: float


@dataclass(frozen=True)
class ReportedFinding:
    """A finding. joints: as in `SoughtEffect`.

    probability: of its name, None where that was not weighed. members: of its class, empty where the name stands alone.
    """

    effect: str
    joints: tuple[int, ...]
    equation: str
    sizes: tuple[ParameterSize, ...]
    rivals: tuple[RivalName, ...]
    probability: float | None = None
    members: tuple[PossibleName, ...] = ()


@dataclass(frozen=True)
class ExaminedCase:
    """The outcome of one case: findings, and the RMS of each joint in N m (N), on the runs that took no part.

    given: of the error of the simulation that was handed over. found: of the error with the model found, in which
    no surrogate predicts what is unknown. hidden: of the torque that is concealed. torque: of the filtered torque as
    measured. recovered: share of the hidden torque that the findings sought explain; None in a control. All of these
    are empty where nothing was diagnosed, and in random cases, which are judged by their findings alone. refused: why
    nothing was diagnosed, empty where something was. weighed: the names of each finding, and of what was not probable
    enough for one.
    """

    case: str
    findings: tuple[ReportedFinding, ...]
    given: tuple[float, ...]
    found: tuple[float, ...]
    hidden: tuple[float, ...]
    torque: tuple[float, ...]
    recovered: float | None
    seconds: float
    refused: str = ""
    weighed: tuple[Weighed, ...] = ()


def summarise_claim(claim: Claim) -> ReportedFinding:
    """A claim without its arrays."""
    sizes = []
    for each in claim.parameters:
        if isinstance(each.value, tuple):
            continue
        span = each.interval
        pair = (float(span[0]), float(span[1])) if span and not isinstance(span[0], tuple) else None
        sizes.append(ParameterSize(each.name, float(each.value), pair, each.unit))
    rivals = tuple(RivalName(each.effect, joints_of(each.joint, each.joints)) for each in claim.rivals)
    members = tuple(
        PossibleName(each.effect, joints_of(each.joint, each.joints), each.probability) for each in claim.members
    )
    place = joints_of(claim.joint, claim.joints)
    return ReportedFinding(claim.effect, place, claim.equation, tuple(sizes), rivals, claim.probability, members)


def summarise_mistake(found: SetupFinding) -> ReportedFinding:
    """A mistake of reading: a delay that is corrected there is no claim of physics any more."""
    own = found.mistake
    place = own.joints if own.joint is None else (own.joint,)
    rivals = tuple(RivalName(each.effect, joints_of(each.joint, each.joints)) for each in found.rivals)
    own_name = PossibleName(own.effect, place, found.probability)
    others = (PossibleName(each.effect, joints_of(each.joint, each.joints), each.probability) for each in found.rivals)
    sizes = tuple(
        ParameterSize(name, value, None, unit) for name, value, unit in own.parameters if isinstance(value, float)
    )
    members = (own_name, *others) if rivals else ()
    return ReportedFinding(own.effect, place, found.text, sizes, rivals, found.probability, members)


def joints_of(joint: int | None, joints: tuple[int, ...]) -> tuple[int, ...]:
    """The joints of a name, as `SoughtEffect` has them."""
    if joint is None:
        return ()
    return joints if len(joints) > 1 else (joint,)


def examine_stored(
    reference: ReferenceModel, case: Case, stored: "OutcomeStore", looks: Looks, progress: Callable[[str], None]
) -> ExaminedCase:
    """The stored outcome of a case, or a new one, whose looks at validation runs are logged first."""
    outcome = stored.read(case, reference.recording)
    if outcome is None:
        for run in reference.recording.with_role("validate"):
            looks.note(reference.recording.arm.name, run.name, f"concealed: {case.name}")
        with TemporaryDirectory() as folder:
            outcome = examine_case(reference, case, Path(folder) / "reference.yaml", progress)
        stored.write(case, reference.recording, outcome)
    return outcome


def examine_case(reference: ReferenceModel, case: Case, path: Path, progress: Callable[[str], None]) -> ExaminedCase:
    """The outcome of a case. path: where the simulation that is handed over is written."""
    seen, added = conceal_case(reference, case, path)
    diagnosis, outcome = diagnose_concealed(seen, case.recording, progress)
    outcome = replace(outcome, case=case.name)
    if outcome.refused:
        return outcome
    assert diagnosis.observed is not None
    handed = withhold_pieces(reference.model, case.withheld)
    hidden = _concealed_torque(diagnosis.observed, reference.model, handed, added)
    return _measure_outcome(outcome, diagnosis, hidden, sought_in_case(reference, case))


def conceal_case(reference: ReferenceModel, case: Case, path: Path) -> tuple[Recording, dict[str, TimedTorque] | None]:
    """The recording that a diagnosis gets, and the torque that was added to each run by its name.

    path: where the simulation that is handed over is written. The torque is None where parts of it are withheld.
    """
    recording, added = reference.recording, None
    write_model(withhold_pieces(reference.model, case.withheld), path)
    runs = recording.runs
    if case.injected is not None:
        pairs = [add_disturbance(run, recording.arm, case.injected) for run in runs]
        runs, added = tuple(run for run, _ in pairs), {run.name: (run.time, torque) for run, torque in pairs}
    return replace(recording, runs=runs, simulation=path), added


def diagnose_concealed(seen: Recording, source: str, progress: Callable[[str], None]) -> tuple[Diagnosis, ExaminedCase]:
    """The diagnosis of a recording with something concealed, and what it says; nothing is measured yet.

    source: name of the public recording, about which the weights of names know nothing.
    """
    diagnosis = diagnose(seen, "nominal", settings=Settings(weights=calibrated_weights(source)), progress=progress)
    findings = tuple(summarise_mistake(each) for each in (diagnosis.setup.findings if diagnosis.setup else ()))
    findings += tuple(summarise_claim(each) for each in diagnosis.claims)
    refused = diagnosis.observed is None or diagnosis.final is None
    said = (diagnosis.reason, ()) if refused else ("", diagnosis.weighed)
    return diagnosis, ExaminedCase(seen.name, findings, (), (), (), (), None, diagnosis.seconds, *said)


def sought_in_case(reference: ReferenceModel, case: Case) -> tuple[SoughtEffect, ...]:
    """What should be named."""
    if case.injected is not None:
        return (sought_of_disturbance(case.injected, reference.recording.arm),)
    return sought_of_pieces(reference.model, case.withheld)


def _concealed_torque(
    observed: Observed, whole: TorqueModel, handed: TorqueModel, added: Mapping[str, TimedTorque] | None
) -> Array:
    """Torque of what is concealed at the kept rows, (rows, joints).

    added: of each run by its name; None where parts of the model are withheld. The diagnosis orders the runs in its own
    way, and may have corrected their stamps.
    """
    if added is None:
        parts = [whole.filtered_torque(each) - handed.filtered_torque(each) for each in observed.signals]
    else:
        parts = [np.asarray(each.filter(_read_at(*added[each.run.name], each.run.time))) for each in observed.signals]
    return np.concatenate(parts)


def _read_at(time: Array, torque: Array, wanted: Array) -> Array:
    """Torque (samples, joints) at other stamps."""
    return np.column_stack([np.interp(wanted, time, each) for each in torque.T])


def _measure_outcome(
    outcome: ExaminedCase, diagnosis: Diagnosis, hidden: Array, wanted: tuple[SoughtEffect, ...]
) -> ExaminedCase:
    """The outcome with its errors. hidden: torque of what is concealed at the kept rows, (rows, joints)."""
    assert diagnosis.observed is not None
    assert diagnosis.nominal is not None
    assert diagnosis.final is not None
    rows = rows_in(diagnosis.observed.of_role("validate"), diagnosis.observed.rows)
    predictions = [each.prediction for each in diagnosis.claims if is_sought_kind(each, wanted)]
    left = hidden[rows] - sum((each[rows] for each in predictions), np.zeros(1))
    power = float(np.sum(hidden[rows] ** 2))
    return replace(
        outcome,
        given=_rms(diagnosis.nominal[rows]),
        found=_rms(diagnosis.final[rows]),
        hidden=_rms(hidden[rows]),
        torque=_rms(diagnosis.observed.torque[rows]),
        recovered=1 - float(np.sum(left**2)) / power if power > 0 else None,
    )


def is_sought_kind(claim: Claim, wanted: tuple[SoughtEffect, ...]) -> bool:
    """Whether a claim has a name that is sought, or one of its kind, wherever it is."""
    return any(claim.effect in (*each.effects, *each.identical, *each.laws) for each in wanted)


def _rms(values: Array) -> tuple[float, ...]:
    return tuple(np.sqrt(np.mean(values**2, axis=0)).tolist())


OUTCOME_ADAPTER = TypeAdapter(ExaminedCase)


@dataclass(frozen=True)
class OutcomeStore:
    """A folder of outcomes. code: SHA-256 of everything that an outcome follows from but data."""

    folder: Path
    code: str

    def place(self, case: Case, recording: Recording) -> Path:
        """The file of an outcome."""
        key = hashlib.sha256(f"{self.code} {case!r} {recording_digest(recording)}".encode())
        return self.folder / f"{case.recording}-{key.hexdigest()[:20]}.json"

    def read(self, case: Case, recording: Recording) -> ExaminedCase | None:
        """The stored outcome; None where there is none or its file is damaged."""
        try:
            return OUTCOME_ADAPTER.validate_json(self.place(case, recording).read_bytes())
        except (FileNotFoundError, ValidationError):
            return None

    def write(self, case: Case, recording: Recording, outcome: ExaminedCase) -> None:
        """Keeps an outcome."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.place(case, recording).write_bytes(OUTCOME_ADAPTER.dump_json(outcome))


def open_outcomes(folder: Path) -> OutcomeStore:
    """Outcomes of the code as it stands."""
    own = Path(__file__).parent
    naming = own.parent / "naming"
    return OutcomeStore(folder, code_digest(*own.glob("*.py"), *naming.glob("*.py"), *naming.glob("*.json")))
