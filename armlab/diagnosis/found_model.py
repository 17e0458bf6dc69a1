"""The model that a diagnosis found: links as fitted, the simulation's own terms, every named effect."""

from importlib.metadata import version
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Diagnosis
from armlab.effects.contract import Candidate
from armlab.effects.drive import RotorInertia
from armlab.effects.parameters import ParameterValue, parameter_values
from armlab.identification.model_file import base_covariance
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from problem.robot_file import built_in_arms

Terms = list[tuple[Candidate, Array, tuple[ParameterValue, ...]]]


def model_found(diagnosis: Diagnosis) -> TorqueModel:
    """The model of a diagnosis that fitted something; ValueError for another.

    What could not be named is no component: its surrogate belongs to this recording, and the provenance tells of it,
    as of what the links hold already.
    """
    inertial = diagnosis.inertial
    if inertial is None:
        raise ValueError("the diagnosis fitted nothing: it has no model")
    arm = diagnosis.simulation.arm
    terms = _simulated_terms(diagnosis) + _named_terms(diagnosis)
    structure = Structure(arm, tuple(candidate for candidate, _, _ in terms), load=inertial)
    base = structure.base.values(inertial)
    covariance = diagnosis.base_covariance
    return TorqueModel(
        robot=_robot_path(diagnosis),
        structure=structure,
        values=np.concatenate([base, *(coefficients for _, coefficients, _ in terms)]),
        covariance=None if covariance is None else base_covariance(covariance, structure),
        inertial=inertial if diagnosis.simulation.inertial is not None else None,
        cutoff_hz=None if diagnosis.observed is None else diagnosis.observed.cutoff_hz,
        provenance=_provenance(diagnosis),
        stated=tuple(parameters for _, _, parameters in terms),
    )


def _named_terms(diagnosis: Diagnosis) -> Terms:
    return [
        (claim.candidate, claim.coefficients, claim.parameters)
        for claim in diagnosis.claims
        if claim.candidate is not None and claim.coefficients is not None and not claim.in_links
    ]


def _simulated_terms(diagnosis: Diagnosis) -> Terms:
    """What the simulation has beside its links: components of a model, or the rotor inertias of a robot file."""
    model, arm = diagnosis.simulation.model, diagnosis.simulation.arm
    if model is not None:
        return [
            (each.candidate, each.coefficients, model.component_parameters(index))
            for index, each in enumerate(model.effects)
        ]
    rotors = [(RotorInertia.at(arm, joint), np.array([value])) for joint, value in enumerate(arm.rotor_inertia, 1)]
    return [(rotor, value, parameter_values(rotor, value, None, 1.0)) for rotor, value in rotors if value[0]]


def _provenance(diagnosis: Diagnosis) -> dict[str, Any]:
    unknown = [claim.equation for claim in diagnosis.claims if claim.candidate is None]
    in_links = [f"{claim.effect}: {claim.equation}" for claim in diagnosis.claims if claim.in_links]
    out: dict[str, Any] = {
        "recording": diagnosis.recording.name,
        "runs": [run.name for run in diagnosis.recording.runs if run.role == "identify"],
        "settings": dict(diagnosis.settings),
        "version": version("armlab"),
    }
    return out | ({"unknown": unknown} if unknown else {}) | ({"in_links": in_links} if in_links else {})


def _robot_path(diagnosis: Diagnosis) -> str:
    """The robot as a built-in name, or the path of its file."""
    robot = diagnosis.recording.robot
    return robot if robot in built_in_arms() else str(diagnosis.recording.folder / robot)
