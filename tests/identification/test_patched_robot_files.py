"""A model in the user's own robot file: MuJoCo and Pinocchio find the model's torque, and everything else stays."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.components import usual_components
from armlab.identification.model import Model
from armlab.identification.model_file import read_model
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from problem.motion import Motion
from problem.pseudo_inertia import parameters_of, regular_nominal
from problem.robot_file import load_arm

URDF = """<robot name="two">
  <!-- measured in March -->
  <link name="base_link"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
    </inertial></link>
  <link name="upper">
    <visual><geometry><mesh filename="meshes/upper.stl"/></geometry></visual>
    <inertial><origin xyz="0.1 0 0.2"/><mass value="4"/>
      <inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="lower">
    <inertial><origin xyz="0.1 0.02 0"/><mass value="2"/>
      <inertia ixx="0.05" iyy="0.06" izz="0.07" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="gripper">
    <inertial><origin xyz="0 0 0.05"/><mass value="0.5"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="tool0"/>
  <joint name="shoulder" type="revolute"><parent link="base_link"/>
    <child link="upper"/><origin xyz="0 0 0.3" rpy="0.2 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="50" velocity="3"/><dynamics damping="9"/></joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="gripper"/>
    <origin xyz="0.3 0 0" rpy="0 0.4 0"/></joint>
  <joint name="flange" type="fixed"><parent link="gripper"/><child link="tool0"/></joint>
</robot>
"""
MJCF = """<mujoco model="two">
  <compiler angle="degree"/>
  <worldbody>
    <body name="upper" pos="0 0 0.3">
      <joint name="shoulder" axis="0 1 0" range="-120 120" damping="3"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>
      <body name="lower" pos="0.4 0 0" euler="10 20 30">
        <joint name="elbow" axis="0 0 1" pos="0.01 0 0"/>
        <inertial pos="0.1 0.02 0" mass="2" diaginertia="0.05 0.06 0.07"/>
        <body name="gripper" pos="0.3 0 0"><geom name="finger" type="box" size="0.03 0.02 0.05"/><site name="tip"/>
          </body>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="elbow" kp="30"/></actuator>
