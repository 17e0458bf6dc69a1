"""The augmented model as model/1: the links as fitted, and a component for each effect that was found."""

import os
from importlib.metadata import version
from pathlib import Path
from typing import Any

from diagnosis.result import Claim, Diagnosis, Parameter
from identification.model_file import SCHEMA
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.robot_file import built_in_arms
from recordings.vocabulary import effect_named


def augmented_model(diagnosis: Diagnosis, folder: Path) -> dict[str, Any]:
    """The content of `model.yaml` in a folder.

    What could not be named is no component: its surrogate belongs to this recording, and the provenance tells of it,
    as of what the links hold already.
    """
    content: dict[str, Any] = {"schema": SCHEMA, "robot": _robot_from(diagnosis, folder)}
    inertial = diagnosis.inertial
    if inertial is not None:
        arm = diagnosis.simulation.arm
        base = base_parameters(arm)
        if diagnosis.simulation.inertial is not None:
            content["links"] = [
                {"mass": float(ten[0]), "first_moment": ten[1:4].tolist(), "inertia": ten[4:].tolist()}
                for ten in inertial.reshape(-1, 10)
            ]
        content["base_parameters"] = {"names": list(base.sums), "values": base.values(inertial).tolist()}
        if diagnosis.base_covariance is not None:
            content["base_parameters"]["covariance"] = diagnosis.base_covariance.tolist()
    own = [_component(claim) for claim in diagnosis.claims if claim.candidate is not None and not claim.in_links]
    content["components"] = _simulated(diagnosis) + own
    content["provenance"] = _provenance(diagnosis)
    return content


def _component(claim: Claim) -> dict[str, Any]:
    joints = list(claim.joints)
    return {
        "effect": claim.effect,
        "joint": claim.joint,
        "joints": joints,
        "parameters": {each.name: _parameter(each) for each in claim.parameters},
        **({"form": claim.candidate.form} if claim.candidate and claim.candidate.form else {}),
    }


def _parameter(each: Parameter) -> dict[str, Any]:
    value = list(each.value) if isinstance(each.value, tuple) else each.value
    interval = None
    if each.interval is not None:
        interval = [list(x) if isinstance(x, tuple) else x for x in each.interval]
    return {"value": value, "ci95": interval, "unit": each.unit}


def _simulated(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Components that the simulation has already."""
    model = diagnosis.simulation.model
    if model is None:
        return _rotors(diagnosis.simulation.arm)
    linear = [
        {
            "effect": part.effect,
            "joint": part.joint,
            "joints": list(part.joints),
            "parameters": {
                each.name: {
                    "value": each.value,
                    "ci95": list(each.interval) if each.interval else None,
                    "unit": each.unit,
                }
                for each in model.component_parameters(index)
            },
        }
        for index, part in enumerate(model.structure.components)
    ]
    return linear + [dict(each.told) for each in model.extras]


def _rotors(arm: Arm) -> list[dict[str, Any]]:
    """Rotor inertias of a robot file: a model has them as components."""
    rotor = effect_named("rotor_inertia")
    return [
        {
            "effect": rotor.id,
            "joint": number,
            "joints": [number],
            "parameters": {
                "inertia": {"value": value, "ci95": None, "unit": rotor.parameter("inertia").unit_for(kind)}
            },
        }
        for number, (value, kind) in enumerate(
            zip(arm.rotor_inertia, (each.kind for each in arm.joints), strict=False), 1
        )
        if value
    ]


def _provenance(diagnosis: Diagnosis) -> dict[str, Any]:
    unknown = [claim.equation for claim in diagnosis.claims if claim.candidate is None]
    out: dict[str, Any] = {
        "recording": diagnosis.recording.name,
        "runs": [run.name for run in diagnosis.recording.runs if run.role == "identify"],
        "settings": dict(diagnosis.settings),
        "version": version("armlab"),
    }
    if diagnosis.observed is not None:
        out["cutoff_hz"] = diagnosis.observed.cutoff_hz
    in_links = [f"{claim.effect}: {claim.equation}" for claim in diagnosis.claims if claim.in_links]
    return out | ({"unknown": unknown} if unknown else {}) | ({"in_links": in_links} if in_links else {})


def _robot_from(diagnosis: Diagnosis, folder: Path) -> str:
    """The robot as a file in this folder names it: a built-in name, or a path."""
    robot = diagnosis.recording.robot
    if robot in built_in_arms():
        return robot
    return Path(os.path.relpath(diagnosis.recording.folder / robot, folder)).as_posix()
