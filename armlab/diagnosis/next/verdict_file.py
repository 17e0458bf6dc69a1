"""A verdict as read from a file with its model, and the groups of rival names that it leaves open or that a user
names.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import read_yaml
from armlab.diagnosis.next.question import Name
from armlab.diagnosis.verdict_files import VERDICT_SCHEMA
from armlab.effects.library import EFFECT_IDS, effect_named
from problem.arm import Arm
from problem.base_parameters import base_parameters


@dataclass(frozen=True, eq=False)
class Finding:
    """One finding. parameters: by name, SI units."""

    name: Name
    joints: tuple[int, ...]
    parameters: dict[str, Any]
    rivals: tuple[Name, ...]


@dataclass(frozen=True, eq=False)
class VerdictFile:
    """noise: (joints,), N m, of the filtered torque. cutoff_hz: of the filter, None where the model does not say."""

    path: Path
    findings: tuple[Finding, ...]
    noise: Array
    model: dict[str, Any] | None

    @property
    def cutoff_hz(self) -> float | None:
        """Of the filter, None where the model does not say."""
        found = (self.model or {}).get("provenance", {}).get("cutoff_hz")
        return None if found is None else float(found)

    def inertial(self, arm: Arm) -> Array:
        """Inertial parameters (10 * joints,) that were found, else those of the arm; InputError where none are."""
        links = (self.model or {}).get("links")
        if links and len(links) == len(arm):
            return np.concatenate([[each["mass"], *each["first_moment"], *each["inertia"]] for each in links])
        base = base_parameters(arm)
        values = (self.model or {}).get("base_parameters", {}).get("values")
        if values and len(values) == len(base):
            out = np.zeros(10 * len(arm))
            out[base.columns] = values
            return out
        if arm.links is None:
            raise InputError(f"{self.path}: neither model.yaml beside it nor the robot has inertial parameters")
        return arm.parameters


def read_verdict(path: Path) -> VerdictFile:
    """The verdict in a file or a folder; InputError, in one line, for what is no verdict."""
    file = path / "verdict.json" if path.is_dir() else path
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the verdict {file}: {error}") from None
    if not isinstance(content, dict) or content.get("schema") != VERDICT_SCHEMA:
        raise InputError(f"{file} is no verdict: its 'schema' should be {VERDICT_SCHEMA}")
    beside = file.with_name("model.yaml")
    model = read_yaml(beside) if beside.is_file() else None
    try:
        findings = tuple(_parse_finding(each) for each in content["findings"])
        noise = np.array([each["noise_floor"] for each in content["fit"]], dtype=np.float64)
    except (KeyError, TypeError) as error:
        raise InputError(f"{file} is no whole verdict: {error} is missing or of another form") from None
    return VerdictFile(file, findings, noise, model)


def _parse_finding(each: dict[str, Any]) -> Finding:
    parameters = {name: _parse_value(entry["value"]) for name, entry in each["parameters"].items()}
    rivals = tuple(Name(rival["effect"], rival["joint"]) for rival in each["rivals"])
    return Finding(Name(each["effect"], each["joint"]), tuple(each["joints"]), parameters, rivals)


def _parse_value(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


RivalGroup = tuple[Name, ...]


def select_rival_groups(verdict: VerdictFile, named: str | None) -> tuple[RivalGroup, ...]:
    """Groups of names of which one is right, the finding first; InputError where there is nothing to decide.

    named: like `viscous_friction,time_delay` or `viscous_friction@2,coulomb_friction@2`.
    """
    if named:
        return (_parse_rivals(verdict, named),)
    groups = [_names_of_finding(finding) for finding in verdict.findings if finding.rivals]
    groups = [group for group in groups if len(group) > 1 and group[0].effect != "unknown"]
    unique = {frozenset(group): group for group in reversed(groups)}
    if not unique:
        raise InputError(
            f"{verdict.path}: no finding has rivals, so nothing is to be decided; --rivals a,b names what to tell apart"
        )
    return tuple(reversed(unique.values()))


def _names_of_finding(finding: Finding) -> RivalGroup:
    return tuple(dict.fromkeys((finding.name, *finding.rivals)))


def _parse_rivals(verdict: VerdictFile, named: str) -> RivalGroup:
    parts = [part.strip().partition("@") for part in named.split(",")]
    if len(parts) < 2:
        raise InputError(f"--rivals {named}: should be two names or more, like viscous_friction@2,time_delay")
    place = next((each.name.joint for each in verdict.findings if each.name.effect in {p[0] for p in parts}), None)
    return tuple(dict.fromkeys(_parse_rival_name(effect, joint, place, verdict) for effect, _, joint in parts))


def _parse_rival_name(effect: str, joint: str, place: int | None, verdict: VerdictFile) -> Name:
    if effect not in EFFECT_IDS or effect == "unknown":
        try:
            effect_named(effect)
        except ValueError as error:
            raise InputError(f"--rivals: {error}") from None
        raise InputError("--rivals: 'unknown' has no columns to design a motion for")
    if effect_named(effect).where == "robot":
        return Name(effect, None)
    if joint:
        if not joint.isdigit() or not 1 <= int(joint) <= max(len(verdict.noise), 1):
            raise InputError(f"--rivals {effect}@{joint}: the joint should be a number from 1 to {len(verdict.noise)}")
        return Name(effect, int(joint))
    own: Sequence[int | None] = [each.name.joint for each in verdict.findings if each.name.effect == effect]
    found = own[0] if own else place
    if found is None:
        raise InputError(f"--rivals: at which joint? write {effect}@2 for joint 2")
    return Name(effect, found)
