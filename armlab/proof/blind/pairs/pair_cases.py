"""A pair of recordings made from its plan, with its answer; and how many detection limits large the change is."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.case_files import write_observation
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.engine import Track
from armlab.proof.blind.pairs.pair_plan import PAIRS, PairPlan, SidePlan, draw_change
from armlab.proof.blind.simulate import (
    RunWithout,
    arm_with_effects,
    coarse_track,
    draw_controller,
    effect_torque,
    free_columns,
    reference_track,
    simulate_runs,
)
from armlab.proof.blind.sizing import ORACLE, Oracle, SimulatedCase, SizedEffects, row_noise

SIDES = ("old", "new")


@dataclass(frozen=True, eq=False)
class MadePair:
    """Both recordings, what changed, and its size in detection limits (0 for nothing)."""

    plan: PairPlan
    cases: tuple[SimulatedCase, SimulatedCase]
    change: tuple[HiddenEffect, ...]
    multiple: float


def make_pair(plan: PairPlan) -> MadePair:
    """The pair, its change at the first place drawn where it can be seen, else where it is seen best."""
    old = simulate_side(plan.old, ())
    if plan.kind == "null":
        return MadePair(plan, (old, simulate_side(plan.new, ())), (), 0.0)
    wanted = tuple(reference_track(plan.new, number, run) for number, run in enumerate(plan.new.runs))
    drawn = (draw_change(plan, attempt) for attempt in range(PAIRS.max_draws))
    sized = ((change_multiple(plan, each, old.tracks, wanted), each) for each in drawn)
    best = next(sized)
    for other in sized:
        if best[0] >= PAIRS.least_multiple:
            break
        best = max(best, other, key=lambda each: each[0])
    change = best[1]
    new = simulate_side(plan.new, change)
    return MadePair(plan, (old, new), change, change_multiple(plan, change, old.tracks, new.tracks))


def simulate_side(plan: SidePlan, hidden: tuple[HiddenEffect, ...]) -> SimulatedCase:
    """One recording, with effects beside those of the background."""
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    wanted = [reference_track(plan, number, run) for number, run in enumerate(plan.runs)]
    coarse = simulate_runs(plan, hidden, controller, wanted, [coarse_track(track) for track in wanted])
    fine = simulate_runs(plan, hidden, controller, coarse, wanted)
    zeros = tuple(0.0 for _ in hidden)
    return SimulatedCase(plan, SizedEffects(hidden, zeros), fine, zeros)


def change_multiple(
    pair: PairPlan, change: tuple[HiddenEffect, ...], old: Sequence[Track], new: Sequence[Track]
) -> float:
    """Detection limits of a change: links, friction and the effect itself are free in both recordings together."""
    plan, tracks = pair.new, (*old, *new)
    grids = [np.arange(0.0, track.time[-1] - ORACLE.end_s, 1 / ORACLE.rate_hz) for track in tracks]
    pairs = list(zip(tracks, grids, strict=True))
    oracle = Oracle(row_noise(plan)).with_free_columns(
        [free_columns(plan.true_arm, track, grid) for track, grid in pairs]
    )
    shares = [_change_torque(plan, change, track, grid) for track, grid in pairs]
    added = [share if number >= len(old) else np.zeros_like(share) for number, share in enumerate(shares)]
    return oracle.multiple(added, [share[..., None] for share in shares])


def _change_torque(plan: SidePlan, change: tuple[HiddenEffect, ...], track: Track, grid: Array) -> Array:
    """What a change adds to the recorded torque of a run, (samples, joints), N m."""
    arms = arm_with_effects(plan, change), arm_with_effects(plan, ())
    without = RunWithout(track, plan.background, 0, grid)
    parts = [effect_torque(effect, arms, without) for effect in change]
    return np.asarray(np.sum(parts, axis=0))


def write_pair(made: MadePair, observations: Path, truth: Path) -> None:
    """Writes the recording folders `old` and `new`, and the answer."""
    for side, case in zip(SIDES, made.cases, strict=True):
        write_observation(case, observations / side)
    plan = made.plan
    facts = {
        "pair": plan.name,
        "kind": plan.kind,
        "tier": plan.old.tier,
        "arm": plan.old.machine.name,
        "same_motion": plan.old.same_motion,
        "drifting": plan.drifting,
        "size": made.multiple,
        "visible": made.multiple >= PAIRS.least_multiple,
        "changed": [
            {"effect": each.effect, "joint": each.place, "differences": known_differences(each)} for each in made.change
        ],
        "warmed": [],
    }
    write_answer(facts, truth)


def known_differences(change: HiddenEffect) -> dict[str, float]:
    """New less old of each parameter that means the same in a fitted law; a gain is one where nothing changed."""
    own = {name: value for name, value in change.parameters().items() if name in change.comparable}
    return {name: value - (name == "gain") for name, value in own.items() if not isinstance(value, list)}


def write_answer(facts: dict[str, Any], truth: Path) -> None:
    """Writes what is true of a pair (schema pair-truth/2): size, in detection limits or strengths; visible: whether it
    counts; changed: effects with their places and the differences that are known; warmed: names that are not false.
    """
    truth.parent.mkdir(parents=True, exist_ok=True)
    truth.write_text(json.dumps({"schema": "pair-truth/2", **facts}, indent=1) + "\n", encoding="utf-8")
