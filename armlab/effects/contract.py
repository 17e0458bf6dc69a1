"""What an effect of the library consists of: facts, laws at a place (candidates), and the family that offers them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from string import Formatter
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.settings import suggest_name
from armlab.effects.scene import Scene
from problem.arm import Arm

__all__ = ["Candidate", "Cause", "Effect", "Family", "Kind", "Parameter", "Range", "Scene", "Value"]

Kind = Literal["revolute", "prismatic"]
Cause = Literal[
    "friction",
    "drive",
    "links",
    "gravity and springs",
    "transmission",
    "timing",
    "contact",
    "geometry",
    "unknown",
]
Value = float | tuple[float, ...]

TORQUE, ANGLE, INERTIA = "{torque}", "{position}", "{inertia}"  # units that depend on how the joint moves
UNITS: Mapping[Kind, Mapping[str, str]] = MappingProxyType(
    {
        "revolute": {"torque": "N.m", "position": "rad", "inertia": "kg.m2"},
        "prismatic": {"torque": "N", "position": "m", "inertia": "kg"},
    }
)
MAX_SCALE_RATIO = 3.0  # of the prior scale; no arm has a larger coefficient (chosen by eye)


@dataclass(frozen=True)
class Range:
    """Sizes that a parameter has on arms, SI units: (lowest, highest), and where that is known from.

    prismatic: the same at a joint that slides, where it differs.
    """

    revolute: tuple[float, float]
    source: str
    prismatic: tuple[float, float] | None = None

    def limits(self, kind: Kind = "revolute") -> tuple[float, float]:
        """Lowest and highest at a joint that turns or slides."""
        return self.prismatic if kind == "prismatic" and self.prismatic is not None else self.revolute


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect: its name, its unit, and whether physics wants it positive.

    plausible: sizes that it has on arms; None where nothing general is known. max_width: an interval that is wider, in
    its unit, tells nothing. detail: it may be unknown though the effect is certain. sampled: a shift in time, which
    below one sampling interval is how a log is made.
    """

    name: str
    unit: str
    positive: bool = False
    plausible: Range | None = None
    max_width: float = float("inf")
    detail: bool = False
    sampled: bool = False

    def unit_for(self, kind: Kind = "revolute") -> str:
        """The unit at a joint that turns or slides."""
        return self.unit.format(**UNITS[kind])


