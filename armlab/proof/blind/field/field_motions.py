"""Motions of the field: what people let robots do, and how a servo follows it.

A reference becomes a motion in two steps. Within the play of a joint that sticks it does not follow at all. Then it
follows as a servo does, smoothed by a Gaussian of its bandwidth. Derivatives are those of the same Gaussian, so that
position, velocity and acceleration belong to one motion to within rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.motions import FAMILIES, moving_average
from problem.motion import Motion

KERNEL_WIDTHS = 7.0  # of the Gaussian on each side: what is cut off is below rounding


@dataclass(frozen=True)
class Style:
    """How the robot of a case is moved and follows; drawn once a case.

    vigour: share of the usual speed. used_range: share of the range. servo_s: width of the Gaussian, s, of each joint.
    stuck: way within which a joint does not follow, share of its used range. shake: amplitude of a vibration at
    shake_hz, share of the used range. rest_share: share of the time at rest at both ends. few: whether only some joints
    move at one instant.
    """

    vigour: float
    used_range: float
    servo_s: Array
    stuck: Array
    shake: Array
    shake_hz: Array
    rest_share: tuple[float, float]
    few: bool


def draw_style(rng: np.random.Generator, joints: int) -> Style:
    """A style of motion, slow as often as fast."""
    rests = tuple(float(each) for each in rng.uniform(0, 0.1, 2) * (rng.random(2) < 0.5))
    return Style(
        vigour=float(np.exp(rng.uniform(np.log(0.15), 0.0))),
        used_range=float(rng.uniform(0.4, 0.9)),
        servo_s=np.exp(rng.uniform(np.log(0.01), np.log(0.05), joints)),
        stuck=np.exp(rng.uniform(np.log(1e-5), np.log(1e-3), joints)),
        shake=np.exp(rng.uniform(np.log(3e-6), np.log(3e-4), joints)),
        shake_hz=rng.uniform(4, 25, joints),
        rest_share=(rests[0], rests[1]),
        few=bool(joints > 1 and rng.random() < 0.15),
    )


def sines(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """One or two sines a joint."""
    out = np.zeros((len(time), joints))
    for joint in range(joints):
        for weight in (1.0, float(rng.uniform(0, 0.4))):
            angle = 2 * np.pi * np.exp(rng.uniform(np.log(0.05), np.log(1.0))) * time + rng.uniform(0, 2 * np.pi)
            out[:, joint] += weight * np.sin(angle)
    return out


def trapezes(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Back and forth between two or three places with constant speed, ramps, and rests at the ends."""
    out = np.zeros((len(time), joints))
    for joint in range(joints):
        places = rng.uniform(-1, 1, int(rng.integers(2, 4)))
        knots, values, at = [time[0] - 1.0], [places[0]], 0
        pause, speed = float(rng.uniform(0.0, 0.8)), float(np.exp(rng.uniform(np.log(0.3), np.log(1.5))))
        while knots[-1] < time[-1] + 1:
            at = (at + 1) % len(places)
            knots += [knots[-1] + 0.3 + abs(places[at] - values[-1]) / speed]
            values += [places[at]]
            knots += [knots[-1] + pause * rng.uniform(0.5, 1.5)]
            values += [places[at]]
        out[:, joint] = np.interp(time, knots, values)
    width = max(round(0.1 / (time[1] - time[0])), 1)
    return moving_average(out, width)


