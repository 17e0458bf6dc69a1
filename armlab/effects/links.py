"""Bodies that the simulation does not have or has wrong: payloads and errors of a link's inertial parameters."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Effect, Family, Parameter, Scene, Value
from armlab.effects.term import SIGN_SIGMAS, Term, format_number
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS, Arm
from problem.motion import Motion
from problem.pseudo_inertia import pseudo_inertia_basis
from problem.regressor import observation_matrix, torque_of_links

PLACE_PARAMETERS = (Parameter("centre", "m"), Parameter("inertia", "kg.m2"))
PAYLOAD_FACTS = Effect(
    "payload",
    "a body carried by a link",
    (Parameter("mass", "kg", positive=True), *PLACE_PARAMETERS),
    sentence="The arm carries a load that {model} does not have",
    figures="{mass} at {centre} from {frame}",
    law=r"\Delta\tau = Y_l(q, \dot q, \ddot q) \; \phi(\text{mass}, \text{centre}, \text{inertia})",
    where="link",
    experiment="repeat the motion with nothing attached, or weigh what the link carries",
)
INERTIAL_ERROR_FACTS = Effect(
    "inertial_parameter_error",
    "a link that is not as the simulation has it",
    (Parameter("mass", "kg"), *PLACE_PARAMETERS),
    sentence="The mass, centre of mass or inertia of {place} differs from that in {model}",
    law=r"\Delta\tau = Y_l(q, \dot q, \ddot q) \; \Delta\phi_l",
    where="link",
    in_links=True,
    experiment="weigh the link, or repeat the motion with a payload of known mass",
)

LINK_PROBES = 100  # random states that show which parameters an arm feels
MIN_INDEPENDENT_SHARE = 1e-8  # of a column's length: below is rounding; its root for a smallest singular value


def torque_of_parameters(scene: Scene, link: int, sets: Array) -> Array:
    """Torque at the joints up to a link (from 1) for sets (sets, 10) of its parameters: (samples, link, sets)."""
    motion = scene.motion
    arm = scene.arm.first(link)  # joints behind the link do not feel it
    part = Motion(*(each[:, :link] for each in (motion.position, motion.velocity, motion.acceleration)))
    out = np.empty((len(scene.time), link, len(sets)))
    for index, ten in enumerate(sets):
        out[:, :, index] = torque_of_links(arm, part, np.append(np.zeros(10 * (link - 1)), ten))
    return out


@lru_cache(maxsize=64)
def felt_parameters(arm: Arm, link: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Which of a link's ten parameters an arm feels: an independent set, and those that stand for themselves.

    The others of the set stand for sums with parameters of the same link that are not in it.
    """
    matrix = _link_columns(arm, link)
    lengths = np.linalg.norm(matrix, axis=0)
    felt: list[int] = []
    for index in np.flatnonzero(lengths > MIN_INDEPENDENT_SHARE * lengths.max()).tolist():
        trial = matrix[:, [*felt, index]] / lengths[[*felt, index]]
        if np.linalg.svd(trial, compute_uv=False)[-1] > MIN_INDEPENDENT_SHARE**0.5:
            felt.append(index)
    if not felt:
        return (), ()
    others = [index for index in range(10) if index not in felt]
    sums = np.abs(np.linalg.lstsq(matrix[:, felt], matrix[:, others])[0]).max(axis=1, initial=0.0)
    clear = tuple(index for index, share in zip(felt, sums, strict=True) if share < MIN_INDEPENDENT_SHARE**0.5)
    return tuple(felt), clear


@lru_cache(maxsize=64)
def felt_by_ten(arm: Arm, link: int) -> Array:
    """What each of all ten parameters adds to the values of the felt ones that act like them, (felt, 10)."""
    matrix, (felt, _) = _link_columns(arm, link), felt_parameters(arm, link)
    return np.asarray(np.linalg.lstsq(matrix[:, list(felt)], matrix)[0])


def _link_columns(arm: Arm, link: int) -> Array:
    probe = Motion(*np.random.default_rng(1).uniform(-2, 2, (3, LINK_PROBES, len(arm))))
    return observation_matrix(arm, probe)[:, 10 * (link - 1) : 10 * link]


@dataclass(frozen=True)
class LinkTerm(Term):
    """An effect of a link: the joints before it feel it."""

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a link, from 1."""
        return cls(joint, (joint,), tuple(range(joint)), **details)

    @property
    def link(self) -> int:
        """The link, from 1."""
        return self.joints[0]

    @classmethod
    @abstractmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm's torques show it."""


