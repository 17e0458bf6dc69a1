"""`model.yaml` (schema model/1): read and written so that a model predicts the same after a round trip."""

import os
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from annotated_types import Gt
from pydantic import Field
from scipy.linalg import block_diag
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, validate
from armlab.effects.extras import Extra, extra_from_file, registered_effects
from armlab.identification.components import FORMS, Component
from armlab.identification.structure import Structure
from armlab.identification.torque_model import Parameter, TorqueModel, parameter_jacobian
from problem.arm import Arm
from problem.pseudo_inertia import links_of
from problem.robot_file import LinkEntry, built_in_arms, load_arm

SCHEMA = "model/1"
NORMAL_QUANTILE = float(norm.ppf(0.975))


class ParameterEntry(Settings):
    """One parameter."""

    value: float | tuple[float, ...]
    ci95: tuple[float | tuple[float, ...], ...] | None = None
    unit: str


class ComponentEntry(Settings):
    """One component; form: which of an effect's laws, where its parameters do not tell."""

    effect: str
    joint: int | None
    joints: tuple[int, ...] = ()
    form: str = ""
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


class Numbers(Settings):
    """What the provenance tells of the model itself: its filters, and the factor from standard errors to intervals."""

    cutoff_hz: Annotated[float, Gt(0)] | None = None
    position_factor: Annotated[float, Gt(0)] = 1.0
    interval_factor: Annotated[float, Gt(0)] = NORMAL_QUANTILE


NUMBER_KEYS = tuple(Numbers.model_fields)


def write_model(model: TorqueModel, path: Path) -> Path:
    """Writes a model and returns the path; InputError where it cannot be written."""
    content: dict[str, Any] = {"schema": SCHEMA, "robot": _robot_as_written(model.robot, path.parent)}
    if model.inertial is not None:
        content |= {"links": [_link_entry(ten) for ten in model.inertial.reshape(-1, 10)]}
    base: dict[str, Any] = {"names": list(model.structure.base.sums), "values": model.base_values.tolist()}
    if model.covariance is not None:
        count = len(model.structure.base)
        base["covariance"] = model.covariance[:count, :count].tolist()
    content |= {"base_parameters": base, "components": _component_entries(model)}
    filters = {"cutoff_hz": model.cutoff_hz, "position_factor": model.position_factor}
    factor = {"interval_factor": None if model.covariance is None else model.factor}
    provenance = {**model.provenance, **filters, **factor}
    content["provenance"] = {key: value for key, value in provenance.items() if value is not None}
    try:
        path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path


def _robot_as_written(robot: str, folder: Path) -> str:
    """The robot as a file in this folder names it: a built-in name, or a path beside it."""
    return robot if robot in built_in_arms() else Path(os.path.relpath(robot, folder)).as_posix()


def _link_entry(ten: Array) -> dict[str, Any]:
    return {"mass": float(ten[0]), "first_moment": ten[1:4].tolist(), "inertia": ten[4:].tolist()}


def _component_entries(model: TorqueModel) -> list[dict[str, Any]]:
    linear = [
        {
            "effect": part.effect,
            "joint": part.joint,
            "joints": list(part.joints),
            "parameters": {each.name: _parameter_entry(each) for each in model.component_parameters(index)},
        }
        for index, part in enumerate(model.structure.components)
    ]
    return linear + [dict(each.told) for each in model.extras]


def _parameter_entry(parameter: Parameter) -> dict[str, Any]:
    interval = list(parameter.interval) if parameter.interval else None
    return {"value": parameter.value, "ci95": interval, "unit": parameter.unit}


def read_model(path: Path) -> TorqueModel:
    """The model of a file; InputError, in one line, for what is wrong in it.

    Its covariance is that of the base parameters and, component by component, what the intervals tell: the file
    holds no ties between components.
    """
    return model_of(read_model_file(path), path)


def read_model_file(path: Path) -> ModelFile:
    """The checked content of a `model.yaml`; InputError, in one line, where it is wrong."""
    return validate(ModelFile, read_yaml(path), str(path))


