"""The parts of the engine: whitening, fits of subsets, robust covariance, links' widths, surrogates."""

import engine_cases as cases
import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis.effects.library import library
from diagnosis.engine.flexible import families, features
from diagnosis.engine.folds import gain_of
from diagnosis.engine.links import link_prior
from diagnosis.engine.noise import noise_of
from diagnosis.engine.observed import Observed, observe
from diagnosis.engine.segments import Segment, parts
from diagnosis.engine.simulation import simulation_of
from diagnosis.engine.solver import EXPECTED, Solver, State
from diagnosis.engine.surrogate import structure
from diagnosis.engine.workbench import Workbench, workbench
from diagnosis.settings import Settings
from problem.base_parameters import base_parameters


@pytest.fixture(scope="module")
def bench() -> Workbench:
    recording = cases.recording(seconds=6.0)
    simulation = simulation_of(recording, None)
    observed = observe(recording.runs, simulation.arm, simulation.inertial, Settings())
    base = base_parameters(simulation.arm)
    prior = link_prior(simulation.arm, base, recording.arm.parameters)
    plain = workbench(observed, simulation, base, prior, Settings())
    return plain.with_candidates([family for family in library() if family.effect in EXPECTED])


@pytest.fixture(scope="module")
def observed(bench: Workbench) -> Observed:
    return bench.observed


def solved(bench: Workbench) -> Solver:
    columns = bench.columns
    return bench.solver(noise_of(columns.target, bench.observed, 0.0))[1]


def test_whitened_autoregressive_noise_is_white_with_unit_variance(observed: Observed) -> None:
    coloured = lfilter([0.3], [1, -0.9], np.random.default_rng(0).standard_normal((observed.rows, 3)), axis=0)
    noise = noise_of(coloured, observed, 0.0)
    white = noise.whitened(coloured[:, :1], 0, observed.used(0))[:, 0]
    assert np.var(white) == pytest.approx(1, abs=0.05)
    assert abs(np.mean(white[1:] * white[:-1])) < 0.06


def test_a_fit_from_moments_is_the_least_squares_fit_of_the_whitened_rows(bench: Workbench) -> None:
    solver = solved(bench)
    columns = bench.columns
    noise = noise_of(columns.target, bench.observed, 0.0)
    state = State((0, 4, 8), (0.0, 0.0, 0.0))
    fit = solver.fit(state)
    rows, targets = [], []
    for joint, (matrix, index) in enumerate(zip(columns.matrices, columns.index, strict=True)):
        white = noise.white(matrix, joint, bench.observed, "identify")
        own = np.zeros((len(white), len(fit.columns)))
        for place, column in enumerate(fit.columns):
            found = np.flatnonzero(index == column)
            if len(found):
                own[:, place] = white[:, found[0]]
        rows.append(own)
        targets.append(white[:, -1])
    direct = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets))[0]
    assert fit.coefficients[fit.columns] / solver.moments.lengths[fit.columns] == pytest.approx(direct, rel=1e-5)


def test_the_gain_of_a_group_is_what_adding_it_raises_the_score_by(bench: Workbench) -> None:
    solver, state = solved(bench), State((1,), (0.05, 0.05, 0.05))
    gains = solver.gains(state)
    for group in (0, 5, 7):
        raised = solver.fit(state.plus(group)).score - solver.fit(state).score
        assert gains[group] == pytest.approx(raised, abs=1e-3)


def test_the_loss_of_a_group_is_what_taking_it_out_changes_the_score_by(bench: Workbench) -> None:
    solver, state = solved(bench), State((0, 1, 5), (0.05, 0.05, 0.05))
    losses = solver.losses(solver.fit(state))
    for group in state.groups:
        changed = solver.fit(state.minus(group)).score - solver.fit(state).score
        assert losses[group] == pytest.approx(changed, abs=1e-3)


def test_links_of_zero_width_leave_the_base_parameters_at_the_simulation(bench: Workbench) -> None:
    solver = solved(bench)
    fit = solver.fit(State((), (0.0, 0.0, 0.0)))
    assert not fit.coefficients.any()


def test_widths_are_the_relative_size_of_a_link_that_is_scaled() -> None:
    arm = cases.load_arm("irb120-arm")
    prior = link_prior(arm, base_parameters(arm), arm.parameters)
    scaled = 0.1 * arm.parameters[10:20]
    distance = scaled @ np.linalg.inv(prior.covariances[1]) @ scaled
    assert np.sqrt(distance / 4) == pytest.approx(0.1, rel=0.05)  # trace of the unit matrix of a pseudo-inertia


def test_parts_are_the_long_stretches_where_a_joint_moves() -> None:
    moving = np.ones(200, dtype=bool)
    moving[90:95] = moving[120] = False
    found = parts(Segment(0, "identify", 10, 190), moving)
    assert [(each.start, each.stop) for each in found] == [(10, 90), (121, 190)]


def test_a_surrogate_finds_structure_of_other_joints_and_none_in_noise(observed: Observed) -> None:
    rng = np.random.default_rng(1)
    made = features(observed, 0, rng)
    noise_only = 0.05 * rng.standard_normal((observed.rows, 3))
    noise = noise_of(noise_only, observed, 0.0)
    wave = np.sin(3 * observed.kept("position")[:, 2]) * 0.2
    found = structure(noise_only[:, 0] + wave, 0, made, noise, observed)
    assert found.gain > 0.5
    assert "position_3" in found.depends_on
    assert structure(noise_only[:, 0], 0, made, noise, observed).gain < 0.05


def test_a_small_family_finds_what_drowns_among_all_features(observed: Observed) -> None:
    """A torque constant that falls with speed, on one joint that carries another's load."""
    rng = np.random.default_rng(2)
    left = 0.05 * rng.standard_normal(observed.rows)
    noise = noise_of(np.column_stack([left] * 3), observed, 0.0)
    load = np.sin(2 * observed.kept("position")[:, 2]) + observed.kept("acceleration")[:, 1] / 10
    weak = 0.02 * load * observed.kept("velocity")[:, 1] ** 2
    found = [structure(left + weak, 1, each, noise, observed) for each in families(observed, 1, load)]
    best = max(found, key=lambda each: each.gain)
    assert best.gain > 0.2
    assert best.p_value < 0.05
    assert set(best.depends_on) <= {"torque_2", "velocity_2"}
    chance = [structure(left, 1, each, noise, observed) for each in families(observed, 1, load)]
    assert min(each.p_value for each in chance) * len(chance) > 0.1


def test_a_gain_in_few_stretches_is_sure_but_in_one_alone_is_not() -> None:
    rng = np.random.default_rng(3)
    blocks = np.repeat(np.arange(40), 50)
    noise = rng.standard_normal(len(blocks))
    few = np.where(blocks % 10 == 0, 1.0, 0.0)
    once = np.where(blocks == 7, 1.0, 0.0)
    assert gain_of(noise + few, noise, blocks).chance < 0.01
    assert gain_of(noise + once, noise, blocks).chance > 0.01
    assert gain_of(noise, noise + 0.1 * few, blocks).chance > 0.5
    assert gain_of(noise + 0.3, noise, blocks).p_value < 1e-6
