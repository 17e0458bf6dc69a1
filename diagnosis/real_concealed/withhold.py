"""A reference model without some of its parts, and what a diagnosis should say of those."""

from dataclasses import dataclass, replace

import numpy as np

from diagnosis.real_concealed.plan import Kind, Piece
from identification.components import Component
from identification.torque_model import TorqueModel
from recordings.run import Array

LAWS: dict[Kind, tuple[str, ...]] = {
    "friction": ("coulomb_friction", "viscous_friction", "nonlinear_viscous_friction"),
    "wrist coupling": ("joint_coupling",),
    "counterbalance": ("gravity_compensator",),
    "payload": (),
}
FRICTION = (
    *LAWS["friction"], "stribeck_friction", "asymmetric_friction", "load_dependent_friction", "presliding_hysteresis",
    "friction_drift",
)  # fmt: skip
IDENTICAL = {  # what no motion separates, or what goes by either name
    "payload": ("inertial_parameter_error",),
    "gravity_compensator": ("cable_stiffness",),
    "cable_stiffness": ("gravity_compensator",),
}
Number = tuple[float, tuple[float, float] | None]


@dataclass(frozen=True)
class Sought:
    """What should be named. effects: any of these; joints: (joint,), (link,), a coupling's pair, or () for the arm.

    numbers: by effect and parameter the true or the reference's value, and the reference's 95 % interval. identical:
    other effects that these data cannot tell from it. laws: other effects of the same kind.
    """

    label: str
    effects: tuple[str, ...]
    joints: tuple[int, ...]
    numbers: dict[str, dict[str, Number]]
    identical: tuple[str, ...] = ()
    laws: tuple[str, ...] = ()


def without(model: TorqueModel, pieces: tuple[Piece, ...]) -> TorqueModel:
    """The model without the pieces; ValueError where it has no such part."""
    for piece in pieces:
        if piece.kind != "payload" and not _parts(model, piece):
            raise ValueError(f"the reference model of {model.robot} has no {piece}")
    lost = {index for piece in pieces for index in _parts(model, piece)}
    parts, places = model.structure.components, model.structure.slices
    stay = [index for index in range(len(parts)) if index not in lost]
    base = len(model.structure.base)
    kept = np.concatenate([np.arange(base), *(np.arange(places[each].start, places[each].stop) for each in stay)])
    covariance = None if model.covariance is None else model.covariance[np.ix_(kept, kept)]
    structure = model.structure.with_components(tuple(parts[each] for each in stay))
    less = replace(model, structure=structure, values=model.values[kept], covariance=covariance)
    return _unloaded(less) if any(piece.kind == "payload" for piece in pieces) else less


def _unloaded(model: TorqueModel) -> TorqueModel:
    """The model with its last link as its maker drew it."""
    inertial = _links(model)
    inertial[-10:] = model.arm.parameters[-10:]
    values = model.values.copy()
    values[: len(model.structure.base)] = model.structure.base.values(inertial)
    return replace(model, inertial=inertial, values=values)


def sought_of(model: TorqueModel, pieces: tuple[Piece, ...]) -> tuple[Sought, ...]:
    """One for each joint (link, pair) that loses something."""
    return tuple(
        each for piece in pieces for each in (_load(model) if piece.kind == "payload" else _laws(model, piece))
    )


def _laws(model: TorqueModel, piece: Piece) -> tuple[Sought, ...]:
    parts = model.structure.components
    found: dict[tuple[int, ...], dict[str, dict[str, Number]]] = {}
    for index in _parts(model, piece):
        told = {each.name: (each.value, each.interval) for each in model.component_parameters(index)}
        found.setdefault(parts[index].joints, {})[parts[index].effect] = told
    return tuple(_sought(_label(piece, joints), joints, told) for joints, told in found.items())


def _sought(label: str, joints: tuple[int, ...], told: dict[str, dict[str, Number]]) -> Sought:
    """numbers of a spring hold under either of its names."""
    same = tuple(other for effect in told for other in IDENTICAL.get(effect, ()))
    numbers = told | {other: told[effect] for effect in told for other in IDENTICAL.get(effect, ())}
    laws = tuple(each for each in FRICTION if each not in told) if set(told) <= set(FRICTION) else ()
    return Sought(label, tuple(told), joints, numbers, same, laws)


def _label(piece: Piece, joints: tuple[int, ...]) -> str:
    return f"{piece.kind}, joint {joints[0]}" + (f" from {joints[1]}" if len(joints) > 1 else "")


def _load(model: TorqueModel) -> tuple[Sought, ...]:
    """The load is what the last link has more than its maker's; its interval that of the base parameter it is in."""
    more = _links(model)[-10:] - model.arm.parameters[-10:]
    link, base = len(model.arm), model.structure.base
    place = int(np.flatnonzero(base.grouping[:, -10])[0])
    half = np.nan if model.covariance is None else model.factor * float(np.sqrt(model.covariance[place, place]))
    mass = float(more[0])
    told: dict[str, dict[str, Number]] = {"payload": {"mass": (mass, (mass - half, mass + half))}}
    return (_sought(f"payload, link {link}", (link,), told),)


def _links(model: TorqueModel) -> Array:
    if model.inertial is None:
        raise ValueError(f"the reference model of {model.robot} has no links")
    return model.inertial.copy()


def _parts(model: TorqueModel, piece: Piece) -> list[int]:
    def lost(part: Component) -> bool:
        return part.effect in LAWS[piece.kind] and piece.joint in (None, part.joint)

    return [index for index, part in enumerate(model.structure.components) if lost(part)]
