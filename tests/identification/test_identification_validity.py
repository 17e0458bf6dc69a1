"""Intervals, cross-validation, the log of looks, loads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter
from simulated_arm import arm, motion, run, structure, truth

from armlab.common.arrays import Array
from armlab.effects.friction import ViscousFriction
from armlab.identification.components import every_joint
from armlab.identification.covariance import uncertainty
from armlab.identification.cross_validation import folds, regression_moments
from armlab.identification.estimators.least_squares import OrdinaryLeastSquares
from armlab.identification.payload import identify_payload, torque_gains
from armlab.identification.priors import Pull, point_mass
from armlab.identification.regression import Regression, regression, signals_of
from armlab.identification.selection import (
    USUAL_GROUPS,
    candidate_groups,
    components_of,
    select_structure,
    toggle_group,
)
from armlab.identification.structure import Structure
from armlab.proof.open.coverage import SimulatedNoise, three_joint_experiment
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run
from problem.pseudo_inertia import link_of
from problem.regressor import observation_matrix
from problem.robot_file import load_arm


def test_intervals_hold_the_truth_in_about_95_percent_of_experiments() -> None:
    experiment = three_joint_experiment(SimulatedNoise())
    held = np.array([experiment.check_intervals(seed)[0] for seed in range(20)])
    assert 0.90 < held.mean() < 0.99


def test_correlated_errors_make_standard_errors_as_large_as_they_are() -> None:
    rng = np.random.default_rng(0)
    column = np.sin(np.linspace(0, 40, 2000))[:, None]
    estimates, told = [], []
    for _ in range(200):
        noise = lfilter([1.0], [1.0, -0.9], rng.standard_normal(2000))
        data = Regression(column, column[:, 0] + noise, 1, (2000,), 100.0, 0.2)
        estimate = OrdinaryLeastSquares()(data)
        estimates.append(estimate.values[0])
        told.append(uncertainty(data, estimate).standard_errors[0])
    assert 0.9 < np.mean(told) / np.std(estimates) < 1.25
    independent = np.std(noise) / np.linalg.norm(column)
    assert np.mean(told) > 2.5 * independent


def data_of(lengths: tuple[int, ...]) -> Regression:
    rows = sum(lengths)
    return Regression(np.ones((rows, 1)), np.arange(rows, dtype=float), 1, lengths, 10.0, 0.3)


def test_every_sample_judges_once_and_never_fits_its_own_block_or_the_gap() -> None:
    data = data_of((100, 60))
    parts = list(folds(data, 4))
    assert_allclose(np.sum([part.judge for part in parts], axis=0), 1)
    for part in parts:
        near = np.convolve(part.judge, np.ones(7), mode="same") > 0  # three samples of the filter on each side
        near[:100] &= part.judge[:100].any()
        near[100:] &= part.judge[100:].any()
        assert not np.any(part.fit & near)


def test_moments_fit_like_the_rows_themselves() -> None:
    model = structure()
    data = regression(model, [signals_of(run(model, truth(model), noise=0.3))])
    fitted = regression_moments(data).fit(np.arange(model.size), None, by_joint=False)
    assert_allclose(fitted, OrdinaryLeastSquares()(data).values, rtol=1e-3, atol=1e-4)
    errors = regression_moments(data).errors(fitted, np.arange(model.size))
    assert_allclose(errors, np.sum(data.residuals(fitted) ** 2, axis=0), rtol=1e-6)


def test_selection_finds_the_square_root_that_is_there_and_leaves_out_what_is_not() -> None:
    groups = candidate_groups(arm())
    model = Structure(arm(), components_of(groups, ("coulomb", "square root", "viscous"))).separable()[0]
    values = truth(model)
    values[model.slices[6].start :] = 6.0  # the square roots
    recorded = [run(model, values, seed, noise=0.05) for seed in (0, 1)]
    choice = select_structure(arm(), recorded, groups, (Pull(),), cutoffs=(1.0,)).choice
    assert "square root" in choice.groups or "cube root" in choice.groups
    assert "wrist coupling" not in choice.groups
    assert choice.held_out < 0.05


def test_groups_that_exclude_each_other_are_exchanged() -> None:
    assert toggle_group(USUAL_GROUPS, "direction") == ("coulomb", "rotor", "offset", "direction")
    assert toggle_group(USUAL_GROUPS, "offset") == ("viscous", "coulomb", "rotor")


def test_looks_are_appended_and_counted_for_each_run(tmp_path: Path) -> None:
    looks = Looks(tmp_path / "new" / "looks.jsonl")
    assert looks.count("arm", "b.csv") == 0
    for name in ("a.csv", "b.csv", "b.csv"):
        looks.note("arm", name, "chosen")
    assert looks.count("arm", "b.csv") == 2
    assert looks.count("other", "b.csv") == 0


LOAD = np.array([2.0, 0.1, -0.06, 0.3, 0.08, 0.07, 0.03, 0.002, -0.01, 0.006])


def six_joint_run(load: Array, seed: int, gains: Array) -> tuple[Structure, Signals]:
    six = load_arm("irb120")
    model = Structure(six, every_joint(six, ViscousFriction))
    halves = [motion(seed + part, 20.0)[1] for part in (0, 100)]
    time = motion(seed, 20.0)[0]
    position = np.hstack([half.position for half in halves])
    moved = signals_of(Run("x", "identify", time, position, position), 20.0).motion
    phi = six.parameters.copy()
    phi[-10:] += load
    torque = (observation_matrix(six, moved) @ phi).reshape(-1, 6) + 0.5 * moved.velocity
    noise = 0.01 * np.random.default_rng(seed).standard_normal(torque.shape)
    return model, signals_of(Run(f"{seed}.csv", "identify", time, position, gains * torque + noise), 10.0)


def test_a_payload_is_what_differs_between_runs_with_and_without_it() -> None:
    model, without = six_joint_run(np.zeros(10), 1, np.ones(6))
    loaded = six_joint_run(LOAD, 2, np.ones(6))[1]
    found = identify_payload(model, [without], [loaded])
    assert_allclose(found.parameters[:4], LOAD[:4], atol=0.02)
    assert_allclose(found.centre, LOAD[1:4] / LOAD[0], atol=0.01)
    assert np.all(np.abs(found.parameters - LOAD) < 3 * found.half_widths + 1e-3)


def test_a_known_payload_shows_the_gain_of_each_joints_torque() -> None:
    gains = np.array([1.0, 1.09, 0.95, 1.02, 1.0, 1.1])
    model, without = six_joint_run(np.zeros(10), 3, gains)
    loaded = six_joint_run(LOAD, 4, gains)[1]
    found = torque_gains(model, [without], [loaded], link_of(LOAD))
    assert_allclose(found.gains[:5], gains[:5], atol=0.03)
    assert np.all(np.abs(found.gains - gains) < 2 * found.half_widths + 0.02)


def test_a_payload_needs_runs_with_it_and_gains_runs_of_both_kinds() -> None:
    model, without = six_joint_run(np.zeros(10), 1, np.ones(6))
    with pytest.raises(ValueError, match="runs with the load and runs without it are needed"):
        identify_payload(model, [without], [])
    with pytest.raises(ValueError, match="runs without it are needed"):
        torque_gains(model, [], [without], link_of(LOAD))


def test_a_motionless_arm_does_not_tell_a_payload() -> None:
    model, without = six_joint_run(np.zeros(10), 1, np.ones(6))
    still = replace(without.run, position=np.zeros_like(without.run.position))
    with pytest.raises(ValueError, match="do not determine the parameters of the load"):
        identify_payload(model, [without], [signals_of(still, 10.0)])


def test_a_point_mass_has_the_inertia_of_a_point() -> None:
    assert_allclose(point_mass(1, (0.0, 0.0, 2.0)), [1, 0, 0, 2, 4, 4, 0, 0, 0, 0])
