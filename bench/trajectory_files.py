"""Trajectories as files for robot controllers, sampled at the controller's rate: CSV, ROS 2 message or RAPID module.

A trajectory that breaks a limit at that rate is refused.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.excitation import ExcitationProblem
from problem.limits import Constraints, peaks
from problem.motion import MAX_RATE_AT_REST, Motion
from problem.trajectories import sample_instants

MAX_SAMPLES = 10_000_000  # of a file for a controller


@dataclass(frozen=True, eq=False)
class SampledTrajectory:
    """A motion (samples, joints) at a rate; kinds: of the joints, revolute or prismatic."""

    name: str
    joint_names: tuple[str, ...]
    kinds: tuple[str, ...]
    rate_hz: float
    motion: Motion

    @property
    def times(self) -> Array:
        """Instants (samples,), s."""
        return np.arange(self.motion.samples) / self.rate_hz


def sample_trajectory(problem: ExcitationProblem, point: Array, rate_hz: float, name: str) -> SampledTrajectory:
    """The trajectory of a point (dimension,), both ends included.

    Raises InputError, in one line, if the duration is no whole number of periods, if the arm is not at rest at
    both ends, or if any limit is broken at this rate.
    """
    steps = problem.duration * rate_hz
    if rate_hz <= 0 or abs(steps - round(steps)) > 1e-6:
        raise InputError(f"{name}: {problem.duration:g} s is not a whole number of periods of {rate_hz:g} Hz")
    if steps > MAX_SAMPLES:
        raise InputError(f"{name}: {problem.duration:g} s at {rate_hz:g} Hz are more than {MAX_SAMPLES} samples")
    excitation = problem.trajectory.motions(point[None], sample_instants(problem.duration, round(steps) + 1))
    motion = excitation.motion.select(np.intp(0))
    _check_rest_at_ends(motion, name)
    if problem.constraints.violation(excitation)[0] > 0:
        broken = _describe_worst_violation(problem.constraints, excitation.motion)
        raise InputError(f"{name} breaks a limit at {rate_hz:g} Hz: {broken}; take a record with more samples")
    joints = problem.arm.joints
    return SampledTrajectory(
        name, tuple(joint.name for joint in joints), tuple(joint.kind for joint in joints), rate_hz, motion
    )


def _check_rest_at_ends(motion: Motion, name: str) -> None:
    ends = np.stack([motion.velocity[[0, -1]], motion.acceleration[[0, -1]]])
    if np.abs(ends).max() > MAX_RATE_AT_REST:
        raise InputError(f"{name} is not at rest at both ends: take a record of a problem with `rest: true`")


def _describe_worst_violation(constraints: Constraints, motion: Motion) -> str:
    """The most exceeded limit of joint motion, relative to its size."""
    told: dict[str, float] = {}
    for joint, limits, peak in zip(constraints.arm.joints, constraints.limits, peaks(motion)[0].T, strict=True):
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


DECIMALS = 9  # rad, rad/s, rad/s2; degrees have three less
ROBOT_AXES = 6
_RAPID_MODULE = """\
MODULE ArmlabExcitation
    ! {name}: {count} joint targets at {rate:g} Hz, degrees, from rest to rest. {others}
    ! jtPath is what a stream at this rate sends (EGM); main moves through it with timed MoveAbsJ, which a
    ! controller whose motion planner takes segments of {period:g} s follows in time.
    CONST num nPeriod := {period:g};
    CONST jointtarget jtPath{{{count}}} := [
{targets}
    ];

    PROC main()
        MoveAbsJ jtPath{{1}} \\NoEOffs, v100, fine, tool0;
        FOR i FROM 2 TO {before_last} DO
            MoveAbsJ jtPath{{i}} \\NoEOffs, v1000 \\T:=nPeriod, z0, tool0;
        ENDFOR
        MoveAbsJ jtPath{{{count}}} \\NoEOffs, v1000 \\T:=nPeriod, fine, tool0;
    ENDPROC
ENDMODULE
"""


def to_csv(trajectory: SampledTrajectory) -> str:
    """Columns t, q1 .., qd1 .., qdd1 .., in s and rad (m)."""
    numbers = range(1, trajectory.motion.joints + 1)
    header = ["t", *(f"{name}{number}" for name in ("q", "qd", "qdd") for number in numbers)]
    rows = np.column_stack([trajectory.times, *_motion_parts(trajectory)])
    return "\n".join([",".join(header), *(",".join(_format_numbers(row)) for row in rows)]) + "\n"


def to_ros2(trajectory: SampledTrajectory) -> str:
    """A message trajectory_msgs/msg/JointTrajectory as YAML: rad (m), s from the start of the motion."""
    names = ", ".join(map(json.dumps, trajectory.joint_names))  # in quotes: `1` and `on` would be no texts
    lines = ["header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}", f"joint_names: [{names}]", "points:"]
    for index, parts in enumerate(zip(*_motion_parts(trajectory), strict=True)):
        seconds, nanoseconds = divmod(round(index * 1e9 / trajectory.rate_hz), 10**9)
        keys = ("positions", "velocities", "accelerations")
        entries = [f"{key}: [{', '.join(_format_numbers(part))}]" for key, part in zip(keys, parts, strict=True)]
        entries += ["effort: []", f"time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}"]
        lines += [f"- {entries[0]}", *(f"  {entry}" for entry in entries[1:])]
    return "\n".join(lines) + "\n"


def to_rapid(trajectory: SampledTrajectory) -> str:
    """A RAPID module for a six-axis robot; axes that the arm lacks stay at zero. Raises InputError for another arm."""
    joints = trajectory.motion.joints
    if joints > ROBOT_AXES or "prismatic" in trajectory.kinds:
        sliding = trajectory.kinds.count("prismatic")
        raise InputError(
            f"a RAPID module moves at most {ROBOT_AXES} axes, all of them revolute: {trajectory.name} has {joints} "
            f"joints, {sliding} of them prismatic; take --format csv or ros2"
        )
    degrees = np.zeros((trajectory.motion.samples, ROBOT_AXES))
    degrees[:, :joints] = np.rad2deg(trajectory.motion.position)
    targets = (
        f"        [[{','.join(_format_numbers(row, DECIMALS - 3))}],[{','.join(['9E9'] * 6)}]]" for row in degrees
    )
    return _RAPID_MODULE.format(
        name=trajectory.name,
        count=len(degrees),
        before_last=len(degrees) - 1,
        rate=trajectory.rate_hz,
        period=1 / trajectory.rate_hz,
        others=f"Axes {joints + 1} to {ROBOT_AXES} stay at 0." if joints < ROBOT_AXES else "",
        targets=",\n".join(targets),
    )


TRAJECTORY_FORMATS: Mapping[str, Callable[[SampledTrajectory], str]] = MappingProxyType(
    {"csv": to_csv, "ros2": to_ros2, "rapid": to_rapid}
)


def _motion_parts(trajectory: SampledTrajectory) -> tuple[Array, Array, Array]:
    motion = trajectory.motion
    return motion.position, motion.velocity, motion.acceleration


def _format_numbers(row: Array, decimals: int = DECIMALS) -> list[str]:
    return [f"{value:.{decimals}f}" for value in np.round(row, decimals) + 0.0]  # + 0.0: no -0.0
