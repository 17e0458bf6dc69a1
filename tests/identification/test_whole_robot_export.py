"""A diagnosis of a robot with locked joints goes into the file of the whole robot, whose gripper still moves."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from gripper_robots import GRIPPER_MJCF, GRIPPER_URDF
from numpy.testing import assert_allclose
from refusals import refusal

from armlab.cli.main import main
from armlab.common.arrays import Array
from armlab.identification.components import usual_components
from armlab.identification.model import Model
from armlab.identification.model_file import read_model
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from armlab.recordings.imports.robots import read_robot
from problem.locked_joints import lock_joints, read_lock_record
from problem.motion import Motion
from problem.pseudo_inertia import parameters_of, regular_nominal
from problem.robot_file import load_arm


def locked_robot(folder: Path, suffix: str, locks: tuple[str, ...] = ("finger1=0.03",)) -> Path:
    """The locked copy of a robot with a gripper in a folder, beside the whole robot, as an import leaves it."""
    source = folder / "own" / f"toy{suffix}"
    source.parent.mkdir()
    source.write_text(GRIPPER_URDF if suffix == ".urdf" else GRIPPER_MJCF)
    recording = folder / "recording"
    recording.mkdir()
    robot = read_robot({"robot": str(source), "tip": "hand", "lock": locks})
    assert robot is not None
    for name, text in robot.copies(recording).items():
        (recording / name).write_text(str(text))
    return recording / source.name


def model_of(robot: Path, change: float = 1.2) -> Path:
    """A model whose links are heavier by a factor, with friction and rotors."""
    arm = load_arm(str(robot))
    parts = tuple(each for each in usual_components(arm) if each.effect in ("viscous_friction", "rotor_inertia"))
    structure = Structure(arm, parts)
    inertial = change * parameters_of(regular_nominal(arm))
    own = np.linspace(0.1, 0.5, len(parts))
    values = np.concatenate([structure.base.values(inertial), own])
    return Model(str(robot), structure, values, inertial=inertial).save(robot.parent.parent / "model.yaml")


def states(joints: int) -> Motion:
    return Motion(*np.random.default_rng(4).uniform(-1, 1, (3, 20, joints)))


def mujoco_torque(path: Path, motion: Motion, names: list[str], still: Mapping[str, float]) -> Array:
    """Torque of named joints, the others at rest at a position."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data, out = mujoco.MjData(model), []
    places = [int(model.joint(name).id) for name in names]
    for name, position in still.items():
        data.qpos[model.joint(name).id] = position
    for position, velocity, acceleration in zip(*vars(motion).values(), strict=True):
        data.qpos[places], data.qvel[places], data.qacc[places] = position, velocity, acceleration
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse[places].copy())
    return np.array(out)


def pinocchio_torque(path: Path, motion: Motion, names: list[str], still: Mapping[str, float]) -> Array:
    """The same, with damping and the rotors that stand beside a URDF."""
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(path))
    pin.loadRotorParameters(model, str(path.with_suffix(".srdf")), False)
    data, out = model.createData(), []
    places = [model.joints[model.getJointId(name)].idx_q for name in names]
    q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    for name, position in still.items():
        q[model.joints[model.getJointId(name)].idx_q] = position
    for position, velocity, acceleration in zip(*vars(motion).values(), strict=True):
        q[places], v[places], a[places] = position, velocity, acceleration
        out.append((pin.rnea(model, data, q, v, a) + np.asarray(model.damping) * v)[places])
    return np.array(out)


