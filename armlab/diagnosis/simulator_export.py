"""Export of a model to URDF or MJCF: payloads go into the links, a tilt into gravity, springs to the joints; effects
without a place in the file are listed.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.identification.export import (
    EXPORTED_EFFECTS,
    check_ending,
    format_numbers,
    mjcf_document,
    unsupported_components,
    urdf_document,
    write_files,
)
from armlab.identification.model_file import read_model
from armlab.identification.torque_model import TorqueModel
from problem.arm import Arm
from problem.inertia import link_from_centre_of_mass
from problem.pseudo_inertia import links_of, parameters_of, pseudo_inertias, regular_nominal

SPRING_PARAMETERS = {"stiffness", "rest"}
MAX_FLAT_SHARE = 1e-9  # of a link's size: rounding tells no more of a point or a rod
SPRING_EFFECTS = ("cable_stiffness", "gravity_compensator")


@dataclass(frozen=True)
class Spring:
    """stiffness (q - rest) at a joint, from 1."""

    joint: int
    stiffness: float
    rest: float


@dataclass(frozen=True, eq=False)
class SimulatorModel:
    """model: rigid bodies with what sits in them, gravity as tilted. springs: of joints. missing: has no place.

    thin: links that are points or rods, which no simulator takes: these have been given a little extent.
    """

    model: TorqueModel
    springs: tuple[Spring, ...]
    missing: tuple[str, ...]
    thickened_links: tuple[int, ...] = ()


def effects_without_place(effects: Iterable[tuple[str, frozenset[str]]]) -> tuple[str, ...]:
    """Effects, given with the names of their parameters, that an MJCF file cannot hold."""
    return tuple(dict.fromkeys(effect for effect, names in effects if not _has_place(effect, names)))


def _has_place(effect: str, names: frozenset[str]) -> bool:
    if effect in SPRING_EFFECTS:
        return names == SPRING_PARAMETERS
    return (
        effect in EXPORTED_EFFECTS
        or effect in ("base_tilt", "inertial_parameter_error")
        or (effect == "payload" and {"mass", "centre"} <= names)
    )


def build_simulator_model(known: TorqueModel) -> SimulatorModel:
    """Sorts the effects of a model into bodies, gravity and springs; the rest is named as missing."""
    arm, inertial = known.arm, known.inertial
    springs = _linear_springs(known)
    missing = [each for each in unsupported_components(known) if each not in springs]
    for extra in known.extras:
        effect, joint = extra.told["effect"], extra.told["joint"]
        named = {name: each["value"] for name, each in extra.told["parameters"].items()}
        if effect == "payload" and inertial is not None and {"mass", "centre"} <= set(named):
            inertial = inertial + _payload_parameters(named, extra.law.rows[-1], len(arm))
        elif effect == "base_tilt":
            x, y, z = (float(value) for value in named["gravity"])
            arm = replace(arm, gravity=(x, y, z))
        else:
            missing.append(effect if joint is None else f"{effect}, joint {joint}")
    inertial, thin = (None, ()) if inertial is None else _thicken_links(arm, inertial)
    return SimulatorModel(_model_with_links(known, arm, inertial), tuple(springs.values()), tuple(missing), thin)


def mjcf_text(model: SimulatorModel) -> str:
    """MJCF with springs; InputError for a model without links or with one that is no body."""
    root = ElementTree.fromstring(mjcf_document(model.model))
    by_name = {joint.name: number for number, joint in enumerate(model.model.arm.joints, 1)}
    for node in root.iter("joint"):
        for spring in model.springs:
            if by_name.get(node.get("name", "")) == spring.joint:
                node.set("stiffness", format_numbers((spring.stiffness,)))
                node.set("springref", format_numbers((spring.rest,)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def urdf_text(model: SimulatorModel) -> tuple[str, tuple[str, ...]]:
    """URDF, and what is missing in it."""
    springs = tuple(f"spring of joint {each.joint}" for each in model.springs)
    return urdf_document(model.model), (*springs, *model.missing)


def _linear_springs(known: TorqueModel) -> dict[str, Spring]:
    """Linear springs that push back, by the label of their component."""
    out = {}
    for index, part in enumerate(known.structure.components):
        named = {each.name: each.value for each in known.component_parameters(index)}
        if set(named) == SPRING_PARAMETERS and named["stiffness"] > 0:
            out[part.label] = Spring(part.joint, named["stiffness"], named["rest"])
    return out


def _payload_parameters(named: Mapping[str, Any], link: int, joints: int) -> Array:
    """Ten parameters of what a link (from 0) carries, at its place among those of all links, (10 * joints,)."""
    ten = link_from_centre_of_mass(float(named["mass"]), np.array(named["centre"]), np.zeros((3, 3))).parameters
    if "inertia" in named:
        ten[4:] = named["inertia"]
    out = np.zeros(10 * joints)
    out[10 * link : 10 * link + 10] = ten
    return out


def _thicken_links(arm: Arm, inertial: Array) -> tuple[Array, tuple[int, ...]]:
    """Links with extent in space, and which of them (from 1) had none; what no body could have stays as it is."""
    pseudos = pseudo_inertias(inertial)
    lowest = np.linalg.eigvalsh(pseudos)[:, 0] / np.maximum(np.trace(pseudos, axis1=1, axis2=2), 1e-300)
    flat = np.abs(lowest) <= MAX_FLAT_SHARE
    raised = regular_nominal(replace(arm, links=links_of(inertial)))
    whole = parameters_of(np.where(flat[:, None, None], raised, pseudos))
    return whole, tuple((np.flatnonzero(flat) + 1).tolist())


def _model_with_links(known: TorqueModel, arm: Arm, inertial: Array | None) -> TorqueModel:
    """The model with other links and gravity: another gravity may have other base parameters."""
    if inertial is None:
        return known
    structure = replace(known.structure, arm=arm)
    own = known.values[len(known.structure.base) :]
    values = np.concatenate([structure.base.values(inertial), own])
    return replace(known, structure=structure, values=values, covariance=None, inertial=inertial, extras=())


def export_model(path: Path, out: Path) -> Iterator[str]:
    """Writes the file and tells what it does not hold; InputError where the ending or the model does not fit."""
    check_ending(out)
    found = build_simulator_model(read_model(path))
    text, missing = (mjcf_text(found), found.missing) if out.suffix == ".xml" else urdf_text(found)
    yield from write_files(found.model, out, text, missing)
    if found.thickened_links:
        yield f"given a little extent, as simulators want it: link {', '.join(map(str, found.thickened_links))}"
