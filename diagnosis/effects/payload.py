"""A body that a link carries and the simulation does not know: with all its parameters, or as a point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Self

import numpy as np

from diagnosis.effects.body import Body, LinkFamily, LinkTerm
from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.link_columns import felt_parameters, torque_of_parameters
from diagnosis.effects.term import CERTAIN, number
from identification.pseudo_inertia import basis
from problem.arm import Arm
from recordings.run import Array

REACH = 0.5  # m: a payload's centre is no further from its link's frame
CENTRES = tuple(product((0.0, 0.15), repeat=3))  # m, of a first look


@dataclass(frozen=True)
class Payload(Body):
    """A body carried by a link: a body has a positive semidefinite pseudo-inertia (Wensing, Kim and Slotine 2018)."""

    effect = "payload"
    form = "body"

    @classmethod
    def shown(cls, arm: Arm, link: int) -> bool:
        """Whether the arm can weigh the link."""
        return 0 in felt_parameters(arm, link)[1]

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A payload that no body can be: of negative mass, or with an impossible spread of it."""
        if len(self.felt) < 10:
            return _lighter(coefficients[self.felt.index(0)], covariance, self.felt.index(0))
        values, vectors = np.linalg.eigh(np.einsum("p,pab->ab", self.ten(coefficients), basis()))
        slopes = np.einsum("a,pab,b->p", vectors[:, 0], basis(), vectors[:, 0])
        spread = 0.0 if covariance is None else CERTAIN * float(np.sqrt(max(float(slopes @ covariance @ slopes), 0.0)))
        if values[0] + spread + 1e-9 * abs(values[-1]) < 0:
            return "no body has such a mass, centre and inertia"
        return None


@dataclass(frozen=True)
class PointPayload(LinkTerm):
    """A mass at one point of a link; shape: the point in the link's frame, m."""

    effect = "payload"
    form = "point"
    names = ("mass", "centre")

    @classmethod
    def shown(cls, arm: Arm, link: int) -> bool:
        """On the flange alone, if it feels where a mass is: elsewhere a small mass is a wrong number of the link."""
        return link == len(arm) and bool({1, 2, 3} & set(felt_parameters(arm, link)[0]))

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """The link's frame, and points around it."""
        return [cls.at(arm, joint, shape=centre, bounds=((-REACH, REACH),) * 3) for centre in CENTRES]

    def columns(self, scene: Scene) -> Array:
        """Torque of one kilogram there."""
        x, y, z = self.shape
        ten = [1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
        return torque_of_parameters(scene, self.link, np.array([ten]))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Mass and centre."""
        return {"mass": float(coefficients[0]), "centre": self.shape}

    def equation(self, coefficients: Array) -> str:
        """The mass and where it is."""
        place = ", ".join(number(value) for value in self.shape)
        return f"link {self.link} carries {number(coefficients[0])} kg at ({place}) m"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A negative mass."""
        return _lighter(coefficients[0], covariance, 0)

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The mass at its centre."""
        centre = tuple(float(value) for value in parameters["centre"])
        return cls.at(arm, joints[0], shape=centre, bounds=((-REACH, REACH),) * 3), np.array([parameters["mass"]])


def _lighter(mass: float, covariance: Array | None, place: int) -> str | None:
    spread = 0.0 if covariance is None else CERTAIN * float(np.sqrt(max(covariance[place, place], 0.0)))
    return "a negative mass" if mass + spread < 0 else None


PAYLOAD = LinkFamily("payload", (Payload, PointPayload))
