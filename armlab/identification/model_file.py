"""`model.yaml` (schema model/1): read and written so that a model predicts the same after a round trip."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from annotated_types import Ge, Gt
from pydantic import Field

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.probabilities import normal_quantile
from armlab.common.settings import Settings, read_yaml, validate
from armlab.effects.contract import Candidate
from armlab.effects.library import family_named
from armlab.effects.parameters import Interval, ParameterValue
from armlab.identification.recorded_motion import RecordedMotion
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording_file import ControllerEntry
from problem.arm import Arm
from problem.robot_file import LinkEntry, built_in_arms, check_arm, load_arm

SCHEMA = "model/1"
NORMAL_QUANTILE = normal_quantile(0.975)


class ParameterEntry(Settings):
    """One parameter."""

    value: float | tuple[float, ...]
    ci95: tuple[float | tuple[float, ...], ...] | None = None
    unit: str


class ComponentEntry(Settings):
    """One component.

    form: which of an effect's laws, where its parameters do not decide it. claimed: false for what is in the model
    because every arm has it, without enough evidence for a finding. source: `simulation` for what the simulation has
    already, which is no finding.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...] = ()
    form: str = ""
    claimed: bool = True
    source: Literal["simulation"] | None = None
    parameters: dict[str, ParameterEntry]


class BaseEntry(Settings):
    """Base parameters with their covariance."""

    names: tuple[str, ...]
    values: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...] | None = None


class MotionEntry(Settings):
    """How the joints moved in the runs that the model was fitted on: see `RecordedMotion`.

    speeds: of each joint, rad/s (m/s), at which it spent equal shares of the time that it moved. load: mean size of the
    torque that the links need, N m (N). duration: s. temperature: degrees Celsius.
    """

    speeds: tuple[tuple[Annotated[float, Ge(0)], ...], ...]
    load: tuple[Annotated[float, Ge(0)], ...]
    duration: Annotated[float, Ge(0)]
    temperature: tuple[float, ...] | None = None


class ModelFile(Settings):
    """The content of `model.yaml`. controller: of position servos, where a recording of motion only was diagnosed."""

    schema_: Literal["model/1"] = Field(alias="schema")
    robot: str
    links: tuple[LinkEntry, ...] | None = None
    base_parameters: BaseEntry | None = None
    components: tuple[ComponentEntry, ...]
    motion: MotionEntry | None = None
    controller: ControllerEntry | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


class Numbers(Settings):
    """What the provenance says of the model itself: its filters, and the factor from standard errors to intervals."""

    cutoff_hz: Annotated[float, Gt(0)] | None = None
    position_factor: Annotated[float, Gt(0)] = 1.0
    interval_factor: Annotated[float, Gt(0)] = NORMAL_QUANTILE


NUMBER_KEYS = tuple(Numbers.model_fields)


def write_model(model: TorqueModel, path: Path) -> Path:
    """Writes a model and returns the path; InputError where it cannot be written."""
    write_whole(path, model_text(model, path.parent))
    return path


def model_text(model: TorqueModel, folder: Path) -> str:
    """The text of `model.yaml` as it is to stand in a folder."""
    return yaml.safe_dump(model_content(model, folder), sort_keys=False, default_flow_style=None, width=110)


def model_content(model: TorqueModel, folder: Path) -> dict[str, Any]:
    """The content of `model.yaml` as it is to stand in a folder.

    What belongs to one run, such as a push, is no component of a file: the provenance tells of it.
    """
    content: dict[str, Any] = {"schema": SCHEMA, "robot": _robot_as_written(model.robot, folder)}
    if model.inertial is not None:
        content |= {"links": [_link_entry(ten) for ten in model.inertial.reshape(-1, 10)]}
    base: dict[str, Any] = {"names": list(model.structure.base.sums), "values": model.base_values.tolist()}
    if model.covariance is not None:
        count = len(model.structure.base)
        base["covariance"] = model.covariance[:count, :count].tolist()
    content |= {"base_parameters": base, "components": _component_entries(model)}
    if model.motion is not None:
        content["motion"] = _motion_entry(model.motion)
    filters = {"cutoff_hz": model.cutoff_hz, "position_factor": model.position_factor}
    factor = {"interval_factor": None if model.covariance is None else model.factor}
    once = [each.candidate.equation(each.coefficients) for each in model.effects if each.candidate.of_one_run]
    provenance = {**model.provenance, **({"of_one_run": once} if once else {}), **filters, **factor}
    content["provenance"] = {key: value for key, value in provenance.items() if value is not None}
    return content


