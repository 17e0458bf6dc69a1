"""The answer to a field case (schema field-truth/1): what stands in the background, and what is hidden."""

from typing import Literal

import numpy as np
from pydantic import Field

from armlab.common.settings import Settings
from armlab.proof.blind.field.field_friction import LAW_NUMBERS
from armlab.proof.blind.field.field_hidden import FieldEffect
from armlab.proof.blind.field.field_plan import FieldKind, FieldPlan
from armlab.proof.blind.field.field_runs import FieldCase
from armlab.proof.blind.field.rest import NAMES
from armlab.proof.blind.setup.mistakes import Injected


class PlacedEffect(Settings):
    """An effect that is there. joint: joint or link from 1, null for the whole robot."""

    effect: str
    joint: int | None


class SizedEffect(PlacedEffect):
    """A hidden effect. size: in the unit of its main number. strength: see `field/sizing.py`."""

    size: float
    strength: float


class TrueMistake(PlacedEffect):
    """A reading mistake. joints: an exchanged pair. seen: whether it can be told from the right reading."""

    joints: tuple[int, ...]
    form: str
    size: float
    seen: bool


class RestShare(Settings):
    """The rest of one joint, share of its torque's spread, and its kinds with their weights."""

    share: float
    kinds: dict[str, float]


class FieldTruth(Settings):
    """The answer to a case.

    length_s: of all runs of one recording. links: whether the robot file has some; link_errors: relative, of each.
    background: what every arm has. hidden, mistakes: what a diagnosis should say.
    """

    schema_: Literal["field-truth/1"] = Field(alias="schema")
    case: str
    kind: FieldKind
    robot: str
    joints: int
    rate_hz: int
    length_s: float
    links: bool
    link_errors: tuple[float, ...]
    background: tuple[PlacedEffect, ...]
    rest: tuple[RestShare, ...]
    hidden: tuple[SizedEffect, ...] = ()
    mistakes: tuple[TrueMistake, ...] = ()


def make_field_truth(
    case: FieldCase,
    hidden: tuple[FieldEffect, float] | None = None,
    mistakes: tuple[tuple[Injected, bool], ...] = (),
) -> FieldTruth:
    """The answer to a simulated case. hidden: with its strength. mistakes: with whether each can be seen."""
    plan = case.plan
    return FieldTruth(
        schema="field-truth/1",
        case=plan.name,
        kind=plan.kind,
        robot=plan.machine.name,
        joints=plan.machine.joints,
        rate_hz=plan.log.rate_hz,
        length_s=sum(run.length_s for run in plan.runs),
        links=plan.has_links,
        link_errors=plan.link_errors,
        background=tuple(PlacedEffect(effect=name, joint=joint) for name, joint in background_effects(plan)),
        rest=tuple(RestShare(share=each.share, kinds=each.weights) for each in plan.rest),
        hidden=_sized(hidden),
        mistakes=tuple(
            TrueMistake(
                effect=each.effect,
                joint=each.joint,
                joints=each.joints,
                form=each.form,
                size=each.size,
                seen=seen,
            )
            for each, seen in mistakes
        ),
    )


def background_effects(plan: FieldPlan) -> list[tuple[str, int | None]]:
    """Names of what every arm has, each with its joint or link: a finding of one of them is true."""
    out: list[tuple[str, int | None]] = []
    for joint, (drive, rest) in enumerate(zip(plan.drives, plan.rest, strict=True), 1):
        names = ["coulomb_friction", "viscous_friction", "torque_offset", "torque_gain_error", *LAW_NUMBERS]
        names += ["friction_curve", "presliding_hysteresis", "early_friction"]  # a state with memory is in every joint
        names += ["joint_elasticity"] * (drive.twist > 0) + ["backlash"] * (drive.gap > 0)
        names += [NAMES[kind] for kind in rest.weights if kind in NAMES and NAMES[kind] != "flexible_base"]
        names += ["inertial_parameter_error"] if plan.has_links else ["rotor_inertia"]
        out += [(name, joint) for name in names]
    if any("base compliance" in rest.weights for rest in plan.rest):
        out.append(("flexible_base", None))
    if plan.log.slow_torque > 1:
        out.append(("time_delay", None))
    return out


def _sized(found: tuple[FieldEffect, float] | None) -> tuple[SizedEffect, ...]:
    if found is None:
        return ()
    effect, strength = found
    return tuple(
        SizedEffect(effect=name, joint=effect.place, size=float(np.abs(effect.size)), strength=strength)
        for name in effect.effects
    )
