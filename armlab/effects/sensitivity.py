"""How the rigid torque changes with the geometry, by central differences, and with gravity; derivatives of signals.

The rigid torque of ten thousand samples costs a millisecond or two, so differences of it are cheaper
than any formula, and have no errors of their own kind.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.polynomial.polynomial import polyder, polyval, polyvander

from armlab.common.arrays import Array
from armlab.effects.contract import Scene
from problem.arm import Joint
from problem.regressor import rigid_body_torque

GEOMETRY_STEP = 1e-4  # m, rad, each way
WINDOW, ORDER = 9, 4  # samples and degree of the light low-pass (Savitzky and Golay 1964) that differentiates


def smooth_derivative(signal: Array, step: float, order: int) -> Array:
    """Derivative of a signal (samples,) that a short polynomial through its neighbours has."""
    window = min(WINDOW, len(signal) - 1 + len(signal) % 2)
    half = window // 2
    to_polynomial = np.linalg.pinv(polyvander(np.arange(-half, half + 1), min(ORDER, window - 1)))
    polynomials = polyder(to_polynomial @ sliding_window_view(signal, window).T, order, scl=1 / step)
    before, after = np.arange(-half, 0), np.arange(1, half + 1)
    return np.concatenate([polyval(before, polynomials[:, 0]), polynomials[0], polyval(after, polynomials[:, -1])])


def delay_signal(scene: Scene, signal: Array, seconds: float) -> Array:
    """A signal (samples, ...) as it was `seconds` ago, between samples by straight lines; held at the ends."""
    places = np.clip(np.arange(len(signal)) - seconds / scene.step, 0, len(signal) - 1)
    below = np.minimum(places.astype(int), len(signal) - 2)
    share = (places - below).reshape(-1, *[1] * (signal.ndim - 1))
    return np.asarray(signal[below] * (1 - share) + signal[below + 1] * share)


def gravity_derivative(scene: Scene, direction: Array) -> Array:
    """Change of the rigid torque with gravity along a direction (3,): exact, for it is linear in gravity."""
    changed = replace(scene.arm, gravity=_vector(np.array(scene.arm.gravity) + direction))
    return rigid_body_torque(changed, scene.motion, scene.inertial) - scene.links_torque


def horizontal_directions(gravity: Array) -> tuple[Array, Array]:
    """Two directions across gravity: x and y of the base, where gravity is along z."""
    strength = np.linalg.norm(gravity)
    down = gravity / strength if strength else np.array([0.0, 0.0, -1.0])
    axis = np.eye(3)[1 if abs(down[0]) > 0.9 else 0]
    first = axis - (axis @ down) * down
    first /= np.linalg.norm(first)
    return first, np.cross(-down, first)


def geometry_derivative(scene: Scene, joint: int, changed: Callable[[Joint, float], Joint]) -> Array:
    """Derivative of the rigid torque by a change of a joint (from 0), m or rad: (samples, joints).

    changed: the joint with a change of a size. The links' bodies stay where they are in their frames.
    """
    torques = []
    for step in (GEOMETRY_STEP, -GEOMETRY_STEP):
        joints = list(scene.arm.joints)
        joints[joint] = changed(joints[joint], step)
        torques.append(rigid_body_torque(replace(scene.arm, joints=tuple(joints)), scene.motion, scene.inertial))
    return (torques[0] - torques[1]) / (2 * GEOMETRY_STEP)


def _vector(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
