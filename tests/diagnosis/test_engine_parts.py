"""The parts of the engine: whitening, fits of subsets, robust covariance, links' widths, surrogates."""

from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest
from scipy.signal import lfilter

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.diagnosis.settings import Settings, vary
from armlab.diagnosis.torque.columns.blocks import WhitenedRows, block_covariance, held_out_gain, variance_inflation
from armlab.diagnosis.torque.columns.design import DesignMatrix, build_design_matrix
from armlab.diagnosis.torque.columns.links import link_prior
from armlab.diagnosis.torque.columns.solver import Solver, State
from armlab.diagnosis.torque.evidence.unknown import FitOfAll, is_structured, predict_residual_structure
from armlab.diagnosis.torque.rows.data import Observed, Segment, observe, split_segment
from armlab.diagnosis.torque.rows.features import (
    Features,
    Load,
    flexible_features,
    load_banks,
    motion_banks,
    whole_runs,
)
from armlab.diagnosis.torque.rows.noise import Noise, error_colours, fit_noise
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background
from armlab.diagnosis.torque.search.surrogate import Remainder, Structure, fit_surrogate
from armlab.diagnosis.tuning import Tuning
from armlab.effects.library import library
from armlab.recordings.recording import ROLES
from problem.base_parameters import base_parameters
from problem.motion import Motion

TUNING = Tuning()


@pytest.fixture(scope="module")
def design() -> DesignMatrix:
    recording = cases.recording(seconds=6.0)
    simulation = read_simulation(recording, None)
    observed = observe(recording.runs, simulation.arm, simulation.inertial, Settings())
    base = base_parameters(simulation.arm)
    prior = link_prior(simulation.arm, base, recording.arm.parameters)
    plain = build_design_matrix(observed, simulation, base, prior, Settings())
    return plain.with_candidates([family for family in library() if family.facts.usual])


@pytest.fixture(scope="module")
def observed(design: DesignMatrix) -> Observed:
    return design.observed


def solved(design: DesignMatrix) -> Solver:
    columns = design.columns
    return design.solver(fit_noise(columns.target, design.observed, 0.0, TUNING.noise))[1]


def test_whitened_autoregressive_noise_is_white_with_unit_variance(observed: Observed) -> None:
    coloured = lfilter([0.3], [1, -0.9], np.random.default_rng(0).standard_normal((observed.rows, 3)), axis=0)
    noise = fit_noise(coloured, observed, 0.0, TUNING.noise)
    white = noise.whitened(coloured[:, :1], 0, observed.used(0))[:, 0]
    assert np.var(white) == pytest.approx(1, abs=0.05)
    assert abs(np.mean(white[1:] * white[:-1])) < 0.06


def test_the_colour_of_errors_is_what_their_past_tells_of_them(observed: Observed) -> None:
    white = np.random.default_rng(0).standard_normal((observed.rows, 3))
    coloured = lfilter([0.3], [1, -0.9], white, axis=0)
    assert error_colours(white, observed, TUNING.noise) == pytest.approx(0, abs=0.02)
    assert error_colours(7 * coloured, observed, TUNING.noise) == pytest.approx(-0.5 * np.log(1 - 0.9**2), abs=0.1)


def test_coloured_noise_is_whitened_through_rest_and_counts_less_where_it_is_larger(observed: Observed) -> None:
    coloured = lfilter([0.3], [1, -0.9], np.random.default_rng(0).standard_normal((observed.rows, 3)), axis=0)
    assert observed.at_rest("identify", 0).size > 100
    noise = fit_noise(coloured, observed, 0.0, TUNING.noise)
    white = noise.white(coloured[:, :1], 0, observed, "identify")[:, 0]
    rows = sum(each.stop - each.start - noise.lost(0) for each in observed.of_role("identify"))
    assert (len(white), noise.through) == (rows, (True,) * 3)
    assert np.var(white) == pytest.approx(1, abs=0.1)
    rest = observed.stretches_at_rest(0, observed.segments[0])[-1]
    shaken = np.zeros(coloured.shape)
    shaken[rest.start : rest.stop] = np.random.default_rng(1).standard_normal((rest.stop - rest.start, 3))
    doubted = fit_noise(coloured + 0.6 * shaken, observed, 0.0, TUNING.noise)
    assert doubted.through == (True,) * 3
    assert doubted.numbers(np.arange(observed.rows), 0, observed, "identify")[0] == noise.lost(0)
    assert doubted.resting[0][rest.start] > 1.3 * noise.resting[0][rest.start]
    assert not fit_noise(coloured + 30 * shaken, observed, 0.0, TUNING.noise).through[0]


