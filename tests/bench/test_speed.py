"""The speed report measures what it says; no test here asserts a time."""

from pathlib import Path

import numpy as np
import pytest

from bench.studies.speed.clock import median_seconds
from bench.studies.speed.evaluations import (
    ANCHOR,
    POPULATION,
    SINGLE,
    PipelineFigures,
    random_motions,
    with_joint_frames,
)
from bench.studies.speed.speed_page import speed_page
from problem.base_parameters import base_parameters
from problem.regressor import gram_matrix, rigid_body_torque
from problem.robot_file import load_arm


def test_rivals_take_turns_after_one_call_each_that_does_not_count() -> None:
    calls: list[str] = []
    median_seconds({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, rounds=2, calls=2)
    assert "".join(calls) == "ab" + "aabb" * 2


@pytest.mark.parametrize("arm", ["irb120-arm", "unisa-panda"])
def test_every_pipeline_gives_pinocchios_matrices_and_condition_numbers(arm: str) -> None:
    pytest.importorskip("pinocchio", reason="the engine Pinocchio is not installed")
    pytest.importorskip("casadi", reason="CasADi is not installed")
    from bench.studies.speed.evaluations import compare_pipelines

    figures = compare_pipelines(arm, rounds=1)
    assert figures.matrices_apart < 1e-10
    assert figures.results_apart < 1e-7  # as near as the eigenvalues of a Gram matrix come (see problem/fitness.py)


@pytest.mark.parametrize("samples", [3, 8, 21])
def test_the_code_built_by_hand_sums_the_products_of_any_number_of_samples(samples: int, tmp_path: Path) -> None:
    pytest.importorskip("casadi", reason="CasADi is not installed")
    from bench.studies.speed.four_lanes import compile_gram_matrices, cpp_compiler

    if cpp_compiler() is None:
        pytest.skip("there is no C++ compiler")
    arm = with_joint_frames(load_arm("irb120-arm"))
    columns, motion = base_parameters(arm).columns, random_motions(arm, 2, samples)
    gram = gram_matrix(arm, motion, columns)
    np.testing.assert_allclose(compile_gram_matrices(arm, columns, tmp_path)(motion), gram, atol=1e-12 * gram.max())


def test_armlabs_share_of_the_anchor_is_that_of_the_same_way_of_calling() -> None:
    us = {f"armlab, {POPULATION}": 8.0, f"armlab, {SINGLE}": 15.0}
    anchor = {f"{ANCHOR}, {POPULATION}": 10.0, f"{ANCHOR}, {SINGLE}": 20.0}
    assert PipelineFigures(3, us | anchor, 0.0, 0.0).shares_of_anchor == {POPULATION: 0.8, SINGLE: 0.75}
    assert PipelineFigures(3, us, 0.0, 0.0).shares_of_anchor == {}


def test_moving_the_links_frames_to_the_joints_moves_nothing_else() -> None:
    arm = load_arm("irb120-arm")
    moved = with_joint_frames(arm)
    motion = random_motions(arm, 1, 20)
    point_mass = np.zeros(30)
    point_mass[20] = 1.0  # 1 kg at the origin of the last frame, which is where the tail of joint 3 puts it
    behind = moved.joints[2]
    tail = arm.joints[2].after[:3, 3]
    in_joint = np.zeros(30)
    in_joint[20:24] = 1.0, *tail
    square = np.outer(tail, tail)
    in_joint[24:30] = [*(np.trace(square) - np.diag(square)), -square[0, 1], -square[0, 2], -square[1, 2]]
    assert np.array_equal(behind.after, np.eye(4))
    np.testing.assert_allclose(
        rigid_body_torque(arm, motion, point_mass), rigid_body_torque(moved, motion, in_joint), atol=1e-12
    )


def test_the_page_shows_the_ratio_and_every_rival() -> None:
    figures = {
        "condition_number": [
            {
                "joints": 3,
                "us": {"armlab, one at a time": 10.0, f"{ANCHOR}, {SINGLE}": 16.0, "Pinocchio": 200.0},
                "times_pinocchio": {"armlab, one at a time": 20.0, f"{ANCHOR}, {SINGLE}": 12.5, "Pinocchio": 1.0},
                "results_apart": 1e-14,
                "matrices_apart": 2e-15,
                "shares_of_anchor": {POPULATION: 0.85, SINGLE: 0.95},
            }
        ],
        "anchor": "CasADi 3, g++ 12, -O3",
        "evaluations_per_second": {"paper": 1e5},
        "derivative_price": {"paper": {"stated": 8, "in_population": 61.4, "single": 9.2, "us": 812.0}},
        "overhead_us": {"spso": {"armlab, one": 1.2, "pygmo, one": 1.6}},
        "growth_us": {"samples": {"50": 5.0}},
        "provenance": {"processor": "a processor"},
    }
    text = speed_page(figures)
    assert "| 3 | armlab, one at a time | 10.0 | 20.0 |" in text
    assert "from Pinocchio's: 2.0e-15" in text
    assert "| 3 | 0.85 | 0.95 | 12.5 | 11.8 | yes |" in text
    assert "(CasADi 3, g++ 12, -O3)" in text
    assert "| spso | pygmo, one | 1.60 |" in text
    assert "| samples | 50 | 5.0 |" in text
