"""What most effects share: a place at one joint, units of the vocabulary, positive parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Effect, Family, Kind, Scene, Value
from problem.arm import Arm

SIGN_SIGMAS = 2.0  # standard errors beyond which a sign counts as wrong
DERIVATIVE_STEP = 1e-6  # of a coefficient, for derivatives of named parameters
MIN_TRAVEL = 1e-3  # rad (m): a joint that moves less has no friction or stiffness to show


@dataclass(frozen=True)
class Term(Candidate):
    """An effect at one joint: the place, and what follows from the vocabulary.

    names: parameters as `parameters` gives them; a model file with these names means this form. kind: how the
    joint moves, for units.
    """

    joint: int | None
    joints: tuple[int, ...]
    rows: tuple[int, ...]
    kind: Kind = "revolute"
    shape: tuple[float, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    looks: int = 1

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint, from 1."""
        return cls(joint, (joint,), (joint - 1,), arm.joints[joint - 1].kind, **details)

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """The effect at a joint with each shape worth a first look."""
        return [cls.at(arm, joint)]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The coefficients by their names; laws of which other numbers are told say so."""
        return dict(zip(self.names, coefficients.tolist(), strict=True))

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect and the coefficients that have these parameters."""
        return cls.at(arm, joints[0]), np.array([float(parameters[name]) for name in cls.names])

    @property
    def own(self) -> int:
        """The joint where the torque appears, from 0."""
        return self.rows[0]

    def with_shape(self, shape: tuple[float, ...]) -> Self:
        """The same effect at the same place with other nonlinear parameters."""
        return replace(self, shape=shape)

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        return self.facts.parameter(name).unit_for(self.kind)

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """The first parameter that should be positive and is not, beyond its uncertainty; else None."""
        positive = {each.name for each in self.facts.parameters if each.positive}
        for name, value in self.parameters(coefficients).items():
            if (
                name in positive
                and isinstance(value, float)
                and value + self._doubt(name, coefficients, covariance) < 0
            ):
                return f"{name} {value:.3g} {self.unit(name)} should be positive"
        return None

    def _doubt(self, name: str, coefficients: Array, covariance: Array | None) -> float:
        """SIGN_SIGMAS standard errors of a scalar parameter, by the delta method."""
        if covariance is None:
            return 0.0
        slope = np.empty(len(coefficients))
        for index, change in enumerate(np.diag(DERIVATIVE_STEP * np.maximum(np.abs(coefficients), 1e-12))):
            more = self.parameters(coefficients + change)[name]
            less = self.parameters(coefficients - change)[name]
            slope[index] = (np.asarray(more) - np.asarray(less)) / (2 * change[index])
        return SIGN_SIGMAS * float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))

    def _stacked(self, *columns: Array) -> Array:
        """Columns (samples,) of one joint, stacked to (samples, 1, coefficients)."""
        return np.stack(columns, axis=-1)[:, None, :]


@dataclass(frozen=True)
class TermFamily(Family):
    """A family in one form or several, which a model file tells apart by the names of their parameters."""

    facts: Effect
    terms: tuple[type[Term], ...]

    def from_parameters(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The form of that name, or the one with the most names among the parameters; ValueError for none."""
        named = [term for term in self.terms if not form or term.form == form]
        for term in sorted(named, key=lambda each: -len(each.names)):
            if set(term.names) <= set(parameters):
                return term.from_parameters(arm, joints, parameters)
        if not named:
            raise ValueError(f"{self.effect} has the forms {', '.join(term.form for term in self.terms)}, not {form}")
        wanted = " or ".join(", ".join(term.names) for term in named)
        raise ValueError(f"{self.effect} has parameters {wanted}, not {', '.join(parameters) or 'none'}")


@dataclass(frozen=True)
class EveryJoint(TermFamily):
    """A family whose places are the joints, in one form or several.

    resting: whether a joint that never moves can show it, too.
    """

    resting: bool = False

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """One list for each form at each joint that moves."""
        joints = [joint for joint in range(1, len(arm) + 1) if self.resting or joint_moves(scenes, joint)]
        places = [list[Candidate](term.initial_shapes(arm, joint, scenes)) for term in self.terms for joint in joints]
        return [place for place in places if place]


def joint_moves(scenes: Sequence[Scene], joint: int) -> bool:
    """Whether a joint (from 1) moves in any run."""
    return any(np.ptp(scene.motion.position[:, joint - 1]) > MIN_TRAVEL for scene in scenes)


def top_speed(scenes: Sequence[Scene], joint: int) -> float:
    """Highest speed of a joint (from 1) over all runs, rad/s (m/s)."""
    return max(float(np.abs(scene.motion.velocity[:, joint - 1]).max()) for scene in scenes)


def format_number(value: float) -> str:
    """A number with four significant digits."""
    return f"{value:.4g}"


def format_less(what: str, value: float, unit: str = "") -> str:
    """`t - 0.0005 s`, and `t + 0.0005 s` of a negative value."""
    sign = "+" if value < 0 else "-"
    return f"{what} {sign} {format_number(abs(value))}{' ' + unit if unit else ''}"


def format_sum(*terms: tuple[float, str]) -> str:
    """`2 sgn(qd_1) - 0.5 qd_1` of coefficients and what they multiply."""
    text = " ".join(
        f"{'-' if value < 0 else '+'} {format_number(abs(value))}{' ' + what if what else ''}" for value, what in terms
    )
    return text.removeprefix("+ ") if text.startswith("+") else text.replace("- ", "-", 1)
