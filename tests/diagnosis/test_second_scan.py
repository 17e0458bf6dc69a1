"""Scans look once more in what has passed all tests."""

from collections.abc import Sequence
from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.evidence.pruning import prune, scan_what_is_left
from armlab.diagnosis.torque.search.fitted_model import (
    fit_background,
    search_effects,
    torque_of,
    with_design,
)
from armlab.effects.contract import Family
from armlab.effects.library import library
from problem.motion import Motion

SCANNED = ("torque_ripple", "external_contact", "backlash")


def viscous_and_ripple(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 1] = 0.8 * motion.velocity[:, 1] + 0.3 * np.sin(24.0 * motion.position[:, 1])
    return torque


def viscous(motion: Motion, time: Array) -> Array:
    return np.asarray(motion.velocity * [0.0, 0.8, 0.0])


def passed_without_scans(hidden: cases.Hidden) -> Belief:
    """What passes where no scan has looked, with a library of which scans may look."""
    design = prepare(cases.recording(hidden), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    families = [family for family in library() if family.effect not in SCANNED]
    background = fit_background(design, families, 0, lambda message: None)
    passed = prune(Belief(search_effects(background, lambda message: None)))
    offered: Sequence[Family] = library()
    return replace(passed, model=replace(passed.model, design=replace(passed.model.design, families=tuple(offered))))


def named(belief: Belief) -> set[tuple[str, int | None]]:
    groups = (belief.model.candidate(each) for each in belief.effects)
    return {(each.effect, each.joint) for each in groups}


def test_a_second_scan_finds_what_the_first_one_did_not_and_keeps_the_rest() -> None:
    passed = passed_without_scans(viscous_and_ripple)
    assert ("torque_ripple", 2) not in named(passed)
    scanned = scan_what_is_left(passed)
    model = scanned.model
    assert named(scanned) == {("viscous_friction", 2), ("torque_ripple", 2)}
    (ripple,) = (group for group in scanned.effects if model.candidate(group).effect == "torque_ripple")
    assert model.candidate(ripple).shape[0] == pytest.approx(24.0, abs=0.2)
    assert model.noise is passed.model.noise


def test_a_second_scan_looks_with_the_links_and_the_torque_that_passed() -> None:
    passed = passed_without_scans(viscous_and_ripple)
    model = passed.model
    right = model.design.scenes[0]
    misled = model.design.with_model(0.5 * right.inertial, lambda scene: np.zeros_like(scene.torque))
    scene = scan_what_is_left(replace(passed, model=with_design(model, misled))).model.design.scenes[0]
    np.testing.assert_allclose(scene.inertial, right.inertial)
    np.testing.assert_allclose(scene.torque, torque_of(model)(right))


def test_a_second_scan_that_finds_nothing_changes_nothing() -> None:
    passed = passed_without_scans(viscous)
    assert named(passed) == {("viscous_friction", 2)}
    assert scan_what_is_left(passed) is passed
