from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from simulated_arm import arm, run, structure, truth

from armlab.common.arrays import Array
from armlab.effects.friction import ViscousFriction
from armlab.effects.scene import instants
from armlab.identification.components import every_joint
from armlab.identification.estimators.least_squares import (
    BayesianLeastSquares,
    OrdinaryLeastSquares,
    Prior,
    RobustLeastSquares,
    WeightedLeastSquares,
)
from armlab.identification.identifier import METHODS, Identifier
from armlab.identification.model import Model
from armlab.identification.priors import Pull, nominal_prior, point_mass
from armlab.identification.regression import Regression, regression, signals_of
from armlab.identification.selection import candidate_groups, select_structure
from armlab.recordings.recording import Run
from problem.motion import Motion
from problem.pseudo_inertia import least_eigenvalues, parameters_of, regular_nominal

MODEL = structure()
TRUTH = truth(MODEL)


def line(noise: Array) -> Regression:
    """torque = 2 x + noise, one joint."""
    x = np.linspace(-1, 1, len(noise))[:, None]
    return Regression(x, 2 * x[:, 0] + noise, 1, (len(noise),), 100.0, 0.05)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_finds_the_truth_in_clean_data(method: str) -> None:
    pytest.importorskip("clarabel")
    clean = run(MODEL, TRUTH, seconds=20.0)
    clean = replace(clean, reference_position=clean.position)
    identifier = Identifier(arm(), method=method, cutoff_hz=10.0).fit([clean])
    assert_allclose(identifier.model_.values, TRUTH, rtol=0.05, atol=0.03)
    assert identifier.score(clean) > 0.9999


def test_weights_are_one_over_the_deviation_of_each_joint() -> None:
    rng = np.random.default_rng(0)
    matrix = np.ones((4000, 1))
    noise = rng.standard_normal((2000, 2)) * [0.1, 10.0]
    data = Regression(matrix, (3 + noise).ravel(), 2, (2000,), 100.0, 0.01)
    loud, quiet = OrdinaryLeastSquares()(data).values[0], WeightedLeastSquares()(data).values[0]
    assert abs(quiet - 3) < 0.01 < abs(loud - 3)


@pytest.mark.parametrize("loss", ["huber", "tukey"])
def test_a_push_during_a_tenth_of_the_time_does_not_move_robust_estimates(loss: str) -> None:
    noise = 0.01 * np.random.default_rng(1).standard_normal(1000)
    noise[-100:] += 5.0
    data = line(noise)
    assert abs(OrdinaryLeastSquares()(data).values[0] - 2) > 0.5
    assert abs(RobustLeastSquares(loss)(data).values[0] - 2) < 0.05


def test_a_prior_weighs_like_the_data_that_it_stands_for() -> None:
    noise = np.random.default_rng(2).standard_normal(1000)
    data = line(noise)
    free = OrdinaryLeastSquares()(data)
    variance = float(np.mean(data.residuals(free.values) ** 2))
    information = data.matrix.T @ data.matrix / variance
    drawn = BayesianLeastSquares(Prior(np.array([2.2]), information))(data)
    assert_allclose(drawn.values, (free.values + 2.2) / 2, rtol=0.01)


def noisy_runs(count: int) -> list[Run]:
    """Coarse encoders and a reference that is exactly what was done."""
    out = []
    for seed in range(count):
        clean = run(MODEL, TRUTH, seed, noise=0.02, seconds=10.0)
        noise = 2e-3 * np.random.default_rng(50 + seed).standard_normal(clean.position.shape)
        out.append(replace(clean, position=clean.position + noise, reference_position=clean.position))
    return out


@pytest.mark.parametrize("method", ["instrumental", "total", "likelihood"])
def test_methods_for_noisy_columns_have_less_bias_than_least_squares(method: str) -> None:
    runs = noisy_runs(3)
    distance = {}
    for name in ("ordinary", method):
        found = Identifier(arm(), method=name, cutoff_hz=12.0).fit(runs).model_
        distance[name] = np.linalg.norm(found.torque(signals_of(runs[0]).motion) - _torque(runs[0]))
    assert distance[method] < 0.8 * distance["ordinary"]


def _torque(noisy: Run) -> Array:
    return (MODEL.matrix(instants(arm(), signals_of(noisy).motion)) @ TRUTH).reshape(-1, 3)