def _robot_as_written(robot: str, folder: Path) -> str:
    """The robot as a file in this folder names it: a built-in name, or a path beside it."""
    return robot if robot in built_in_arms() else Path(os.path.relpath(robot, folder)).as_posix()


def _link_entry(ten: Array) -> dict[str, Any]:
    return {"mass": float(ten[0]), "first_moment": ten[1:4].tolist(), "inertia": ten[4:].tolist()}


def _component_entries(model: TorqueModel) -> list[dict[str, Any]]:
    return [
        {
            "effect": part.effect,
            "joint": part.joint,
            "joints": list(part.joints),
            "parameters": {each.name: _parameter_entry(each) for each in model.component_parameters(index)},
            **({"form": part.form} if part.form else {}),
            **({"claimed": False} if index in model.unclaimed else {}),
            **({"source": "simulation"} if index in model.simulated else {}),
        }
        for index, part in enumerate(model.structure.components)
        if not part.of_one_run
    ]


def _motion_entry(motion: RecordedMotion) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "speeds": motion.speeds.tolist(),
        "load": motion.load.tolist(),
        "duration": motion.duration,
    }
    return entry if motion.temperature is None else entry | {"temperature": motion.temperature.tolist()}


def _parameter_entry(parameter: ParameterValue) -> dict[str, Any]:
    value = list(parameter.value) if isinstance(parameter.value, tuple) else parameter.value
    interval = None
    if parameter.interval is not None:
        interval = [list(each) if isinstance(each, tuple) else each for each in parameter.interval]
    return {"value": value, "ci95": interval, "unit": parameter.unit}


def read_model(path: Path) -> TorqueModel:
    """The model of a file; InputError, in one line, for what is wrong in it.

    Its covariance is that of the base parameters; what the file says of a component's intervals is kept as it stands.
    """
    return model_of(read_model_file(path), path)


def read_model_file(path: Path) -> ModelFile:
    """The checked content of a `model.yaml`; InputError, in one line, where it is wrong."""
    return validate(ModelFile, read_yaml(path), str(path))


def model_of(file: ModelFile, path: Path) -> TorqueModel:
    """The model that the content of a file describes; path: where it stands, for its robot and for messages."""
    arm = load_arm(file.robot, path.parent)
    robot = file.robot if file.robot in built_in_arms() else str(path.parent / file.robot)
    components, coefficients = list[Candidate](), list[Array]()
    for index, entry in enumerate(file.components):
        candidate, values = _read_component(entry, f"{path}, components[{index}] ({entry.effect})", arm)
        components.append(candidate)
        coefficients.append(values)
    inertial = _read_inertial(file, arm, path)
    structure = Structure(arm, tuple(components))
    base = _read_base_values(file, structure, inertial, path)
    numbers = validate(Numbers, {key: file.provenance[key] for key in NUMBER_KEYS if key in file.provenance}, str(path))
    return TorqueModel(
        robot=robot,
        structure=replace(structure, load=structure.full(base)),
        values=np.concatenate([base, *coefficients]),
        covariance=_read_covariance(file, structure, path),
        factor=numbers.interval_factor,
        inertial=inertial,
        cutoff_hz=numbers.cutoff_hz,
        position_factor=numbers.position_factor,
        provenance={key: value for key, value in file.provenance.items() if key not in NUMBER_KEYS},
        stated=tuple(_stated_parameters(entry) for entry in file.components),
        unclaimed=frozenset(index for index, entry in enumerate(file.components) if not entry.claimed),
        simulated=frozenset(index for index, entry in enumerate(file.components) if entry.source == "simulation"),
        motion=None if file.motion is None else _read_motion(file.motion, arm, path),
    )


