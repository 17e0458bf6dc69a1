"""Exported files, read by MuJoCo and Pinocchio, which share no code with this project."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.components import usual_components
from armlab.identification.export import (
    build_simulator_model,
    mjcf_document,
    srdf_document,
    unstated_limits,
    urdf_document,
)
from armlab.identification.model import Model
from armlab.identification.model_file import read_model
from armlab.identification.structure import Structure
from armlab.identification.write_simulator import export_model
from problem.arm import Limits
from problem.motion import Motion
from problem.pseudo_inertia import parameters_of, regular_nominal
from problem.robot_file import load_arm

ARMS = ("irb120-arm", "irb120", "staubli-tx40")
SMOOTH = ("viscous_friction", "rotor_inertia")


def model_of(name: str, effects: tuple[str, ...] = SMOOTH) -> Model:
    arm = load_arm(name)
    chosen = tuple(part for part in usual_components(arm) if part.effect in effects)
    structure = Structure(arm, chosen)
    own = np.random.default_rng(3).uniform(0.1, 1.0, len(chosen))
    inertial = parameters_of(regular_nominal(arm))
    values = np.concatenate([structure.base.values(inertial), own])
    return Model(name, structure, values, inertial=inertial)


def states(joints: int) -> Motion:
    return Motion(*np.random.default_rng(4).uniform(-2, 2, (3, 20, joints)))


def mujoco_torque(document: str, motion: Motion) -> Array:
    mujoco = pytest.importorskip("mujoco")
    simulated = mujoco.MjModel.from_xml_string(document)
    simulated.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, out = mujoco.MjData(simulated), []
    for position, velocity, acceleration in zip(motion.position, motion.velocity, motion.acceleration, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
        mujoco.mj_inverse(simulated, data)
        out.append(data.qfrc_inverse.copy())
    return np.array(out)


@pytest.mark.parametrize("name", ARMS)
def test_mujoco_reproduces_rigid_armature_and_viscous_torque_of_the_mjcf(name: str) -> None:
    model = model_of(name)
    motion = states(len(model.arm))
    assert_allclose(mujoco_torque(mjcf_document(build_simulator_model(model)), motion), model.torque(motion), atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_mujoco_reproduces_rigid_and_viscous_torque_of_the_urdf(name: str) -> None:
    model = model_of(name, ("viscous_friction",))
    motion = states(len(model.arm))
    assert_allclose(mujoco_torque(urdf_document(build_simulator_model(model)), motion), model.torque(motion), atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("form", ["mjcf", "urdf"])
def test_pinocchio_reproduces_the_exported_torque(name: str, form: str, tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    model = model_of(name)
    motion = states(len(model.arm))
    path = tmp_path / ("arm.xml" if form == "mjcf" else "arm.srdf")
    path.write_text(
        mjcf_document(build_simulator_model(model)) if form == "mjcf" else srdf_document(build_simulator_model(model))
    )
    read = (
        pin.buildModelFromMJCF(str(path))
        if form == "mjcf"
        else pin.buildModelFromXML(urdf_document(build_simulator_model(model)))
    )
    if form == "urdf":
        pin.loadRotorParameters(read, str(path), False)
    read.gravity.linear[:] = model.arm.gravity
    data, out = read.createData(), []
    for position, velocity, acceleration in zip(motion.position, motion.velocity, motion.acceleration, strict=True):
        torque = pin.rnea(read, data, _configuration(read, position), velocity, acceleration)
        out.append(torque + _damping(read, velocity))
    assert_allclose(np.array(out), model.torque(motion), atol=1e-9)


def _configuration(read: object, position: Array) -> Array:
    """Pinocchio writes a joint without limits as a cosine and a sine."""
    if read.nq == len(position):
        return position
    return np.column_stack([np.cos(position), np.sin(position)]).ravel()


def _damping(read: object, velocity: Array) -> Array:
    return np.asarray(read.damping) * velocity


def test_gravity_along_any_direction_survives_the_urdf() -> None:
    arm = load_arm("kuka-kr300")  # gravity along +z of its base
    structure = Structure(arm, ())
    inertial = np.concatenate([[10, 1, 2, 0.5, 2.0, 2.0, 2.0, 0, 0, 0] for _ in range(6)]).astype(float)
    model = Model("kuka-kr300", structure, structure.base.values(inertial), inertial=inertial)
    motion = states(6)
    assert_allclose(mujoco_torque(urdf_document(build_simulator_model(model)), motion), model.torque(motion), atol=1e-7)


def test_a_model_without_links_cannot_be_exported(tmp_path: Path) -> None:
    model = model_of("irb120-arm")
    bare = Model(model.robot, model.structure, model.values)
    path = bare.save(tmp_path / "model.yaml")
    with pytest.raises(InputError, match="--method physical"):
        list(export_model(path, tmp_path / "arm.urdf"))
    with pytest.raises(InputError, match=r"should end in \.urdf or \.xml"):
        list(export_model(path, tmp_path / "arm.step"))


def test_export_says_what_the_file_does_not_hold(tmp_path: Path) -> None:
    path = model_of("irb120-arm", (*SMOOTH, "torque_offset")).save(tmp_path / "model.yaml")
    lines = list(export_model(path, tmp_path / "arm.urdf"))
    assert lines[:2] == [str(tmp_path / "arm.urdf"), str(tmp_path / "arm.srdf")]
    assert "URDF has no place for them" in lines[-2]
    offset = read_model(path).component_parameters(6)[0].value
    assert lines[-1].startswith(f"not in the file: torque offset at joint 1 ({offset:.3g} N m); ")
    assert "rotor" not in lines[-1]


def test_a_number_that_is_no_finding_is_written_and_told(tmp_path: Path) -> None:
    model = model_of("irb120-arm", ("rotor_inertia", "torque_offset"))
    parts = [(part.effect, part.joint) for part in model.structure.components]
    rotor, offset = parts.index(("rotor_inertia", 2)), parts.index(("torque_offset", 1))
    model = replace(model, unclaimed=frozenset({rotor, offset}))
    lines = list(export_model(model.save(tmp_path / "model.yaml"), tmp_path / "arm.xml"))
    inertia = float(model.values[model.structure.slices[rotor]][0])
    told = "in the model because it predicts better with them, but not named by the verdict: "
    assert told + f"rotor inertia at joint 2 ({inertia:.3g} kg m²)" in lines
    assert f'armature="{inertia!r}"' in (tmp_path / "arm.xml").read_text()


def test_a_urdf_has_a_limit_that_the_robot_lacks_only_where_urdf_wants_one_and_that_is_told() -> None:
    known, free = Limits((-1.0, 1.0), velocity=2.0), Limits(velocity=3.0)
    arm = load_arm("irb120-arm")
    limits = (known, Limits(), free)
    joints = tuple(replace(joint, limits=each) for joint, each in zip(arm.joints, limits, strict=True))
    arm = replace(arm, joints=joints)
    structure = Structure(arm, ())
    inertial = parameters_of(regular_nominal(arm))
    model = Model("irb120-arm", structure, structure.base.values(inertial), inertial=inertial)
    document = urdf_document(build_simulator_model(model))
    names = [joint.name for joint in joints]
    found = {node.get("name"): node.find("limit") for node in ElementTree.fromstring(document).iter("joint")}
    assert found[names[0]].attrib == {"effort": "1000000000.0", "velocity": "2.0", "lower": "-1.0", "upper": "1.0"}
    assert found[names[1]] is None
    assert found[names[2]].attrib == {"effort": "1000000000.0", "velocity": "3.0"}
    assert unstated_limits(arm) == [
        f"the robot has no limit of torque for {names[0]}, {names[2]}: URDF wants one, 1e+09 stands for none"
    ]
    pin = pytest.importorskip("pinocchio")
    assert pin.buildModelFromXML(document).njoints == 4
