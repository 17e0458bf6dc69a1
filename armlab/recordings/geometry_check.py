"""Tests whether the geometry of the arm explains the torques: swapped channels, wrong zeros, another arm.

All torques of a recording are fitted by least squares with the base parameters and the friction of each joint free,
on every second block of time, and judged on the other blocks. No nominal parameters are needed. The zero of the
last joint cannot be tested: the parameters of its link absorb an offset.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.recordings.differentiate import differentiate
from armlab.recordings.recording import Finding, Run
from problem.arm import Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

MAX_FIT_ROWS = 2000  # of a recording are enough to tell channels apart
BLOCKS_PER_RUN = 10  # of each run
MAX_UNEXPLAINED_SHARE = 0.6  # of a torque's scatter: an arm of the right geometry leaves less
MAX_SWAP_ERROR_RATIO = 0.6  # times the error: a swap has to be so much better to be named
RIDGE_WEIGHT = 1e-6  # of the rows: what the motion does not excite stays small

ChannelOrder = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ThinnedSignals:
    """Filtered signals of all runs at a few instants: motion and torque (rows, joints), and what is held out."""

    motion: Motion
    torque: Array
    held_out: NDArray[np.bool_]


def check_torque_fit(runs: Sequence[Run], arm: Arm) -> tuple[Finding, ...]:
    """A warning where swapped channels explain the runs much better, or where the arm explains them badly."""
    thinned, base = thin_runs(runs), base_parameters(arm)
    columns = fit_columns(arm, base, thinned.motion)
    own = held_out_errors(columns, thinned, np.arange(len(arm)))
    swap = _find_swapped_channels(arm, base, thinned, columns, own)
    if swap:
        return (swap,)
    if _overall_error(own) > MAX_UNEXPLAINED_SHARE:
        return (_unexplained_warning(f"the geometry of {arm.name} does not explain", own),)
    if arm.links is not None:
        nominal = nominal_errors(arm, thinned)
        if _overall_error(nominal) > MAX_UNEXPLAINED_SHARE:
            return (_unexplained_warning(f"the `links` of {arm.name} with fitted friction do not explain", nominal),)
    return ()


def _unexplained_warning(what: str, errors: Array) -> Finding:
    bad = [f"{joint + 1} ({error:.0%})" for joint, error in enumerate(errors) if error > MAX_UNEXPLAINED_SHARE]
    text = f"{what} much of the torque of joint {', '.join(bad)}: another robot or units?"
    return Finding("another_arm", "warning", text)


def thin_runs(runs: Sequence[Run]) -> ThinnedSignals:
    """A few filtered instants of each run; every second block of time is held out."""
    motions, torques, held_out = [], [], []
    step = max(sum(run.samples for run in runs) // MAX_FIT_ROWS, 1)
    for signals in (differentiate(run, step=step) for run in runs):
        rows, motion = signals.filter.rows, signals.motion
        motions.append(Motion(motion.position[rows], motion.velocity[rows], motion.acceleration[rows]))
        torques.append(signals.torque)
        count = len(signals.torque)
        held_out.append((np.arange(count) * BLOCKS_PER_RUN // count) % 2 == 1)
    motion = Motion(
        position=np.concatenate([each.position for each in motions]),
        velocity=np.concatenate([each.velocity for each in motions]),
        acceleration=np.concatenate([each.acceleration for each in motions]),
    )
    return ThinnedSignals(motion, np.concatenate(torques), np.concatenate(held_out))


def fit_columns(arm: Arm, base: BaseParameters, motion: Motion) -> Array:
    """Columns of the base parameters and of each joint's own friction: (rows, joints, columns)."""
    rigid = observation_matrix(arm, motion)[:, base.columns].reshape(motion.samples, len(arm), -1)
    return np.concatenate([rigid, _joint_columns(motion)], axis=2)


def nominal_errors(arm: Arm, thinned: ThinnedSignals) -> Array:
    """Errors (joints,) where the arm's own links give the rigid torque and only friction is fitted."""
    left = replace(thinned, torque=thinned.torque - rigid_body_torque(arm, thinned.motion))
    errors = held_out_errors(_joint_columns(thinned.motion), left, np.arange(len(arm)))
    scatter = np.std(thinned.torque, axis=0)
    return np.asarray(errors * np.std(left.torque, axis=0) / np.where(scatter > 0, scatter, np.inf))


def _joint_columns(motion: Motion) -> Array:
    """Viscous and Coulomb friction, rotor and offset of each joint."""
    own = (motion.velocity, np.sign(motion.velocity), motion.acceleration, np.ones_like(motion.velocity))
    return np.concatenate([signal[:, :, None] * np.eye(motion.joints) for signal in own], axis=2)


