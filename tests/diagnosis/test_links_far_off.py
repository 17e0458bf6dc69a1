"""Links of the simulation whose centre of mass is far off."""

from dataclasses import replace

import numpy as np
import pytest
from example_log import record_example

from armlab.diagnosis.result import Claim
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


@pytest.fixture(scope="module")
def link_far_off(tmp_path_factory: pytest.TempPathFactory) -> Claim:
    """What is found of the last link beside friction, where its centre of mass is 7 cm off."""
    recording = load_recording(record_example(tmp_path_factory.mktemp("example")))
    found = diagnose(replace(recording, arm=with_moved_centre(recording.arm, (0.0, 0.07, 0.0))), as_read=True)
    (link,) = (each for each in found.claims if each.effect not in FRICTION)
    return link


def mass_interval(link: Claim) -> tuple[float, float]:
    """Kilograms."""
    mass = next(each for each in link.parameters if each.name in ("mass", "m"))
    low, high = np.ravel(mass.interval)
    return float(low), float(high)


def test_a_centre_of_mass_that_is_far_off_is_named_with_its_mass(link_far_off: Claim) -> None:
    assert (link_far_off.effect, link_far_off.joint) == ("inertial_parameter_error", 3)
    low, high = mass_interval(link_far_off)
    assert low < LOAD_MASS < high


@pytest.mark.xfail(strict=True, reason="since friction stays in the search all links may be off, and share the mass")
def test_the_mass_of_a_link_that_is_far_off_is_known_well(link_far_off: Claim) -> None:
    low, high = mass_interval(link_far_off)
    assert high - low < 0.4 * LOAD_MASS  # a link before it that may be off a little shares what both weigh
