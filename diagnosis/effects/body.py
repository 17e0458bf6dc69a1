"""Inertial parameters that add to those of a link: what payloads and wrong links share."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Candidate, Family, Scene, Value
from diagnosis.effects.link_columns import felt_parameters, felt_values, torque_of_parameters
from diagnosis.effects.term import Term, number
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS, Arm
from recordings.run import Array


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
    def shown(cls, arm: Arm, link: int) -> bool:
        """Whether the arm's torques show it."""


@dataclass(frozen=True)
class Body(LinkTerm):
    """Up to ten inertial parameters: those that the arm feels.

    felt: indices of an independent set of the ten. clear: those of them that stand for themselves, in no sum with
    others. Where all are clear they are told as mass, centre and inertia; else each by its own name, one that is
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
        """Torque of each felt parameter at one."""
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
        """Unit of a parameter."""
        return PARAMETER_UNITS[PARAMETER_NAMES.index(name)] if name in PARAMETER_NAMES else super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The parameters with their numbers."""
        named = zip(self.felt, coefficients.tolist(), strict=True)
        return ", ".join(f"{PARAMETER_NAMES[index]}_{self.link} += {number(value)}" for index, value in named)

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The body with mass, centre and inertia about the link's frame, or with single ones of the ten."""
        unknown = set(parameters) - {*cls.names, *PARAMETER_NAMES}
        if unknown:
            raise ValueError(f"{cls.effect} has parameters {', '.join(cls.names)}, not {', '.join(sorted(unknown))}")
        ten = np.array([float(parameters.get(name, 0.0)) for name in PARAMETER_NAMES])
        ten[0] += float(parameters.get("mass", 0.0))
        ten[1:4] += ten[0] * np.array(parameters.get("centre", np.zeros(3)))
        ten[4:] += np.array(parameters.get("inertia", np.zeros(6)))
        return cls.at(arm, joints[0]), felt_values(arm, joints[0], ten)


@dataclass(frozen=True)
class LinkFamily(Family):
    """One place a form and link that shows it."""

    effect: str
    terms: tuple[type[LinkTerm], ...]

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Each form at each link."""
        places = [(term, link) for term in self.terms for link in range(1, len(arm) + 1) if term.shown(arm, link)]
        return [list(term.first_looks(arm, link, scenes)) for term, link in places]

    def restored(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The form of that name, or a point where a centre but no inertia is given; joints: the link."""
        point = "centre" in parameters and "inertia" not in parameters
        wanted = form or ("point" if point else self.terms[0].form)
        for term in self.terms:
            if term.form == wanted:
                return term.restored(arm, joints, parameters)
        raise ValueError(f"{self.effect} has the forms {', '.join(term.form for term in self.terms)}, not {wanted}")
