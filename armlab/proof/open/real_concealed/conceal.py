"""How something is concealed in a real recording: the reference model that is identified first, parts withheld from
it, known disturbances added to the recorded torque, and what a diagnosis should name.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate
from armlab.effects.library import library
from armlab.identification.identifier import Identifier
from armlab.identification.selection import Groups, components_of, describe_choice, select_structure
from armlab.identification.torque_model import TorqueModel
from armlab.proof.open.real_concealed.concealed_case import Disturbance, Piece, PieceKind
from armlab.proof.open.real_identification.identify_recording import Recipe
from armlab.recordings.differentiate import differentiate, resample_evenly
from armlab.recordings.recording import Recording, Run
from problem.arm import Arm
from problem.motion import Motion
from problem.pseudo_inertia import link_from_centre_of_mass
from problem.regressor import observation_matrix, rigid_body_torque

MIXED_LAWS = ("direction", "cube root", "square", "load")
"""Laws of velocity or load that only improve a sum of laws. None is an effect by itself, so none can be named."""


@dataclass(frozen=True, eq=False)
class ReferenceModel:
    """A recording and its complete model. description: how the model was chosen, in a line."""

    recording: Recording
    model: TorqueModel
    description: str


def identify_reference(recording: Recording, recipe: Recipe) -> ReferenceModel:
    """Components, filters and prior by blocked cross-validation; links are bodies that can exist.

    The diagnosis measures errors of links in the metric of their pseudo-inertias, so it needs links, not base
    parameters.
    """
    arm, runs = recording.arm, recording.with_role("identify")
    groups: Groups = {name: parts for name, parts in recipe.groups(arm).items() if name not in MIXED_LAWS}
    choice = select_structure(arm, runs, groups, recipe.pulls(arm), recipe.starts).choice
    filters = choice.cutoff_hz, recording.robot, choice.position_factor
    components = components_of(groups, choice.groups)
    model = Identifier(arm, components, "physical", choice.pull, *filters).fit(runs).model_
    return ReferenceModel(recording, model, describe_choice(choice))


LAWS_BY_KIND: dict[PieceKind, tuple[str, ...]] = {
    "friction": ("coulomb_friction", "viscous_friction", "nonlinear_viscous_friction"),
    "wrist coupling": ("joint_coupling",),
    "counterbalance": ("gravity_compensator",),
    "payload": (),
}
EQUIVALENT_NAMES = {"inertial_parameter_error": "payload", "gravity_compensator": "cable_stiffness"}
"""What no motion separates, or what goes by either name; both count as the second one."""
EQUIVALENT_AT_ONLY_JOINT = {"channel_skew": "time_delay", "rotor_inertia": "payload"}
"""The same at the only joint of an arm."""


@dataclass(frozen=True)
class SoughtEffect:
    """What should be named.

    effects: ids, any of which answers. joints: (joint,), (link,), (joint, driving joint), or () for the whole arm.
    numbers: by effect and parameter the value that is true or of the reference.
    identical: other effects that no motion separates from it. laws: other effects of the same kind.
    """

    label: str
    effects: tuple[str, ...]
    joints: tuple[int, ...]
    numbers: dict[str, dict[str, float]]
    identical: tuple[str, ...] = ()
    laws: tuple[str, ...] = ()


def equivalent_effects(effect: str) -> tuple[str, ...]:
    """The other effects that count as this one at any joint."""
    common = EQUIVALENT_NAMES.get(effect, effect)
    alike = (common, *(name for name, other in EQUIVALENT_NAMES.items() if other == common))
    return tuple(name for name in alike if name != effect)


def friction_laws() -> tuple[str, ...]:
    """All effects of the library that take energy from the motion, those of plug-ins included."""
    return tuple(family.effect for family in library() if family.facts.dissipates)


def withhold_pieces(model: TorqueModel, pieces: tuple[Piece, ...]) -> TorqueModel:
    """The model without the pieces; ValueError where it has no such part."""
    for piece in pieces:
        if piece.kind != "payload" and not _part_indices(model, piece):
            raise ValueError(f"the reference model of {model.robot} has no {piece}")
    lost = {index for piece in pieces for index in _part_indices(model, piece)}
    parts, places = model.structure.components, model.structure.slices
    stay = [index for index in range(len(parts)) if index not in lost]
    base = len(model.structure.base)
    kept = np.concatenate([np.arange(base), *(np.arange(places[each].start, places[each].stop) for each in stay)])
    covariance = None if model.covariance is None else model.covariance[np.ix_(kept, kept)]
    structure = model.structure.with_components(tuple(parts[each] for each in stay))
    stated = tuple(model.stated[each] for each in stay) if model.stated else ()
    less = replace(model, structure=structure, values=model.values[kept], covariance=covariance, stated=stated)
    return _without_load(less) if any(piece.kind == "payload" for piece in pieces) else less


def _without_load(model: TorqueModel) -> TorqueModel:
    """The model with its last link as its maker drew it."""
    inertial = _model_links(model)
    inertial[-10:] = model.arm.parameters[-10:]
    values = model.values.copy()
    values[: len(model.structure.base)] = model.structure.base.values(inertial)
    return replace(model, inertial=inertial, values=values)


def sought_of_pieces(model: TorqueModel, pieces: tuple[Piece, ...]) -> tuple[SoughtEffect, ...]:
    """One for each joint (link, pair) that loses something."""
    return tuple(
        each
        for piece in pieces
        for each in (_sought_load(model) if piece.kind == "payload" else _sought_laws(model, piece))
    )


def _sought_laws(model: TorqueModel, piece: Piece) -> tuple[SoughtEffect, ...]:
    parts = model.structure.components
    numbers_by_place: dict[tuple[int, ...], dict[str, dict[str, float]]] = {}
    for index in _part_indices(model, piece):
        numbers = {each.name: float(np.sum(each.value)) for each in model.component_parameters(index)}
        numbers_by_place.setdefault(parts[index].joints, {})[parts[index].effect] = numbers
    return tuple(
        _build_sought(_piece_label(piece, joints), joints, numbers) for joints, numbers in numbers_by_place.items()
    )


def _build_sought(label: str, joints: tuple[int, ...], known: dict[str, dict[str, float]]) -> SoughtEffect:
    """A spring or a body keeps its numbers under each of its equivalent names. known: by effect and parameter."""
    same = tuple(other for effect in known for other in equivalent_effects(effect))
    numbers = known | {other: known[effect] for effect in known for other in equivalent_effects(effect)}
    friction = friction_laws()
    laws = tuple(each for each in friction if each not in known) if set(known) <= set(friction) else ()
    return SoughtEffect(label, tuple(known), joints, numbers, same, laws)


def _piece_label(piece: Piece, joints: tuple[int, ...]) -> str:
    return f"{piece.kind}, joint {joints[0]}" + (f" from {joints[1]}" if len(joints) > 1 else "")


def _sought_load(model: TorqueModel) -> tuple[SoughtEffect, ...]:
    """The load: the last link as identified, less the link of its maker."""
    more = _model_links(model)[-10:] - model.arm.parameters[-10:]
    link = len(model.arm)
    return (_build_sought(f"payload, link {link}", (link,), {"payload": {"mass": float(more[0])}}),)


def _model_links(model: TorqueModel) -> Array:
    if model.inertial is None:
        raise ValueError(f"the reference model of {model.robot} has no links")
    return model.inertial.copy()


def _part_indices(model: TorqueModel, piece: Piece) -> list[int]:
    def is_withheld(part: Candidate) -> bool:
        return part.effect in LAWS_BY_KIND[piece.kind] and piece.joint in (None, part.joint)

    return [index for index, part in enumerate(model.structure.components) if is_withheld(part)]


MAIN_PARAMETER = {
    "payload": "mass",
    "cable_stiffness": "stiffness",
    "time_delay": "seconds",
    "channel_skew": "seconds",
    "viscous_friction": "coefficient",
    "coulomb_friction": "level",
    "torque_gain_error": "gain",
    "torque_ripple": "amplitude",
    "rotor_inertia": "inertia",
    "torque_offset": "offset",
}
LATE_KINDS = ("time_delay", "channel_skew")


def add_disturbance(run: Run, arm: Arm, what: Disturbance) -> tuple[Run, Array]:
    """The run, even in time, with the disturbance, and what that adds to its torque, (samples, joints), N m (N).

    The motion is smoothed at the cut-off of least error of the acceleration, which is not that of the diagnosis. A
    late channel reads the recorded torque, noise and all, that much earlier by cubic splines; the first samples, before
    which nothing was recorded, are left out.
    """
    even = resample_evenly(run)
    if what.effect in LATE_KINDS:
        kept = even.time - what.size >= even.time[0]
        late = np.asarray(make_interp_spline(even.time, even.torque, k=3)(even.time[kept] - what.size))
        if what.joint is not None:
            others = np.arange(len(arm)) != what.joint - 1
            late[:, others] = even.torque[kept][:, others]
        return replace(even.rows(kept), torque=late), late - even.torque[kept]
    added = _disturbance_torque(what, arm, even)
    return replace(even, torque=even.torque + added), added


def sought_of_disturbance(what: Disturbance, arm: Arm) -> SoughtEffect:
    """What should be named.

    The only joint of an arm cannot tell its own skew from a delay of all, nor a load from a rotor; no joint tells its
    rotor from a link that may have any inertia about its axis.
    """
    value = 1 + what.size if what.effect == "torque_gain_error" else what.size
    size: dict[str, float] = {MAIN_PARAMETER[what.effect]: value}
    if what.effect == "torque_ripple":
        size["order"] = float(what.order)
    numbers: dict[str, dict[str, float]] = {what.effect: size}
    place = () if what.joint is None else (what.joint,)
    same = equivalent_effects(what.effect)
    numbers |= dict.fromkeys(same, size)
    if len(arm) == 1:
        alike = tuple(name for name, other in EQUIVALENT_AT_ONLY_JOINT.items() if other == what.effect)
        same += alike
        numbers |= {name: {MAIN_PARAMETER[name]: what.size} for name in alike}
    if what.effect == "rotor_inertia" and what.joint is not None and links_hold_rotor(arm, what.joint):
        same += ("payload", *equivalent_effects("payload"))
    return SoughtEffect(str(what), (what.effect,), place, numbers, same)


ROTOR_STATES = 200  # random states at which a rotor is compared with links
MAX_ROTOR_REST = 1e-6  # of its torque, beyond which links do not hold it


def links_hold_rotor(arm: Arm, joint: int) -> bool:
    """Whether no motion separates the rotor of a joint, from 1, from inertial parameters of links."""
    rng = np.random.default_rng(0)
    motion = Motion(*rng.uniform(-2, 2, (3, ROTOR_STATES, len(arm))))
    rotor = np.zeros((ROTOR_STATES, len(arm)))
    rotor[:, joint - 1] = motion.acceleration[:, joint - 1]
    links = observation_matrix(arm, motion)
    held = links @ np.linalg.lstsq(links, rotor.ravel(), rcond=None)[0]
    return bool(np.linalg.norm(held - rotor.ravel()) < MAX_ROTOR_REST * np.linalg.norm(rotor))


def _disturbance_torque(what: Disturbance, arm: Arm, run: Run) -> Array:
    """Torque of a disturbance on an even run, (samples, joints), N m (N)."""
    if what.joint is None:
        raise ValueError(f"{what.effect} needs a joint")
    joint, motion = what.joint - 1, differentiate(run).motion
    if what.effect == "payload":
        ball = 0.4 * what.size * what.radius**2 * np.eye(3)
        phi = np.zeros(10 * len(arm))
        ten = slice(10 * joint, 10 * joint + 10)
        phi[ten] = link_from_centre_of_mass(what.size, np.array(what.centre), ball).parameters
        return rigid_body_torque(arm, motion, phi)
    out = np.zeros(motion.position.shape)
    out[:, joint] = what.size * _unit_law(what, joint, motion, run.torque)
    return out


def _unit_law(what: Disturbance, joint: int, motion: Motion, torque: Array) -> Array:
    """What a disturbance of size 1 adds at its joint, from 0, (samples,)."""
    position, velocity = motion.position[:, joint], motion.velocity[:, joint]
    match what.effect:
        case "cable_stiffness":
            return position - what.rest
        case "viscous_friction":
            return velocity
        case "coulomb_friction":
            return np.asarray(np.tanh(velocity / what.width))
        case "torque_gain_error":
            return torque[:, joint]
        case "torque_ripple":
            return np.asarray(np.sin(what.order * position + what.phase))
        case "rotor_inertia":
            return motion.acceleration[:, joint]
        case "torque_offset":
            return np.ones(len(position))
        case _:
            raise ValueError(f"{what.effect} is no law at one joint")
