"""A trajectory at the rate of a controller, which is refused if it breaks a limit there."""

from dataclasses import dataclass

import numpy as np

from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.limits import Constraints, peaks
from problem.motion import Motion
from problem.trajectory import instants
from problem.transforms import Array

AT_REST = 1e-9  # rad/s and rad/s2 (m): what rounding leaves


@dataclass(frozen=True, eq=False)
class Sampled:
    """A motion (samples, joints) at a rate, by joint names; kinds: revolute or prismatic."""

    name: str
    joint_names: tuple[str, ...]
    kinds: tuple[str, ...]
    rate_hz: float
    motion: Motion

    @property
    def times(self) -> Array:
        """Instants (samples,), s."""
        return np.arange(self.motion.samples) / self.rate_hz


def sampled(problem: ExcitationProblem, point: Array, rate_hz: float, name: str) -> Sampled:
    """The trajectory of a point (dimension,), both ends included.

    Raises InputError, in one line, if the duration is no whole number of periods, if the arm is not at rest at
    both ends, or if any limit is broken at this rate.
    """
    steps = problem.duration * rate_hz
    if rate_hz <= 0 or abs(steps - round(steps)) > 1e-6:
        raise InputError(f"{name}: {problem.duration:g} s is not a whole number of periods of {rate_hz:g} Hz")
    excitation = problem.trajectory.motions(point[None], instants(problem.duration, round(steps) + 1))
    motion = excitation.motion.select(np.intp(0))
    _check_ends(motion, name)
    if problem.constraints.violation(excitation)[0] > 0:
        broken = _worst(problem.constraints, excitation.motion)
        raise InputError(f"{name} breaks a limit at {rate_hz:g} Hz: {broken}; take a record with more samples")
    joints = problem.arm.joints
    return Sampled(name, tuple(joint.name for joint in joints), tuple(joint.kind for joint in joints), rate_hz, motion)


def _check_ends(motion: Motion, name: str) -> None:
    ends = np.stack([motion.velocity[[0, -1]], motion.acceleration[[0, -1]]])
    if np.abs(ends).max() > AT_REST:
        raise InputError(f"{name} is not at rest at both ends: take a record of a problem with `rest: true`")


def _worst(constraints: Constraints, motion: Motion) -> str:
    """The limit of joint motion that is exceeded most, relative to its size."""
    told: dict[str, float] = {}
    for joint, limits, peak in zip(constraints.arm.joints, constraints.limits, peaks(motion)[0], strict=True):
        low, high, speed, acceleration = (float(value) for value in peak)
        entries = [
            ("position", low, limits.position[0], limits.position[0] - low),
            ("position", high, limits.position[1], high - limits.position[1]),
            ("speed", speed, limits.velocity, speed - limits.velocity),
            ("acceleration", acceleration, limits.acceleration, acceleration - limits.acceleration),
        ]
        for what, reached, limit, excess in entries:
            told[f"{what} of {joint.name} reaches {reached:.6g}, limit {limit:.6g} (SI)"] = excess / (1 + abs(limit))
    worst = max(told, key=lambda text: np.nan_to_num(told[text], nan=-np.inf))
    return worst if told[worst] > 0 else "of torque, workspace or reach"