@dataclass(frozen=True)
class Body(LinkTerm):
    """Up to ten inertial parameters: those that the arm feels.

    felt: indices of an independent set of the ten. clear: those of them that stand for themselves, in no sum with
    others. Where all are clear they are given as mass, centre and inertia; else each by its own name, one that is
    not clear standing for the sum that the arm feels.
    """

    names = ("mass", "centre", "inertia")
    felt: tuple[int, ...] = tuple(range(10))
    clear: tuple[int, ...] = tuple(range(10))

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a link, from 1."""
        felt, clear = felt_parameters(arm, joint)
        return super().at(arm, joint, felt=felt, clear=clear, **details)

    def columns(self, scene: Scene) -> Array:
        return torque_of_parameters(scene, self.link, np.eye(10)[list(self.felt)])

    def ten(self, coefficients: Array) -> Array:
        """All ten parameters about the link's frame, zero where nothing is felt."""
        full = np.zeros(10)
        full[list(self.felt)] = coefficients
        return full

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Mass, centre and inertia of what is added, about the link's frame; or what the arm feels of them."""
        ten = self.ten(coefficients)
        if len(self.clear) == 10 and ten[0]:
            centre, inertia = tuple((ten[1:4] / ten[0]).tolist()), tuple(ten[4:].tolist())
            return {"mass": float(ten[0]), "centre": centre, "inertia": inertia}
        return {self._name(index): float(ten[index]) for index in self.felt}

    def _name(self, index: int) -> str:
        return "mass" if index == 0 and index in self.clear else PARAMETER_NAMES[index]

    def unit(self, name: str) -> str:
        return PARAMETER_UNITS[PARAMETER_NAMES.index(name)] if name in PARAMETER_NAMES else super().unit(name)

    @property
    def size(self) -> int:
        """One coefficient for each felt parameter."""
        return len(self.felt)

    def added_body(self, coefficients: Array) -> Array:
        """All ten parameters about the link's frame."""
        return self.ten(coefficients)

    def equation(self, coefficients: Array) -> str:
        named = zip(self.felt, coefficients.tolist(), strict=True)
        return ", ".join(f"{PARAMETER_NAMES[index]}_{self.link} += {format_number(value)}" for index, value in named)

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The body with mass, centre and inertia about the link's frame, or with single ones of the ten."""
        unknown = set(parameters) - {*cls.names, *PARAMETER_NAMES}
        if unknown:
            raise ValueError(f"{cls.effect} has parameters {', '.join(cls.names)}, not {', '.join(sorted(unknown))}")
        ten = np.array([float(parameters.get(name, 0.0)) for name in PARAMETER_NAMES])
        ten[0] += float(parameters.get("mass", 0.0))
        ten[1:4] += ten[0] * np.array(parameters.get("centre", np.zeros(3)))
        ten[4:] += np.array(parameters.get("inertia", np.zeros(6)))
        return cls.at(arm, joints[0]), felt_by_ten(arm, joints[0]) @ ten


@dataclass(frozen=True)
class LinkFamily(Family):
    """One place a form and link that shows it."""

    facts: Effect
    terms: tuple[type[LinkTerm], ...]

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Each form at each link."""
        places = [(term, link) for term in self.terms for link in range(1, len(arm) + 1) if term.is_visible(arm, link)]
        return [list(term.initial_shapes(arm, link, scenes)) for term, link in places]

    def from_parameters(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The form of that name, or a point where a centre but no inertia is given; joints: the link."""
        point = "centre" in parameters and "inertia" not in parameters
        wanted = form or ("point" if point else self.terms[0].form)
        for term in self.terms:
            if term.form == wanted:
                return term.from_parameters(arm, joints, parameters)
        raise ValueError(f"{self.effect} has the forms {', '.join(term.form for term in self.terms)}, not {wanted}")


LEAST_RADIUS_M = 0.005  # of gyration: that a body is a body tells no more of a thinner one
BODY_SIZE_M = 0.1  # the size of a body, which brings its pseudo-inertia to kilograms
EIGENVALUE_TOLERANCE = 0.1  # of the largest eigenvalue: a point has no spread, and its fit may have a little less
MAX_PAYLOAD_RATIO = 3.0  # times the mean mass of the links: in the mean square (chosen by eye)
MAX_CENTRE_M = 0.5  # m: a payload's centre is no further from its link's frame
MAX_REACH_M = 10.0  # m, and m2: no part of a body is further from its link's frame
POINT_CENTRES = tuple(product((0.0, 0.15), repeat=3))  # m, of a first look


