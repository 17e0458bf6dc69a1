"""Changes that may be named: sure, allowed by physics in every recording, and helpful on held-out stretches."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.changes.between_runs import scatter_between_runs
from armlab.diagnosis.changes.change_search import find_changes, held_out_errors
from armlab.diagnosis.changes.changes import ChangeTable, Tested
from armlab.diagnosis.changes.numbers import (
    between_ends,
    half_width_factor,
    laws_of,
    mean_of_scale,
    recording_values,
)
from armlab.diagnosis.changes.pooled import Pooled, is_body
from armlab.diagnosis.torque.search.fitted_model import inertial_parameters
from armlab.effects.contract import Scene
from armlab.effects.drive import ROTOR_INERTIA
from armlab.effects.term import SIGN_SIGMAS
from problem.motion import Motion

INERTIA_STATES = 50  # a run
LEAST_TORQUE_TOLD = 0.5  # recorded torque over that of the common model: below it the model tells another torque


@dataclass(frozen=True)
class SoundChanges:
    """named: the changes, fitted together. doubtful: where there are none, the likeliest change of those by which the
    runs of one recording differ as much, fitted alone. elsewhere: the doubtful change is another one, sure only where
    rows count whose states not all recordings were in.
    """

    named: tuple[Tested, ...]
    doubtful: Tested | None = None
    elsewhere: bool = False


def find_sound_changes(pooled: Pooled, table: ChangeTable) -> SoundChanges:
    """The changes that are sure, that physics allows in every recording, that help on held-out stretches, and by which
    the runs of one recording do not differ as much. What fails leaves its place to others.
    """
    banned: frozenset[int] = frozenset()
    varying: set[int] = set()
    while True:
        found = find_changes(table, banned)
        wrong = _impossible(pooled, table, found) or _least_helpful(table, found)
        if not wrong:
            wrong = _within_runs(table, found)
            varying |= wrong
        if not wrong:
            return SoundChanges(found, None if found else _likeliest_alone(pooled, table, varying))
        banned |= wrong


def _likeliest_alone(pooled: Pooled, table: ChangeTable, numbers: Iterable[int]) -> Tested | None:
    """Of changes that are sure, possible and helpful even alone, the likeliest."""
    tested = [table.test((each,))[0] for each in numbers]
    alone = [each for each in tested if table.is_sure(each)]
    sound = [each for each in alone if not _impossible(pooled, table, [each]) and not _least_helpful(table, [each])]
    return max(sound, key=table.log_odds, default=None)


def _impossible(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> set[int]:
    """The changes that physics does not allow."""
    return {each.group for each in found if reason_impossible(pooled, table, found, each) is not None}


def _within_runs(table: ChangeTable, found: Sequence[Tested]) -> set[int]:
    """Of the changes by which runs of one recording differ as much, the one of least evidence."""
    alike = [each for each in found if runs_differ_as_much(table, found, each)]
    return {min(alike, key=lambda each: each.evidence).group} if alike else set()


def _least_helpful(table: ChangeTable, found: Sequence[Tested]) -> set[int]:
    """The change that helps least on held-out stretches, where one does not help enough."""
    chosen = [each.group for each in found]
    errors = {each: held_out_errors(table, chosen, each) for each in chosen}
    failed = [each for each in chosen if not predicts_better(table, each, errors[each])]
    return set(sorted(failed, key=lambda each: float(np.mean(held_out_gains(table, each, errors[each]))))[:1])


def reason_impossible(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> str | None:
    """The law of physics that a change breaks in one of the recordings, in a few words; None where it breaks none."""
    group = table.groups[tested.group]
    if is_body(group.candidate):
        return _reason_no_body(pooled, table, tested)
    _, covariance = between_ends(table, tested)
    if group.candidate.facts.scales_torque:
        return _reason_no_scale(pooled, table, tested)
    if group.parts or group.laws:
        return _reason_driving(pooled, table, tested, covariance)
    for law, own, of_group in laws_of(pooled, table, found, tested):
        if not law.known:
            continue
        doubt = of_group @ covariance @ of_group.T
        size = law.candidate.size
        reasons = (law.shaped(each).objection(law.coefficients(each), doubt[:size, :size]) for each in own)
        reason = next((each for each in reasons if each is not None), None)
        if reason is not None:
            return reason
    return None


def _reason_no_scale(pooled: Pooled, table: ChangeTable, tested: Tested) -> str | None:
    """What speaks against a gain: torque that the common model does not tell, or that changes its sign."""
    mean, (difference, _) = mean_of_scale(pooled, table, tested), between_ends(table, tested)
    if np.any(mean < LEAST_TORQUE_TOLD):
        return "the common model does not tell the torque of the joint"
    return "torque would change its sign" if np.any(np.abs(difference) >= 2 * mean) else None


def _reason_driving(pooled: Pooled, table: ChangeTable, tested: Tested, covariance: Array) -> str | None:
    """What speaks against a change of all friction of a joint: that it would drive the motion in a recording.

    A single coefficient may be negative: that of viscous friction is where friction saturates.
    """
    model, block = pooled.model, table.groups[tested.group].block
    row = block.candidate.rows[0]
    velocity = pooled.observed.kept("velocity")[:, row]
    common = 0.0
    for number, own in enumerate(model.design.blocks):
        if own.candidate.is_friction_of(row + 1):
            nominal = pooled.design.simulation.coefficients_of(own.candidate)
            torque = own.values[:, 0] @ (model.solver.values(model.fit, number) + nominal)
            common += float(np.mean(velocity * torque))
    power = np.mean(block.values[:, 0] * velocity[:, None], axis=0)
    doubt = SIGN_SIGMAS * float(np.sqrt(power @ covariance @ power))
    if np.all(common + recording_values(table, tested) @ power + doubt > 0):
        return None
    return f"the friction of joint {row + 1} would drive it"


def runs_differ_as_much(table: ChangeTable, found: Sequence[Tested], tested: Tested) -> bool:
    """Whether the runs of one recording differ by as much as two recordings do; more recordings are not asked."""
    if len(table.contrast) > 2:
        return False
    difference, _ = between_ends(table, tested)
    scatter = scatter_between_runs(table, [each.group for each in found], tested.group)
    return bool(half_width_factor(tested.degrees) * np.sqrt(scatter.variance_along(difference)) > 1)


def _reason_no_body(pooled: Pooled, table: ChangeTable, tested: Tested) -> str | None:
    """What speaks against a load: a joint that would have no inertia in one of the recordings."""
    body = table.groups[tested.group].candidate
    common, link = inertial_parameters(pooled.model), body.joints[0]
    place = slice(10 * link - 10, 10 * link)
    scenes = [_few_states(each) for each in pooled.design.scenes]

    def inertia(change: Array) -> Array:
        changed = common.copy()
        added = body.added_body(change)
        changed[place] += 0.0 if added is None else added
        moved = [replace(each, inertial=changed) for each in scenes]
        means = [[each.torque_by_acceleration(of)[:, of].mean() for of in range(len(each.arm))] for each in moved]
        return np.asarray(np.mean(means, axis=0))

    bare = inertia(np.zeros(body.size)) + _rotors(pooled)
    slopes = np.stack([inertia(unit) + _rotors(pooled) - bare for unit in np.eye(body.size)], axis=-1)
    _, covariance = between_ends(table, tested)
    doubt = SIGN_SIGMAS * np.sqrt(np.maximum(np.einsum("ji,ik,jk->j", slopes, covariance, slopes), 0.0))
    for each in recording_values(table, tested):
        negative = np.flatnonzero((bare + slopes @ each + doubt < 0) & (bare > 0))
        if len(negative):
            return f"joint {negative[0] + 1} would have a negative inertia"
    return None


def _few_states(scene: Scene) -> Scene:
    """Some states of a run."""
    every = slice(None, None, max(len(scene.time) // INERTIA_STATES, 1))
    motion = Motion(
        *(each[every] for each in (scene.motion.position, scene.motion.velocity, scene.motion.acceleration))
    )
    return replace(scene, time=scene.time[every], motion=motion, torque=scene.torque[every])


def _rotors(pooled: Pooled) -> Array:
    """Inertia of the rotors in simulation and common model, (joints,)."""
    model, arm = pooled.model, pooled.design.simulation.arm
    out = np.array(arm.rotor_inertia or [0.0] * len(arm), dtype=float)
    for number, block in enumerate(model.design.blocks):
        if block.candidate.effect == ROTOR_INERTIA.facts.id:
            out[block.candidate.rows[0]] += float(model.solver.values(model.fit, number)[0])
    return out


def held_out_gains(table: ChangeTable, tested: int, errors: tuple[list[Array], list[Array]]) -> tuple[float, ...]:
    """Share by which the squared held-out error of each recording falls at the joints where a group acts.

    Joints are weighted by their noise.
    """
    less, left = _sums_of_squares(table, tested, errors)
    return tuple(less / np.maximum(left, 1e-300))


def predicts_better(table: ChangeTable, tested: int, errors: tuple[list[Array], list[Array]]) -> bool:
    """Whether a change lowers the held-out error of every recording, and the mean of them by a least share.

    Recordings of one motion err alike, and half of a change brings one nearer to that error and takes the other one
    away from it: they are judged together.
    """
    less, left = _sums_of_squares(table, tested, errors)
    shared = np.zeros((len(table.contrast),) * 2, dtype=bool)
    for joint in table.mixed.joints:
        pairs = np.unique(np.column_stack([joint.rows.stretches, joint.rows.members]), axis=0)
        present = np.zeros((table.mixed.stretches, len(table.contrast)))
        present[pairs[:, 0], pairs[:, 1]] = 1
        shared |= present.T @ present > 0
    together = shared @ less
    return bool(together.min() > 0) and float(np.mean(less / np.maximum(left, 1e-300))) > table.tuning.least_gain


def _sums_of_squares(table: ChangeTable, tested: int, errors: tuple[list[Array], list[Array]]) -> tuple[Array, Array]:
    """By how much the weighted squares of each recording fall at the joints where a group acts, and what is left."""
    less, left = np.zeros((2, len(table.contrast)))
    for row in table.groups[tested].candidate.rows:
        before, after = (part[row] for part in errors)
        joint, count = table.mixed.joints[row], len(table.contrast)
        less += np.bincount(joint.rows.members, (before**2 - after**2) / joint.variance, minlength=count)
        left += np.bincount(joint.rows.members, after**2 / joint.variance, minlength=count)
    return less, left
