"""One case: conceal, hand over, diagnose, and measure what is left on the runs that took no part."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from armlab.diagnosis.data import rows_in
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.real_concealed.inject import disturbed, sought_in
from diagnosis.real_concealed.outcome import Outcome, said_of
from diagnosis.real_concealed.plan import Case
from diagnosis.real_concealed.reference import Reference
from diagnosis.real_concealed.withhold import Sought, sought_of, without
from identification.model_file import write_model
from identification.torque_model import TorqueModel
from problem.errors import InputError
from recordings.run import Array

UNKNOWN = "unknown"


def examine(reference: Reference, case: Case, path: Path, progress: Callable[[str], None]) -> Outcome:
    """The outcome of a case. path: where the simulation that is handed over is written."""
    recording, handed = reference.recording, without(reference.model, case.withheld)
    write_model(handed, path)
    added: list[Array] | None = None
    runs = recording.runs
    if case.injected is not None:
        pairs = [disturbed(run, recording.arm, case.injected) for run in runs]
        runs, added = tuple(run for run, _ in pairs), [torque for _, torque in pairs]
    found = diagnose(replace(recording, runs=runs, simulation=path), "nominal", progress=progress)
    return _measured(case, found, _hidden(found, reference.model, handed, added), sought(reference, case))


def sought(reference: Reference, case: Case) -> tuple[Sought, ...]:
    """What should be named."""
    if case.injected is not None:
        return (sought_in(case.injected, len(reference.recording.arm)),)
    return sought_of(reference.model, case.withheld)


def _hidden(found: Diagnosis, whole: TorqueModel, handed: TorqueModel, added: Sequence[Array] | None) -> Array:
    """Torque of what is concealed at the kept rows, (rows, joints)."""
    if found.observed is None:
        raise InputError(f"{found.recording.name}: {found.summary}")
    signals = found.observed.signals
    if added is None:
        parts = [whole.filtered_torque(each) - handed.filtered_torque(each) for each in signals]
    else:
        parts = [np.asarray(each.filter(torque)) for each, torque in zip(signals, added, strict=True)]
    return np.concatenate(parts)


def _measured(case: Case, found: Diagnosis, hidden: Array, wanted: tuple[Sought, ...]) -> Outcome:
    assert found.observed is not None
    assert found.nominal is not None
    assert found.final is not None
    rows = rows_in(found.observed.of_role("validate"), found.observed.rows)
    named = found.final + sum((each.prediction for each in found.claims if each.effect == UNKNOWN), np.zeros(1))
    answers = [each.prediction for each in found.claims if answers_one(each, wanted)]
    left = hidden[rows] - sum((each[rows] for each in answers), np.zeros(1))
    power = float(np.sum(hidden[rows] ** 2))
    given, after, final, size, torque = (
        _rms(each[rows]) for each in (found.nominal, named, found.final, hidden, found.observed.torque)
    )
    recovered = 1 - float(np.sum(left**2)) / power if power > 0 else None
    said = tuple(said_of(each) for each in found.claims)
    return Outcome(case.name, said, given, after, final, size, torque, recovered, found.seconds)


def answers_one(claim: Claim, wanted: tuple[Sought, ...]) -> bool:
    """Whether a claim has a name that is sought, or one of its kind, wherever it is."""
    return any(claim.effect in (*each.effects, *each.identical, *each.laws) for each in wanted)


def _rms(values: Array) -> tuple[float, ...]:
    return tuple(np.sqrt(np.mean(values**2, axis=0)).tolist())
