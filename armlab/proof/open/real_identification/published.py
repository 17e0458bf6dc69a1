"""The TX40's base parameters beside the published ones: differences over their combined standard errors."""

import re
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate
from armlab.identification.components import usual_components, wrist_couplings
from armlab.identification.identifier import Identifier
from armlab.identification.model import Model
from armlab.recordings.public import PUBLIC_RECORDINGS, STAUBLI, RemoteFile, find_raw_file
from armlab.recordings.recording import Recording
from problem.arm import PARAMETER_NAMES

PUBLISHED_TABLE = RemoteFile(
    "TX40_bp_5.csv", f"{STAUBLI}/TX40_bp_5.csv", "00dc377866e792e7dad787eaa719def4cc428aa0735c00216526a60f8df0dec6"
)
TERM_PATTERN = re.compile(r"([+-]?)\s*(?:([\d.]+)\*)?([A-Za-z]+)(\d)")
LINK_TERMS = dict(zip(("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"), PARAMETER_NAMES, strict=True))
JOINT_TERMS = {
    "fv": ("viscous_friction", "coefficient"),
    "fs": ("coulomb_friction", "level"),
    "Ia": ("rotor_inertia", "inertia"),
    "off": ("torque_offset", "offset"),
}
COUPLING_TERMS = {"fvm": "coefficient", "fsm": "level", "Iam": "inertia"}


@dataclass(frozen=True)
class PublishedComparison:
    """One base parameter: published and found with standard errors; ratio: difference over the combined one."""

    name: str
    published: float
    published_error: float
    found: float
    found_error: float

    @property
    def ratio(self) -> float:
        """Difference over the combined standard error."""
        return abs(self.found - self.published) / float(np.hypot(self.published_error, self.found_error))


def compare_with_published(model: Model) -> tuple[PublishedComparison, ...]:
    """Every published base parameter that the model has; weighted least squares with errors in percent."""
    table = pd.read_csv(find_raw_file(PUBLIC_RECORDINGS["staubli-tx40"], PUBLISHED_TABLE), header=None)
    if model.covariance is None:
        raise ValueError("a comparison needs the covariance of the model")
    out = []
    for name, value, percent in table[[0, 3, 4]].itertuples(index=False):
        weights = sum_weights(model, str(name))
        error = float(np.sqrt(weights @ model.covariance @ weights))
        out.append(
            PublishedComparison(str(name), value, abs(value) * percent / 100, float(weights @ model.values), error)
        )
    return tuple(out)


def fit_published_structure(recording: Recording, cutoff_hz: float, position_factor: float) -> Model:
    """The model with the terms of the published one, from the runs that identify."""
    components = usual_components(recording.arm) + wrist_couplings(recording.arm)
    identifier = Identifier(recording.arm, components, cutoff_hz=cutoff_hz, position_factor=position_factor)
    return identifier.fit(recording.with_role("identify")).model_


def sum_weights(model: Model, expression: str) -> Array:
    """Weights (columns,) of a sum of standard parameters like `my4 + 1.0*mz5`.

    Raises ValueError for a sum that the torques of this arm do not determine.
    """
    structure = model.structure
    phi, weights = np.zeros(10 * len(model.arm)), np.zeros(structure.size)
    for sign, factor, name, joint in TERM_PATTERN.findall(expression):
        size = (-1.0 if sign == "-" else 1.0) * float(factor or 1)
        if name in LINK_TERMS:
            phi[model.arm.parameter_names.index(f"{LINK_TERMS[name]}{joint}")] += size
        else:
            weights += size * _joint_term_weights(model, name, int(joint))
    base = np.linalg.lstsq(structure.base.grouping.T, phi, rcond=None)[0]
    if np.abs(structure.base.grouping.T @ base - phi).max() > 1e-6:
        raise ValueError(f"{expression} is no sum of base parameters of {model.arm.name}")
    weights[: len(base)] += base
    return weights


def _joint_term_weights(model: Model, name: str, joint: int) -> Array:
    """Weights of a parameter of friction or rotor; zero where a link's inertia has taken it in."""
    weights = np.zeros(model.structure.size)
    places = [
        place.start + part.names.index(parameter)
        for part, place in zip(model.structure.components, model.structure.slices, strict=True)
        for parameter in [_matching_parameter(part, name, joint)]
        if parameter
    ]
    weights[places] = 1 / max(len(places), 1)  # a coupling appears in both its joints
    return weights


def _matching_parameter(part: Candidate, name: str, joint: int) -> str | None:
    if name in COUPLING_TERMS:
        return COUPLING_TERMS[name] if part.effect == "joint_coupling" and joint in part.joints else None
    effect, parameter = JOINT_TERMS[name]
    return parameter if part.effect == effect and part.joint == joint else None
