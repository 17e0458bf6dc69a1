"""Other arms from an arm: links, lengths, gravity and rotors changed; always bodies that could exist."""

from dataclasses import replace

import numpy as np

from problem.arm import Arm, Joint, Link
from problem.inertia import about_origin, moved, pseudo_link
from problem.transforms import rotation_x, rotation_y, translation
from recordings.run import Array


def with_parameters(arm: Arm, parameters: Array) -> Arm:
    """The arm with other inertial parameters, (10 * joints,)."""
    return replace(arm, links=tuple(_link(*row) for row in parameters.reshape(-1, 10).tolist()))


def _link(
    m: float, x: float, y: float, z: float, xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> Link:
    return Link(m, (x, y, z), (xx, yy, zz, xy, xz, yz))


def with_body(arm: Arm, link: int, body: Link) -> Arm:
    """The arm with a body fixed to a link (from 0), given in that link's frame."""
    parameters = arm.parameters.reshape(-1, 10).copy()
    parameters[link] += body.parameters
    return with_parameters(arm, parameters.ravel())


def with_stretched_link(arm: Arm, link: int, mass: float, shift: Array, spread: float) -> Arm:
    """The arm with a link whose mass and inertia grow by factors and whose centre of mass is moved.

    shift: (3,), m. spread: factor of the inertia about the centre, beyond that of the mass.
    """
    if arm.links is None:
        raise ValueError(f"the arm {arm.name!r} has no `links`")
    old = arm.links[link]
    pseudo, centre = about_origin(old), np.array(old.first_moment) / old.mass
    about_centre = moved(pseudo, translation(*(-centre)))
    about_centre[:3, :3] *= spread
    new = pseudo_link(mass * moved(about_centre, translation(*(centre + shift))))
    parameters = arm.parameters.reshape(-1, 10).copy()
    parameters[link] = new.parameters
    return with_parameters(arm, parameters.ravel())


def with_longer_link(arm: Arm, joint: int, along: str, metres: float) -> Arm:
    """The arm with a longer `a` (behind the joint, from 0, along x) or `d` (along z)."""
    old = arm.joints[joint]
    if along == "d":
        new = Joint(old.name, old.kind, old.before @ translation(0, 0, metres), old.after, old.limits)
    else:
        new = Joint(old.name, old.kind, old.before, translation(metres, 0, 0) @ old.after, old.limits)
    return replace(arm, joints=(*arm.joints[:joint], new, *arm.joints[joint + 1 :]))


def with_tilt(arm: Arm, about_x: float, about_y: float) -> Arm:
    """The arm on a base that is turned about its x and y axes, rad."""
    turn = (rotation_x(about_x) @ rotation_y(about_y))[:3, :3]
    gravity = turn.T @ np.array(arm.gravity)
    return replace(arm, gravity=(float(gravity[0]), float(gravity[1]), float(gravity[2])))


def with_rotor(arm: Arm, joint: int, inertia: float) -> Arm:
    """The arm with more inertia behind the gear of a joint (from 0), kg m2."""
    rotors = list(arm.rotor_inertia or (0.0,) * len(arm))
    rotors[joint] += inertia
    return replace(arm, rotor_inertia=tuple(rotors))