def test_rows_at_rest_count_nothing_in_motion(observed: Observed) -> None:
    coloured = lfilter([0.3], [1, -0.9], np.random.default_rng(0).standard_normal((observed.rows, 3)), axis=0)
    for noise in (fit_noise(coloured, observed, 0.0, TUNING.noise, colour) for colour in (True, False)):
        white = noise.in_motion(observed).white(np.ones((observed.rows, 1)), 0, observed, "identify")[:, 0]
        numbers = noise.numbers(np.arange(observed.rows), 0, observed, "identify")
        assert not white[np.isin(numbers, observed.at_rest("identify", 0))].any()
        assert np.mean(white != 0) > 0.4


def test_a_fit_from_moments_is_the_least_squares_fit_of_the_whitened_rows(design: DesignMatrix) -> None:
    solver = solved(design)
    columns = design.columns
    noise = fit_noise(columns.target, design.observed, 0.0, TUNING.noise)
    state = State((0, 4, 8), (0.0, 0.0, 0.0))
    fit = solver.fit(state)
    rows, targets = [], []
    for joint, index in enumerate(columns.index):
        white = noise.white(columns.matrix(joint), joint, design.observed, "identify")
        own = np.zeros((len(white), len(fit.columns)))
        for place, column in enumerate(fit.columns):
            found = np.flatnonzero(index == column)
            if len(found):
                own[:, place] = white[:, found[0]]
        rows.append(own)
        targets.append(white[:, -1])
    direct = np.linalg.lstsq(np.vstack(rows), np.concatenate(targets))[0]
    assert fit.coefficients[fit.columns] / solver.moments.lengths[fit.columns] == pytest.approx(direct, rel=1e-5)


def test_the_gain_of_a_group_is_what_adding_it_raises_the_score_by(design: DesignMatrix) -> None:
    solver, state = solved(design), State((1,), (0.05, 0.05, 0.05))
    gains = solver.gains(state)
    for group in (0, 5, 7):
        raised = solver.fit(state.plus(group)).score - solver.fit(state).score
        assert gains[group] == pytest.approx(raised, abs=1e-3)


def test_the_loss_of_a_group_is_what_taking_it_out_changes_the_score_by(design: DesignMatrix) -> None:
    solver, state = solved(design), State((0, 1, 5), (0.05, 0.05, 0.05))
    losses = solver.losses(solver.fit(state))
    for group in state.groups:
        changed = solver.fit(state.minus(group)).score - solver.fit(state).score
        assert losses[group] == pytest.approx(changed, abs=1e-3)


def test_links_of_zero_width_leave_the_base_parameters_at_the_simulation(design: DesignMatrix) -> None:
    solver = solved(design)
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
    found = split_segment(Segment(0, "identify", 10, 190), moving, TUNING.data.min_segment_rows)
    assert [(each.start, each.stop) for each in found] == [(10, 90), (121, 190)]


def filtered(values: Array, observed: Observed) -> Array:
    """A signal of all samples (samples,) through the filter of the torque, (rows,)."""
    return whole_runs(observed).filtered(values[:, None])[:, 0]


def structure_of(left: Array, joint: int, made: Features, noise: Noise, observed: Observed) -> Structure:
    """What features predict of a signal (rows,) that no model has been fitted to. joint: from 0."""
    remainder = Remainder(left, made)
    surrogate = fit_surrogate(remainder, remainder, joint, noise, observed, TUNING.surrogate)
    return surrogate.structure(observed, TUNING.surrogate)


def test_a_surrogate_finds_structure_of_other_joints_and_none_in_noise(observed: Observed) -> None:
    rng = np.random.default_rng(1)
    made = flexible_features(observed, 0, rng, TUNING.surrogate)
    noise_only = 0.05 * rng.standard_normal((observed.rows, 3))
    noise = fit_noise(noise_only, observed, 0.0, TUNING.noise)
    wave = np.sin(3 * observed.kept("position")[:, 2]) * 0.2
    found = structure_of(noise_only[:, 0] + wave, 0, made, noise, observed)
    assert found.gain > 0.5
    assert "position_3" in found.depends_on
    assert structure_of(noise_only[:, 0], 0, made, noise, observed).gain < 0.05


