"""A verdict as a design needs it: what was found, its rivals, the noise, and the model that was written beside it."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.diagnosis.verdict_files import VERDICT_SCHEMA
from diagnosis.next.question import Name
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.errors import InputError
from problem.yaml_input import read_yaml
from recordings.run import Array


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
        findings = tuple(_finding(each) for each in content["findings"])
        noise = np.array([each["noise_floor"] for each in content["fit"]], dtype=np.float64)
    except (KeyError, TypeError) as error:
        raise InputError(f"{file} is no whole verdict: {error} is missing or of another form") from None
    return VerdictFile(file, findings, noise, model)


def _finding(each: dict[str, Any]) -> Finding:
    parameters = {name: _value(entry["value"]) for name, entry in each["parameters"].items()}
    rivals = tuple(Name(rival["effect"], rival["joint"]) for rival in each["rivals"])
    return Finding(Name(each["effect"], each["joint"]), tuple(each["joints"]), parameters, rivals)


def _value(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