@pytest.mark.parametrize(
    ("locks", "change"), [(("finger1=0.03",), 1.2), (("finger1=0.02", "joint2=0.7"), 1.2), (("finger1=0.03",), 0.7)]
)
def test_pinocchio_finds_the_torque_of_the_locked_urdf_in_the_whole_one_with_a_still_gripper(
    tmp_path: Path, locks: tuple[str, ...], change: float
) -> None:
    pytest.importorskip("pinocchio")
    robot = locked_robot(tmp_path, ".urdf", locks)
    model, names = model_of(robot, change), [joint.name for joint in load_arm(str(robot)).joints]
    lines = list(export_model(model, tmp_path / "whole.urdf"))
    list(export_model(model, tmp_path / "fixed.urdf", into=robot))
    record = read_lock_record(robot)
    assert record is not None
    assert any(line.startswith("locked in the recording, free to move in this file: ") for line in lines)
    assert any(line.endswith("finger2") for line in lines)
    motion = states(len(names))
    whole = pinocchio_torque(tmp_path / "whole.urdf", motion, names, record.positions)
    assert_allclose(whole, pinocchio_torque(tmp_path / "fixed.urdf", motion, names, {}), atol=1e-9)
    assert_allclose(whole, read_model(model).torque(motion), atol=1e-9)


@pytest.mark.parametrize("change", [1.2, 0.6])
def test_mujoco_finds_the_torque_of_the_locked_mjcf_in_the_whole_one_with_a_still_gripper(
    tmp_path: Path, change: float
) -> None:
    pytest.importorskip("mujoco")
    robot = locked_robot(tmp_path, ".xml", ("finger1=0.3",))
    model, names = model_of(robot, change), ["joint1", "joint2"]
    list(export_model(model, tmp_path / "whole.xml"))
    list(export_model(model, tmp_path / "fixed.xml", into=robot))
    record, motion = read_lock_record(robot), states(2)
    assert record is not None
    whole = mujoco_torque(tmp_path / "whole.xml", motion, names, record.positions)
    assert_allclose(whole, mujoco_torque(tmp_path / "fixed.xml", motion, names, {}), atol=1e-4)  # six digits there
    assert_allclose(whole, read_model(model).torque(motion), atol=1e-4)
    text = (tmp_path / "whole.xml").read_text()
    assert all(
        word in text for word in ('<fixed name="split">', '<frame pos="0 .1 1" euler=".2 .3 .4">', 'name="home"')
    )


