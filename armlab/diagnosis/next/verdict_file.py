"""A verdict as read from a file with its model, and the groups of rival names that it leaves open or that a user
names.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.formats import FindingEntry, Value, read_verdict_file
from armlab.diagnosis.next.question import Name
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.identification.model_file import read_model_file
from problem.arm import Arm
from problem.base_parameters import base_parameters


@dataclass(frozen=True, eq=False)
class VerdictFinding:
    """One finding. parameters: by name, SI units."""

    name: Name
    joints: tuple[int, ...]
    parameters: dict[str, Value]
    rivals: tuple[Name, ...]


@dataclass(frozen=True, eq=False)
class VerdictWithModel:
    """A verdict with the model beside it. noise: (joints,), N m, of the filtered torque.

    cutoff_hz: of the filter of the diagnosis. links: inertial parameters that were found, (10 * joints,).
    base_values: base parameters that were found, (base,). Each is None where no model says it.
    """

    path: Path
    findings: tuple[VerdictFinding, ...]
    noise: Array
    cutoff_hz: float | None = None
    links: Array | None = None
    base_values: Array | None = None

    def inertial(self, arm: Arm) -> Array:
        """Inertial parameters (10 * joints,) that were found, else those of the arm; InputError where none are."""
        if self.links is not None and len(self.links) == 10 * len(arm):
            return self.links
        base = base_parameters(arm)
        if self.base_values is not None and len(self.base_values) == len(base):
            out = np.zeros(10 * len(arm))
            out[base.columns] = self.base_values
            return out
        if arm.links is None:
            raise InputError(f"{self.path}: neither model.yaml beside it nor the robot has inertial parameters")
        return arm.parameters


def read_verdict(path: Path) -> VerdictWithModel:
    """The verdict in a file or a folder, with the model.yaml beside it.

    Raises InputError, in one line, for a file that is no verdict or no model.
    """
    file = path / "verdict.json" if path.is_dir() else path
    verdict = read_verdict_file(file)
    findings = tuple(_read_finding(each) for each in verdict.findings if each.kind != "setup")
    noise = np.array([each.noise_floor for each in verdict.fit], dtype=np.float64)
    beside = file.with_name("model.yaml")
    if not beside.is_file():
        return VerdictWithModel(file, findings, noise)
    model = read_model_file(beside)
    if model.controller is not None:
        raise InputError(f"{file} is of a recording of motion only: `armlab next` needs the verdict of one with torque")
    cutoff_hz = model.provenance.get("cutoff_hz")
    if not isinstance(cutoff_hz, float | int | None):
        raise InputError(f"provenance.cutoff_hz in {beside} should be a number, not {cutoff_hz!r}")
    tens = [[each.mass, *each.first_moment, *each.inertia] for each in model.links or ()]
    links = np.concatenate(tens) if tens else None
    base_values = None if model.base_parameters is None else np.array(model.base_parameters.values)
    return VerdictWithModel(file, findings, noise, cutoff_hz, links, base_values)


def _read_finding(entry: FindingEntry) -> VerdictFinding:
    parameters = {name: each.value for name, each in entry.parameters.items()}
    rivals = tuple(Name(each.effect, each.joint) for each in entry.rivals)
    return VerdictFinding(Name(entry.effect, entry.joint), entry.joints, parameters, rivals)


RivalGroup = tuple[Name, ...]


def select_rival_groups(verdict: VerdictWithModel, named: str | None) -> tuple[RivalGroup, ...]:
    """Groups of names of which one is right, the finding first; InputError where there is nothing to decide.

    named: like `viscous_friction,time_delay` or `viscous_friction@2,coulomb_friction@2`.
    """
    if named:
        return (_parse_rivals(verdict, named),)
    groups = [tuple(dict.fromkeys((finding.name, *finding.rivals))) for finding in verdict.findings if finding.rivals]
    groups = [group for group in groups if len(group) > 1 and group[0].effect != UNKNOWN.id]
    unique = {frozenset(group): group for group in reversed(groups)}
    if not unique:
        raise InputError(
            f"{verdict.path}: no finding has rivals, so nothing is to be decided; --rivals a,b names what to tell apart"
        )
    return tuple(reversed(unique.values()))


def _parse_rivals(verdict: VerdictWithModel, named: str) -> RivalGroup:
    parts = [part.strip().partition("@") for part in named.split(",")]
    if len(parts) < 2:
        raise InputError(f"--rivals {named}: should be two names or more, like viscous_friction@2,time_delay")
    place = next((each.name.joint for each in verdict.findings if each.name.effect in {p[0] for p in parts}), None)
    return tuple(dict.fromkeys(_parse_rival_name(effect, joint, place, verdict) for effect, _, joint in parts))


def _parse_rival_name(effect: str, joint: str, place: int | None, verdict: VerdictWithModel) -> Name:
    try:
        facts = effect_named(effect)
    except ValueError as error:
        raise InputError(f"--rivals: {error}") from None
    if facts == UNKNOWN:
        raise InputError(f"--rivals: '{UNKNOWN.id}' has no columns to design a motion for")
    if facts.where == "robot":
        return Name(effect, None)
    if joint:
        if not joint.isdigit() or not 1 <= int(joint) <= max(len(verdict.noise), 1):
            raise InputError(f"--rivals {effect}@{joint}: the joint should be a number from 1 to {len(verdict.noise)}")
        return Name(effect, int(joint))
    own: Sequence[int | None] = [each.name.joint for each in verdict.findings if each.name.effect == effect]
    chosen = own[0] if own else place
    if chosen is None:
        raise InputError(f"--rivals: at which joint? write {effect}@2 for joint 2")
    return Name(effect, chosen)
