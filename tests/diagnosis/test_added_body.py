"""Bodies that are added to a link can exist."""

import numpy as np

from armlab.diagnosis.added_body import _likeliest_body, is_possible_body
from problem.arm import Link
from problem.pseudo_inertia import link_from_centre_of_mass

BODY = np.asarray(link_from_centre_of_mass(120.0, np.array([0.0, 0.1, 0.2]), np.diag([2.0, 2.5, 3.0])).parameters)


def test_a_body_that_the_data_determine_is_found_as_it_is() -> None:
    found, gain = _likeliest_body(1e6 * np.eye(10), 1e6 * BODY)
    np.testing.assert_allclose(found, BODY, rtol=1e-3, atol=1e-2)
    assert gain > 0


def test_data_that_ask_for_a_negative_mass_get_no_body_of_negative_mass() -> None:
    wanted = BODY.copy()
    wanted[0] = -39.0
    found, _ = _likeliest_body(np.eye(10), wanted)
    assert is_possible_body(found, 1e-6)


def test_a_body_without_mass_or_with_an_impossible_spread_of_it_is_none() -> None:
    assert is_possible_body(BODY)
    assert not is_possible_body(-BODY)
    parameters = np.asarray(Link(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 5.0, 0.0, 0.0, 0.0)).parameters)
    assert not is_possible_body(parameters)
