"""The files of a verdict: verdict.json, model.yaml and the predicted torque, all written or none."""

import json
import math
import os
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Located, Parameter, Unexplained
from armlab.identification.model_file import SCHEMA
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Recording
from armlab.recordings.vocabulary import effect_named
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.robot_file import built_in_arms

MODEL = "model.yaml"


def verdict_texts(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """verdict.json and, where something was fitted, model.yaml, as they are to stand in a folder."""
    texts = {"verdict.json": json.dumps(verdict_content(diagnosis), indent=1, allow_nan=False) + "\n"}
    if diagnosis.inertial is not None:
        model = augmented_model(diagnosis, folder)
        texts[MODEL] = yaml.safe_dump(model, sort_keys=False, default_flow_style=None, width=110)
    return texts


def write_verdict(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Writes verdict.json and, where something was fitted, model.yaml; InputError where that cannot be done."""
    return write_texts(verdict_texts(diagnosis, folder), folder)


def check_output_folder(folder: Path, recording: Recording) -> None:
    """Makes sure, before any work, that the files of a verdict may stand there; InputError where they may not."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder} is a file: give a folder")
    if recording.simulation is not None and recording.simulation.resolve() == (folder / MODEL).resolve():
        raise InputError(f"--out {folder} holds {MODEL}, the simulation of {recording.name}: give another folder")
    nearest = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        raise InputError(f"cannot write into {nearest}: give --out a folder that can be written")


VERDICT_SCHEMA = "verdict/1"


def verdict_content(diagnosis: Diagnosis) -> dict[str, Any]:
    """The verdict of a diagnosis."""
    return {
        "schema": VERDICT_SCHEMA,
        "status": diagnosis.status,
        "summary": diagnosis.summary,
        "located": [_located_entry(each) for each in diagnosis.located],
        "findings": [_finding_entry(each) for each in diagnosis.claims],
        "unexplained": [_unexplained_entry(each) for each in diagnosis.unexplained],
        "fit": [_fit_entry(each) for each in diagnosis.fit],
    }


def _located_entry(each: Located) -> dict[str, Any]:
    where: dict[str, Any] = {"variable": each.variable, "regime": each.regime, "runs": list(each.runs)}
    where["time"] = None if each.time is None else list(each.time)
    return {"joint": each.joint, "share": each.share, "where": where}


def _finding_entry(claim: Claim) -> dict[str, Any]:
    rivals = [{"effect": each.effect, "joint": each.joint} for each in claim.rivals]
    return {
        "effect": claim.effect,
        "joint": claim.joint,
        "joints": list(claim.joints),
        "parameters": {each.name: _parameter(each) for each in claim.parameters},
        "equation": claim.equation,
        "heldout_rms_before": claim.evidence.rms_before,
        "heldout_rms_after": claim.evidence.rms_after,
        "p_value": claim.evidence.corrected,
        "rivals": rivals,
        "next_experiment": claim.next_experiment,
    }


def _parameter(each: Parameter) -> dict[str, Any]:
    value = list(each.value) if isinstance(each.value, tuple) else _finite(each.value)
    interval = None if each.interval is None else [list(x) if isinstance(x, tuple) else x for x in each.interval]
    return {"value": value, "ci95": interval, "unit": each.unit}


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.copysign(1e300, value)  # JSON has no infinity


def _unexplained_entry(each: Unexplained) -> dict[str, Any]:
    return {"joint": each.joint, "share": each.share, "depends_on": list(each.depends_on)}


def _fit_entry(each: JointFit) -> dict[str, Any]:
    return {
        "joint": each.joint,
        "heldout_rms_before": each.before,
        "heldout_rms_after": each.after,
        "noise_floor": each.noise_floor,
        "gap_closed": each.gap_closed,
    }


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
    own = [_component_entry(claim) for claim in diagnosis.claims if claim.candidate is not None and not claim.in_links]
    content["components"] = _simulated_components(diagnosis) + own
    content["provenance"] = _provenance(diagnosis)
    return content


def _component_entry(claim: Claim) -> dict[str, Any]:
    joints = list(claim.joints)
    return {
        "effect": claim.effect,
        "joint": claim.joint,
        "joints": joints,
        "parameters": {each.name: _parameter_entry(each) for each in claim.parameters},
        **({"form": claim.candidate.form} if claim.candidate and claim.candidate.form else {}),
    }


def _parameter_entry(each: Parameter) -> dict[str, Any]:
    value = list(each.value) if isinstance(each.value, tuple) else each.value
    interval = None
    if each.interval is not None:
        interval = [list(x) if isinstance(x, tuple) else x for x in each.interval]
    return {"value": value, "ci95": interval, "unit": each.unit}


def _simulated_components(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Components that the simulation has already."""
    model = diagnosis.simulation.model
    if model is None:
        return _rotor_components(diagnosis.simulation.arm)
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


def _rotor_components(arm: Arm) -> list[dict[str, Any]]:
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


PREDICTED_FOLDER = "predicted"


def predicted_texts(diagnosis: Diagnosis) -> dict[str, str]:
    """`predicted/RUN.csv` of each validation run: t in s, tau1, ... in N m (N).

    The torque passed the filter of the diagnosis, and stands at the run's own even stamps, ends left out.
    """
    observed, final = diagnosis.observed, diagnosis.final
    if observed is None or final is None:
        return {}
    rows = zip(observed.signals, _split_by_run(final, observed.signals), strict=True)
    return {
        f"{PREDICTED_FOLDER}/{Path(each.run.file).stem}.csv": _csv_text(each, each.torque - left)
        for each, left in rows
        if each.run.role == "validate" and not each.run.part
    }


def _split_by_run(stacked: Array, signals: tuple[Signals, ...]) -> Iterator[Array]:
    ends = np.cumsum([len(each.torque) for each in signals])
    return iter(np.split(stacked, ends[:-1]))


def _csv_text(signals: Signals, torque: Array) -> str:
    known, time = signals.time, signals.run.time
    inside = time[(time >= known[0]) & (time <= known[-1])]
    values = make_interp_spline(known, torque, k=3)(inside)
    head = ",".join(["t", *(f"tau{joint}" for joint in range(1, values.shape[1] + 1))])
    return "\n".join([head, *(",".join(f"{x:.6g}" for x in row) for row in np.column_stack([inside, values])), ""])
