"""Whether the positions of a recording of motion only answer its commands: units, order of the columns, standstill."""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.recording import Finding, MotionRun
from problem.arm import Arm
from problem.joint_words import joint_in_words

MIN_MOVED = 0.02  # rad (m): less travel of a joint than this says nothing about its drive
MIN_LIKENESS = 0.9  # correlation of a position with a command that it answers
MIN_LIKENESS_GAP = 0.2  # by which another command has to be more like a position than its own
MAX_GAIN = 5.0  # rad per rad: no position servo moves so much further than it is told
KNOWN_FACTORS = {"degrees for radians": 180 / np.pi, "counts of 4096 a turn for radians": 4096 / (2 * np.pi)}
FACTOR_TOLERANCE = 0.25  # relative


def check_answers(runs: Sequence[MotionRun], arm: Arm) -> tuple[Finding, ...]:
    """Warnings where positions do not answer their commands; the first names what was probably mistaken.

    A joint that stands still is reported, too: its drive cannot be diagnosed.
    """
    commands = np.concatenate([np.asarray(run.reference_position) for run in runs])
    positions = np.concatenate([run.position for run in runs])
    moved, commanded = np.ptp(positions, axis=0), np.ptp(commands, axis=0)
    still = (moved < MIN_MOVED) & (commanded < MIN_MOVED)
    likeness = _correlations(positions, commands)
    found = [_unit_error(commands, positions, likeness, arm, joint) for joint in range(len(moved)) if not still[joint]]
    found += [_exchanged(likeness, arm, joint) for joint in range(len(moved)) if not still[joint]]
    found += [_still(arm, int(joint)) for joint in np.flatnonzero(still)]
    return tuple(each for each in found if each is not None)


def _correlations(positions: Array, commands: Array) -> Array:
    """Correlation (joints, joints) of each position with each command; 0 where one is constant."""
    first, second = positions - positions.mean(axis=0), commands - commands.mean(axis=0)
    sizes = np.outer(np.linalg.norm(first, axis=0), np.linalg.norm(second, axis=0))
    return np.asarray(np.divide(first.T @ second, sizes, out=np.zeros_like(sizes), where=sizes > 0))


def _unit_error(commands: Array, positions: Array, likeness: Array, arm: Arm, joint: int) -> Finding | None:
    swing = commands[:, joint] - commands[:, joint].mean()
    gain = float(swing @ positions[:, joint]) / max(float(swing @ swing), 1e-300)
    if abs(likeness[joint, joint]) < MIN_LIKENESS or 1 / MAX_GAIN < abs(gain) < MAX_GAIN:
        return None
    size = max(abs(gain), 1 / max(abs(gain), 1e-300))
    named = [name for name, factor in KNOWN_FACTORS.items() if abs(size / factor - 1) < FACTOR_TOLERANCE]
    own = joint_in_words(arm, joint + 1)
    text = f"position of {own} moves {gain:.3g} times as far as its command: units.position and "
    text += f"units.reference_position differ{': ' + named[0] + '?' if named else '?'}"
    return Finding("command_unit", "warning", text, joint + 1)


def _exchanged(likeness: Array, arm: Arm, joint: int) -> Finding | None:
    own, best = abs(likeness[joint, joint]), int(np.argmax(np.abs(likeness[joint])))
    if best == joint or abs(likeness[joint, best]) < max(MIN_LIKENESS, own + MIN_LIKENESS_GAP):
        return None
    text = f"position of {joint_in_words(arm, joint + 1)} follows the command of {joint_in_words(arm, best + 1)} "
    text += f"(correlation {likeness[joint, best]:.2f}, with its own {likeness[joint, joint]:.2f}): exchanged columns?"
    return Finding("exchanged_columns", "warning", text, joint + 1)


def _still(arm: Arm, joint: int) -> Finding:
    own = joint_in_words(arm, joint + 1)
    text = f"{own} moves less than {MIN_MOVED} rad (m) and is told no more: its drive cannot be diagnosed"
    return Finding("still_joint", "warning", text, joint + 1)