@dataclass(frozen=True)
class Payload(Body):
    """A body carried by a link: a body has a positive semidefinite pseudo-inertia (Wensing, Kim and Slotine 2018)."""

    facts = PAYLOAD_FACTS
    form = "body"
    identical = ("inertial_parameter_error",)

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm can weigh the link."""
        return 0 in felt_parameters(arm, link)[1]

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A payload that no body can be: of negative mass, or with an impossible spread of it."""
        if len(self.felt) < 10:
            return _negative_mass(coefficients[self.felt.index(0)], covariance, self.felt.index(0))
        values, vectors = np.linalg.eigh(np.einsum("p,pab->ab", self.ten(coefficients), pseudo_inertia_basis()))
        slopes = np.einsum("a,pab,b->p", vectors[:, 0], pseudo_inertia_basis(), vectors[:, 0])
        spread = (
            0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(float(slopes @ covariance @ slopes), 0.0)))
        )
        if values[0] + spread + 1e-9 * abs(values[-1]) < 0:
            return "no body has such a mass, centre and inertia"
        return None


def unit_mass_at(point: Sequence[float]) -> Array:
    """Parameters (10,) of one kilogram at a point of a link's frame, m."""
    x, y, z = point
    return np.array([1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])


@dataclass(frozen=True)
class PointPayload(LinkTerm):
    """A mass at one point of a link; shape: the point in the link's frame, m."""

    facts = PAYLOAD_FACTS
    form = "point"
    identical = ("inertial_parameter_error",)
    names = ("mass", "centre")

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """On the flange alone, if it feels where a mass is: elsewhere a small mass is a wrong number of the link."""
        return link == len(arm) and bool({1, 2, 3} & set(felt_parameters(arm, link)[0]))

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """The link's frame, and points around it."""
        return [
            cls.at(arm, joint, shape=centre, bounds=((-MAX_CENTRE_M, MAX_CENTRE_M),) * 3) for centre in POINT_CENTRES
        ]

    def prior_scale(self, inertial: Array | None) -> float:
        """A few times the mass of the links that carry it: the root mean square of a payload."""
        return float("inf") if inertial is None else MAX_PAYLOAD_RATIO * float(np.mean(inertial[::10]))

    def columns(self, scene: Scene) -> Array:
        """Torque of one kilogram there."""
        return torque_of_parameters(scene, self.link, unit_mass_at(self.shape)[None])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"mass": float(coefficients[0]), "centre": self.shape}

    def added_body(self, coefficients: Array) -> Array:
        """A point mass about the link's frame."""
        return float(coefficients[0]) * unit_mass_at(self.shape)

    def equation(self, coefficients: Array) -> str:
        """The mass and where it is."""
        place = ", ".join(format_number(value) for value in self.shape)
        return f"link {self.link} carries {format_number(coefficients[0])} kg at ({place}) m"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A negative mass."""
        return _negative_mass(coefficients[0], covariance, 0)

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        centre = tuple(float(value) for value in parameters["centre"])
        return cls.at(arm, joints[0], shape=centre, bounds=((-MAX_CENTRE_M, MAX_CENTRE_M),) * 3), np.array(
            [parameters["mass"]]
        )


def _negative_mass(mass: float, covariance: Array | None, place: int) -> str | None:
    spread = 0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(covariance[place, place], 0.0)))
    return "a negative mass" if mass + spread < 0 else None


@dataclass(frozen=True)
class SolidBody(LinkTerm):
    """A body of known form and unknown mass, carried by a link.

    shape: the centre, m, and the inertia about the link's frame, m2, of one kilogram of it. A search finds other forms;
    this one holds a body that can exist while the rest of a model changes.
    """

    facts = PAYLOAD_FACTS
    form = "body"
    identical = ("inertial_parameter_error",)
    names = ("mass", "centre", "inertia")

    @classmethod
    def of_body(cls, arm: Arm, link: int, ten: Array) -> Self:
        """The form of a body with these ten parameters about the link's frame; its mass is not zero."""
        shape = tuple((ten[1:] / ten[0]).tolist())
        return cls.at(arm, link, shape=shape, bounds=((-MAX_REACH_M, MAX_REACH_M),) * 9)

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm can weigh the link."""
        return Payload.is_visible(arm, link)

    def columns(self, scene: Scene) -> Array:
        """Torque of one kilogram of it."""
        return torque_of_parameters(scene, self.link, self._unit_mass()[None])

    def _unit_mass(self) -> Array:
        return np.array([1.0, *self.shape])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        mass = float(coefficients[0])
        return {"mass": mass, "centre": self.shape[:3], "inertia": tuple(mass * each for each in self.shape[3:])}

    def known(self, coefficients: Array) -> Array | None:
        """That it is a body: the curvature of -log det of its pseudo-inertia, (10, 10), in mass and shape.

        The determinant is that of the spread about the centre times a power of the mass, so the centre itself is free:
        a small body is a narrow one and not one whose place is known. None without a mass, where other columns of a
        model leave nothing to it.
        """
        if coefficients[0] == 0:
            return None
        x, y, z = self.shape[:3]
        to_spread = np.column_stack([-_slopes_of_point(x, y, z), np.eye(6)])
        out = np.zeros((10, 10))
        out[0, 0] = 4 / float(coefficients[0]) ** 2
        out[1:, 1:] = to_spread.T @ _spread_information(np.array(self.shape[3:]) - _point_inertia(x, y, z)) @ to_spread
        return out

    def added_body(self, coefficients: Array) -> Array:
        """All ten parameters about the link's frame."""
        return float(coefficients[0]) * self._unit_mass()

    def equation(self, coefficients: Array) -> str:
        """The mass and where it is."""
        place = ", ".join(format_number(value) for value in self.shape[:3])
        return f"link {self.link} carries a body of {format_number(coefficients[0])} kg at ({place}) m"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A negative mass."""
        return _negative_mass(coefficients[0], covariance, 0)

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        mass, centre = float(parameters["mass"]), np.array(parameters["centre"])
        ten = np.array([mass, *(mass * centre), *np.array(parameters["inertia"])])
        return cls.of_body(arm, joints[0], ten), np.array([mass])


PAYLOAD = LinkFamily(PAYLOAD_FACTS, (Payload, PointPayload))


@dataclass(frozen=True)
class InertialError(Body):
    """What has to be added to a link's parameters, of either sign."""

    facts = INERTIAL_ERROR_FACTS
    second_name = True

    @classmethod
    def is_visible(cls, arm: Arm, link: int) -> bool:
        """Whether the arm feels anything of the link."""
        return bool(felt_parameters(arm, link)[0])

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """None: the simulation's link may be too heavy as well as too light."""
        return None