</mujoco>
"""


def model_of(source: Path, change: float = 1.2) -> Path:
    """A model of a robot file, with links and rotors of its own, beside the file."""
    arm = load_arm(str(source))
    parts = tuple(each for each in usual_components(arm) if each.effect in ("viscous_friction", "rotor_inertia"))
    structure = Structure(arm, parts)
    inertial = change * parameters_of(regular_nominal(arm))
    values = np.concatenate([structure.base.values(inertial), [0.3, 0.4, 0.1, 0.2]])
    return Model(str(source), structure, values, inertial=inertial).save(source.parent / "model.yaml")


def states() -> Motion:
    return Motion(*np.random.default_rng(4).uniform(-2, 2, (3, 20, 2)))


def mujoco_torque(path: Path, motion: Motion) -> Array:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data, out = mujoco.MjData(model), []
    for position, velocity, acceleration in zip(motion.position, motion.velocity, motion.acceleration, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse.copy())
    return np.array(out)


def predicted(path: Path, motion: Motion) -> Array:
    return read_model(path).torque(motion)


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    path = tmp_path / "own" / "two.urdf"
    path.parent.mkdir()
    path.write_text(URDF)
    return path


@pytest.fixture
def mjcf(tmp_path: Path) -> Path:
    pytest.importorskip("mujoco")
    path = tmp_path / "own" / "two.xml"
    path.parent.mkdir()
    path.write_text(MJCF)
    return path


def test_pinocchio_finds_the_models_torque_in_the_users_urdf(urdf: Path, tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    model, out = model_of(urdf), tmp_path / "new" / "two.urdf"
    list(export_model(model, out))
    read, motion = pin.buildModelFromUrdf(str(out)), states()
    pin.loadRotorParameters(read, str(out.with_suffix(".srdf")), False)
    data, found = read.createData(), []
    for position, velocity, acceleration in zip(motion.position, motion.velocity, motion.acceleration, strict=True):
        found.append(pin.rnea(read, data, position, velocity, acceleration) + np.asarray(read.damping) * velocity)
    assert_allclose(np.array(found), predicted(model, motion), atol=1e-9)


def test_names_frames_meshes_limits_and_remarks_of_a_urdf_stay(urdf: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "two.urdf"
    lines = list(export_model(model_of(urdf), out))
    text = out.read_text()
    assert "measured in March" in text
    root = ElementTree.fromstring(text)
    assert [each.get("name") for each in root.findall("link")] == ["base_link", "upper", "lower", "gripper", "tool0"]
    assert root.find("link/visual/geometry/mesh").get("filename") == "../own/meshes/upper.stl"
    assert root.find("joint/limit").attrib == {"lower": "-2", "upper": "2", "effort": "50", "velocity": "3"}
    gripper = root.find("link[@name='gripper']/inertial/mass")
    assert gripper is not None
    assert gripper.get("value") == "0.5"
    assert "two.urdf with other numbers" in lines[2]
    assert load_arm(str(out)).links is not None


def test_a_body_that_would_weigh_nothing_takes_what_the_others_had(urdf: Path, tmp_path: Path) -> None:
    model, out = model_of(urdf, 0.15), tmp_path / "new" / "two.urdf"
    lines = list(export_model(model, out))
    assert any(each.startswith("lower has the whole inertia") and each.endswith("gripper, tool0") for each in lines)
    root = ElementTree.fromstring(out.read_text())
    assert root.find("link[@name='gripper']/inertial") is None
    known, arm = load_arm(str(urdf)), load_arm(str(out))
    assert known.links is not None
    assert arm.links is not None
    assert_allclose([each.mass for each in arm.links], [0.15 * each.mass for each in known.links])


@pytest.mark.parametrize("change", [1.2, 0.15])
def test_mujoco_finds_the_models_torque_in_the_users_mjcf_with_its_actuators(
    mjcf: Path, tmp_path: Path, change: float
) -> None:
    mujoco = pytest.importorskip("mujoco")
    model, out, motion = model_of(mjcf, change), tmp_path / "new" / "two.xml", states()
    list(export_model(model, out))
    assert_allclose(mujoco_torque(out, motion), predicted(model, motion), atol=1e-9)
    read = mujoco.MjModel.from_xml_path(str(out))
    assert [read.body(number).name for number in range(1, read.nbody)] == ["upper", "lower", "gripper"]
    assert (read.actuator(0).name, read.geom(0).name, read.site(0).name) == ("servo", "arm", "tip")
    assert_allclose(read.jnt_range[0], np.radians([-120, 120]), atol=1e-5)


CUBE = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)) + "\nf 1 2 3\nf 5 6 7\nf 2 4 8\n"


@pytest.mark.parametrize("change", [1.2, 0.15])
def test_a_urdf_becomes_an_mjcf_with_its_names_frames_and_the_meshes_at_hand(
    urdf: Path, tmp_path: Path, change: float
) -> None:
    mujoco = pytest.importorskip("mujoco")
    mesh = '<collision><geometry><mesh filename="package://own/cube.obj"/></geometry></collision>'
    urdf.write_text(URDF.replace('<link name="tool0"/>', f'<link name="tool0">{mesh}</link>'))
    (urdf.parent / "cube.obj").write_text(CUBE)
    model, out, motion = model_of(urdf, change), tmp_path / "new" / "two.xml", states()
    lines = list(export_model(model, out))
    assert lines[1] == "two.urdf with other numbers: its names, frames and meshes stay"
    assert "left out, since they are not at hand as STL or OBJ: meshes/upper.stl" in lines
    assert_allclose(mujoco_torque(out, motion), predicted(model, motion), atol=1e-9)
    read = mujoco.MjModel.from_xml_path(str(out))
    assert [read.body(number).name for number in range(1, read.nbody)] == [
        "base_link",
        "upper",
        "lower",
        "gripper",
        "tool0",
    ]
    assert [read.joint(number).name for number in range(2)] == ["shoulder", "elbow"]
    assert read.nmesh == 1
    assert_allclose(read.jnt_range, [[-2, 2], [-2, 2]])


def test_a_urdf_that_mujoco_refuses_becomes_a_chain_and_the_reason_is_told(urdf: Path, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    shape = '<collision><geometry><sphere radius="-1"/></geometry></collision>'
    urdf.write_text(URDF.replace('<link name="tool0"/>', f'<link name="tool0">{shape}</link>'))
    lines = list(export_model(model_of(urdf), tmp_path / "two.xml"))
    assert lines[1].startswith("a chain of bodies without meshes: MuJoCo cannot read two.urdf: ")


def test_an_mjcf_becomes_a_chain_as_urdf_and_what_keeps_the_meshes_is_told(mjcf: Path, tmp_path: Path) -> None:
    lines = list(export_model(model_of(mjcf), tmp_path / "two.urdf"))
    assert "a chain of bodies without meshes: only an .xml file keeps what two.xml has" in lines


def test_an_input_file_is_never_written_over(urdf: Path) -> None:
    model, before = model_of(urdf), urdf.read_text()
    with pytest.raises(InputError, match="is there already: choose another name"):
        list(export_model(model, urdf))
    assert urdf.read_text() == before


def test_a_damping_that_is_no_number_is_refused(urdf: Path, tmp_path: Path) -> None:
    model = model_of(urdf)
    urdf.write_text(urdf.read_text().replace("<axis", '<dynamics damping="much"/><axis', 1))
    with pytest.raises(InputError, match="dynamics damping='much' should hold 1 finite number"):
        list(export_model(model, tmp_path / "out.urdf"))
