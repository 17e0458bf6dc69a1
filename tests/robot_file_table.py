"""Small robot files as makers write them, each beside an independent engine: `python tests/robot_file_table.py`.

An MJCF is compared with MuJoCo's inverse dynamics, a URDF with Pinocchio's and the damping and friction that Pinocchio
reads of `<dynamics>`. Where a file holds more than one arm, a tip says which one is read.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.markdown import markdown_table
from problem.coupled_joints import chain_motion, torque_at_leaders
from problem.drive_torque import drive_torque
from problem.locked_joints import lock_joints
from problem.motion import Motion
from problem.robot_file import load_arm
from problem.simulator_check import check_with_mujoco, random_states

FILES = Path(__file__).parent / "problem" / "robot_files"
TIPS = {
    "gripper_equality.xml": "hand",
    "two_arms.xml": "left_hand",
    "free_base.xml": "shank",
    "gripper_with_loop.xml": "gripper",
    "scene_without_names.xml": "fore",
    "fingers_that_mimic.urdf": "hand",
    "two_legs.urdf": "L_foot",
    "floating_base.urdf": "a",
}
LOCKS = {"free_base.xml": "root", "floating_base.urdf": "float"}  # joints that are locked at zero


@dataclass(frozen=True)
class Row:
    """A file with its number of joints and the largest difference over the largest torque, or why it is refused."""

    file: str
    joints: int | None
    engine: str
    difference: float | None
    refused: str = ""


def robot_files() -> list[Path]:
    """All sample files, MJCF first; parts that others include are left out."""
    return [*sorted(FILES.glob("*.xml")), *sorted(FILES.glob("*.urdf"))]


def compare(path: Path, folder: Path) -> Row:
    """A file beside its engine. folder: for a file with locked joints."""
    engine = "MuJoCo" if path.suffix == ".xml" else "Pinocchio"
    try:
        read = _one_arm(path, folder)
        arm = load_arm(str(read))
        if engine == "MuJoCo":
            return Row(path.name, len(arm), engine, check_with_mujoco(read, with_actuators=False).difference)
        motion = random_states(arm, np.random.default_rng(0))
        names = [joint.name for joint in arm.chain.joints]
        expected = torque_at_leaders(arm, pinocchio_torque(read, chain_motion(arm, motion), names))
        difference = np.abs(drive_torque(arm, motion) - expected).max() / np.abs(expected).max()
        return Row(path.name, len(arm), engine, float(difference))
    except InputError as error:
        return Row(path.name, None, engine, None, str(error).replace(f"{path.parent}/", ""))


def _one_arm(path: Path, folder: Path) -> Path:
    if path.name not in TIPS:
        return path
    locked, locks = folder / path.name, {LOCKS[path.name]: 0.0} if path.name in LOCKS else {}
    locked.write_text(lock_joints(path, TIPS[path.name], locks, folder).document)
    return locked


def pinocchio_torque(path: Path, motion: Motion, joints: list[str]) -> Array:
    """Torque of a URDF by Pinocchio, (samples, joints), with the damping and friction that it reads."""
    pin: Any = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    model = pin.buildModelFromUrdf(str(path))
    data, out = model.createData(), np.empty(motion.position.shape)
    numbers = [model.getJointId(name) for name in joints]
    places = [model.joints[number].idx_v for number in numbers]
    for row, (position, velocity, acceleration) in enumerate(
        zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    ):
        q, qd, qdd = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for number, angle in zip(numbers, position, strict=True):
            start, count = model.joints[number].idx_q, model.joints[number].nq
            q[start : start + count] = [angle] if count == 1 else [np.cos(angle), np.sin(angle)]
        qd[places], qdd[places] = velocity, acceleration
        torque = pin.rnea(model, data, q, qd, qdd) + model.damping * qd + model.upperDryFrictionLimit * np.sign(qd)
        out[row] = torque[places]
    return out


def _format(difference: float | None) -> str:
    return "–" if difference is None else f"{difference:.1e}"


def main() -> None:
    """Prints the table."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [compare(path, Path(folder)) for path in robot_files()]
    refused = sum(row.joints is None for row in rows)
    print("# Robot files as makers write them, beside their simulators\n")
    print(f"{len(rows)} files, {refused} refused. Difference: the largest of all torques over the largest torque.\n")
    cells = [[row.file, str(row.joints or "–"), row.engine, _format(row.difference), row.refused] for row in rows]
    print(markdown_table(["file", "joints", "engine", "largest difference", "refused"], cells))


if __name__ == "__main__":
    main()
