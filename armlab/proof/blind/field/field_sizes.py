"""How large a hidden effect or a change is against the rest of its joint.

    strength = RMS of what it adds / RMS of rest and noise,

both at the joint where it is largest, in the recorded torque, and both without what links, rotors, Coulomb and viscous
friction and offsets of all joints explain. At a strength of one the held-out error of that joint grows by 1.41 where
the effect is left out. A detection limit, as in the other tiers, would need rows whose noise is known; here a rest that
no law explains stands in its place.
"""

from collections.abc import Callable

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.field.field_hidden import FieldEffect
from armlab.proof.blind.field.field_plan import FieldPlan
from armlab.proof.blind.field.field_runs import FieldCase, FieldRun, on_same_motion
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

ROWS = 1500  # of a case, at most
TARGET = (0.7, 3.0)  # strengths that are aimed at
SEEN_SHARE = 0.6  # of the target that counts as reached
MAX_DRAWS, MAX_STEPS, MAX_FACTOR = 6, 4, 30.0
SIGN_WIDTH = 0.01  # of the top speed, in which a column of Coulomb friction changes its sign


def draw_sized(
    plan: FieldPlan,
    base: FieldCase,
    draw: Callable[[np.random.Generator, int], FieldEffect | None],
    beside: FieldCase | None = None,
) -> tuple[FieldEffect, float]:
    """An effect of about the strength that is aimed at, and its strength; the strongest of some draws where none is.

    base: the case without it. draw: from random numbers and the number of the draw. beside: another recording of the
    same robot without it, whose links and friction are the same.
    """
    rng = plan.stream("hidden")
    target = float(np.exp(rng.uniform(*np.log(TARGET))))
    best: tuple[FieldEffect, float] | None = None
    for number in range(MAX_DRAWS):
        drawn = draw(rng, number)
        if drawn is None:
            continue
        found = _scaled(plan, base, drawn, target, beside)
        if best is None or found[1] > best[1]:
            best = found
        if found[1] >= SEEN_SHARE * target:
            break
    if best is None:
        raise ValueError(f"no effect has a place on {plan.machine.name}")
    return best


def strength(base: FieldCase, effect: FieldEffect, beside: FieldCase | None = None) -> float:
    """See the module."""
    changed = on_same_motion(base, effect)
    cases = [base] if beside is None else [base, beside]
    added = [_added(base, changed, number) for number in range(len(base.runs))]
    added += [np.zeros_like(run.track.load) for run in beside.runs] if beside else []
    left = [run.rest for case in cases for run in case.runs]
    thinned = max(sum(len(each) for each in added) // ROWS, 1)
    runs = [run for case in cases for run in case.runs]
    columns = [_free_columns(base.arm, run, thinned) for run in runs]
    joints = len(base.arm)
    matrix = np.concatenate(columns).reshape(-1, columns[0].shape[-1])
    right = np.column_stack([np.concatenate([each[::thinned] for each in signal]).ravel() for signal in (added, left)])
    lengths = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
    kept = right - (matrix / lengths) @ np.linalg.lstsq(matrix / lengths, right, rcond=1e-8)[0]
    effect_rms, rest_rms = np.sqrt(np.mean(kept.reshape(-1, joints, 2) ** 2, axis=0)).T
    noise = base.spread * base.plan.log.noise
    return float(np.max(effect_rms / np.hypot(rest_rms, noise)))


def _scaled(
    plan: FieldPlan, base: FieldCase, effect: FieldEffect, target: float, beside: FieldCase | None
) -> tuple[FieldEffect, float]:
    if effect.law is not None:
        peak = np.max([np.abs(run.torque).max(axis=0) for run in base.runs], axis=0)
        effect = effect.with_peak_torque(peak)
    found = strength(base, effect, beside)
    for _ in range(MAX_STEPS):
        if abs(np.log(max(found, 1e-9) / target)) < 0.1:
            break
        wanted = effect.sized(effect.size * float(np.clip(target / max(found, 1e-9), 1 / MAX_FACTOR, MAX_FACTOR)))
        if wanted.size == effect.size:
            break
        effect = wanted
        found = strength(base, effect, beside)
    return effect, found


def _added(base: FieldCase, changed: FieldCase, number: int) -> Array:
    """What an effect adds to the torque that a reader of the recording cannot explain, (steps, joints), N m."""
    before, after = base.runs[number], changed.runs[number]
    read = changed.read(changed.late(after.track.time, after.torque)) - base.read(before.torque)
    if changed.shift.any():
        links = before.track.motion
        moved = Motion(links.position + changed.shift, links.velocity, links.acceleration)
        read += rigid_body_torque(base.arm, links) - rigid_body_torque(base.arm, moved)
    return np.asarray(read)


def _free_columns(arm: Arm, run: FieldRun, thinned: int) -> Array:
    """Columns of all that is refitted, (samples, joints, columns)."""
    motion = run.track.motion
    own = Motion(*(each[::thinned] for each in (motion.position, motion.velocity, motion.acceleration)))
    links = observation_matrix(arm, own)[:, base_parameters(arm).columns].reshape(own.samples, len(arm), -1)
    top = np.maximum(np.abs(motion.velocity).max(axis=0), 1e-9)
    laws = (own.acceleration, np.tanh(own.velocity / (SIGN_WIDTH * top)), own.velocity, np.ones(own.velocity.shape))
    return np.concatenate([links, *(law[:, :, None] * np.eye(len(arm)) for law in laws)], axis=2)