def test_a_whole_urdf_becomes_an_mjcf_whose_gripper_moves(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    robot = locked_robot(tmp_path, ".urdf")
    model, motion = model_of(robot), states(3)
    list(export_model(model, tmp_path / "whole.xml"))
    record = read_lock_record(robot)
    assert record is not None
    found = mujoco_torque(tmp_path / "whole.xml", motion, ["joint1", "joint2", "joint3"], record.positions)
    assert_allclose(found, read_model(model).torque(motion), atol=1e-9)


def test_the_last_moving_link_takes_the_change_and_the_gripper_keeps_its_own(tmp_path: Path) -> None:
    robot = locked_robot(tmp_path, ".urdf")
    list(export_model(model_of(robot), tmp_path / "whole.urdf"))
    root = ElementTree.parse(tmp_path / "whole.urdf").getroot()
    masses = {link.get("name"): link.find("inertial/mass").get("value") for link in root.findall("link")}
    assert {name: masses[name] for name in ("link0", "hand", "left", "right")} == {
        "link0": "2.0",
        "hand": "0.7",
        "left": "0.2",
        "right": "0.2",
    }
    assert float(masses["link3"]) == pytest.approx(1.2 * (2.0 + 0.7 + 0.4) - 1.1)
    assert root.find("joint[@name='finger1']").get("type") == "prismatic"
    assert root.find("joint[@name='finger2']/mimic") is not None


def test_fixed_links_lose_their_inertia_before_moving_ones_and_less_than_those_have_is_refused(tmp_path: Path) -> None:
    robot = locked_robot(tmp_path, ".urdf")
    lines = list(export_model(model_of(robot, 0.7), tmp_path / "whole.urdf"))
    assert any(line.endswith("none is left to hand") for line in lines)
    told = refusal(lambda: list(export_model(model_of(robot, 0.05), tmp_path / "other.urdf")))
    assert "left and right on joints that were locked have more inertia than the model has from link3 on" in told
    assert not (tmp_path / "other.urdf").exists()


def test_the_whole_robot_of_a_locked_file_that_lock_joints_wrote_is_found(tmp_path: Path) -> None:
    source, locked, again = tmp_path / "a--b.urdf", tmp_path / "new" / "arm.urdf", tmp_path / "new" / "less.urdf"
    source.write_text(GRIPPER_URDF)
    locked.parent.mkdir()
    run = CliRunner().invoke(
        main, ["model", "lock-joints", str(source), str(locked), "--tip", "hand", "--lock", "finger1=0.03"]
    )
    assert run.exit_code == 0, run.output
    run = CliRunner().invoke(main, ["model", "lock-joints", str(locked), str(again), "--lock", "joint1=-0.5"])
    assert run.exit_code == 0, run.output
    record = read_lock_record(again)
    assert record is not None
    assert record.original.resolve() == source
    assert record.positions == pytest.approx({"finger1": 0.03, "finger2": 0.6, "joint1": -0.5})
    assert again.read_text().count("armlab: locked joints") == 1
    model = model_of(again)
    command = ["model", "export", str(model), str(tmp_path / "whole.urdf")]
    source.rename(tmp_path / "elsewhere.urdf")
    run = CliRunner().invoke(main, command)
    assert run.exit_code == 2
    assert "a--b.urdf, is not there: give it with --into" in run.output
    run = CliRunner().invoke(main, [*command, "--into", str(tmp_path / "elsewhere.urdf")])
    assert run.exit_code == 0, run.output


def test_a_file_that_says_nothing_of_its_locked_joints_needs_their_positions(tmp_path: Path) -> None:
    robot = locked_robot(tmp_path, ".urdf")
    whole = robot.with_name("whole-toy.urdf")
    robot.write_text(lock_joints(whole, "hand", {"finger1": 0.03}, robot.parent).document)
    model, out = model_of(robot), tmp_path / "out.urdf"
    told = refusal(lambda: list(export_model(model, out, into=whole)))
    assert "has joints that the model does not have, finger1, finger2: say with --lock JOINT=VALUE" in told
    list(export_model(model, out, whole, {"finger1": 0.03}))
    assert ElementTree.parse(out).getroot().find("joint[@name='finger1']").get("type") == "prismatic"


def test_a_file_of_another_robot_is_refused(tmp_path: Path) -> None:
    robot = locked_robot(tmp_path, ".urdf")
    other = tmp_path / "other.urdf"
    other.write_text(robot.read_text().replace('xyz="0.1 0 0.2"', 'xyz="0.1 0 0.3"'))
    told = refusal(lambda: list(export_model(model_of(robot), tmp_path / "out.urdf", into=other)))
    assert "stands or moves otherwise than in the robot of the model" in told


def test_a_damaged_record_is_refused(tmp_path: Path) -> None:
    robot = locked_robot(tmp_path, ".urdf")
    for wrong in ('{"original": 3}', '{"positions": {"finger1": NaN}, "original": "x.urdf"}', "{x}"):
        robot.write_text(f"<robot><!-- armlab: locked joints {wrong} --></robot>")
        assert "the comment 'armlab: locked joints'" in refusal(read_lock_record, robot)


def test_positions_of_joints_that_no_file_of_the_export_locks_are_refused(tmp_path: Path) -> None:
    model, out = model_of(locked_robot(tmp_path, ".urdf")), tmp_path / "out.urdf"
    told = refusal(lambda: list(export_model(model, out, None, {"joint1": 0.0})))
    assert "--lock names joint1, which the model moves" in told
    arm = load_arm("irb120-arm")
    structure = Structure(arm, ())
    values = structure.base.values(arm.parameters)
    own = Model("irb120-arm", structure, values, inertial=arm.parameters).save(tmp_path / "own.yaml")
    told = refusal(lambda: list(export_model(own, out, None, {"finger1": 0.0})))
    assert told == "--lock needs a robot file that has finger1: give it with --into"