def test_features_do_not_tell_what_rounding_makes_of_a_joint_that_stands(observed: Observed) -> None:
    def with_rounding(seed: int) -> Observed:
        rng, signals = np.random.default_rng(seed), []
        for each in observed.signals:
            position, velocity, acceleration = (part.copy() for part in vars(each.motion).values())
            position[:, 2] = 0.7 + 1e-15 * rng.normal(size=len(position))
            velocity[:, 2], acceleration[:, 2] = 0.0, 1e-11 * rng.normal(size=len(position))
            signals.append(replace(each, motion=Motion(position, velocity, acceleration)))
        return replace(observed, signals=tuple(signals))

    one, other = (
        flexible_features(with_rounding(seed), 0, np.random.default_rng(1), TUNING.surrogate).values for seed in (2, 3)
    )
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_small_family_finds_what_drowns_among_all_features(observed: Observed) -> None:
    """A torque constant that falls with speed, on one joint that carries another's load."""
    rng = np.random.default_rng(2)
    left = 0.05 * rng.standard_normal(observed.rows)
    noise = fit_noise(np.column_stack([left] * 3), observed, 0.0, TUNING.noise)
    motions = [each.motion for each in observed.signals]
    torque = np.concatenate([np.sin(2 * each.position[:, [2]]) + each.acceleration[:, [1]] / 10 for each in motions])
    load = Load(np.tile(torque, 3), np.tile(torque, 3))
    weak = 0.02 * torque[:, 0] * np.concatenate([each.velocity[:, 1] for each in motions]) ** 2
    banks = [*motion_banks(observed, TUNING.surrogate)[1], *load_banks(observed, 1, load, TUNING.surrogate)]
    found = [structure_of(left + filtered(weak, observed), 1, each, noise, observed) for each in banks]
    best = max(found, key=lambda each: each.gain)
    assert best.gain > 0.2
    assert best.p_value < 0.05
    assert set(best.depends_on) <= {"torque_2", "velocity_2"}
    chance = [structure_of(left, 1, each, noise, observed) for each in banks]
    assert min(each.p_value for each in chance) * len(chance) > 0.1


def test_hysteresis_of_another_joint_is_found_at_any_speed(observed: Observed) -> None:
    left = 0.05 * np.random.default_rng(4).standard_normal(observed.rows)
    noise = fit_noise(np.column_stack([left] * 3), observed, 0.0, TUNING.noise)
    hose = filtered(
        np.concatenate([dahl_state(each.motion.position[:, 2], 0.2) for each in observed.signals]), observed
    )
    banks = motion_banks(observed, TUNING.surrogate)[0]
    found = [structure_of(left + 0.05 * hose, 0, each, noise, observed) for each in banks]
    best = min(found, key=lambda each: each.p_value)
    assert best.depends_on == ("velocity_3",)
    assert best.gain > 0.3


def test_what_jumps_with_the_load_passes_the_filter_of_the_torque(observed: Observed) -> None:
    """A dead zone of the current that is smaller than the load: a sign of the load, rounded by the filter."""
    torque = np.concatenate([np.sin(9 * each.motion.position[:, [2]]) for each in observed.signals])
    load = Load(np.tile(torque, 3), np.zeros((len(torque), 3)))
    jumps = filtered(np.sign(torque[:, 0]), observed)
    about_zero = load_banks(observed, 1, load, TUNING.surrogate)[1].values
    left = jumps - about_zero @ np.linalg.lstsq(about_zero, jumps, rcond=None)[0]
    assert np.var(left) < 0.01 * np.var(jumps)


def test_what_swings_is_driven_by_the_bodies_and_not_by_friction(observed: Observed) -> None:
    speeds = np.concatenate([each.motion.velocity for each in observed.signals])
    bodies = np.concatenate([np.sin(2 * each.motion.position) for each in observed.signals])
    with_friction, without = (
        load_banks(observed, 1, Load(bodies + 3 * jumps, bodies), TUNING.surrogate) for jumps in (np.sign(speeds), 0)
    )
    np.testing.assert_array_equal(with_friction[2].values, without[2].values)
    assert not np.array_equal(with_friction[1].values, without[1].values)


