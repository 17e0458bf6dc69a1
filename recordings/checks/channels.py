"""Channels of one run: dead, frozen, beyond the limits of the joint, or at odds with each other."""

import numpy as np

from problem.arm import Arm
from recordings.run import Array, Finding, Run

FROZEN_S = 0.25  # a torque that repeats to the last digit for so long while its joint moves
BEYOND = 1.05  # times a limit: calibration and rounding aside
FOLLOWS = 0.9  # correlation of a velocity channel with the slope of its position


def channel_findings(run: Run, arm: Arm) -> tuple[Finding, ...]:
    """What is suspicious in the channels of a run, joint by joint."""
    findings: list[Finding] = []
    for joint in range(run.joints):
        findings += _dead(run, joint) + _frozen(run, joint) + _beyond_limits(run, arm, joint)
        findings += _velocity(run, joint)
    return tuple(findings)


def _warning(kind: str, joint: int, text: str) -> list[Finding]:
    return [Finding(kind, "warning", text, joint + 1)]


def _dead(run: Run, joint: int) -> list[Finding]:
    found = []
    for name, signal in run.signals.items():
        if name in ("torque", "velocity") and np.ptp(signal[:, joint]) == 0:
            found += _warning("dead_channel", joint, f"{name} of joint {joint + 1} is constant: a dead channel?")
    if np.ptp(run.position[:, joint]) == 0:
        found += _warning("still_joint", joint, f"position of joint {joint + 1} is constant: locked, or dead?")
    return found


def _frozen(run: Run, joint: int) -> list[Finding]:
    torque, position = run.torque[:, joint], run.position[:, joint]
    longest, start = _longest_repetition(torque)
    least = max(int(FROZEN_S * run.rate_hz), 20)
    if longest < least or longest == run.samples:
        return []
    moved = np.ptp(position[start : start + longest])
    if moved < 0.01 * np.ptp(position):
        return []
    where = f"{run.time[start]:.4g} s to {run.time[start + longest - 1]:.4g} s"
    text = f"torque of joint {joint + 1} repeats one value from {where} while the joint moves: frozen channel?"
    return _warning("frozen_channel", joint, text)


def _longest_repetition(values: Array) -> tuple[int, int]:
    """Length and start of the longest stretch of one and the same value."""
    starts = np.append(0, np.flatnonzero(np.diff(values) != 0) + 1)
    lengths = np.diff(np.append(starts, len(values)))
    longest = int(np.argmax(lengths))
    return int(lengths[longest]), int(starts[longest])


def _beyond_limits(run: Run, arm: Arm, joint: int) -> list[Finding]:
    limits = arm.joints[joint].limits
    low, high = run.position[:, joint].min(), run.position[:, joint].max()
    slack = (BEYOND - 1) * (limits.position[1] - limits.position[0])
    found = []
    if np.isfinite(slack) and (low < limits.position[0] - slack or high > limits.position[1] + slack):
        text = (
            f"position of joint {joint + 1} runs from {low:.4g} to {high:.4g}, its limits are "
            f"{limits.position[0]:.4g} and {limits.position[1]:.4g}: another unit, zero or robot?"
        )
        found += _warning("beyond_limits", joint, text)
    peak = float(np.abs(run.torque[:, joint]).max())
    if peak > BEYOND * limits.torque:
        text = f"torque of joint {joint + 1} reaches {peak:.4g}, its limit is {limits.torque:.4g}: another unit?"
        found += _warning("beyond_limits", joint, text)
    return found


def _velocity(run: Run, joint: int) -> list[Finding]:
    """Compares a velocity channel with the slope of the positions; steps of the encoder are averaged away."""
    if run.velocity is None or np.ptp(run.velocity[:, joint]) == 0:
        return []
    slopes = _averaged(np.gradient(run.position, run.time, axis=0))
    velocity = _averaged(run.velocity[:, joint : joint + 1])[:, 0]
    likeness = np.array([_correlation(velocity, slope) for slope in slopes.T])
    if likeness[joint] >= FOLLOWS or np.ptp(slopes[:, joint]) == 0:
        return _velocity_scale(velocity, slopes[:, joint], joint) if likeness[joint] >= FOLLOWS else []
    best = int(np.argmax(np.abs(likeness)))
    if abs(likeness[best]) < FOLLOWS:
        text = f"velocity of joint {joint + 1} does not follow its position (correlation {likeness[joint]:.2f})"
    elif best == joint:
        text = f"velocity of joint {joint + 1} has the opposite sign of its position's slope"
    else:
        text = f"velocity of joint {joint + 1} follows the position of joint {best + 1}: swapped channels?"
    return _warning("velocity_mismatch", joint, text)


def _velocity_scale(velocity: Array, slope: Array, joint: int) -> list[Finding]:
    scale = float(velocity @ slope / (slope @ slope))
    if 0.9 < scale < 1.1:
        return []
    text = f"velocity of joint {joint + 1} is {scale:.4g} times its position's slope: another unit or gear?"
    return _warning("velocity_mismatch", joint, text)


def _averaged(signal: Array) -> Array:
    """Means over stretches of about a hundredth of the run."""
    length = max(len(signal) // 100, 1)
    whole = len(signal) // length * length
    return np.asarray(signal[:whole].reshape(-1, length, signal.shape[1]).mean(axis=1))


def _correlation(first: Array, second: Array) -> float:
    first, second = first - first.mean(), second - second.mean()
    scale = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(first @ second) / scale if scale > 0 else 0.0