@dataclass(frozen=True)
class Effect:
    """Everything that is known of an effect, whatever law it follows.

    id: its name in verdicts and models. meaning: a line for a list. parameters: those that a finding may give.
    law: its equation in LaTeX, in its commonest form; words are parameters, j is the joint.
    title: its name in a sentence; the id with spaces where it is left out.
    sentence: how a verdict says that it was found, without a full stop; `{model}` is what the recording is compared
    with (`the simulation`), `{place}` the joint, the link or `the whole robot`. Left out where `{model} lacks TITLE at
    {place}` says it. figures: what stands behind that sentence, each parameter's name in braces for its value with
    unit and interval, `{frame}` for the name of the joint.
    where: `joint` for an effect at one joint, `coupling` where torque and motion are at two joints, `link` for
    parameters of a link, `robot` for an effect of the whole arm (its joint is null).
    usual: every arm has it. common: many arms have some of it, so that a model may hold it where the evidence is too
    little for a claim. dissipates: it takes energy from the motion.
    sticks: at rest it takes any value up to its level, so data at a standstill do not determine it.
    contains: ids of simpler effects at the same joint. A law of this effect has to explain more than they do.
    one_of: name of a set of effects of which a joint has at most one. last_resort: it can follow any other effect of
    that set, so it is named only where it is clearly better than each of them.
    at_most_beside: ids of other effects, and how many of each may stand beside this one.
    equal_sums: pairs of effects which together are this effect exactly, for any motion.
    prior_scale: standard deviation (SI units) of the normal prior about zero of its coefficients; infinite where
    nothing is known. single_event: it happens once, in one stretch of one run, and no other data repeat it.
    scanned: its places are found by a scan of the residual, not by columns alone.
    in_links: the links of a model hold it, so that it is no term beside them.
    scales_torque: it is a scale by which torque is read; one that bends looks like it, and has no name.
    axis: the variable against which a figure shows it; `cycle` is the position within one wave, of which a parameter
    `order` says how many there are in a turn.
    experiment: the next experiment that separates it from its rivals.
    origin: the cause to which the story of a verdict counts it; where it is left out, its other facts say it (`cause`).
    """

    id: str
    meaning: str
    parameters: tuple[Parameter, ...] = ()
    law: str = field(default="", kw_only=True)
    title: str = ""
    sentence: str = field(default="", kw_only=True)
    figures: str = field(default="", kw_only=True)
    where: Literal["joint", "coupling", "link", "robot"] = "joint"
    usual: bool = False
    common: bool = False
    dissipates: bool = False
    sticks: bool = False
    contains: tuple[str, ...] = ()
    one_of: str = ""
    last_resort: bool = False
    at_most_beside: Mapping[str, int] = field(default_factory=dict, hash=False)
    equal_sums: tuple[tuple[str, str], ...] = ()
    prior_scale: float = float("inf")
    single_event: bool = False
    scanned: bool = False
    in_links: bool = False
    scales_torque: bool = False
    axis: Literal["velocity", "position", "acceleration", "time", "cycle", ""] = ""
    experiment: str = ""
    origin: Cause | None = None

    def __post_init__(self) -> None:
        """Raises ValueError if a sentence has a field that nothing fills."""
        parameters = {parameter.name for parameter in self.parameters}
        for text, known in ((self.sentence, {"model", "place"}), (self.figures, {"frame", *parameters})):
            unknown = {field for _, field, _, _ in Formatter().parse(text) if field is not None} - known
            if unknown:
                wrong = ", ".join(sorted(unknown))
                raise ValueError(f"{self.id}: {text!r} has the fields {wrong}, known are {', '.join(sorted(known))}")

    @property
    def cause(self) -> Cause:
        """The cause to which the story of a verdict counts it."""
        if self.origin is not None:
            return self.origin
        if self.where == "link":
            return "links"
        if self.dissipates:
            return "friction"
        if self.single_event:
            return "contact"
        return "transmission" if self.where == "coupling" else "drive"

    @property
    def words(self) -> str:
        """Its name in a sentence."""
        return self.title or self.id.replace("_", " ")

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; ValueError, with the right names, for an unknown one."""
        found = {parameter.name: parameter for parameter in self.parameters}
        if name not in found:
            raise ValueError(f"'{name}' is no parameter of {self.id}: {suggest_name(name, list(found))}")
        return found[name]


COULOMB_LEVEL = Parameter("level", TORQUE, positive=True)
VISCOUS_COEFFICIENT = Parameter("coefficient", f"{TORQUE}.s/{ANGLE}", positive=True)
STIFFNESS = Parameter("stiffness", f"{TORQUE}/{ANGLE}", positive=True)
HALF_CIRCLE = 3.1416  # rad: a phase whose interval is wider has not even a sign

UNKNOWN = Effect(
    "unknown",
    "structure that no effect of this library explains",
    sentence="Something that no known effect explains acts at {place}",
    origin="unknown",
    experiment="move the joint alone over the variables it depends on, one at a time",
)


class Candidate(ABC):
    """A law of an effect at a place, its nonlinear parameters held: linear in its coefficients.

    facts: the effect. joint: from 1, None for the whole robot, the link for parameters of a link. joints: (where the
    torque appears, where the motion is) for a coupling. rows: the joints, from 0, whose torque its columns change.
    form: which of the effect's laws, where it has several. shape: values of the nonlinear parameters, in their order;
    bounds: one (lowest, highest) a value.
    follows_model: its columns depend on `Scene.torque` or `Scene.inertial` and are made anew when the model changes.
    follows_closely: a law that follows the model and needs the motion at the bandwidth of the torque. Other such laws
    get a motion that is smoothed further, so that encoder noise in their columns does not explain itself.
    of_channel: a fault of the torque's channel (a gain, a delay, a limit). It acts on the torque of all other effects,
    which is what `Scene.torque` holds.
    replaces: effects at the same joint whose columns are among its own, as Coulomb friction is in Stribeck friction. A
    model has either them or this law. (`Effect.contains` is about what a law has to explain better, and does not
    exclude.) identical: effects that no motion separates from this law.
    second_name: another effect has the same columns and is searched for instead; the columns carry its name first.
    names: of its parameters, in the order of `parameters`. size: number of its coefficients. of_time: its columns
    depend on the order of the samples in time, so single instants do not determine its torque. of_one_run: it happened
    once in a recording, so a model that is written for others does not hold it.
    looks: number of alternatives from which a scan of the residual chose it, for the correction of p-values.
    """

    facts: ClassVar[Effect]
    joint: int | None
    joints: tuple[int, ...]
    rows: tuple[int, ...]
    form: str = ""
    shape: tuple[float, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    follows_model: bool = False
    follows_closely: bool = False
    replaces: tuple[str, ...] = ()
    identical: tuple[str, ...] = ()
    second_name: bool = False
    names: ClassVar[tuple[str, ...]] = ()
    of_time: bool = False
    of_one_run: bool = False
    of_channel: bool = False
    looks: int = 1

    @property
    def effect(self) -> str:
        """The id of its effect."""
        return self.facts.id

    @property
    def size(self) -> int:
        """Number of its coefficients."""
        return 1

    @property
    def is_friction(self) -> bool:
        """Whether it is friction of one joint by that joint's own motion."""
        return self.facts.dissipates and self.facts.where == "joint" and len(self.joints) == 1

    @property
    def outgrows_speed(self) -> bool:
        """Whether its torque grows faster than the speed: slow motions do not tell its torque in fast ones."""
        return False

    def is_friction_of(self, joint: int) -> bool:
        """Whether it is friction of this joint, from 1, alone."""
        return self.is_friction and self.joint == joint

    @property
    def label(self) -> str:
        """Effect, law and place, for a table."""
        details = [*([self.form] if self.form else []), *(f"{value:.4g}" for value in self.shape)]
        law = f" ({', '.join(details)})" if details else ""
        if self.joint is None:
            return f"{self.effect}{law}"
        driver = f" from {self.joints[1]}" if len(self.joints) > 1 else ""
        return f"{self.effect}{law}, {'link' if self.facts.where == 'link' else 'joint'} {self.joint}{driver}"

    @abstractmethod
    def columns(self, scene: Scene) -> Array:
        """Torque for each coefficient at one: (samples, len(rows), coefficients), N m (N)."""

    @classmethod
    def columns_together(cls, candidates: Sequence["Candidate"], scene: Scene) -> list[Array]:
        """The columns of several candidates of this class; where they share work, in less time."""
        return [each.columns(scene) for each in candidates]

    @abstractmethod
    def with_shape(self, shape: tuple[float, ...]) -> "Candidate":
        """The same law at the same place with other nonlinear parameters."""

    @abstractmethod
    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Parameters by their names, SI units; the nonlinear ones included.

        A vector (a centre of mass, a direction of gravity) is a tuple.
        """

    @abstractmethod
    def unit(self, name: str) -> str:
        """Unit of one of its parameters."""

    @abstractmethod
    def equation(self, coefficients: Array) -> str:
        """The law with its numbers, like `tau_2 += 2.31 qd_2`."""

    @abstractmethod
    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """The law of physics that these coefficients break beyond their uncertainty, in a few words; else None."""

    def absurdity(self, coefficients: Array) -> str | None:
        """Why no arm has an effect of this size, in a few words; else None."""
        largest = float(np.abs(coefficients).max(initial=0.0))
        return f"{largest:.3g} is more than any arm has" if largest > MAX_SCALE_RATIO * self.facts.prior_scale else None

    def prior_scale(self, inertial: Array | None) -> float:
        """Standard deviation of its coefficients; infinite where nothing is known. inertial: (10 * joints,)."""
        return self.facts.prior_scale

    def known(self, coefficients: Array) -> Array | None:
        """Inverse covariance of its coefficients and shapes by what physics tells of them; None for nothing."""
        return None

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """Fields of a simulator's joint that are this law, in SI units; empty where none is.

        Friction needs none: all friction of a joint becomes the nearest line of Coulomb and viscous friction. Names as
        in MJCF: damping, frictionloss, armature, stiffness, springref.
        """
        return {}

    def added_body(self, coefficients: Array) -> Array | None:
        """Inertial parameters (10,) that it adds to its link, about the link's frame; None for what is no body."""
        return None

    def changed_gravity(self, coefficients: Array) -> Array | None:
        """Gravity (3,) in the base frame that it stands for, m/s2; None for another effect."""
        return None

    def first_name(self, coefficients: Array, scenes: Sequence[Scene]) -> "Candidate":
        """This law, or the law of another effect with the same columns that fits these coefficients better in name.

        A linear spring that carries gravity is a compensator, not a cable.
        """
        return self


class Family(ABC):
    """All candidates of one effect. Registered through the entry-point group `armlab.effects`."""

    facts: Effect

    @property
    def effect(self) -> str:
        """The id of the effect."""
        return self.facts.id

    @abstractmethod
    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """One list a place: the same law there with each shape worth a first look (one if it has none)."""

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The same after a cheap look at what the present model leaves, where a plain grid is long.

        residuals: one a scene, (samples, joints), N m (N), with NaN where it is not known. A candidate's
        `looks` says how many alternatives the look has compared.
        """
        return self.candidates(arm, scenes)

    def from_parameters(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The candidate and the coefficients that have these parameters, as a model file gives them.

        joints: (joint or link, joint of the motion); empty for the whole robot. form: as in `Candidate.form`;
        the names of the parameters decide where it is left out. Raises ValueError where they do not fit.
        """
        raise ValueError(f"{self.effect} cannot be computed from its parameters")
