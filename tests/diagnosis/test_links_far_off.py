"""Links of the simulation whose centre of mass is far off."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from example_log import record_example

from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from problem.arm import Arm
from problem.pseudo_inertia import link_from_centre_of_mass

LOAD_MASS = 1.5  # of the example, which the robot file lacks
FRICTION = {"coulomb_friction", "viscous_friction"}


def with_moved_centre(arm: Arm, by: tuple[float, float, float]) -> Arm:
    """The arm with the centre of mass of its last link moved, m; mass and inertia about the centre stay."""
    assert arm.links is not None
    last = arm.links[-1]
    centre = np.array(last.first_moment) / last.mass
    away = link_from_centre_of_mass(last.mass, centre, np.zeros((3, 3)))
    own = np.array(last.inertia) - np.array(away.inertia)
    xx, yy, zz, xy, xz, yz = own
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return replace(arm, links=(*arm.links[:-1], link_from_centre_of_mass(last.mass, centre + by, about)))


def test_a_centre_of_mass_that_is_far_off_is_named_with_its_mass(tmp_path: Path) -> None:
    recording = load_recording(record_example(tmp_path))
    found = diagnose(replace(recording, arm=with_moved_centre(recording.arm, (0.0, 0.07, 0.0))), as_read=True)
    (link,) = (each for each in found.claims if each.effect not in FRICTION)
    assert (link.effect, link.joint) == ("inertial_parameter_error", 3)
    mass = next(each for each in link.parameters if each.name in ("mass", "m"))
    low, high = np.ravel(mass.interval)
    assert low < LOAD_MASS < high
    assert high - low < 0.8 * LOAD_MASS  # a link before it that may be off a little shares what both weigh
