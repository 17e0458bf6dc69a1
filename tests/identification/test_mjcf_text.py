"""A model in the text of an MJCF: only the numbers that change are written, and MuJoCo reads what was meant."""

import difflib
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from armlab.common.arrays import Array
from armlab.diagnosis.motion import servo_plugin
from armlab.effects.friction import ViscousFriction
from armlab.effects.springs import LinearSpring
from armlab.identification.model import Model
from armlab.identification.model_file import read_model
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from problem.motion import Motion
from problem.pseudo_inertia import parameters_of, regular_nominal
from problem.robot_file import load_arm

mujoco = pytest.importorskip("mujoco")

PLAIN = """<?xml version="1.0"?>
<!-- the lab's arm -->
<mujoco model='two'>
  <compiler angle="degree"/>
  <default><joint damping="0.4"/><default class="strong"><joint armature='0.7' damping="3"/></default></default>
  <worldbody>
    <!-- measured in March -->
    <body name="upper" pos="0 0 0.3">
      <joint name="shoulder" axis="0 1 0"   range="-120 120"
             class="strong" /> <!-- a > b -->
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.05"/>
      <body pos="0.4 0 0" euler="10 20 30">
        <joint name="elbow" axis="0 0 1" pos="0.01 0 0" stiffness="2" springref="30"/>
        <inertial pos="0.1 0.02 0" mass="2" diaginertia="0.05 0.06 0.07" euler="0 0 10"/>
        <body name="tool" pos="0.3 0 0"><geom type="box" size="0.03 0.02 0.05"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="elbow" kp="30"/></actuator>
</mujoco>
<!-- end -->
"""


def model_of(robot: Path, change: float = 1.2, damping: tuple[float, ...] = (3.0, 1 / 3)) -> Path:
    """A model whose links are heavier by a factor, with viscous friction."""
    arm = load_arm(str(robot))
    parts = tuple(ViscousFriction.at(arm, joint) for joint in range(1, len(arm) + 1))
    structure = Structure(arm, parts)
    inertial = change * arm.parameters
    values = np.concatenate([structure.base.values(inertial), damping])
    return Model(str(robot), structure, values, inertial=inertial).save(robot.parent / "model.yaml")


def mujoco_torque(path: Path, motion: Motion) -> Array:
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data, out = mujoco.MjData(model), []
    for position, velocity, acceleration in zip(*vars(motion).values(), strict=True):
        data.qpos[:2], data.qvel[:2], data.qacc[:2] = position, velocity, acceleration
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse[:2].copy())
    return np.array(out)


def exported(folder: Path, text: str, change: float = 1.2) -> tuple[str, list[str]]:
    """What an export writes and tells; MuJoCo finds the torque of the model in it."""
    source, out = folder / "own" / "two.xml", folder / "new" / "two.xml"
    source.parent.mkdir(exist_ok=True)
    source.write_text(text)
    model = model_of(source, change)
    lines = list(export_model(model, out))
    motion = Motion(*np.random.default_rng(4).uniform(-2, 2, (3, 20, 2)))
    assert_allclose(mujoco_torque(out, motion), read_model(model).torque(motion), atol=1e-9)
    return out.read_text(), lines


def test_only_the_lines_with_new_numbers_change(tmp_path: Path) -> None:
    text, _ = exported(tmp_path, PLAIN)
    changed = [line for line in difflib.unified_diff(PLAIN.splitlines(), text.splitlines(), n=0) if line[:2] != "@@"]
    added = [line[1:].strip() for line in changed[2:] if line.startswith("+")]
    assert [line.split()[0] for line in added] == ["<inertial", 'class="strong"', "<joint", "<inertial"]
    assert [line[1:].strip().split()[0] for line in changed[2:] if line[0] == "-"] == [
        'class="strong"',
        "<joint",
        "<inertial",
    ]
    assert 'class="strong" armature="0.0" /> <!-- a > b -->' in text  # damping is that of the class already
    assert f'damping="{1 / 3!r}"' in text
    assert 'stiffness="0.0" springref="30"' in text
    assert "diaginertia" not in text


def test_a_model_that_changes_nothing_leaves_the_text_as_it_is(tmp_path: Path) -> None:
    plain = PLAIN.replace(' stiffness="2"', "").replace("armature='0.7' ", "")
    source = tmp_path / "two.xml"
    source.write_text(plain)
    list(export_model(model_of(source, 1.0, (3.0, 0.4)), tmp_path / "out.xml"))
    assert (tmp_path / "out.xml").read_text() == plain


