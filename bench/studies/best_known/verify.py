"""What a trajectory keeps at every instant, not at its samples alone: limits of motion, and distances between parts."""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.excitation import ExcitationProblem
from problem.feasible import FeasibleFourier
from problem.limits import peaks
from problem.motion import Motion
from problem.safe_motion import SafeConstraints
from problem.safety_proof import SafetyReport, check_motion
from problem.trajectories import JointFourier, sample_instants

INSTANTS_PER_HARMONIC = 1024  # of a series: the bound between them is at most 5e-6 above the peak (`problem.feasible`)
PATH_INSTANTS = 20_001  # of a path of the tool point, for which there is no bound
LIMIT_TOLERANCE = 1e-5  # of a limit: how far above it the bound of a motion that keeps it may be


@dataclass(frozen=True)
class Verification:
    """limit_use: by kind of limit the largest share that is used. safety: what was shown of distances, if asked for."""

    limit_use: dict[str, float]
    safety: SafetyReport | None


def verify_motion(problem: ExcitationProblem, point: Array, name: str) -> Verification:
    """What the motion of a point (dimension,) keeps; InputError, in one line, where it breaks a limit or collides."""
    use = limit_use_of_point(problem, point)
    worst = max(use, key=lambda kind: use[kind])
    if not use[worst] <= 1 + LIMIT_TOLERANCE:
        raise InputError(f"{name}: breaks a limit, at the samples or between them: {worst} uses {use[worst]:.2%} of it")
    if not isinstance(problem.constraints, SafeConstraints):
        return Verification(use, None)
    try:
        return Verification(use, check_motion(problem.constraints.rules, problem.trajectory, point, problem.duration))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def limit_use_of_point(problem: ExcitationProblem, point: Array) -> dict[str, float]:
    """Largest share used of each kind of limit at any instant by the motion of a point (dimension,)."""
    trajectory = problem.trajectory.series if isinstance(problem.trajectory, FeasibleFourier) else problem.trajectory
    instants, factor = PATH_INSTANTS, 1.0
    if isinstance(trajectory, JointFourier):
        instants, factor = INSTANTS_PER_HARMONIC * trajectory.harmonics + 1, 1 / np.cos(np.pi / INSTANTS_PER_HARMONIC)
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are far too large
        excitation = problem.trajectory.motions(point[None], sample_instants(problem.duration, instants))
        if excitation.overreach[0] > 0:
            return {"reach": np.inf}
        return {kind: factor * share for kind, share in limit_use(problem, excitation.motion).items()}


def limit_use(problem: ExcitationProblem, motion: Motion) -> dict[str, float]:
    """Largest share used of each kind of limit by a motion (1, samples, joints): half range, speed, acceleration."""
    lowest, highest, speed, acceleration = peaks(motion)[0]
    low, high = np.array([limit.position for limit in problem.constraints.limits]).T
    bounded = np.isfinite(high - low)
    middle, half = np.where(bounded, (low + high) / 2, 0.0), np.where(bounded, (high - low) / 2, np.inf)
    use = {
        "position": np.maximum(highest - middle, middle - lowest) / half,
        "speed": speed / [limit.velocity for limit in problem.constraints.limits],
        "acceleration": acceleration / [limit.acceleration for limit in problem.constraints.limits],
    }
    return {name: float(np.max(share)) for name, share in use.items()}