def by_hand(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """As a hand leads an arm, or as a person commands it: moves of uneven length and speed, held places between."""
    out = np.zeros((len(time), joints))
    for joint in range(joints):
        knots, values = [time[0] - 2.0], [float(rng.normal())]
        while knots[-1] < time[-1] + 2:
            moves = rng.random() < 0.85
            knots += [knots[-1] + float(np.exp(rng.normal(np.log(0.7), 0.6)))]
            values += [values[-1] * 0.8 + float(rng.normal(0, 0.8)) if moves else values[-1]]
        out[:, joint] = np.interp(time, knots, values)
    width = max(round(float(rng.uniform(0.15, 0.5)) / (time[1] - time[0])), 1)
    return moving_average(moving_average(out, width), width)


Family = Callable[[np.random.Generator, Array, int], Array]
FIELD_FAMILIES: dict[str, Family] = {**FAMILIES, "sines": sines, "trapezes": trapezes, "by hand": by_hand}


def field_motion(
    rng: np.random.Generator, family: str, time: Array, machine: Machine, style: Style, still: NDArray[np.bool_]
) -> Motion:
    """A motion of the links of a machine, within its range and speed.

    still: (joints,), whether a joint holds its place. Returns (steps, joints).
    """
    step = float(time[1] - time[0])
    shape = FIELD_FAMILIES[family](rng, time, machine.joints)
    if style.few:
        shape = _one_after_another(rng, shape, time)
    shape = _with_rests(shape, style.rest_share)
    shape = shape - (shape.max(axis=0) + shape.min(axis=0)) / 2
    low, high = machine.range
    reach = style.used_range * np.minimum((high - low) / 2, 2.0) * rng.uniform(0.5, 1.0, machine.joints)
    smooth = gaussian_filter1d(shape, 0.03 / step, axis=0, mode="nearest")
    velocity = np.gradient(smooth, step, axis=0)
    fastest = np.maximum(np.abs(velocity).max(axis=0), 1e-9)
    hardest = np.maximum(np.abs(np.gradient(velocity, step, axis=0)).max(axis=0), 1e-9)
    most = np.minimum(style.vigour * machine.speed / fastest, np.sqrt(style.vigour) * machine.acceleration / hardest)
    scale = np.minimum(reach / np.maximum(np.abs(shape).max(axis=0), 1e-9), most) * ~still
    room = np.maximum((high - low) / 2 - scale * np.abs(shape).max(axis=0), 0)
    centre = (low + high) / 2 + rng.uniform(-0.7, 0.7, machine.joints) * room
    reference = centre + scale * shape
    return _as_followed(rng, reference, time, style, np.where(still, 0.0, reach))


def _one_after_another(rng: np.random.Generator, shape: Array, time: Array) -> Array:
    """Joints move one or a few at a time: of the others, the path stands still."""
    joints = shape.shape[1]
    pieces = int(rng.integers(joints, 2 * joints + 1))
    owner = np.concatenate([rng.permutation(joints) for _ in range(2)])[:pieces]
    piece = np.minimum((pieces * (time - time[0]) / (time[-1] - time[0])).astype(int), pieces - 1)
    moving = np.zeros(shape.shape)
    for joint in range(joints):
        company = rng.random(pieces) < 0.15
        moving[:, joint] = (owner == joint)[piece] | company[piece]
    soft = moving_average(moving, max(round(0.2 / (time[1] - time[0])), 1))
    return np.asarray(np.cumsum(np.gradient(shape, axis=0) * soft, axis=0))


def _with_rests(shape: Array, shares: tuple[float, float]) -> Array:
    """The motion squeezed between rests at its first and last place."""
    number = len(shape)
    place = np.arange(number)
    first, last = shares[0] * number, (1 - shares[1]) * number
    inside = np.clip((place - first) / (last - first), 0, 1)
    inside = moving_average(inside[:, None], max(number // 50, 1))[:, 0] if any(shares) else inside
    return np.column_stack([np.interp(inside * (number - 1), place, column) for column in shape.T])


def _as_followed(rng: np.random.Generator, reference: Array, time: Array, style: Style, reach: Array) -> Motion:
    step = float(time[1] - time[0])
    followed = np.empty((3, *reference.shape))
    for joint in range(reference.shape[1]):
        path = _behind_play(reference[:, joint], style.stuck[joint] * reach[joint])
        wander = gaussian_filter1d(rng.standard_normal(len(time)), 1.0 / step / style.shake_hz[joint] / 6)
        moves = np.abs(np.gradient(path, step))
        moves = gaussian_filter1d(moves / max(float(moves.max()), 1e-12), 0.05 / step)
        path = path + style.shake[joint] * reach[joint] * moves * wander / max(float(np.std(wander)), 1e-12)
        width = style.servo_s[joint] / step
        for order in range(3):
            smooth = gaussian_filter1d(path, width, order=order, mode="nearest", truncate=KERNEL_WIDTHS)
            followed[order, :, joint] = smooth / step**order
    return Motion(*followed)


def _behind_play(path: Array, way: float) -> Array:
    """A place that a path pushes ahead of itself within a play (Prandtl 1928): it rests at reversals."""
    if way <= 0:
        return path
    state, out = float(path[0]), []
    for value in path.tolist():
        state = min(max(state, value - way), value + way)
        out.append(state)
    return np.array(out)
