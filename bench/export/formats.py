"""The three forms: CSV, a ROS 2 JointTrajectory message in YAML, and an ABB RAPID module."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from bench.export.sampled import Sampled
from problem.errors import InputError
from problem.transforms import Array

DECIMALS = 9  # rad, rad/s, rad/s2; degrees have three less
ROBOT_AXES = 6
_RAPID = """\
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


def as_csv(trajectory: Sampled) -> str:
    """Columns t, q1 .., qd1 .., qdd1 .., in s and rad (m)."""
    numbers = range(1, trajectory.motion.joints + 1)
    header = ["t", *(f"{name}{number}" for name in ("q", "qd", "qdd") for number in numbers)]
    rows = np.column_stack([trajectory.times, *_parts(trajectory)])
    return "\n".join([",".join(header), *(",".join(_numbers(row)) for row in rows)]) + "\n"


def as_ros2(trajectory: Sampled) -> str:
    """A message trajectory_msgs/msg/JointTrajectory as YAML: rad (m), from the start of the motion."""
    names = ", ".join(trajectory.joint_names)
    lines = ["header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}", f"joint_names: [{names}]", "points:"]
    for index, parts in enumerate(zip(*_parts(trajectory), strict=True)):
        seconds, nanoseconds = divmod(round(index * 1e9 / trajectory.rate_hz), 10**9)
        keys = ("positions", "velocities", "accelerations")
        entries = [f"{key}: [{', '.join(_numbers(part))}]" for key, part in zip(keys, parts, strict=True)]
        entries += ["effort: []", f"time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}"]
        lines += [f"- {entries[0]}", *(f"  {entry}" for entry in entries[1:])]
    return "\n".join(lines) + "\n"


def as_rapid(trajectory: Sampled) -> str:
    """A RAPID module for a six-axis robot, axes behind the arm's at zero; raises InputError for another arm."""
    joints = trajectory.motion.joints
    if joints > ROBOT_AXES or "prismatic" in trajectory.kinds:
        raise InputError(f"RAPID has six turning robot axes; {trajectory.name} moves {', '.join(trajectory.kinds)}")
    degrees = np.zeros((trajectory.motion.samples, ROBOT_AXES))
    degrees[:, :joints] = np.rad2deg(trajectory.motion.position)
    targets = (f"        [[{','.join(_numbers(row, DECIMALS - 3))}],[{','.join(['9E9'] * 6)}]]" for row in degrees)
    return _RAPID.format(
        name=trajectory.name,
        count=len(degrees),
        before_last=len(degrees) - 1,
        rate=trajectory.rate_hz,
        period=1 / trajectory.rate_hz,
        others=f"Axes {joints + 1} to {ROBOT_AXES} stay at 0." if joints < ROBOT_AXES else "",
        targets=",\n".join(targets),
    )


FORMATS: Mapping[str, Callable[[Sampled], str]] = MappingProxyType({"csv": as_csv, "ros2": as_ros2, "rapid": as_rapid})


def _parts(trajectory: Sampled) -> tuple[Array, Array, Array]:
    motion = trajectory.motion
    return motion.position, motion.velocity, motion.acceleration


def _numbers(row: Array, decimals: int = DECIMALS) -> list[str]:
    return [f"{value:.{decimals}f}" for value in np.round(row, decimals) + 0.0]  # + 0.0: no -0.0
