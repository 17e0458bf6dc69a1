"""The load of an arm whose robot file describes it without, or the gains that a known one shows.

Nobody has recorded the arm without the load, so what else the robot file lacks has to be found in the same runs. The
model is that of `armlab diagnose`; in the place of bodies that it adds there is one at the link that carries the load.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from armlab.common.arrays import Array
from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Settings, vary
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.diagnose import find_setup, prepare
from armlab.diagnosis.torque.evidence.added_body import body_groups, fit_body, payload_groups
from armlab.diagnosis.torque.names.intervals import extend_with_shapes
from armlab.diagnosis.torque.search.fitted_model import FittedModel, Progress
from armlab.diagnosis.torque.stages import find_names
from armlab.effects.contract import Candidate
from armlab.effects.links import (
    MAX_CENTRE_M,
    PAYLOAD_FACTS,
    LinkTerm,
    Payload,
    SolidBody,
    torque_of_parameters,
    unit_mass_at,
)
from armlab.effects.parameters import half_widths
from armlab.effects.scene import Scene
from armlab.effects.springs import SpringCompensator
from armlab.effects.term import format_number
from armlab.effects.words import at_place
from armlab.identification.payload import (
    CENTRE_NAMES,
    LoadNumber,
    PayloadSetting,
    TorqueGains,
    gains_document,
    gains_table,
    load_document,
    number_line,
)
from armlab.recordings.identifiable import require_identifiable
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS, Arm
from problem.pseudo_inertia import link_from_centre_of_mass

MASS_NAME = PARAMETER_NAMES[0]
UNDETERMINED = "these motions do not determine the mass of the load"
SMALLEST_SHARE = 1e-6  # of the torque of a load at the joint that feels it most: less is rounding
MAX_GAIN_HALF_WIDTH = 1.0  # a reading that may be off by all of itself says nothing
METRES = {"kg": 0, "kg.m": 1, "m": 1, "kg.m2": 2}  # how often a unit has the metre


@dataclass(frozen=True)
class MassAtPoint(LinkTerm):
    """A mass at a known point of a link. centre: the point in the link's frame, m."""

    facts = PAYLOAD_FACTS
    form = "known point"
    names = ("mass",)
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm can weigh the link."""
        return Payload.is_visible(arm, link)

    def columns(self, scene: Scene) -> Array:
        """Torque of one kilogram there."""
        return torque_of_parameters(scene, self.link, unit_mass_at(self.centre)[None])

    def added_body(self, coefficients: Array) -> Array:
        """A point mass about the link's frame."""
        return float(coefficients[0]) * unit_mass_at(self.centre)

    def equation(self, coefficients: Array) -> str:
        return f"link {self.link} carries {format_number(coefficients[0])} kg"