def held_out_errors(columns: Array, thinned: ThinnedSignals, order: ChannelOrder) -> Array:
    """Root mean square error over scatter, (joints,), where joint i is given torque channel order[i]."""
    torque = thinned.torque[:, order]
    scatter = np.std(torque, axis=0)
    weight = np.where(scatter > 0, 1 / np.where(scatter > 0, scatter, 1), 0)
    scaled, target = columns * weight[:, None], torque * weight
    matrix, goal = scaled[~thinned.held_out].reshape(-1, columns.shape[2]), target[~thinned.held_out].ravel()
    lengths = np.linalg.norm(matrix, axis=0)
    unit = matrix / np.where(lengths > 0, lengths, 1)
    gram = unit.T @ unit + RIDGE_WEIGHT * np.eye(unit.shape[1])
    fitted = np.linalg.solve(gram, unit.T @ goal) / np.where(lengths > 0, lengths, 1)
    residual = target[thinned.held_out] - scaled[thinned.held_out] @ fitted
    return np.asarray(np.sqrt(np.mean(residual**2, axis=0)))


def _find_swapped_channels(
    arm: Arm, base: BaseParameters, thinned: ThinnedSignals, columns: Array, own: Array
) -> Finding | None:
    """The exchange of two channels that explains the torques best, if that is clearly better than none."""
    trials: dict[tuple[str, int, int], float] = {}
    for first, second in combinations(range(len(arm)), 2):
        order = np.arange(len(arm))
        order[[first, second]] = second, first
        trials["torque", first, second] = _overall_error(held_out_errors(columns, thinned, order))
        trials["position", first, second] = _overall_error(_errors_with_swapped_positions(arm, base, thinned, order))
    best = min(trials, key=lambda trial: trials[trial], default=None)
    if best is None or trials[best] > MAX_SWAP_ERROR_RATIO * _overall_error(own):
        return None
    signal, first, second = best
    rival = "position" if signal == "torque" else "torque"
    if trials[rival, first, second] <= MAX_SWAP_ERROR_RATIO * _overall_error(own):
        signal = f"{signal} (or {rival})"
    channels = f"{first + 1} and {second + 1}"
    text = f"{signal} channels {channels} look swapped: exchanged, they fit the motion of the arm much better"
    return Finding("swapped_channels", "warning", text)


def _errors_with_swapped_positions(
    arm: Arm, base: BaseParameters, thinned: ThinnedSignals, order: ChannelOrder
) -> Array:
    motion = thinned.motion
    swapped = Motion(motion.position[:, order], motion.velocity[:, order], motion.acceleration[:, order])
    return held_out_errors(fit_columns(arm, base, swapped), thinned, np.arange(len(arm)))


def _overall_error(errors: Array) -> float:
    return float(np.exp(np.mean(np.log(np.maximum(errors, 1e-6)))))


ZERO_TURNS_DEG = (90, -90, 180)
MAX_TURNED_ERROR_RATIO = 0.8  # times the error: a turned zero has to be so much better to be named


def find_turned_zero(arm: Arm, thinned: ThinnedSignals) -> Finding | None:
    """A warning where a joint's turned zero explains the torques much better."""
    own = _errors_with_offset(arm, thinned, np.zeros(len(arm)))
    size = np.std(thinned.torque, axis=0)
    trials = {
        (joint, turn): _error_ratio(
            _errors_with_offset(arm, thinned, np.deg2rad(turn) * np.eye(len(arm))[joint]), own, size
        )
        for joint in range(len(arm))
        if arm.joints[joint].kind == "revolute"
        for turn in ZERO_TURNS_DEG
    }
    best = min(trials, key=lambda trial: trials[trial], default=None)
    if best is None or trials[best] > MAX_TURNED_ERROR_RATIO:
        return None
    joint, turn = best
    text = (
        f"with its zero turned by {turn:+d} deg, joint {joint + 1} explains the torques much better "
        f"(error x {trials[best]:.2f}): see transmission.offset, or theta_offset of the robot file"
    )
    return Finding("turned_zero", "warning", text, joint + 1)


def _errors_with_offset(arm: Arm, thinned: ThinnedSignals, offset: Array) -> Array:
    motion = replace(thinned.motion, position=thinned.motion.position + offset)
    return held_out_errors(fit_columns(arm, base_parameters(arm), motion), thinned, np.arange(len(arm)))


def _error_ratio(errors: Array, own: Array, size: Array) -> float:
    """The error of all joints in N m, as a share of that without a turn."""
    return float(np.linalg.norm(errors * size) / max(float(np.linalg.norm(own * size)), 1e-300))