def _read_component(entry: ComponentEntry, where: str, arm: Arm) -> tuple[Candidate, Array]:
    joints = entry.joints or (() if entry.joint is None else (entry.joint,))
    if any(not 1 <= each <= len(arm) for each in joints):
        raise InputError(f"{where}: joints {list(joints)} should be from 1 to {len(arm)}")
    if entry.joint is not None and not 1 <= entry.joint <= len(arm):
        raise InputError(f"{where}: joint {entry.joint} should be from 1 to {len(arm)}")
    parameters = {name: each.value for name, each in entry.parameters.items()}
    try:
        return family_named(entry.effect).from_parameters(arm, joints, parameters, entry.form)
    except (ValueError, KeyError) as error:
        raise InputError(f"{where}: {error}") from None


def _stated_parameters(entry: ComponentEntry) -> tuple[ParameterValue, ...]:
    return tuple(
        ParameterValue(name, each.value, _stated_interval(each), each.unit) for name, each in entry.parameters.items()
    )


def _stated_interval(entry: ParameterEntry) -> Interval | None:
    if not entry.ci95:
        return None
    if isinstance(entry.value, tuple):
        return tuple((each[0], each[1]) for each in entry.ci95 if isinstance(each, tuple))
    low, high = entry.ci95
    return float(np.sum(low)), float(np.sum(high))


def _read_inertial(file: ModelFile, arm: Arm, path: Path) -> Array | None:
    if file.links is None:
        return None
    if len(file.links) != len(arm):
        raise InputError(f"{path}: links should have {len(arm)} entries, one a joint, has {len(file.links)}")
    check_arm(replace(arm, links=tuple(each.build() for each in file.links)), str(path))
    return np.concatenate([[each.mass, *each.first_moment, *each.inertia] for each in file.links])


def _read_motion(entry: MotionEntry, arm: Arm, path: Path) -> RecordedMotion:
    counts = {len(own) for own in entry.speeds}
    if len(entry.speeds) != len(arm) or len(entry.load) != len(arm):
        raise InputError(f"{path}: motion.speeds and motion.load should have {len(arm)} entries, one a joint")
    if len(counts) != 1 or 0 in counts:
        raise InputError(f"{path}: motion.speeds should have equally many speeds for each joint, one or more")
    temperature = None if entry.temperature is None else np.array(entry.temperature)
    return RecordedMotion(np.array(entry.speeds), np.array(entry.load), entry.duration, temperature)


def _read_base_values(file: ModelFile, structure: Structure, inertial: Array | None, path: Path) -> Array:
    if file.base_parameters is None:
        if inertial is None:
            raise InputError(f"{path} has neither links nor base_parameters")
        return structure.base.values(inertial)
    if file.base_parameters.names != structure.base.sums or len(file.base_parameters.values) != len(structure.base):
        raise InputError(
            f"{path}: base_parameters are not those of {structure.arm.name}: see `armlab model base-parameters`"
        )
    return np.array(file.base_parameters.values)


def _read_covariance(file: ModelFile, structure: Structure, path: Path) -> Array | None:
    """Covariance (columns, columns) of the base parameters, NaN for the components; None where the file has none."""
    if file.base_parameters is None or file.base_parameters.covariance is None:
        return None
    given, count = file.base_parameters.covariance, len(structure.base)
    if len(given) != count or any(len(row) != count for row in given):
        raise InputError(f"{path}: base_parameters.covariance should be {count} x {count}")
    return base_covariance(np.array(given), structure)


def base_covariance(base: Array, structure: Structure) -> Array:
    """Covariance (columns, columns) with that of the base parameters, and NaN where components are concerned."""
    out = np.full((structure.size, structure.size), np.nan)
    out[: len(base), : len(base)] = base
    return out