@dataclass(frozen=True)
class LoadAtJoint(LinkTerm):
    """The torque of a known load at one joint: the coefficient is how many times the reading there is too large.

    load: its ten parameters in the link's frame. felt_at: the joint, from 1.
    """

    facts = PAYLOAD_FACTS
    form = "known load"
    names = ("gain",)
    load: tuple[float, ...] = (0.0,) * 10
    felt_at: int = 1

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm can weigh the link."""
        return Payload.is_visible(arm, link)

    @classmethod
    def each(cls, link: int, load: Array) -> list[Self]:
        """At each joint up to a link, from 1. load: (10,)."""
        ten = tuple(load.tolist())
        return [cls(link, (link,), (joint - 1,), load=ten, felt_at=joint) for joint in range(1, link + 1)]

    def columns(self, scene: Scene) -> Array:
        """Torque of the load at the joint."""
        joint = self.felt_at - 1
        return torque_of_parameters(scene, self.link, np.array([self.load]))[:, joint : joint + 1]

    def equation(self, coefficients: Array) -> str:
        return f"the load counts {format_number(coefficients[0])} times at joint {self.felt_at}"


@dataclass(frozen=True)
class FoundLoad:
    """Numbers of a load that the motions determine, the names of those that they do not, and what stands beside it."""

    link: int
    numbers: tuple[LoadNumber, ...]
    undetermined: tuple[str, ...]
    beside: tuple[str, ...]


def nominal_payload_lines(loaded: Path, setting: PayloadSetting, progress: Progress) -> ResultLines:
    """The load of a recording beside the robot file's links, with intervals.

    Raises InputError, in one line, where the recording does not determine its mass.
    """
    recording = load_recording(loaded)
    setting.check(recording.arm)
    if recording.arm.links is None:
        raise InputError(f"--without is needed: the robot {recording.arm.name} has no nominal `links` to stand for it")
    require_identifiable(recording)
    settings = _settings_of(setting)
    setup = find_setup(recording, None, settings, progress)
    if setup is not None and setup.mistakes:
        yield setup.sentence
    found = find_load(setup.recording if setup else recording, setting, settings, progress)
    yield from (number_line(each) for each in found.numbers)
    if found.undetermined:
        yield "not determined by these motions: " + ", ".join(found.undetermined)
    if found.beside:
        yield "beside it: " + ", ".join(found.beside)
    document = load_document(found.link, found.numbers)
    return {**document, "not_determined": list(found.undetermined), "beside": list(found.beside)}


def _settings_of(setting: PayloadSetting) -> Settings:
    """Those of a diagnosis, with the cut-off that a person gives."""
    return Settings() if setting.cutoff_hz is None else vary(Settings(), "data.cutoff_hz", setting.cutoff_hz)


def nominal_gains_lines(loaded: Path, mass: float, setting: PayloadSetting, progress: Progress) -> ResultLines:
    """The gain of each joint's torque reading from a known load beside the robot file's links.

    The recording is taken as it is read: a wrong gain is a mistake of reading. mass: of the load, kg, at the centre of
    the setting. Raises InputError, in one line, where no joint feels the load.
    """
    recording = load_recording(loaded)
    setting.check(recording.arm)
    require_identifiable(recording)
    if recording.arm.links is None:
        raise InputError(f"--without is needed: the robot {recording.arm.name} has no nominal `links` to stand for it")
    load = link_from_centre_of_mass(mass, np.array(setting.place.centre or (0.0, 0.0, 0.0)), np.zeros((3, 3)))
    gains = find_gains(recording, load.parameters, setting, progress)
    yield from gains_table(gains)
    return gains_document(gains)


def find_gains(recording: Recording, load: Array, setting: PayloadSetting, progress: Progress) -> TorqueGains:
    """How much each joint's torque reading is too large, by a load of known parameters (10,) in its link's frame.

    The robot file's links stand for the arm without it, as its readings have them. Raises InputError where no joint
    feels the load.
    """
    link, joints = setting.place.link or len(recording.arm), len(recording.arm)
    bare = _bare_model(recording, link, setting, _settings_of(setting), progress)
    gains, half = np.full((2, joints), np.nan)
    candidates, groups = LoadAtJoint.each(link, load), {}
    sizes = [max(float(np.abs(each.columns(scene)).max()) for scene in bare.design.scenes) for each in candidates]
    for candidate, size in zip(candidates, sizes, strict=True):
        if size > SMALLEST_SHARE * max(sizes):
            bare, groups[candidate.felt_at - 1] = _with_candidate(bare, candidate)
    wide = extend_with_shapes(bare)
    for joint, group in groups.items():
        spread = wide.factor * float(np.sqrt(wide.covariance(group)[0, 0]))
        if spread < MAX_GAIN_HALF_WIDTH:
            gains[joint], half[joint] = float(bare.solver.values(bare.fit, group)[0]), spread
    if np.isnan(gains).all():
        raise InputError(
            f"{recording.folder}: these motions do not determine the gains: no joint feels the load enough"
        )
    return TorqueGains(gains, half)


def _bare_model(
    recording: Recording, link: int, setting: PayloadSetting, settings: Settings, progress: Progress
) -> FittedModel:
    """What the robot file lacks but a load at a link, from 1: as `armlab diagnose` finds it, without added bodies."""
    design = prepare(recording, None, settings, progress)
    if isinstance(design, Diagnosis):
        raise InputError(f"{recording.folder}: {design.reason}")
    if design.prior is None:
        raise InputError(f"--without is needed: links of the robot {recording.arm.name} have no mass")
    return _with_counterbalance(_without_bodies(find_names(design, 0, progress).model, link), setting.counterbalanced)


def find_load(recording: Recording, setting: PayloadSetting, settings: Settings, progress: Progress) -> FoundLoad:
    """The load of a recording that is read rightly; InputError where its mass is not determined."""
    link, centre = setting.place.link or len(recording.arm), setting.place.centre
    bare = _bare_model(recording, link, setting, settings, progress)
    candidates = [bare.candidate(each) for each in bare.state.groups]
    beside = tuple(
        at_place(recording.arm, each.facts.words, each.effect, each.joint, each.joints) for each in candidates
    )
    if centre is not None:
        mass = _numbers(*_with_candidate(bare, MassAtPoint.at(recording.arm, link, centre=centre)))[MASS_NAME]
        if not np.isfinite(mass.half_width):
            raise InputError(f"{recording.folder}: {UNDETERMINED}: no joint feels a mass there")
        return FoundLoad(link, (mass,), (), beside)
    groups = body_groups(bare.solver)
    if link not in groups:
        raise InputError(f"{recording.folder}: {UNDETERMINED}: no joint feels the mass of link {link} alone")
    free = _numbers(replace(bare, state=bare.state.plus(groups[link])), groups[link])
    mass, names = free[MASS_NAME], (*PARAMETER_NAMES, *CENTRE_NAMES)
    if not np.isfinite(mass.half_width):
        raise InputError(f"{recording.folder}: {UNDETERMINED} at link {link}")
    if mass.value <= mass.half_width:
        return FoundLoad(link, (mass,), names[1:], beside)
    body = fit_body(bare, bare.state, groups[link], link).ten
    held = _numbers(*_with_candidate(bare, SolidBody.of_body(recording.arm, link, body)))
    determined = [each for each in names if each in free and _says_where(free[each], mass.value)]
    undetermined = tuple(each for each in names if each not in determined)
    return FoundLoad(link, tuple(held[each] for each in determined), undetermined, beside)


def _says_where(number: LoadNumber, mass: float) -> bool:
    """Whether an interval is narrower than loads of this mass differ."""
    weight = mass if number.unit.startswith("kg") else 1.0
    return number.half_width <= weight * MAX_CENTRE_M ** METRES[number.unit]


def _without_bodies(model: FittedModel, link: int) -> FittedModel:
    """The model without bodies that are added, and with the link (from 1) as in the robot file."""
    groups = tuple(each for each in model.state.groups if each not in payload_groups(model))
    widths = tuple(0.0 if each == link else width for each, width in enumerate(model.state.widths or (), 1))
    return replace(model, state=State(groups, widths))


def _with_counterbalance(model: FittedModel, joint: int | None) -> FittedModel:
    """The model with a spring at a joint, where it has no counterbalance there already."""
    if joint is None:
        return model
    spring = SpringCompensator.at(model.design.simulation.arm, joint)
    inside = [model.candidate(each) for each in model.state.groups]
    if any(each.effect == spring.effect and each.joint == joint for each in inside):
        return model
    return _with_candidate(model, spring)[0]


def _with_candidate(model: FittedModel, candidate: Candidate) -> tuple[FittedModel, int]:
    """The model with one more candidate, and its group."""
    design, number = model.design, len(model.design.blocks)
    design = replace(design, blocks=(*design.blocks, design.block(candidate, 0)))
    moments, solver = design.solver(model.noise)
    return FittedModel(design, model.noise, moments, solver, model.state.plus(number), model.steps), number


def _numbers(model: FittedModel, group: int) -> dict[str, LoadNumber]:
    """The numbers of a body that a model adds, by name: those that stand for themselves, and its centre."""
    wide, candidate = extend_with_shapes(model), model.candidate(group)
    values, covariance = model.solver.values(model.fit, group), wide.covariance(group)
    ten, slopes = _ten(candidate, values), _slopes(candidate, values)
    clear = candidate.clear if isinstance(candidate, Payload) else tuple(range(10))
    half = half_widths(slopes, covariance, wide.factor)
    rows = zip(PARAMETER_NAMES, ten.tolist(), half.tolist(), PARAMETER_UNITS, strict=True)
    numbers = [row for index, row in enumerate(rows) if index in clear]
    if {0, 1, 2, 3} <= set(clear) and ten[0]:
        centre = ten[1:4] / ten[0]
        spread = half_widths((slopes[1:4] - np.outer(centre, slopes[0])) / ten[0], covariance, wide.factor)
        numbers += zip(CENTRE_NAMES, centre.tolist(), spread.tolist(), ["m"] * 3, strict=True)
    return {row[0]: LoadNumber(*row) for row in numbers}


def _ten(candidate: Candidate, values: Array) -> Array:
    body = candidate.added_body(values)
    if body is None:
        raise TypeError(f"{candidate.effect} is no body")
    return body


def _slopes(candidate: Candidate, values: Array) -> Array:
    """Derivatives of ten parameters by the numbers of a body, (10, numbers): its coefficients, then its shape."""
    by_values = np.column_stack([_ten(candidate, unit) for unit in np.eye(len(values))])
    if not isinstance(candidate, SolidBody):
        return by_values
    return np.column_stack([by_values, values[0] * np.eye(10)[:, 1:]])