@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass'")
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<compiler angle="degree"/>', '<compiler angle="degree" inertiafromgeom="true"/>'),
        ('<compiler angle="degree"/>', '<compiler angle="degree"/><compiler settotalmass="5"/>'),
        ('<default><joint damping="0.4"/>', '<default><joint damping="0.4" springdamper="0.1 1"/>'),
        ('<inertial pos="0.1 0.02 0"', '<frame pos="1 0 0"><inertial pos="0.1 0.02 0"'),
        ("<worldbody>", '<option gravity="0 1 -9"/><worldbody>'),
        ("</worldbody>", '<replicate count="3" offset="1 0 0"><body name="post"><geom size="1"/></body></replicate>'
         "</worldbody>"),
        ("</worldbody>", '<body name="table"/></worldbody><worldbody><body name="lamp"/></worldbody>'),
        ('damping="0.4"', 'damping="0.4" frictionloss="1"'),
    ],
    ids=["geoms", "total", "springdamper", "frame", "gravity", "replicate", "worlds", "loss"],
)  # fmt: skip
def test_options_of_the_file_count_as_mujoco_has_them(tmp_path: Path, old: str, new: str) -> None:
    plain = PLAIN.replace(old, new)
    if "<frame" in new:
        plain = plain.replace('euler="0 0 10"/>', 'euler="0 0 10"/></frame>')
    assert plain != PLAIN
    text, lines = exported(tmp_path, plain)
    assert "measured in March" in text
    assert not any("written by MuJoCo" in line for line in lines)


def test_a_spring_is_written_in_the_unit_of_the_file(tmp_path: Path) -> None:
    for unit, angle in (("degree", np.degrees(0.2)), ("radian", 0.2)):
        source = tmp_path / f"{unit}.xml"
        source.write_text(PLAIN.replace('angle="degree"', f'angle="{unit}"').replace("-120 120", "-2 2"))
        arm = load_arm(str(source))
        spring = LinearSpring.at(arm, 1)
        structure = Structure(arm, (spring,))
        inertial = parameters_of(regular_nominal(arm))
        values = np.concatenate([structure.base.values(inertial), [5.0, -1.0]])  # N m/rad, N m
        model = Model(str(source), structure, values, inertial=inertial).save(tmp_path / "model.yaml")
        list(export_model(model, tmp_path / f"{unit}-out.xml"))
        read = mujoco.MjModel.from_xml_path(str(tmp_path / f"{unit}-out.xml"))
        assert_allclose([read.jnt_stiffness[0], read.qpos_spring[0]], [5.0, 0.2])
        assert f'springref="{float(angle)!r}"' in (tmp_path / f"{unit}-out.xml").read_text()


def test_what_a_file_includes_becomes_a_part_of_it_and_meshes_are_found(tmp_path: Path) -> None:
    own = tmp_path / "own"
    (own / "parts" / "shapes").mkdir(parents=True)
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    (own / "parts" / "shapes" / "cube.obj").write_text(corners + "\nf 1 2 3\nf 5 6 7\nf 2 4 8\n")
    (own / "parts" / "tool.xml").write_text(
        '<mujocoinclude><!-- the tool --><body name="tool" pos="0.3 0 0">'
        '<geom type="mesh" mesh="cube" mass="1"/></body></mujocoinclude>'
    )
    tool = '<body name="tool" pos="0.3 0 0"><geom type="box" size="0.03 0.02 0.05"/></body>'
    plain = PLAIN.replace(tool, '<include file="parts/tool.xml"/>')
    plain = plain.replace("<worldbody>", '<asset><mesh file="cube.obj"/></asset><worldbody>')
    plain = plain.replace('angle="degree"', 'angle="degree" meshdir="parts/shapes"')
    text, lines = exported(tmp_path, plain)
    assert "<!-- the tool --><body" in text
    assert 'meshdir="../own/parts/shapes"' in text
    assert "the file holds what two.xml includes: parts/tool.xml" in lines