def test_noise_of_the_encoder_is_no_spring_that_the_bodies_drive() -> None:
    """The noise of an acceleration is in the torque of the bodies and, with the other sign, in what is left."""
    rng, quiet = np.random.default_rng(0), cases.recording()
    runs = tuple(
        replace(each, position=each.position + 3e-4 * rng.standard_normal(each.position.shape)) for each in quiet.runs
    )
    recording = replace(quiet, runs=runs)
    simulation = read_simulation(recording, None)
    observed = observe(runs, simulation.arm, simulation.inertial, Settings())
    base = base_parameters(simulation.arm)
    prior = link_prior(simulation.arm, base, recording.arm.parameters)
    plain = build_design_matrix(observed, simulation, base, prior, Settings())
    model = fit_background(plain, library(), 0, lambda _: None)
    assert not any(is_structured(each, TUNING) for each in predict_residual_structure(model, model.noise))


def test_a_recording_of_which_too_little_motion_is_held_out_is_too_short(observed: Observed) -> None:
    """The runs that identify are long enough by themselves."""
    identify, validate = (
        max(each.stop - each.start for joint in range(3) for each in observed.of_role(role, joint)) for role in ROLES
    )
    least = min(identify, validate) + 1
    for role, other in (("identify", "validate"), ("validate", "identify")):
        segments = [
            replace(each, stop=min(each.stop, each.start + least - 1)) if each.role == role else each
            for each in observed.segments
        ]
        moving = np.ones_like(observed.moving)
        short = replace(observed, segments=tuple(segments), moving=moving, min_segment_rows=least)
        assert not short.of_role(role, 0)
        assert short.of_role(other, 0)
        reason = short.reason_too_short(cases.recording(seconds=6.0).arm)
        assert reason is not None
        assert "record longer runs" in reason


def test_features_of_a_joint_that_carries_nothing_find_nothing(observed: Observed) -> None:
    rng = np.random.default_rng(3)
    left = 0.05 * rng.standard_normal((observed.rows, 3))
    noise, samples = fit_noise(left, observed, 0.0, TUNING.noise), sum(each.run.samples for each in observed.signals)
    banks = load_banks(observed, 1, Load(np.zeros((samples, 3)), np.zeros((samples, 3))), TUNING.surrogate)
    assert [structure_of(left[:, 1], 1, each, noise, observed).gain for each in banks] == [0, 0, 0]


def test_a_law_that_columns_share_with_it_is_found_beside_them(design: DesignMatrix) -> None:
    """Friction columns take a part of a cube of the velocity; what is left resembles the rest of the cube."""
    observed = design.observed
    rng = np.random.default_rng(5)
    cube = filtered(np.concatenate([each.motion.velocity[:, 0] ** 3 for each in observed.signals]), observed)
    torque = np.zeros((observed.rows, 3))
    torque[:, 0] = 0.3 * cube
    noisy = replace(design, target=torque + 0.02 * rng.standard_normal(torque.shape))
    noise = fit_noise(noisy.target - torque, observed, 0.0, TUNING.noise)
    moments, solver = noisy.solver(noise)
    model = FittedModel(noisy, noise, moments, solver, State(tuple(range(len(solver.groups))), (0.0, 0.0, 0.0)))
    residual = model.residual_at(0, model.fit)
    assert np.var(residual) < 0.5 * np.var(torque[:, 0])
    whole = FitOfAll.of(model, 0)
    held = whole.white[ROLES.index("validate")]
    np.testing.assert_allclose(
        whole.inverse @ (np.linalg.inv(model.fit.inverse) + held.T @ held), np.eye(len(held.T)), atol=1e-6
    )
    beside = whole.remainder(Features(cube[:, None], (frozenset({"velocity_1"}),)))
    alone = np.corrcoef(residual, cube)[0, 1]
    assert np.corrcoef(beside.residual, beside.features.values[:, 0])[0, 1] > 2 * alone


def test_a_gain_in_few_stretches_is_sure_but_in_one_alone_is_not() -> None:
    rng = np.random.default_rng(3)
    blocks = np.repeat(np.arange(40), 50)
    noise = rng.standard_normal(len(blocks))
    few = np.where(blocks % 10 == 0, 1.0, 0.0)
    once = np.where(blocks == 7, 1.0, 0.0)
    assert held_out_gain(noise + few, noise, blocks).chance < 0.01
    assert held_out_gain(noise + once, noise, blocks).chance > 0.01
    assert held_out_gain(noise, noise + 0.1 * few, blocks).chance > 0.5
    assert held_out_gain(noise + 0.3, noise, blocks).p_value < 1e-6


