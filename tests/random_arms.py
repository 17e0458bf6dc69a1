"""Arms, links and motions at random, for properties that should hold for every arm."""

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm, Joint, Link
from problem.motion import Motion
from problem.pseudo_inertia import link_from_pseudo_inertia
from problem.transforms import roll_pitch_yaw


def random_pose(rng: np.random.Generator) -> Array:
    """Any turn, and a shift of up to 0.4 m a coordinate."""
    pose = roll_pitch_yaw(*rng.uniform(-np.pi, np.pi, 3))
    pose[:3, 3] = rng.uniform(-0.4, 0.4, 3)
    return pose


def random_link(rng: np.random.Generator) -> Link:
    """A body made of ten point masses: it always exists."""
    masses, places = rng.uniform(0.1, 1.0, 10), rng.uniform(-0.3, 0.3, (10, 3))
    homogeneous = np.column_stack([places, np.ones(10)])
    return link_from_pseudo_inertia((masses[:, None] * homogeneous).T @ homogeneous)


def random_arm(kinds: str, seed: int = 0) -> Arm:
    """An arm of one joint a letter, R or P, between random transforms, with links and a slanted gravity."""
    rng = np.random.default_rng(seed)
    names = {"R": "revolute", "P": "prismatic"}
    joints = tuple(
        Joint(f"joint{number}", names[kind], random_pose(rng), random_pose(rng))
        for number, kind in enumerate(kinds, start=1)
    )
    links = tuple(random_link(rng) for _ in kinds)
    return Arm(f"random-{kinds}", joints, links, gravity=(1.7, -3.1, -9.0))


def random_motion(joints: int, samples: int, seed: int = 0, batch: tuple[int, ...] = ()) -> Motion:
    """Positions within half a turn, speeds and accelerations of a few units."""
    rng = np.random.default_rng(seed)
    shape = (*batch, samples, joints)
    return Motion(rng.uniform(-np.pi, np.pi, shape), rng.uniform(-4, 4, shape), rng.uniform(-20, 20, shape))
