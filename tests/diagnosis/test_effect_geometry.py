"""What no motion separates shows as an angle of zero, and what the base parameters swallow as invisible."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest
from effect_scenes import scene_of, waves

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Scene
from armlab.effects.library import BUILT_IN
from armlab.effects.separability import Confusion, base_rows, candidate_rows, compute_confusion
from armlab.recordings.filters import Butterworth
from problem.base_parameters import base_parameters
from problem.robot_file import load_arm


@lru_cache(maxsize=1)
def scenes() -> list[Scene]:
    arm = load_arm("irb120-arm")
    found = []
    for seed in (1, 2):
        time, motion = waves(3, seed)
        found.append(scene_of(arm, motion, time, f"run-{seed}.csv"))
    return found


def filters() -> list[Butterworth]:
    return [Butterworth(500.0, 30.0, len(where.time), 4) for where in scenes()]


def named(*wanted: tuple[str, int | None, str]) -> list[Candidate]:
    places = [place for each in BUILT_IN for place in each.candidates(scenes()[0].arm, scenes())]
    return [
        next(p[0] for p in places if p[0].effect == effect and p[0].joint == joint and form in p[0].form)
        for effect, joint, form in wanted
    ]


def between(wanted: Sequence[tuple[str, int | None, str]], refit: bool = False) -> Confusion:
    free: Array | None = base_rows(base_parameters(scenes()[0].arm), scenes(), filters()) if refit else None
    return compute_confusion(named(*wanted), scenes(), filters(), free)


def test_asymmetric_levels_are_coulomb_friction_and_an_offset() -> None:
    found = between([("asymmetric_friction", 2, "levels"), ("coulomb_friction", 2, ""), ("torque_offset", 2, "")])
    assert found.covered[1, 0] == pytest.approx(1, abs=1e-9)
    assert found.covered[2, 0] == pytest.approx(1, abs=1e-9)
    assert found.covered[0, 1] == 0  # one column cannot do what two can


def test_linear_spring_and_cable_are_one() -> None:
    found = between([("cable_stiffness", 2, "linear"), ("gravity_compensator", 2, "linear spring")])
    assert found.covered[0, 1] == pytest.approx(1, abs=1e-9)
    assert found.rivals(0, 0.99) == [1]


@pytest.mark.parametrize(("joint", "gone"), [(1, True), (2, True), (3, False)])
def test_rotor_inertia_is_the_links_on_joints_one_and_two(joint: int, gone: bool) -> None:
    found = between([("rotor_inertia", joint, "")], refit=True)
    assert bool(found.visible[0] < 1e-6) is gone


def test_a_refit_swallows_payload_tilt_less_friction() -> None:
    found = between([("payload", 3, "body"), ("inertial_parameter_error", 2, ""), ("viscous_friction", 2, "")], True)
    assert found.visible[:2] == pytest.approx([0, 0], abs=1e-6)
    assert found.visible[2] > 0.5
    assert found.closest[0, 2] == 0


def test_payload_of_a_link_is_an_error_of_its_parameters() -> None:
    found = between([("payload", 3, "body"), ("inertial_parameter_error", 3, ""), ("payload", 3, "point")])
    assert found.covered[0, 1] == pytest.approx(1, abs=1e-9)
    assert found.covered[2, 0] == pytest.approx(1, abs=1e-6)


def test_a_delay_resembles_viscous_friction_more_than_coulomb_friction_resembles_an_offset() -> None:
    found = between(
        [("time_delay", None, ""), ("viscous_friction", 2, ""), ("coulomb_friction", 2, ""), ("torque_offset", 2, "")]
    )
    assert found.closest[0, 1] > found.closest[2, 3]


def test_a_joint_that_is_measured_well_counts_more() -> None:
    pair = named(("time_delay", None, ""), ("channel_skew", 3, "torque"))
    alike = compute_confusion(pair, scenes(), filters()).closest[0, 1]
    third = compute_confusion(pair, scenes(), filters(), noise=np.array([10.0, 10.0, 0.01])).closest[0, 1]
    assert third > 0.99 > alike


def test_rows_stand_joint_by_joint_within_a_sample() -> None:
    friction = named(("coulomb_friction", 2, ""))[0]
    rows = candidate_rows(friction, scenes(), filters()).reshape(-1, 3)
    assert not rows[:, [0, 2]].any()
    assert len(rows) == sum(len(range(*keep.rows.indices(4000))) for keep in filters())
