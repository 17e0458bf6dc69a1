"""From positions, speeds and accelerations to the condition number: armlab beside Pinocchio with numpy."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import Array
from bench.speed.clock import median_seconds
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.fitness import condition_number, singular_values
from problem.motion import Motion
from problem.robot_file import load_arm

POPULATION = 50
SAMPLES = 100
ROUNDS = 15
PINOCCHIO_ORDER = (0, 1, 2, 3, 4, 6, 9, 5, 7, 8)  # m, mc, Ixx Ixy Iyy Ixz Iyz Izz: where each of eq. 31 stands


def against_pinocchio(arm_name: str = "irb120-arm") -> dict[str, float]:
    """Microseconds a trajectory of both pipelines, their ratio, and how far their results are apart.

    Both take the same population of random motions on one core. Pinocchio's pipeline: its regressor for each
    sample, the base columns of the stack, `numpy.linalg.cond`.
    """
    arm = in_joint_frames(load_arm(arm_name))
    motion = random_motions(arm, POPULATION, SAMPLES)
    columns = base_parameters(arm).columns
    ours, theirs = _armlab(arm, motion, columns), _pinocchio(arm, motion, columns)
    single = _armlab(arm, motion.select(np.arange(POPULATION) == 0), columns)
    seconds = median_seconds({"armlab": ours, "single": single, "pinocchio": theirs}, ROUNDS)
    armlab, pinocchio = (1e6 * seconds[name] / POPULATION for name in ("armlab", "pinocchio"))
    return {
        "armlab_us": armlab,
        "armlab_one_at_a_time_us": 1e6 * seconds["single"],
        "pinocchio_us": pinocchio,
        "ratio_to_pinocchio": pinocchio / armlab,
        "ratio_to_pinocchio_one_at_a_time": pinocchio / (1e6 * seconds["single"]),
        "largest_relative_difference": float(np.max(np.abs(ours() / theirs() - 1.0))),
    }


def in_joint_frames(arm: Arm) -> Arm:
    """The same joints, with each link's frame where Pinocchio has it: at its joint."""
    tails = [np.eye(4), *(joint.after for joint in arm.joints)]
    joints = (
        replace(joint, before=tail @ joint.before, after=np.eye(4))
        for tail, joint in zip(tails, arm.joints, strict=False)
    )
    return Arm(arm.name, tuple(joints), gravity=arm.gravity)


def random_motions(arm: Arm, trajectories: int, samples: int) -> Motion:
    """Motions (trajectories, samples, joints) of independent random states."""
    rng = np.random.default_rng(0)
    return Motion(*(rng.uniform(-2, 2, (trajectories, samples, len(arm))) for _ in range(3)))


def _armlab(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Callable[[], Array]:
    return lambda: condition_number(singular_values(arm, motion, columns, unit_columns=False))


def _pinocchio(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Callable[[], Array]:
    import pinocchio

    model = _model(arm)
    data = model.createData()
    chosen = [10 * (column // 10) + PINOCCHIO_ORDER[column % 10] for column in columns]

    def condition(q: Array, v: Array, a: Array) -> float:
        regressor = pinocchio.computeJointTorqueRegressor
        rows = [regressor(model, data, *state).copy() for state in zip(q, v, a, strict=True)]
        return float(np.linalg.cond(np.vstack(rows)[:, chosen]))

    trajectories = list(zip(motion.position, motion.velocity, motion.acceleration, strict=True))
    return lambda: np.array([condition(*trajectory) for trajectory in trajectories])


def _model(arm: Arm) -> Any:
    """The arm as a Pinocchio model; a regressor needs no inertias."""
    import pinocchio

    model = pinocchio.Model()
    model.gravity.linear = np.array(arm.gravity)
    parent = 0
    for joint in arm.joints:
        kind = pinocchio.JointModelRZ() if joint.kind == "revolute" else pinocchio.JointModelPZ()
        placement = pinocchio.SE3(joint.before[:3, :3], joint.before[:3, 3])
        parent = model.addJoint(parent, kind, placement, joint.name)
    return model