INERTIAL_ERROR = LinkFamily(INERTIAL_ERROR_FACTS, (InertialError,))


@dataclass(frozen=True)
class LinkLaw:
    """What a link has more than its simulation, as a law; rivals: effects that no motion separates from it."""

    candidate: Candidate
    rivals: tuple[str, ...]


def link_law(arm: Arm, link: int, mean: Array, spread: Array, added: bool) -> LinkLaw | None:
    """The first name for what a link (from 1) has more than its simulation; None where a negative mass would be left.

    A payload where it can be a body, the link is the last one, and `added` says that no other link is off as far;
    else an error of the link. mean (10,), spread (10, 10): of its ten parameters.
    """
    if arm.links is not None and arm.links[link - 1].mass + mean[0] < 0:
        return None
    body = _may_be_body(mean, spread)
    names = (PAYLOAD_FACTS.id, INERTIAL_ERROR_FACTS.id)
    if body and added and link == len(arm):
        return LinkLaw(Payload.at(arm, link), names[1:])
    return LinkLaw(InertialError.at(arm, link), names[:1] if body else ())


def _may_be_body(ten: Array, covariance: Array) -> bool:
    """Whether ten parameters could be a body: positive mass, and a positive semidefinite pseudo-inertia."""
    parts = pseudo_inertia_parts()
    values, vectors = np.linalg.eigh(np.einsum("p,pab->ab", ten, parts))
    slopes = np.einsum("a,pab,b->p", vectors[:, 0], parts, vectors[:, 0])
    doubt = 1.5 * SIGN_SIGMAS * np.sqrt(max(float(slopes @ covariance @ slopes), 0.0))
    tolerance = EIGENVALUE_TOLERANCE * float(np.abs(values).max())
    return bool(ten[0] > 0 and values[0] + doubt + tolerance >= 0)


def pseudo_inertia_parts() -> Array:
    """Pseudo-inertia of each of the ten parameters at one, in kilograms, (10, 4, 4)."""
    to_kilograms = np.array([1 / BODY_SIZE_M, 1 / BODY_SIZE_M, 1 / BODY_SIZE_M, 1.0])
    return np.asarray(pseudo_inertia_basis() * np.outer(to_kilograms, to_kilograms))


def _point_inertia(x: float, y: float, z: float) -> Array:
    """Inertia of one kilogram at a point, (6,), m2."""
    return np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])


def _slopes_of_point(x: float, y: float, z: float) -> Array:
    """Derivatives of `_point_inertia` by the point, (6, 3), m."""
    return np.array(
        [[0, 2 * y, 2 * z], [2 * x, 0, 2 * z], [2 * x, 2 * y, 0], [-y, -x, 0], [-z, 0, -x], [0, -z, -y]], dtype=float
    )


def _spread_information(inertia: Array) -> Array:
    """Curvature of -log det of the second moments of one kilogram with this inertia (6,) about its centre, (6, 6)."""
    moments = pseudo_inertia_basis()[4:, :3, :3]
    widths, axes = np.linalg.eigh(np.einsum("p,pab->ab", inertia, moments))
    turned = (axes / np.maximum(widths, LEAST_RADIUS_M**2)) @ axes.T @ moments
    return np.asarray(np.einsum("pab,qba->pq", turned, turned))
