"""What is hidden in a field case, or changes within a pair: a law that has grown, a law of the library, or a drive."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.effects.bodies import Geometry, Payload, Tilt
from armlab.proof.blind.effects.channels import Contact, Delay, EncoderOffset, Saturation, Skew
from armlab.proof.blind.effects.drives import Coupling
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.springs import Cable, Compensator, Ripple
from armlab.proof.blind.engine import Track
from armlab.proof.blind.field.field_friction import LAW_NUMBERS, LawNumber
from armlab.proof.blind.field.field_plan import FieldPlan

FIELD_LIBRARY: tuple[type[HiddenEffect], ...] = (
    Ripple,
    Compensator,
    Cable,
    Coupling,
    Contact,
    Saturation,
    Delay,
    Skew,
    EncoderOffset,
    Payload,
    Tilt,
    Geometry,
)
LARGEST = {"asymmetry": 0.8, "cold": 1.5, "load_share": 0.6, "friction": 3.0, "gain": 0.4}
FIELD_CHANGES = ("friction", "payload", "gain", "zero")
Number = LawNumber | Literal["", "friction", "gain"]


@dataclass(frozen=True)
class FieldEffect:
    """One effect. effects: its names. place: joint or link from 1, None for the whole robot. size: in the unit of its
    number. number: of the friction of its joint that is larger by the size (`friction`: level and slope, by that
    factor; `gain`: of its drive); empty where `law` says what it does.
    """

    effects: tuple[str, ...]
    place: int | None
    size: float
    number: Number = ""
    law: HiddenEffect | None = None

    def sized(self, size: float) -> "FieldEffect":
        """The same with another size, within what makes sense."""
        if self.law is not None:
            law = self.law.sized(size)
            return replace(self, law=law, size=law.size)
        return replace(self, size=float(min(size, LARGEST.get(self.number, np.inf))))

    def with_peak_torque(self, peak: Array) -> "FieldEffect":
        """The effect adapted to the largest torque of each joint without it, (joints,), N m."""
        return self if self.law is None else replace(self, law=self.law.with_peak_torque(peak))

    def in_plan(self, plan: FieldPlan) -> FieldPlan:
        """The plan with the changed number of a joint."""
        if self.law is not None or self.place is None:
            return plan
        joint = self.place - 1
        if self.number == "gain":
            drives = list(plan.drives)
            drives[joint] = replace(drives[joint], gain=drives[joint].gain * (1 + self.size))
            return replace(plan, drives=tuple(drives))
        friction = list(plan.friction)
        own = friction[joint]
        if self.number == "friction":
            factor = 1 + self.size
            friction[joint] = replace(own, coulomb=own.coulomb * factor, viscous=own.viscous * factor)
        else:
            friction[joint] = replace(own, **{self.number: getattr(own, self.number) + self.size})
        return replace(plan, friction=tuple(friction))

    def torque(self, track: Track, run: int) -> Array:
        """What a law of the library takes from the motors, (steps, joints), N m."""
        out = np.zeros_like(track.load)
        own = self.law.torque(track, run) if self.law else None
        if self.law is not None and own is not None:
            out[:, self.law.joint] += own
        return out


def hidden_names() -> tuple[str, ...]:
    """Effects that a case may hide."""
    return (*LAW_NUMBERS, *(kind.effect for kind in FIELD_LIBRARY))


def draw_field_effect(rng: np.random.Generator, plan: FieldPlan, name: str) -> FieldEffect | None:
    """An effect of a name at a random place; None where the robot has no place for it."""
    moving = [joint for joint, still in enumerate(plan.still) if not still]
    if name in LAW_NUMBERS:
        joint = int(rng.choice(moving))
        return FieldEffect((name,), joint + 1, _usual_size(plan, name, joint), LAW_NUMBERS[name])
    kind = next(each for each in FIELD_LIBRARY if each.effect == name)
    if kind in (Coupling, Skew) and plan.machine.joints < 2:
        return None
    places = [place for place in kind.places(plan.machine) if place in moving or kind.where != "joint"]
    if not places:
        return None
    law = kind.draw(rng, plan.machine, int(rng.choice(places)))
    if isinstance(law, Contact):
        length = plan.runs[0].length_s
        start = float(rng.uniform(0.1, 0.6)) * length
        shape = {**law.shape, "start": start, "end": start + 0.25 * length, "run": 0.0}
        law = replace(law, shape=shape)
    return FieldEffect((law.effect,), law.place, law.size, law=law)


def draw_field_change(rng: np.random.Generator, plan: FieldPlan, kind: str) -> FieldEffect:
    """What changes between the recordings of a pair: friction, payload, gain of the torque, or a zero."""
    moving = [joint for joint, still in enumerate(plan.still) if not still]
    joint = int(rng.choice(moving))
    if kind == "friction":
        return FieldEffect(("coulomb_friction", "viscous_friction"), joint + 1, 0.4, "friction")
    if kind == "gain":
        return FieldEffect(("torque_gain_error",), joint + 1, 0.1, "gain")
    if kind == "zero":
        law: HiddenEffect = EncoderOffset(joint, 0.01, 0.2, "constant", {"direction": float(rng.choice([-1, 1]))})
    else:
        law = Payload.draw(rng, plan.machine, int(rng.choice(Payload.places(plan.machine))))
        law = replace(law, max_size=np.inf)
    return FieldEffect((law.effect,), law.place, law.size, law=law)


def _usual_size(plan: FieldPlan, name: str, joint: int) -> float:
    own = plan.friction[joint]
    top = float(plan.machine.speed[joint])
    usual: dict[str, float] = {
        "stribeck_friction": own.coulomb,
        "nonlinear_viscous_friction": own.coulomb / top**own.exponent,
        "asymmetric_friction": 0.3,
        "load_dependent_friction": 0.2,
        "friction_drift": 0.5,
    }
    return usual[name]
