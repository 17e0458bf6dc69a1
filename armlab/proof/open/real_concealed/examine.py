"""One case: what a diagnosis gets of it, what it says, and what should be named."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter

from armlab.diagnosis.result import Claim, Weighed
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.names.decide import calibrated_weights
from armlab.identification.model_file import write_model
from armlab.proof.open.real_concealed.conceal import (
    ReferenceModel,
    SoughtEffect,
    add_disturbance,
    sought_of_disturbance,
    sought_of_pieces,
    withhold_pieces,
)
from armlab.proof.open.real_concealed.concealed_case import Case
from armlab.recordings.reading.answer import SetupFinding
from armlab.recordings.recording import Recording
from problem.robot_file import built_in_arms

Span = tuple[float, float]


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
    """What a diagnosis says of one case.

    refused: why nothing was diagnosed, empty where something was. weighed: the names of each finding, and of what was
    not probable enough for one.
    """

    case: str
    findings: tuple[ReportedFinding, ...]
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


def conceal_case(reference: ReferenceModel, case: Case, path: Path) -> Recording:
    """The recording that a diagnosis gets. path: where the simulation that is handed over is written, beside the robot
    file of the recording where it has one.
    """
    recording, what = reference.recording, case.injected
    robot = recording.robot if recording.robot in built_in_arms() else str(path.parent / recording.robot)
    write_model(replace(withhold_pieces(reference.model, case.withheld), robot=robot), path)
    runs = recording.runs
    if what is not None:
        runs = tuple(add_disturbance(run, recording.arm, what)[0] for run in runs)
    return replace(recording, runs=runs, simulation=path)


def diagnose_concealed(seen: Recording, source: str, progress: Callable[[str], None]) -> ExaminedCase:
    """What the diagnosis of a recording with something concealed says.

    source: name of the public recording, about which the weights of names know nothing.
    """
    diagnosis = diagnose(seen, "nominal", settings=Settings(weights=calibrated_weights(source)), progress=progress)
    findings = tuple(summarise_mistake(each) for each in (diagnosis.setup.findings if diagnosis.setup else ()))
    findings += tuple(summarise_claim(each) for each in diagnosis.claims)
    refused = diagnosis.observed is None or diagnosis.final is None
    said = (diagnosis.reason, ()) if refused else ("", diagnosis.weighed)
    return ExaminedCase(seen.name, findings, diagnosis.seconds, *said)


def sought_in_case(reference: ReferenceModel, case: Case) -> tuple[SoughtEffect, ...]:
    """What should be named."""
    if case.injected is not None:
        return (sought_of_disturbance(case.injected, reference.recording.arm),)
    return sought_of_pieces(reference.model, case.withheld)


OUTCOME_ADAPTER = TypeAdapter(ExaminedCase)
