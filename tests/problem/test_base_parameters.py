"""Which parameters joint torques can tell, which only in sums, and which not at all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import random_motion

from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix
from problem.robot_file import RobotFile, load_arm

QUARTER = np.pi / 2


def dh_arm(
    convention: str, rows: list[tuple[float, float, float, float]], kinds: str = "R" * 16, g: float = 9.81
) -> Arm:
    """Rows of a, d, alpha, theta_offset; kinds: a letter a joint, R or P."""
    joints = tuple(
        {
            "name": "j",
            "type": "prismatic" if kind == "P" else "revolute",
            "a": a,
            "d": d,
            "alpha": alpha,
            "theta_offset": o,
        }
        for (a, d, alpha, o), kind in zip(rows, kinds, strict=False)
    )
    data = {"name": "arm", "dh_convention": convention, "joints": joints, "gravity": (0.0, -g, 0.0)}
    return RobotFile.model_validate(data).build()


def names(text: str) -> tuple[str, ...]:
    return tuple(text.split())


def test_irb120_arm_has_15_base_parameters_six_of_them_alone_and_9_zero_columns() -> None:
    base = base_parameters(load_arm("irb120-arm"))
    assert len(base) == 15
    assert base.alone == names("mcy2 Ixy2 Iyz2 mcz3 Ixz3 Iyz3")
    assert base.unidentifiable == names("m1 mcx1 mcy1 mcz1 Ixx1 Izz1 Ixy1 Ixz1 Iyz1")
    assert len(base.grouped) == 15
    assert sum(" " in readable for readable in base.sums) == 9


def test_six_joints_have_36_base_parameters_and_9_zero_columns_in_standard_dh_frames() -> None:
    base = base_parameters(load_arm("irb120"))
    assert (len(base), len(base.unidentifiable)) == (36, 9)


def test_six_joints_have_36_base_parameters_and_11_zero_columns_in_frames_at_the_joints() -> None:
    rows = [
        (0.0, 0.29, 0.0, 0.0),
        (0.0, 0.0, -QUARTER, -QUARTER),
        (0.27, 0.0, 0.0, 0.0),
        (0.07, 0.302, -QUARTER, 0.0),
        (0.0, 0.0, QUARTER, 0.0),
        (0.0, 0.072, -QUARTER, 0.0),
    ]
    modified = dh_arm("modified", rows)
    base = base_parameters(Arm("irb120", modified.joints, None, (0.0, 0.0, -9.81)))
    assert len(base) == 36
    assert base.unidentifiable == names("m1 mcx1 mcy1 mcz1 Ixx1 Iyy1 Ixy1 Ixz1 Iyz1 m2 mcz2")


def test_a_pendulum_shows_its_inertia_and_both_first_moments() -> None:
    base = base_parameters(dh_arm("modified", [(0.0, 0.0, 0.0, 0.0)]))
    assert base.sums == ("mcx1", "mcy1", "Izz1")
    assert len(base.unidentifiable) == 7


def test_a_pendulum_without_gravity_shows_its_inertia_alone() -> None:
    assert base_parameters(dh_arm("modified", [(0.0, 0.0, 0.0, 0.0)], g=0.0)).sums == ("Izz1",)


def test_a_pendulum_written_about_its_end_shows_the_parallel_axis_theorem() -> None:
    # Frame at the tip, a = 0.5 behind the joint: gravity sees mcx + a m, the inertia Izz + 2 a mcx + a^2 m.
    base = base_parameters(dh_arm("standard", [(0.5, 0.0, 0.0, 0.0)]))
    assert base.sums == ("mcx1 + 0.5 m1", "mcy1", "Izz1 - 0.25 m1")


def test_a_two_link_planar_arm_has_the_sums_of_the_textbooks() -> None:
    # Khalil and Dombre 2002, planar arm with link length L = 0.4: mX1 + L m2 and Izz1 + L^2 m2.
    arm = dh_arm("modified", [(0.0, 0.0, 0.0, 0.0), (0.4, 0.0, 0.0, 0.0)])
    base = base_parameters(arm, "earlier_columns")
    assert base.sums == ("mcx1 + 0.4 m2", "mcy1", "Izz1 + 0.16 m2", "mcx2", "mcy2", "Izz2")
    later = base_parameters(arm)
    assert later.sums == ("mcy1", "Izz1 - 0.4 mcx1", "m2 + 2.5 mcx1", "mcx2", "mcy2", "Izz2")


def test_values_of_the_sums_are_what_the_sums_say() -> None:
    arm = dh_arm("modified", [(0.0, 0.0, 0.0, 0.0), (0.4, 0.0, 0.0, 0.0)])
    phi = np.zeros(20)
    phi[[1, 6, 10]] = 3.0, 2.0, 5.0  # mcx1, Izz1, m2
    np.testing.assert_allclose(
        base_parameters(arm, "earlier_columns").values(phi), [3 + 2, 0, 2 + 0.8, 0, 0, 0], rtol=1e-12, atol=1e-12
    )


def test_named_parameters_are_kept_first() -> None:
    base = base_parameters(load_arm("irb120-arm"), ("m2", "Iyy1", "m2"))
    kept = [readable.split()[0] for readable in base.sums]
    assert len(base) == 15
    assert {"m2", "Iyy1"} <= set(kept)
    assert not {"m2", "Iyy1"} & {
        base_parameters(load_arm("irb120-arm")).names[i] for i in base_parameters(load_arm("irb120-arm")).columns
    }


def test_an_unknown_name_to_keep_is_refused() -> None:
    with pytest.raises(ValueError, match="no parameter 'm9' in irb120-arm"):
        base_parameters(load_arm("irb120-arm"), ("m9",))


def test_every_parameter_is_alone_or_grouped_or_unidentifiable() -> None:
    base = base_parameters(load_arm("irb120"))
    assert sorted([*base.alone, *base.grouped, *base.unidentifiable]) == sorted(base.names)


LENGTH = st.sampled_from([0.0, 0.0, 0.13, 0.4, -0.27])
ANGLE = st.sampled_from([0.0, 0.0, QUARTER, -QUARTER, np.pi, 0.7])
ROW = st.tuples(LENGTH, LENGTH, ANGLE, ANGLE)


@settings(max_examples=60, deadline=None)
@given(
    convention=st.sampled_from(["standard", "modified"]),
    rows=st.lists(ROW, min_size=1, max_size=5),
    kinds=st.text("RRP", min_size=5, max_size=5),
    gravity=st.sampled_from([0.0, 9.81]),
    preference=st.sampled_from(["later_columns", "earlier_columns", ("m1", "mcx1")]),
    seed=st.integers(0, 1000),
)
def test_torques_of_any_arm_depend_on_its_base_parameters_alone(
    convention: str,
    rows: list[tuple[float, float, float, float]],
    kinds: str,
    gravity: float,
    preference: tuple[str, ...],
    seed: int,
) -> None:
    arm = dh_arm(convention, rows, kinds, gravity)
    base = base_parameters(arm, preference)
    matrix = observation_matrix(arm, random_motion(len(arm), 60, seed))
    phi = np.random.default_rng(seed).normal(size=10 * len(arm))
    torque = matrix @ phi
    np.testing.assert_allclose(
        matrix[:, base.columns] @ base.values(phi), torque, rtol=0, atol=1e-9 * np.abs(matrix).max()
    )
    assert np.linalg.matrix_rank(matrix[:, base.columns], tol=1e-9 * np.abs(matrix).max()) == len(base)