def model_of(file: ModelFile, path: Path) -> TorqueModel:
    """The model that the content of a file describes; path: where it stands, for its robot and for messages."""
    arm = load_arm(file.robot, path.parent)
    robot = file.robot if file.robot in built_in_arms() else str(path.parent / file.robot)
    places = [f"{path}, components[{index}] ({entry.effect})" for index, entry in enumerate(file.components)]
    linear = [_is_linear(entry) for entry in file.components]
    rows = list(zip(file.components, places, linear, strict=True))
    parts = [_read_component(entry, where, len(arm)) for entry, where, own in rows if own]
    extras = tuple(_read_extra(entry, where, arm) for entry, where, own in rows if not own)
    inertial = _read_inertial(file, arm, path)
    structure = Structure(arm, tuple(part for part, _ in parts))
    base = _read_base_values(file, structure, inertial, path)
    structure = Structure(arm, structure.components, structure.full(base))
    values = np.concatenate([base, *(part.coefficients(named) for part, named in parts)])
    numbers = validate(Numbers, {key: file.provenance[key] for key in NUMBER_KEYS if key in file.provenance}, str(path))
    file = file.model_copy(update={"components": tuple(entry for entry, _, own in rows if own)})
    covariance = _read_covariance(file, structure, values, numbers.interval_factor, path)
    others = {key: value for key, value in file.provenance.items() if key not in NUMBER_KEYS}
    return TorqueModel(
        robot,
        structure,
        values,
        covariance,
        numbers.interval_factor,
        inertial,
        numbers.cutoff_hz,
        numbers.position_factor,
        others,
        extras,
    )


def _is_linear(entry: ComponentEntry) -> bool:
    """Whether a component has exactly these parameters, or no plug-in could have the effect."""
    names, forms = set(entry.parameters), FORMS.get(entry.effect, ())
    if any(names in ({*form.names}, {*form.names, form.held}) for form in forms):
        return True
    return bool(forms) and entry.effect not in {each.effect for _, each in registered_effects()}


def _read_extra(entry: ComponentEntry, where: str, arm: Arm) -> Extra:
    told = entry.model_dump(mode="json")
    try:
        return extra_from_file(arm, told, {name: each.value for name, each in entry.parameters.items()})
    except (ValueError, KeyError) as error:
        raise InputError(f"{where}: {error}") from None


def _read_component(entry: ComponentEntry, where: str, joints: int) -> tuple[Component, dict[str, float]]:
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


def _read_inertial(file: ModelFile, arm: Arm, path: Path) -> Array | None:
    if file.links is None:
        return None
    if len(file.links) != len(arm):
        raise InputError(f"{path}: links should have {len(arm)} entries, one a joint, has {len(file.links)}")
    return np.concatenate([[each.mass, *each.first_moment, *each.inertia] for each in file.links])


def _read_base_values(file: ModelFile, structure: Structure, inertial: Array | None, path: Path) -> Array:
    if file.base_parameters is None:
        if inertial is None:
            raise InputError(f"{path} has neither links nor base_parameters")
        return structure.base.values(inertial)
    if file.base_parameters.names != structure.base.sums or len(file.base_parameters.values) != len(structure.base):
        raise InputError(f"{path}: base_parameters are not those of {structure.arm.name}: see `armlab base`")
    return np.array(file.base_parameters.values)


def _read_covariance(file: ModelFile, structure: Structure, values: Array, factor: float, path: Path) -> Array | None:
    """Covariance (columns, columns), NaN where the file gives no interval; None where it gives none at all."""
    count = len(structure.base)
    blocks = [np.full((count, count), np.nan)]
    if file.base_parameters is not None and file.base_parameters.covariance is not None:
        given = file.base_parameters.covariance
        if len(given) != count or any(len(row) != count for row in given):
            raise InputError(f"{path}: base_parameters.covariance should be {count} x {count}")
        blocks = [np.array(given)]
    for entry, part, place in zip(file.components, structure.components, structure.slices, strict=True):
        half = np.array([_half_width(entry.parameters[name]) for name in part.names])
        inverse = np.linalg.pinv(parameter_jacobian(part, values[place]))
        blocks.append(inverse @ np.diag((half / factor) ** 2) @ inverse.T)
    known = any(np.isfinite(block).any() for block in blocks)
    return np.asarray(block_diag(*blocks)) if known else None


def _half_width(entry: ParameterEntry) -> float:
    low, high = entry.ci95 if entry.ci95 and len(entry.ci95) == 2 else (np.nan, np.nan)
    return (high - low) / 2 if isinstance(low, float) and isinstance(high, float) else np.nan


def arm_of_model(model: TorqueModel) -> Arm:
    """The model's arm with its identified links and rotors; ValueError for a model without physical links."""
    if model.inertial is None:
        raise ValueError("the model has base parameters only: identify it with physically consistent links")
    rotors = np.zeros(len(model.arm))
    for part, place in zip(model.structure.components, model.structure.slices, strict=True):
        if part.effect == "rotor_inertia":
            rotors[part.joint - 1] += model.values[place][0]
    arm = model.arm
    return Arm(arm.name, arm.joints, links_of(model.inertial), arm.gravity, tuple(rotors.tolist()))
