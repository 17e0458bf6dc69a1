"""The model that a diagnosis writes: links as fitted, the simulation's own terms, named effects, and parts that are
present without a claim.
"""

from collections.abc import Iterator, Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.torque.names.intervals import extend_with_shapes
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.diagnosis.torque.search.fitted_model import FittedModel, inertial_parameters
from armlab.effects.contract import Candidate
from armlab.effects.drive import RotorInertia
from armlab.effects.parameters import ParameterValue, parameter_values
from armlab.identification.model_file import base_covariance
from armlab.identification.recorded_motion import RecordedMotion
from armlab.identification.structure import Structure
from armlab.identification.torque_model import ADDS_TO, SIMULATED_TORQUE, TorqueModel
from armlab.recordings.recording import Recording
from problem.robot_file import built_in_arms

Term = tuple[Candidate, Array, tuple[ParameterValue, ...], bool]  # the last: whether it is claimed


def model_found(diagnosis: Diagnosis) -> TorqueModel:
    """The model of a diagnosis that fitted something; ValueError for another.

    What could not be named is no component: its surrogate belongs to this recording, and the provenance tells of it,
    as of what the links hold already.
    """
    return _existing(diagnosis.model)


def named_model(diagnosis: Diagnosis) -> TorqueModel:
    """The same fitted with the named effects alone, without what is only present; ValueError as for `model_found`."""
    return _existing(diagnosis.named_model)


def _existing(model: TorqueModel | None) -> TorqueModel:
    if model is None:
        raise ValueError("the diagnosis fitted nothing: it has no model")
    return model


def build_model(
    recording: Recording,
    simulation: Simulation,
    fitted: FittedModel,
    claims: Mapping[int, Claim],
    notes: dict[str, Any],
) -> TorqueModel:
    """The model of a fit. claims: by group; what has none is present without a claim. notes: for the provenance.

    Beside a torque that was simulated elsewhere the model is the difference to it.
    """
    inertial, is_difference = inertial_parameters(fitted), simulation.kind == "simulated"
    simulated = [] if is_difference else _simulated_terms(simulation)
    terms = [*simulated, *_fitted_terms(fitted, claims)]
    structure = Structure(simulation.arm, tuple(term[0] for term in terms), load=inertial)
    known = simulation.inertial
    own = inertial - known if is_difference and known is not None else inertial
    base = structure.base.values(own)
    covariance = fitted.base_parameters()[1]
    return TorqueModel(
        robot=_robot_path(recording),
        structure=structure,
        values=np.concatenate([base, *(term[1] for term in terms)]),
        covariance=base_covariance(covariance, structure),
        inertial=inertial if known is not None and not is_difference else None,
        cutoff_hz=fitted.design.observed.cutoff_hz,
        provenance=_provenance(recording, notes | ({ADDS_TO: SIMULATED_TORQUE} if is_difference else {})),
        stated=tuple(term[2] for term in terms),
        unclaimed=frozenset(number for number, term in enumerate(terms) if not term[3]),
        simulated=frozenset(range(len(simulated))),
        motion=_recorded_motion(fitted, inertial),
    )


def _recorded_motion(fitted: FittedModel, inertial: Array) -> RecordedMotion:
    """The motion of the runs that identify. inertial: (10 * joints,), the links."""
    design = fitted.design
    numbers = sorted({segment.run for segment in design.observed.of_role("identify")})
    return RecordedMotion.of([design.scenes[number] for number in numbers], inertial)


def _fitted_terms(fitted: FittedModel, claims: Mapping[int, Claim]) -> Iterator[Term]:
    """The effects of a fit, those with a claim by its name."""
    wide = extend_with_shapes(fitted) if fitted.state.groups else None
    for group in fitted.state.groups:
        assert wide is not None
        claim = claims.get(group)
        candidate = fitted.candidate(group)
        if claim is not None and claim.candidate is not None:
            candidate = claim.candidate
        coefficients = fitted.solver.values(fitted.fit, group)
        stated = parameter_values(candidate, coefficients, wide.covariance(group), wide.factor)
        yield candidate, coefficients, stated, claim is not None


def _simulated_terms(simulation: Simulation) -> list[Term]:
    """What the simulation has beside its links: components of a model, or the rotor inertias of a robot file."""
    model, arm = simulation.model, simulation.arm
    if model is not None:
        return [
            (each.candidate, each.coefficients, model.component_parameters(index), index not in model.unclaimed)
            for index, each in enumerate(model.effects)
        ]
    rotors = [(RotorInertia.at(arm, joint), np.array([value])) for joint, value in enumerate(arm.rotor_inertia, 1)]
    return [(rotor, value, parameter_values(rotor, value, None, 1.0), True) for rotor, value in rotors if value[0]]


def _provenance(recording: Recording, notes: dict[str, Any]) -> dict[str, Any]:
    out: dict[str, Any] = {
        "recording": recording.name,
        "runs": [run.name for run in recording.runs if run.role == "identify"],
        "version": version("armlab"),
    }
    return out | {key: value for key, value in notes.items() if value}


def _robot_path(recording: Recording) -> str:
    """The robot as a built-in name, or the path of its file."""
    return recording.robot if recording.robot in built_in_arms() else str(recording.folder / recording.robot)
