"""`model.yaml` (schema model/1): read and written so that a model predicts the same after a round trip."""

import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from pydantic import Field

from identification.components import FORMS, Component
from identification.model import Model, Parameter
from identification.pseudo_inertia import links_of
from identification.structure import Structure
from problem.arm import Arm
from problem.errors import InputError
from problem.robot_file import LinkEntry, built_in_arms, load_arm
from problem.settings import Settings, validate
from problem.yaml_input import read_yaml
from recordings.run import Array

SCHEMA = "model/1"


class ParameterEntry(Settings):
    """One parameter."""

    value: float | tuple[float, ...]
    ci95: tuple[float, ...] | None = None
    unit: str


class ComponentEntry(Settings):
    """One component."""

    effect: str
    joint: int | None
    joints: tuple[int, ...] = ()
    parameters: dict[str, ParameterEntry]


class BaseEntry(Settings):
    """Base parameters with their covariance."""

    names: tuple[str, ...]
    values: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...] | None = None


class ModelFile(Settings):
    """The content of `model.yaml`."""

    schema_: Literal["model/1"] = Field(alias="schema")
    robot: str
    links: tuple[LinkEntry, ...] | None = None
    base_parameters: BaseEntry | None = None
    components: tuple[ComponentEntry, ...]
    provenance: dict[str, Any] = Field(default_factory=dict)


def write_model(model: Model, path: Path) -> Path:
    """Writes a model and returns the path; InputError where it cannot be written."""
    content: dict[str, Any] = {"schema": SCHEMA, "robot": _robot_from(model.robot, path.parent)}
    if model.inertial is not None:
        content |= {"links": [_link(ten) for ten in model.inertial.reshape(-1, 10)]}
    base: dict[str, Any] = {"names": list(model.structure.base.sums), "values": model.base_values.tolist()}
    if model.covariance is not None:
        count = len(model.structure.base)
        base["covariance"] = model.covariance[:count, :count].tolist()
    content |= {"base_parameters": base, "components": _components(model)}
    provenance = {**model.provenance, "cutoff_hz": model.cutoff_hz}
    content["provenance"] = {key: value for key, value in provenance.items() if value is not None}
    try:
        path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path


def _robot_from(robot: str, folder: Path) -> str:
    """The robot as a file in this folder names it: a built-in name, or a path beside it."""
    return robot if robot in built_in_arms() else Path(os.path.relpath(robot, folder)).as_posix()


def _link(ten: Array) -> dict[str, Any]:
    return {"mass": float(ten[0]), "first_moment": ten[1:4].tolist(), "inertia": ten[4:].tolist()}


def _components(model: Model) -> list[dict[str, Any]]:
    return [
        {
            "effect": part.effect,
            "joint": part.joint,
            "joints": list(part.joints),
            "parameters": {each.name: _entry(each) for each in model.component_parameters(index)},
        }
        for index, part in enumerate(model.structure.components)
    ]


def _entry(parameter: Parameter) -> dict[str, Any]:
    interval = list(parameter.interval) if parameter.interval else None
    return {"value": parameter.value, "ci95": interval, "unit": parameter.unit}


def read_model(path: Path) -> Model:
    """The model of a file; InputError, in one line, for what is wrong in it."""
    file = validate(ModelFile, read_yaml(path), str(path))
    arm = load_arm(file.robot, path.parent)
    robot = file.robot if file.robot in built_in_arms() else str(path.parent / file.robot)
    parts = [_component(entry, index, len(arm), path) for index, entry in enumerate(file.components)]
    inertial = _inertial(file, arm, path)
    structure = Structure(arm, tuple(part for part, _ in parts))
    base = _base_values(file, structure, inertial, path)
    structure = Structure(arm, structure.components, structure.full(base))
    values = np.concatenate([base, *(part.coefficients(named) for part, named in parts)])
    cutoff = file.provenance.get("cutoff_hz")
    return Model(robot, structure, values, None, inertial=inertial, cutoff_hz=cutoff, provenance=dict(file.provenance))


def _component(entry: ComponentEntry, index: int, joints: int, path: Path) -> tuple[Component, dict[str, float]]:
    where = f"{path}, components[{index}] ({entry.effect})"
    named = {name: each.value for name, each in entry.parameters.items() if isinstance(each.value, float)}
    if entry.joint is None or not 1 <= entry.joint <= joints:
        raise InputError(f"{where}: joint {entry.joint} should be one from 1 to {joints}")
    forms = FORMS.get(entry.effect, ())
    fits = [number for number, form in enumerate(forms) if set(form.names) <= set(named)]
    if not fits:
        wanted = " or ".join(", ".join(form.names) for form in forms) or "no effect that a model can compute"
        raise InputError(f"{where}: parameters {', '.join(named) or 'none'} should be {wanted}")
    held = forms[fits[0]].held
    driver = entry.joints[1] if len(entry.joints) > 1 else None
    try:
        part = Component(entry.effect, entry.joint, driver, named.get(held) if held else None, fits[0])
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
    return part, named


def _inertial(file: ModelFile, arm: Arm, path: Path) -> Array | None:
    if file.links is None:
        return None
    if len(file.links) != len(arm):
        raise InputError(f"{path}: links should have {len(arm)} entries, one a joint, has {len(file.links)}")
    return np.concatenate([[each.mass, *each.first_moment, *each.inertia] for each in file.links])


def _base_values(file: ModelFile, structure: Structure, inertial: Array | None, path: Path) -> Array:
    if file.base_parameters is None:
        if inertial is None:
            raise InputError(f"{path} has neither links nor base_parameters")
        return structure.base.values(inertial)
    if file.base_parameters.names != structure.base.sums or len(file.base_parameters.values) != len(structure.base):
        raise InputError(f"{path}: base_parameters are not those of {structure.arm.name}: see `armlab base`")
    return np.array(file.base_parameters.values)


def links_of_model(model: Model) -> Arm:
    """The model's arm with its identified links and rotors; ValueError for a model without physical links."""
    if model.inertial is None:
        raise ValueError("the model has base parameters only: identify it with physically consistent links")
    rotors = np.zeros(len(model.arm))
    for part, place in zip(model.structure.components, model.structure.slices, strict=True):
        if part.effect == "rotor_inertia":
            rotors[part.joint - 1] += model.values[place][0]
    arm = model.arm
    return Arm(arm.name, arm.joints, links_of(model.inertial), arm.gravity, tuple(rotors.tolist()))
