"""Reads MJCF, the format of MuJoCo, as an arm. MuJoCo compiles the file: defaults and includes count as it has them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import import_package
from problem.arm import Arm, Joint, JointLaw, Limits, Link
from problem.coupled_joints import couple_joints
from problem.mjcf_document import UneditableError
from problem.mjcf_laws import is_disabled, read_joint_laws, read_rotors
from problem.mjcf_meshes import text_without_meshes
from problem.mjcf_names import joint_name, name_joints
from problem.mjcf_tree import MOVING_KINDS, joints_of_body, mjcf_tree, read_couplings
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia
from problem.transforms import inverse, translation, turn_z_to


def import_mujoco() -> Any:
    """The package mujoco; InputError, with the command that installs it, where it is missing."""
    return import_package("mujoco", "what reads MJCF, replays a motion or measures distances")


def compile_mjcf(path: Path) -> Any:
    """The mujoco.MjModel of a file; InputError, in one line, where it is missing or MuJoCo refuses it.

    Meshes that are not at hand are left out, where the file states the inertia of their bodies.
    """
    mujoco = import_mujoco()
    if not path.is_file():
        raise InputError(f"cannot read {path}: no such file")
    try:
        return _compiled(mujoco.MjModel.from_xml_path, str(path), path)
    except InputError as error:
        if not _lacks_files(path):
            raise
        reason = error
    try:
        return compile_mjcf_text(text_without_meshes(path), path)
    except UneditableError:
        raise reason from None


def mjcf_spec(path: Path) -> Any:
    """The mujoco.MjSpec of a file that `compile_mjcf` takes, without meshes where some are not at hand.

    Joints without names get those of `joint_name`.
    """
    mujoco = import_mujoco()
    lacks = _lacks_files(path)
    spec = mujoco.MjSpec.from_string(text_without_meshes(path)) if lacks else mujoco.MjSpec.from_file(str(path))
    name_joints(spec)
    return spec


def _lacks_files(path: Path) -> bool:
    """Whether a file that an MJCF names for its shapes and colours is not at hand."""
    try:
        spec = import_mujoco().MjSpec.from_file(str(path))
    except ValueError:
        return False
    folder = path.parent
    shapes = [folder / spec.meshdir / each.file for each in (*spec.meshes, *spec.hfields, *spec.skins) if each.file]
    colours = [folder / spec.texturedir / each.file for each in spec.textures if each.file]
    return not all(each.is_file() for each in (*shapes, *colours))


def compile_mjcf_text(text: str, path: Path) -> Any:
    """The mujoco.MjModel of a text with absolute paths of meshes; path: of its file, for messages. Errors as above."""
    return _compiled(import_mujoco().MjModel.from_xml_string, text, path)


def _compiled(read: Callable[[str], Any], given: str, path: Path) -> Any:
    try:
        return read(given)
    except ValueError as error:
        reason = in_one_line(error)
        hint = "; remove visual meshes that are not at hand" if "mesh" in reason.lower() else ""
        raise InputError(f"{path}: MuJoCo cannot compile it: {reason}{hint}") from None


def written_mjcf(spec: Any, source: Path) -> str:
    """The text of a mujoco.MjSpec; of one that was read from an MJCF file with absolute paths of meshes and textures.

    Raises InputError, in one line, where MuJoCo refuses it.
    """
    if source.suffix == ".xml" and (spec.meshes or spec.textures or spec.hfields or spec.skins):
        folder = source.parent.resolve()
        spec.meshdir, spec.texturedir = str(folder / spec.meshdir), str(folder / spec.texturedir)
    try:
        spec.compile()
        return str(spec.to_xml())
    except (ValueError, import_mujoco().FatalError) as error:
        raise InputError(f"MuJoCo cannot write {source.name}: {in_one_line(error)}") from None


def read_mjcf(path: Path) -> Arm:
    """The arm of an MJCF file: a chain of hinges and slides on a fixed base, with what the file says of its joints.

    Joint laws, armature and the weight that MuJoCo compensates count as `mj_inverse` has them; contacts, limits and the
    forces of actuators are no part of an arm. Raises InputError, in one line, for a free or ball joint, for what has no
    place in an arm (see `read_joint_laws`), and for a file that MuJoCo refuses; for a branch or an equality
    constraint an UndecidedError with the bodies where an arm may end, if there are any.
    """
    return arm_of(compile_mjcf(path), path)


def arm_of(model: Any, path: Path) -> Arm:
    """The arm of a mujoco.MjModel; path: of its file, for messages. Raises InputError as `read_mjcf`."""
    if model.njnt == 0:
        raise InputError(f"{path} has no joint")
    follows = read_couplings(model, path)
    joints: list[Joint] = []
    for body, carrier, pose in _walk_bodies(model):
        numbers = joints_of_body(model, body)
        if numbers and carrier != len(joints):
            name = joint_name(model, numbers[0])
            raise mjcf_tree(model, path).refuse(f"{path}, joint '{name}': a second branch of moving joints")
        for number in numbers:
            joints.append(_joint(model, number, pose, path))
            pose = np.eye(4)
    groups = carried_bodies(model)
    laws = read_joint_laws(model, path)
    compensated = tuple(_compensated(model, own) for own in groups)
    is_compensated = any(link.mass for link in compensated)
    chain = Arm(
        name=path.stem,
        joints=tuple(joints),
        links=tuple(link_from_pseudo_inertia(_sum_of(own)) for own in groups),
        gravity=(0.0, 0.0, 0.0) if is_disabled(model, "GRAVITY") else tuple(model.opt.gravity.tolist()),
        rotor_inertia=read_rotors(model),
        joint_laws=laws if is_compensated or any(law != JointLaw() for law in laws) else (),
        compensated=compensated if is_compensated else (),
    )
    return couple_joints(chain, follows, str(path))


def _sum_of(carried: "tuple[CarriedBody, ...]") -> Array:
    return np.asarray(np.sum([np.zeros((4, 4)), *(each.seen for each in carried)], axis=0))


def _compensated(model: Any, carried: "tuple[CarriedBody, ...]") -> Link:
    """The masses that a joint carries whose weight the simulator holds, as a link without inertia."""
    parts = [float(model.body_gravcomp[each.number]) * each.seen[3] for each in carried]
    x, y, z, mass = np.sum([np.zeros(4), *parts], axis=0).tolist()
    return Link(mass, (x, y, z), (0.0,) * 6)


def _walk_bodies(model: Any) -> Iterator[tuple[int, int, Array]]:
    """Each body with the number of the joint before it (0: none), and its pose in the frame of that joint's body.

    Several joints of a body count each: the body belongs to the last one, and the others carry nothing.
    """
    carried: dict[int, tuple[int, Array]] = {0: (0, np.eye(4))}
    jointed = 0
    for body in range(1, model.nbody):
        carrier, pose = carried[int(model.body_parentid[body])]
        pose = pose @ _pose(model.body_pos[body], model.body_quat[body])
        yield body, carrier, pose
        if model.body_jntnum[body]:
            jointed += int(model.body_jntnum[body])
            carrier, pose = jointed, np.eye(4)
        carried[body] = carrier, pose


@dataclass(frozen=True, eq=False)
class CarriedBody:
    """A body of a mujoco.MjModel that a moving joint carries.

    seen: its pseudo-inertia (4, 4) about the frame of the body with the joint, which is the first of those.
    """

    number: int
    seen: Array


def carried_bodies(model: Any) -> tuple[tuple[CarriedBody, ...], ...]:
    """The bodies that each joint of a chain carries, from the base on."""
    groups: list[list[CarriedBody]] = []
    for body, carrier, pose in _walk_bodies(model):
        if model.body_jntnum[body]:
            groups += [[] for _ in joints_of_body(model, body)]
            groups[-1].append(CarriedBody(body, body_inertia(model, body)))
        elif carrier:
            groups[carrier - 1].append(CarriedBody(body, transform_pseudo_inertia(body_inertia(model, body), pose)))
    return tuple(tuple(own) for own in groups)


def _pose(position: Array, quaternion: Array) -> Array:
    pose, turn = translation(*position), np.empty(9)
    import_mujoco().mju_quat2Mat(turn, quaternion)
    pose[:3, :3] = turn.reshape(3, 3)
    return pose


def _joint(model: Any, number: int, pose: Array, path: Path) -> Joint:
    """A joint. pose: of its body, or of the frame that the joint before it on that body turns, in the link before.

    The body stands as the file has it where the joint is at its reference position, `ref`.
    """
    name, kind = joint_name(model, number), int(model.jnt_type[number])
    if kind not in MOVING_KINDS:
        raise InputError(
            f"{path}, joint '{name}': only hinge and slide joints on a fixed base are supported: "
            f"hold it still with --lock {name}=0 of `armlab recording import`"
        )
    frame = translation(*model.jnt_pos[number]) @ turn_z_to(model.jnt_axis[number])
    bounds = tuple(model.jnt_range[number].tolist()) if model.jnt_limited[number] else (-np.inf, np.inf)
    own = Joint(name, MOVING_KINDS[kind], pose @ frame, inverse(frame), Limits(position=bounds))  # type: ignore[arg-type]
    return own.counted_from(float(model.qpos0[model.jnt_qposadr[number]]))


def body_inertia(model: Any, body: int) -> Array:
    """Pseudo-inertia (4, 4) of a body about its own frame."""
    xx, yy, zz = model.body_inertia[body].tolist()
    link = Link(float(model.body_mass[body]), (0.0, 0.0, 0.0), (xx, yy, zz, 0.0, 0.0, 0.0))
    return transform_pseudo_inertia(pseudo_inertia_of(link), _pose(model.body_ipos[body], model.body_iquat[body]))
