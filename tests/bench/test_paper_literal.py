"""The paper's equations read to the letter: a right transcription, and what each reading can identify."""

import numpy as np
import pytest

from bench.printed import read_printed, times_pi
from bench.studies.paper.literal import (
    PRINTED_GRAVITY,
    RANDOM_STATES,
    Identifiability,
    Reading,
    identifiability,
    inertia_matrix,
    literal_matrix,
)
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.regressor import observation_matrix
from problem.transforms import rotation_x, translation

OWN = Reading(False, False, "third moment", True)


def _found(reading: Reading) -> Identifiability:
    return identifiability(literal_matrix(read_printed(), reading))


def _paper_arm() -> Arm:
    joints = [
        Joint(
            f"joint{number}",
            "revolute",
            translation(0, 0, row.d_mm / 1e3),
            translation(row.a_mm / 1e3, 0, 0) @ rotation_x(times_pi(row.alpha)),
        )
        for number, row in enumerate(read_printed().table1[:3], start=1)
    ]
    return Arm("paper", tuple(joints), gravity=(0.0, 0.0, -PRINTED_GRAVITY))


def test_moments_about_the_joints_axes_are_the_torques_of_the_projects_own_dynamics() -> None:
    states = np.random.default_rng(0).uniform(-2, 2, (RANDOM_STATES, 3, 3))
    arm = _paper_arm()
    expected = observation_matrix(arm, Motion(*np.moveaxis(states, 1, 0))).reshape(RANDOM_STATES, 3, 30)
    moments = literal_matrix(read_printed(), Reading(False, False, "moments", True)).reshape(RANDOM_STATES, 3, 3, 30)
    axes = np.array([joint.after[:3, :3].T @ [0, 0, 1] for joint in arm.joints])  # z of the frame before
    np.testing.assert_allclose(np.einsum("jk,sjkp->sjp", axes, moments), expected, atol=1e-12)


def test_eq_28_is_the_product_of_an_inertia_tensor_with_a_vector() -> None:
    xx, yy, zz, xy, xz, yz = inertia = np.array([2.0, 3.0, 5.0, 0.1, 0.2, 0.3])
    omega = np.array([0.7, -1.1, 1.3])
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(inertia_matrix(omega, "eq. 28") @ inertia, tensor @ omega)
    np.testing.assert_allclose(inertia_matrix(omega, "eq. 26") @ [xx, xy, xz, yy, yz, zz], tensor @ omega)


@pytest.mark.parametrize(
    ("reading", "columns", "rank"),
    [
        (OWN, 24, 19),
        (Reading(False, False, "moments", True), 25, 23),
        (Reading(False, False, "wrench", True), 26, 26),
    ],
)
def test_columns_and_rank_of_the_readings_with_the_right_frames(reading: Reading, columns: int, rank: int) -> None:
    found = _found(reading)
    assert (len(found.alone) + len(found.combined), found.rank) == (columns, rank)


@pytest.mark.parametrize(("gravity", "counts"), [(False, (20, 2, 8)), (True, (21, 2, 7))])
def test_eq_11_as_printed_gives_the_papers_counts_without_gravity(gravity: bool, counts: tuple[int, int, int]) -> None:
    found = _found(Reading(True, True, "third moment", gravity))
    assert (len(found.alone), len(found.combined), len(found.without_effect)) == counts


def test_one_reading_holds_all_parameters_of_table_4_and_one_more() -> None:
    found = _found(Reading(False, True, "third moment", False, "eq. 26"))
    assert set(found.alone) | set(found.combined) == set(read_printed().table4) | {"Ixy2"}
    assert set(found.combined) == {"mcy1", "Ixz1", "Ixx2", "Ixy2"}


def test_identifiability_of_a_matrix_with_a_sum_a_zero_and_free_columns() -> None:
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(50, 10))
    matrix[:, 3] = 0.0
    matrix[:, 5] = 2.0 * matrix[:, 4]
    found = identifiability(matrix)
    assert found.without_effect == ("mcz1",)
    assert found.combined == ("Ixx1", "Iyy1")
    assert found.rank == 8