def test_a_body_that_the_text_does_not_have_is_written_by_mujoco_and_that_is_told(tmp_path: Path) -> None:
    plain = PLAIN.replace('<body name="upper"', '<replicate count="1" sep="-"><body name="upper"', 1)
    plain = plain.replace("    </body>\n  </worldbody>", "    </body></replicate>\n  </worldbody>")
    plain = plain.replace('<actuator><position name="servo" joint="elbow" kp="30"/></actuator>', "")
    source = tmp_path / "own" / "two.xml"
    source.parent.mkdir()
    source.write_text(plain)
    model, out = model_of(source), tmp_path / "out.xml"
    lines = list(export_model(model, out))
    assert any(
        line.startswith("written by MuJoCo, without comments") and "<replicate> in line 8 may make" in line
        for line in lines
    )
    motion = Motion(*np.random.default_rng(4).uniform(-2, 2, (3, 20, 2)))
    assert_allclose(mujoco_torque(out, motion), read_model(model).torque(motion), atol=1e-4)


CONTROLLER = {"type": "pd", "kp": [40.0, 1 / 3], "kd": [0.5, 0.0], "torque_limit": [None, 7.0], "delay": [0.0, 0.011]}


@pytest.mark.parametrize(
    "drive",
    [
        '<position name="servo" joint="elbow" kp="30"/>',
        '<position name="servo" joint="elbow" kp="30" dampratio="1" forcerange="-1 1"/>',
        '<general name="servo" joint="elbow" gainprm="30" biastype="affine" biasprm="0 -30 0"/>',
    ],
)
def test_the_drives_of_a_model_of_motion_go_into_the_actuators(tmp_path: Path, drive: str) -> None:
    source = tmp_path / "two.xml"
    source.write_text(PLAIN.replace('<position name="servo" joint="elbow" kp="30"/>', f"<!-- ours -->{drive}"))
    model = model_of(source)
    content = yaml.safe_load(model.read_text()) | {"controller": CONTROLLER | {"dead_band": [0.0, 0.02]}}
    model.write_text(yaml.safe_dump(content))
    lines = list(export_model(model, tmp_path / "out.xml"))
    assert lines[-1] == "not in the file: dead band of elbow"
    assert "<!-- ours --><" in (tmp_path / "out.xml").read_text()
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    assert [read.actuator(number).name for number in range(2)] == ["servo", "servo-shoulder"]
    assert_allclose(read.actuator_gainprm[:, 0], [1 / 3, 40.0], rtol=1e-15)
    assert_allclose(read.actuator_biasprm[:, :3], [[0, -1 / 3, 0], [0, -40, -0.5]], rtol=1e-15)
    assert read.actuator_forcelimited.tolist() == [True, False]
    assert_allclose(read.actuator_forcerange[0], [-7, 7])
    assert_allclose(read.actuator_delay, [0.011, 0.0])
    assert_allclose(read.dof_solimp, [servo_plugin.STICKING] * 2)  # a copy of the plug-in stands alone
    lines = list(export_model(model, tmp_path / "out.urdf"))
    assert lines[-1].endswith("the gains of the drives")


@pytest.mark.parametrize(
    "drive",
    [
        '<motor name="servo" joint="elbow" gear="7" ctrlrange="-1 1"/>',
        '<general name="servo" joint="elbow" gainprm="30"/>',
        '<velocity name="servo" joint="elbow" kv="3"></velocity>',
        '<position name="servo" joint="elbow" kp="30" gear="2"/>',
    ],
)
def test_an_actuator_of_another_kind_becomes_the_servo_that_the_model_has_there(tmp_path: Path, drive: str) -> None:
    source = tmp_path / "two.xml"
    source.write_text(PLAIN.replace('<position name="servo" joint="elbow" kp="30"/>', drive))
    model = model_of(source)
    model.write_text(yaml.safe_dump(yaml.safe_load(model.read_text()) | {"controller": CONTROLLER}))
    list(export_model(model, tmp_path / "out.xml"))
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    assert read.actuator(0).name == "servo"
    assert read.actuator_gear[0, 0] == 1
    assert not read.actuator_ctrllimited[0]
    assert_allclose(read.actuator_gainprm[0, 0], 1 / 3, rtol=1e-15)
    assert_allclose(read.actuator_biasprm[0, :3], [0, -1 / 3, 0], rtol=1e-15)


def test_a_drive_of_a_model_has_no_filter_of_its_command(tmp_path: Path) -> None:
    source = tmp_path / "two.xml"
    source.write_text(PLAIN.replace('joint="elbow" kp="30"', 'joint="elbow" kp="30" timeconst="0.1"'))
    model = model_of(source)
    model.write_text(yaml.safe_dump(yaml.safe_load(model.read_text()) | {"controller": CONTROLLER}))
    list(export_model(model, tmp_path / "out.xml"))
    assert not mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml")).actuator_dyntype.any()