def test_physical_estimates_are_bodies_that_can_exist_and_friction_that_brakes() -> None:
    pytest.importorskip("clarabel")
    short = run(MODEL, TRUTH * np.where(np.arange(MODEL.size) < len(MODEL.base), 1, -0.2), noise=3.0, seconds=3.0)
    free = Identifier(arm(), method="weighted").fit([short]).model_
    physical = Identifier(arm(), method="physical").fit([short]).model_
    assert braking(free, short).min() < -1
    assert braking(physical, short).min() > -1e-6
    assert physical.inertial is not None
    assert least_eigenvalues(physical.inertial).min() > 0
    assert_allclose(MODEL.base.values(physical.inertial), physical.base_values, atol=1e-9)


def braking(model: Model, of: Run) -> Array:
    """Viscous and Coulomb friction against the motion, N m, from a hundredth of the fastest speed on, both ways."""
    fastest = np.abs(signals_of(of).motion.velocity).max(axis=0)
    speeds = np.concatenate([np.linspace(-1, -0.01, 50), np.linspace(0.01, 1, 50)])[:, None] * fastest
    motion = Motion(np.zeros_like(speeds), speeds, np.zeros_like(speeds))
    friction = np.zeros_like(speeds)
    for part, place in zip(model.structure.components, model.structure.slices, strict=True):
        if part.effect in ("viscous_friction", "coulomb_friction"):
            friction[:, part.joint - 1] += part.columns(instants(arm(), motion))[:, 0] @ model.values[place]
    return np.asarray(friction * np.sign(speeds))


def test_a_tight_nominal_prior_gives_back_the_nominal_links() -> None:
    pytest.importorskip("clarabel")
    noisy = run(MODEL, 1.5 * TRUTH, noise=0.5)
    nominal = MODEL.base.values(parameters_of(regular_nominal(arm())))
    for method in ("weighted", "physical"):
        tight = Identifier(arm(), method=method, pull=Pull("nominal", 1e-4)).fit([noisy]).model_
        assert_allclose(tight.base_values, nominal, rtol=0.01, atol=0.003)


def test_a_physical_estimate_leaves_a_mass_that_no_motion_shows_near_the_nominal_one() -> None:
    """The first joint is vertical: its link turns about it, and no torque depends on that link's mass."""
    pytest.importorskip("clarabel")
    found = Identifier(arm(), method="physical").fit([run(MODEL, TRUTH, noise=0.05)]).model_
    assert found.inertial is not None
    assert_allclose(found.inertial[0], regular_nominal(arm())[0, 3, 3], rtol=0.02)


def test_a_payload_of_any_mass_costs_the_prior_nothing() -> None:
    model = structure(every_joint(arm(), ViscousFriction))
    prior = nominal_prior(model, 0.1, (0.0, 0.0, 0.1))
    load = np.zeros(model.size)
    load[: len(model.base)] = model.base.values(point_mass(3, (0.0, 0.0, 0.1)))
    free = nominal_prior(model, 0.1)
    assert load @ prior.information @ load < 1e-6 * (load @ free.information @ load)


def test_positions_with_a_higher_cut_off_leave_the_columns_what_the_torque_has() -> None:
    clean = run(MODEL, TRUTH)
    left = {}
    for factor in (1.0, 2.0):
        signals = signals_of(clean, 0.7, factor)
        predicted = MODEL.filtered(signals) @ TRUTH
        left[factor] = np.linalg.norm(signals.torque.ravel() - predicted) / np.linalg.norm(signals.torque)
    assert left[2.0] < 0.2 * left[1.0]


def test_the_smoothing_of_positions_is_chosen_by_what_predicts_held_out_blocks() -> None:
    clean = run(MODEL, TRUTH)
    choice = select_structure(arm(), [clean], candidate_groups(arm()), (Pull(),), cutoffs=(0.2,)).choice
    assert choice.position_factor == 2.0


def test_runs_of_another_arm_are_refused() -> None:
    wrong = run(MODEL, TRUTH)
    wrong = replace(wrong, position=wrong.position[:, :2], torque=wrong.torque[:, :2])
    with pytest.raises(ValueError, match="does not have the 3 joints"):
        regression(MODEL, [signals_of(wrong)])