def test_correlated_errors_widen_what_happens_once_as_they_do_on_the_average() -> None:
    rng, rows = np.random.default_rng(0), np.arange(4000)
    shape = np.where((rows > 2000) & (rows < 2200), 1.0, 0.0)
    white = rng.standard_normal((400, len(rows)))
    slow = lfilter([1.0], [1.0, -0.9], white)
    scatter = np.var(slow @ shape) / (np.var(slow) * float(shape @ shape))
    found = [variance_inflation(shape, each) for each in slow]
    assert np.mean(found) == pytest.approx(scatter, rel=0.15)
    assert np.mean([variance_inflation(shape, each) for each in white]) < 1.3


def test_a_direction_that_the_prior_alone_holds_hides_no_other() -> None:
    rng = np.random.default_rng(0)
    forward = (rng.standard_normal(3000) > 0).astype(float)
    speed = 100 * rng.standard_normal(3000)
    blocks = np.arange(3000) // 100
    noise = rng.standard_normal(3000) + 30 * rng.standard_normal(30)[blocks]
    both, apart = np.column_stack([forward, 1 - forward]), (2 * forward - 1)[:, None]
    weights = rng.uniform(0.5, 1.5, (3000, 1))
    designs = [weights * np.column_stack([speed, np.ones(3000), part]) for part in (both, apart)]
    chances = []
    for design in designs:
        errors = noise - design @ np.linalg.lstsq(design, noise, rcond=None)[0]
        precision = 3e-12 * float(speed @ speed) * np.eye(design.shape[1])
        rows = WhitenedRows((design,), (errors,), (blocks,))
        covariance = block_covariance(rows, rows.gram(), precision, robust=True)
        values = np.array([3.0, -3.0]) if design.shape[1] == 4 else np.array([3.0])
        chances.append(covariance.p_value(values, list(range(2, design.shape[1])), 1e5))
    assert np.log(chances[0]) == pytest.approx(np.log(chances[1]), rel=0.25)
    assert chances[0] < 1e-3


def test_a_second_look_adds_what_a_scan_finds_then_and_leaves_what_was_there(design: DesignMatrix) -> None:
    families = [family for family in library() if family.effect in ("external_contact", "viscous_friction")]
    quiet = [np.zeros(each.run.position.shape) for each in design.observed.signals]
    first = design.with_candidates(families, quiet)
    assert first.scanned_again(lambda effect: quiet).blocks == first.blocks
    pushed = [each.copy() for each in quiet]
    pushed[0][200:300, 0] = 1.0
    again = first.scanned_again(lambda effect: pushed)
    assert again.blocks[: len(first.blocks)] == first.blocks
    more = [each.candidate for each in again.blocks[len(first.blocks) :]]
    assert {(each.effect, each.joint) for each in more} == {("external_contact", 1)}
    assert more[0].shape == pytest.approx((200 / cases.RATE_HZ, 300 / cases.RATE_HZ), abs=0.2)


def test_short_runs_are_cut_into_blocks_that_count() -> None:
    """Where no run that validates is long enough, no block is shorter than a stretch that counts."""
    recording = cases.recording(seconds=6.0)
    long = [replace(each, role="identify") for each in recording.runs[:1]]
    step = observe(long, recording.arm, recording.arm.parameters, Settings())
    rows = len(step.signals[0].torque)
    least = rows // 4
    few = vary(Settings(), "data.min_segment_rows", least)
    short = replace(recording.runs[1].rows(slice(None, 30)), role="validate")
    found = observe([*long, short], recording.arm, recording.arm.parameters, few)
    assert found.held_out_blocks
    assert [each.role for each in found.segments] == ["identify", "identify", "validate", "identify", "identify"]
    assert min(each.stop - each.start for each in found.segments[:4]) >= least
    lost = observe([short], recording.arm, recording.arm.parameters, few)
    assert "held out: record longer runs" in str(lost.reason_too_short(recording.arm))


def test_shorter_stretches_count_where_a_joint_has_no_others(observed: Observed) -> None:
    """The run that validates has less than a stretch of the usual length, and none can be cut into blocks."""
    recording = cases.recording(seconds=6.0)
    rows = max(each.stop - each.start for each in observed.of_role("validate"))
    usual = vary(Settings(), "data.min_segment_rows", int(1.5 * rows))
    runs = [recording.runs[0], replace(recording.runs[1], role="validate")]
    found = observe(runs, recording.arm, recording.arm.parameters, usual)
    assert found.min_segment_rows == int(1.5 * rows) // 2
    assert not found.held_out_blocks
    assert found.reason_too_short(recording.arm) is None
