"""Cheap looks at a residual: they find the order of a ripple and the time of a push, and count what they compared."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from effect_scenes import family, scene

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Scene
from armlab.effects.springs import MAX_ORDER, order_resolution


def scanned(effect: str, residual: Callable[[Scene], Array], joint: int) -> list[Candidate]:
    """Candidates of a scan at a joint: what is left is noise, and something at joint 2."""
    scenes = [scene(seed=seed, run=f"run-{seed}.csv") for seed in (1, 2)]
    left = []
    for where in scenes:
        noise = 0.05 * np.random.default_rng(9).standard_normal(where.motion.position.shape)
        noise[:, 1] += residual(where)
        noise[:60] = np.nan
        left.append(noise)
    places = family(effect).scan(scenes[0].arm, scenes, left)
    return [each for place in places for each in place if each.joint == joint]


@pytest.mark.parametrize("order", [17.3, 64.0, 120.0])
def test_scan_finds_the_order_of_a_ripple(order: float) -> None:
    found = scanned("torque_ripple", lambda where: 0.2 * np.sin(order * where.motion.position[:, 1] + 1), 2)
    low, high = found[0].bounds[0]
    assert low < order < high
    assert high - low < 6
    assert found[0].looks > 50


def test_a_joint_that_rests_for_most_of_a_run_is_slow_enough_for_all_orders() -> None:
    moving = scene(seed=1)
    velocity = moving.motion.velocity.copy()
    velocity[: int(0.6 * len(velocity)), 1] = 0.0
    resting = replace(moving, motion=replace(moving.motion, velocity=velocity))
    assert order_resolution([resting], 2)[1] == MAX_ORDER


def test_scan_finds_the_stretch_of_a_push() -> None:
    def push(where: Scene) -> Array:
        inside = (where.time > 3.0) & (where.time < 3.8) & (where.run == "run-2.csv")
        return np.where(inside, 2 * np.sin(np.pi * (where.time - 3.0) / 0.8), 0.0)

    found = [each for each in scanned("external_contact", push, 2) if each.run == "run-2.csv"]
    assert found[0].shape == pytest.approx((3.0, 3.8), abs=0.15)
    assert found[1].shape == pytest.approx((3.1, 3.7), abs=0.1)
    assert {each.form for each in found} == {"half sine", "box"}
    assert found[0].looks > 50


def test_a_push_is_in_its_own_run_alone() -> None:
    push = scanned("external_contact", lambda where: np.zeros(len(where.time)), 2)[0]
    assert np.any(push.columns(scene(seed=1, run="run-1.csv")))
    assert not np.any(push.columns(scene(seed=2, run="run-2.csv")))


def test_families_without_a_cheap_look_offer_their_candidates() -> None:
    where = scene()
    left = [np.zeros(where.motion.position.shape)]
    assert family("coulomb_friction").scan(where.arm, [where], left) == family("coulomb_friction").candidates(
        where.arm, [where]
    )


def test_orders_that_the_motion_cannot_tell_apart_are_not_tried_twice() -> None:
    where = scene()
    places = family("torque_ripple").candidates(where.arm, [where])
    for place in places:
        joint = place[0].rows[0]
        travel = np.ptp(where.motion.position[:, joint])
        assert np.diff([each.shape[0] for each in place]).min() >= 0.99 * np.pi / travel
