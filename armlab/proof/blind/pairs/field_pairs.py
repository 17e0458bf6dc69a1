"""Pairs that resemble real recordings: a robot of the field tier on two days, with nothing changed or one thing.

What is known of the numbers of a change: a gain and a zero. Friction of the field is no level and no slope, and warms;
a load is read through the gains of the drives. Where a joint is so much warmer or colder that its friction differs by
`WARMED`, friction may be named there.
"""

from pathlib import Path
from typing import Any

import numpy as np

from armlab.proof.blind.field.field_friction import JointFriction
from armlab.proof.blind.field.field_hidden import FIELD_CHANGES, FieldEffect, draw_field_change
from armlab.proof.blind.field.field_plan import FieldPlan, new_side
from armlab.proof.blind.field.field_runs import simulate_field
from armlab.proof.blind.field.field_score import LEAST_STRENGTH
from armlab.proof.blind.field.field_sizes import draw_sized
from armlab.proof.blind.field.files import write_field_observation
from armlab.proof.blind.pairs.pair_cases import SIDES, known_differences, write_answer

WARMED = 0.05  # of the friction: less drowns in the rest of any joint
# names of friction whose level and slope grow: its state has a memory at every joint
LAWS = ("coulomb_friction", "viscous_friction", "presliding_hysteresis")


def write_field_pair(plan: FieldPlan, observation: Path, truth: Path) -> None:
    """Writes the recording folders `old` and `new`, and the answer. plan: of the old side."""
    old, later = simulate_field(plan), new_side(plan)
    new = simulate_field(later, rest_factors=old.rest_factors)
    kind, strength = "null", 0.0
    changed: list[dict[str, Any]] = []
    if plan.kind == "pair changed":
        kinds: list[str] = []

        def draw(rng: np.random.Generator, number: int) -> FieldEffect:
            kinds.append(FIELD_CHANGES[(plan.index + number // 3) % len(FIELD_CHANGES)])  # another where it is not seen
            return draw_field_change(rng, later, kinds[-1])

        change, strength = draw_sized(later, new, draw, beside=old)
        new = simulate_field(later, (change,), old.rest_factors)
        kind, changed = _kind_of(change), _changed(change)
    for side, case in zip(SIDES, (old, new), strict=True):
        write_field_observation(case, observation / side)
    facts = {
        "pair": plan.name,
        "kind": kind,
        "tier": "field",
        "arm": f"{plan.machine.name}, {plan.machine.joints}",
        "same_motion": plan.same_motion,
        "drifting": False,
        "size": strength,
        "visible": strength >= LEAST_STRENGTH,
        "changed": changed,
        "warmed": [[law, joint] for joint in _warmed(plan, later) for law in LAWS],
    }
    write_answer(facts, truth)


def _warmed(old: FieldPlan, new: FieldPlan) -> list[int]:
    """Joints, from 1, whose friction differs between the recordings because they are warmer or colder."""
    heats = [np.array([_mean_heat(each, plan) for each in plan.friction]) for plan in (old, new)]
    return [joint + 1 for joint in np.flatnonzero(np.abs(np.log(heats[1] / heats[0])) > WARMED).tolist()]


def _mean_heat(friction: JointFriction, plan: FieldPlan) -> float:
    """The mean factor of a joint's friction over all runs, which all begin as warm."""
    times = np.concatenate([np.linspace(0, run.length_s, 50) for run in plan.runs])
    return float(np.mean(friction.heat(times)))


def _kind_of(change: FieldEffect) -> str:
    """A kind of change, by what changes."""
    kinds = {"torque_gain_error": "gain", "encoder_offset": "zero", "payload": "payload"}
    return kinds.get(change.effects[0], "friction")


def _changed(change: FieldEffect) -> list[dict[str, Any]]:
    """What changed, with the numbers that are known."""
    known: dict[str, float] = {}
    if change.number == "gain":
        known = {"gain": change.size}
    elif change.law is not None and "payload" not in change.effects:
        known = known_differences(change.law)
    effects = LAWS if change.number == "friction" else change.effects
    return [{"effect": effect, "joint": change.place, "differences": known} for effect in effects]
