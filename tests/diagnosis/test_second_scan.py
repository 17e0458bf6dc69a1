"""Scans look once more in what has passed all tests."""

from collections.abc import Sequence
from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.evidence.pruning import Pruned, prune, scan_what_is_left
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
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


def passed_without_scans(hidden: cases.Hidden) -> Pruned:
    """What passes where no scan has looked, with a library of which scans may look."""
    design = prepare(cases.recording(hidden), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    families = [family for family in library() if family.effect not in SCANNED]
    model, *rest = prune(
        search_effects(fit_background(design, families, 0, lambda message: None), lambda message: None)
    )
    offered: Sequence[Family] = library()
    return replace(model, design=replace(model.design, families=tuple(offered))), rest[0], rest[1]


def named(model: FittedModel) -> set[tuple[str, int | None]]:
    groups = (model.solver.groups[each].candidate for each in model.state.groups)
    return {(each.effect, each.joint) for each in groups}


def test_a_second_scan_finds_what_the_first_one_did_not_and_keeps_the_rest() -> None:
    passed = passed_without_scans(viscous_and_ripple)
    assert ("torque_ripple", 2) not in named(passed[0])
    model, effects, _ = scan_what_is_left(passed)
    assert named(model) == {("viscous_friction", 2), ("torque_ripple", 2)}
    (ripple,) = (group for group in effects if model.solver.groups[group].candidate.effect == "torque_ripple")
    assert model.solver.groups[ripple].candidate.shape[0] == pytest.approx(24.0, abs=0.2)
    assert model.noise is passed[0].noise


def test_a_second_scan_looks_with_the_links_and_the_torque_that_passed() -> None:
    model, *rest = passed_without_scans(viscous_and_ripple)
    right = model.design.scenes[0]
    misled = model.design.with_model(0.5 * right.inertial, lambda scene: np.zeros_like(scene.torque))
    scene = scan_what_is_left((with_design(model, misled), *rest))[0].design.scenes[0]
    np.testing.assert_allclose(scene.inertial, right.inertial)
    np.testing.assert_allclose(scene.torque, torque_of(model)(right))


def test_a_second_scan_that_finds_nothing_changes_nothing() -> None:
    passed = passed_without_scans(viscous)
    assert named(passed[0]) == {("viscous_friction", 2)}
    assert scan_what_is_left(passed) is passed
