"""The second engine: the same runs on rigid bodies whose joints stick, which shares no code with MuJoCo.

Coulomb, viscous and Stribeck friction in their obvious forms are in its joints, as sets (`servo_arm.c`): a joint sticks
where its friction holds it, and friction shakes the arm. The servos make up for a share of the usual friction by the
velocity that they want, so that reversals are never met exactly. Every other law is added to the recorded torque, as
with MuJoCo. Effects with parts of their own have no place here.

A step of this engine holds at its middle: position, velocity, acceleration and torque of a track are of that instant.
"""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.effects.friction import Coulomb, Stribeck, Viscous
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.engine import Track
from armlab.proof.blind.servo.servo_engine import Body, Servo, ServoArm, follow
from problem.arm import Arm
from problem.motion import Motion
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia

CARRIED_FORMS: dict[type[HiddenEffect], str] = {Coulomb: "sign", Viscous: "linear", Stribeck: "gauss"}


def is_carried(effect: HiddenEffect) -> bool:
    """Whether an effect is in the joints of this engine."""
    return CARRIED_FORMS.get(type(effect)) == effect.form


def play_sticking(
    arm: Arm, gains: tuple[Array, Array], time: Array, given: Array, wanted: Motion, carried: Sequence[HiddenEffect]
) -> Track:
    """The run of an arm whose servos add given torques (steps, joints), N m, to those of their gains.

    gains: of position and velocity, (joints,): torque = given - gain q - gain qd. wanted: where it begins. carried:
    friction in its joints. Raises FloatingPointError where the simulation diverges.
    """
    step = float(time[1] - time[0])
    servos = tuple(_servo(arm, joint, gains, carried) for joint in range(len(arm)))
    middle = (given[1:] + given[:-1]) / 2
    first = wanted.position[0], wanted.velocity[0]
    moved = follow(ServoArm(_bodies(arm), servos), arm.gravity, step, middle, first)
    if not np.all(np.isfinite(moved.position)):
        raise FloatingPointError(f"the simulated arm runs away at a step of {step:g} s")
    motion = Motion(
        (moved.position[1:] + moved.position[:-1]) / 2,
        (moved.velocity[1:] + moved.velocity[:-1]) / 2,
        np.diff(moved.velocity, axis=0) / step,
    )
    track = Track(time[:-1] + step / 2, motion, moved.torque)
    load = moved.torque.copy()
    for effect in carried:
        law = effect.torque(track, 0)
        if law is not None:
            load[:, effect.joint] -= law  # what the laws say is added again where torque is recorded
    return Track(track.time, motion, load)


def _servo(arm: Arm, joint: int, gains: tuple[Array, Array], carried: Sequence[HiddenEffect]) -> Servo:
    own = [effect for effect in carried if effect.joint == joint]
    fall = next((effect for effect in own if isinstance(effect, Stribeck)), None)
    level = sum(effect.size for effect in own if isinstance(effect, Coulomb))
    return Servo(
        kp=float(gains[0][joint]),
        kd=float(gains[1][joint]),
        limit=float("inf"),
        armature=float(arm.rotor_inertia[joint]) if arm.rotor_inertia else 0.0,
        damping=sum(effect.size for effect in own if isinstance(effect, Viscous)),
        friction=level + (fall.shape["level"] if fall else 0.0),
        static_extra=fall.size if fall else 0.0,
        stribeck_velocity=fall.shape["velocity"] if fall else 0.0,
    )


def _bodies(arm: Arm) -> tuple[Body, ...]:
    """The links with their hinges, all frames turned as the base where the joints are at zero.

    Raises ValueError for an arm without links, and for one with a joint that slides.
    """
    if arm.links is None or any(joint.kind != "revolute" for joint in arm.joints):
        raise ValueError(f"the arm {arm.name!r} needs links and joints that turn")
    pose, origin, out = np.eye(4), np.zeros(3), []
    for joint, link in zip(arm.joints, arm.links, strict=True):
        hinge = pose @ joint.before
        turned = hinge @ joint.after
        turned[:3, 3] -= hinge[:3, 3]
        body = link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(link), turned))
        centre = np.array(body.first_moment) / body.mass
        back = np.eye(4)
        back[:3, 3] = -centre
        central = link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(body), back))
        place, axis, middle = (
            (float(each[0]), float(each[1]), float(each[2])) for each in (hinge[:3, 3] - origin, hinge[:3, 2], centre)
        )
        out.append(Body(place, axis, body.mass, middle, central.inertia))
        origin, pose = hinge[:3, 3], hinge @ joint.after
    return tuple(out)
