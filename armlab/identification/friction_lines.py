"""The friction of a model's joints as simulators have it: a line of Coulomb and viscous friction at each joint."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from armlab.common.errors import InputError
from armlab.common.report.wording import format_number, format_unit, join_words
from armlab.effects.contract import COULOMB_LEVEL, VISCOUS_COEFFICIENT
from armlab.effects.model import FittedEffect
from armlab.identification.torque_model import TorqueModel
from problem.arm import Arm
from problem.joint_words import joint_in_words


@dataclass(frozen=True)
class FrictionLine:
    """level sgn(qd) + slope qd at a joint, from 1; neither is negative, SI units.

    laws: the friction that it stands for, by the names of the effects; empty where it is the friction exactly. rms:
    of its distance from that friction at the speeds of the recording, N m (N); share: the same of the friction's rms.
    """

    joint: int
    level: float
    slope: float
    laws: tuple[str, ...] = ()
    rms: float = 0.0
    share: float = 0.0


def friction_lines(model: TorqueModel) -> tuple[FrictionLine, ...]:
    """The line of each joint that is nearest to its friction in the model, by least squares.

    All laws of friction of the joint by its own motion count, claimed or not, at the speeds of the recording in both
    directions, each as long as the joint had it, and under its mean load. InputError where friction is no such line and
    the model does not know the speeds.
    """
    return tuple(_friction_line(model, joint) for joint in range(1, len(model.arm) + 1))


def _friction_line(model: TorqueModel, joint: int) -> FrictionLine:
    laws = [each for each in model.effects if each.candidate.is_friction_of(joint)]
    stated = [law.candidate.joint_fields(law.coefficients) for law in laws]
    level, slope = (float(sum(each.get(name, 0.0) for each in stated)) for name in ("frictionloss", "damping"))
    if all(stated) and level >= 0 and slope >= 0:
        return FrictionLine(joint, level, slope)
    return _nearest_line(model, joint, laws)


def _nearest_line(model: TorqueModel, joint: int, laws: list[FittedEffect]) -> FrictionLine:
    names = tuple(dict.fromkeys(law.candidate.facts.words for law in laws))
    if model.motion is None:
        raise InputError(
            f"the friction of {joint_in_words(model.arm, joint)} ({join_words(names)}) is no line over velocity, and "
            "the model does not say how fast the joint moved: give it `motion`, or fit it anew"
        )
    scene = model.motion.to_and_fro(model.arm, model.links)
    velocity = scene.motion.velocity[1:, joint - 1]
    friction = np.sum([law.torque(scene)[1:, joint - 1] for law in laws], axis=0)
    columns = np.column_stack([np.sign(velocity), velocity])
    (level, slope), distance = nnls(columns, friction)
    rms, size = distance / np.sqrt(len(friction)), np.sqrt(np.mean(friction**2))
    return FrictionLine(joint, float(level), float(slope), names, float(rms), float(rms / size) if size else 0.0)


def line_in_words(arm: Arm, line: FrictionLine) -> str:
    """What a line stands for, and how far it is from that."""
    kind = arm.joints[line.joint - 1].kind
    torque, slope = (format_unit(each.unit_for(kind)) for each in (COULOMB_LEVEL, VISCOUS_COEFFICIENT))
    rms, percent = format_number(line.rms), format_number(100 * line.share)
    return (
        f"{joint_in_words(arm, line.joint)}: friction loss {format_number(line.level)} {torque} and damping "
        f"{format_number(line.slope)} {slope} stand for {join_words(line.laws)}; at the speeds of the recording "
        f"they are {rms} {torque} rms ({percent} % of the friction) from them"
    )
