"""The model that predicts: parts without a claim, whitening that must not cost predictions, and smoothing."""

from dataclasses import replace
from pathlib import Path

import engine_cases as cases
import numpy as np
import pytest
from small_recordings import frame, recording_in

from armlab.common.arrays import Array
from armlab.diagnosis.formats import VerdictFile
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Guards, Settings
from armlab.diagnosis.torque.columns.columns import Group
from armlab.diagnosis.torque.columns.solver import ROUNDING
from armlab.diagnosis.torque.diagnose import diagnose, prepare
from armlab.diagnosis.torque.predict.found_model import model_found, named_model
from armlab.diagnosis.torque.predict.prediction import (
    _may_help,
    choose_smoothing,
    filtered_residual,
    fit_prediction,
    recorded_residual,
)
from armlab.diagnosis.torque.predict.yardstick import fit_yardstick
from armlab.diagnosis.torque.rows.data import identification_runs
from armlab.diagnosis.torque.rows.noise import Noise, choose_noise
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
    fit_background,
    fit_coloured_noise,
    whitening_losses,
)
from armlab.effects.friction import PowerFriction
from armlab.effects.library import library
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from armlab.report.verdict_files import make_verdict
from problem.motion import Motion


def friction_and_trifle(motion: Motion, time: Array) -> Array:
    """Friction of joint 2 that nobody can miss, and a hardly visible one of joint 3."""
    out = np.zeros(motion.position.shape)
    out[:, 1] = 3.0 * motion.velocity[:, 1] + 2.0 * np.sign(motion.velocity[:, 1])
    out[:, 2] = 0.001 * motion.velocity[:, 2]
    return out


def coloured_noise(motion: Motion, time: Array) -> Array:
    """Errors of all joints that are tied over some tenths of a second."""
    rng = np.random.default_rng(len(time) + int(1e6 * abs(motion.position[0, 0])))
    out = np.zeros(motion.position.shape)
    for row in range(1, len(out)):
        out[row] = 0.97 * out[row - 1] + 0.05 * rng.standard_normal(out.shape[1])
    return out


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose(cases.recording(friction_and_trifle))


def test_what_is_not_sure_is_present_without_a_claim(found: Diagnosis) -> None:
    model = model_found(found)
    claimed = {(each.effect, each.joint) for each in found.claims}
    parts = {(each.effect, each.joint): index for index, each in enumerate(model.structure.components)}
    assert ("viscous_friction", 2) in claimed
    assert ("viscous_friction", 3) not in claimed
    assert all((parts[place] in model.unclaimed) == (place not in claimed) for place in parts)
    assert {("viscous_friction", 3), ("torque_offset", 1)} <= set(parts)


def test_no_law_that_outgrows_the_speed_is_present_without_a_claim() -> None:
    """Its size at the speeds of the recording says nothing of faster motions."""
    for exponent, helps in ((0.5, True), (1.0, True), (3.0, False)):
        law = PowerFriction(2, (2,), (1,), shape=(exponent,))
        assert _may_help(law) == helps


def test_the_named_model_has_the_claims_and_nothing_else(found: Diagnosis) -> None:
    alone = named_model(found)
    assert {(each.effect, each.joint) for each in alone.structure.components} == {
        (each.effect, each.joint) for each in found.claims
    }
    assert not alone.unclaimed


def test_held_out_errors_are_those_of_the_written_models(found: Diagnosis) -> None:
    observed = found.observed
    assert observed is not None
    for index, each in enumerate(found.fit):
        rows = np.concatenate([np.arange(part.start, part.stop) for part in observed.of_role("validate", index)])
        for errors, residual in ((each.filtered, filtered_residual), (each.recorded, recorded_residual)):
            for value, model in ((errors.after, model_found(found)), (errors.named, named_model(found))):
                left = residual(model, observed)[rows, index]
                assert value == pytest.approx(float(np.sqrt(np.mean(left**2))))
        assert each.recorded.after > 0.8 * cases.NOISE > each.filtered.after
    verdict = VerdictFile.model_validate_json(make_verdict(found).to_json())
    assert verdict.fit[1].heldout_rms_named == found.fit[1].filtered.named
    assert verdict.fit[1].recorded is not None
    assert verdict.fit[1].recorded.heldout_rms_identify == found.fit[1].recorded.identified


def test_the_model_is_no_worse_than_a_plain_identification(found: Diagnosis) -> None:
    assert all(each.filtered.after <= 1.05 * each.filtered.identified for each in found.fit)


def test_the_runs_that_identify_are_cut_to_their_kept_rows(found: Diagnosis) -> None:
    assert found.observed is not None
    runs = identification_runs(found.observed)
    assert [each.name for each in runs] == ["run-0.csv", "run-1.csv"]
    assert all(0 < each.time[0] < 1 and each.role == "identify" for each in runs)


def test_a_law_of_unknown_size_is_held_to_the_torque_of_its_joint() -> None:
    model = first_model(cases.recording(friction_and_trifle))
    torque = np.sqrt(np.mean(model.design.observed.torque**2, axis=0))
    moments, held = model.design.solver(model.noise, as_large_as_torque=True)
    levels = [(each, block) for each, block in zip(held.groups, model.design.blocks, strict=True) if is_coulomb(each)]
    assert len(levels) == 3
    for group, block in levels:
        (column,), joint = group.columns, group.candidate.rows[0]
        prior = held.precisions[column] - model.solver.precisions[column]
        scale = torque[joint] / np.sqrt(np.mean(block.values**2))
        assert prior == pytest.approx((scale * moments.lengths[column]) ** -2, rel=1e-6)


def is_coulomb(group: Group) -> bool:
    return group.candidate.effect == "coulomb_friction"


def test_an_offset_is_thought_to_be_as_large_as_beside_the_friction_of_real_joints() -> None:
    model = first_model(cases.recording(friction_and_trifle))
    friction = friction_and_trifle(model.design.scenes[0].motion, np.empty(0))
    moments, solver = model.moments, model.solver
    for group in (each for each in solver.groups if each.candidate.effect == "torque_offset"):
        (column,), joint = group.columns, group.candidate.rows[0]
        torque = np.sqrt(np.mean(model.design.observed.torque[:, joint] ** 2))
        scale = np.hypot(0.3 * np.sqrt(np.mean(friction[:, joint] ** 2)), 0.01 * torque)
        prior = (solver.precisions[column] - ROUNDING) ** -0.5 / moments.lengths[column]
        assert prior == pytest.approx(scale, rel=0.1)


def test_positions_are_smoothed_as_predicts_best(found: Diagnosis) -> None:
    observed, model = found.observed, model_found(found)
    assert observed is not None
    rows = observed.of_role("identify")

    def error(factor: float) -> float:
        left = recorded_residual(replace(model, position_factor=factor), observed)
        return float(sum(np.sum(left[each.start : each.stop] ** 2) for each in rows))

    plain = fit_yardstick(found.recording.arm, observed)
    chosen = choose_smoothing(replace(model, position_factor=50.0), plain, observed)
    assert chosen.position_factor != 50.0
    assert error(chosen.position_factor) <= min(error(factor * chosen.position_factor) for factor in (0.1, 10.0))


def test_refitted_links_stay_near_a_robot_file_that_holds_where_that_predicts_better(tmp_path: Path) -> None:
    model = first_model(load_recording(recording_in(tmp_path, frame(0, 2.5), frame(1, 2.5))), baseline="refit")
    assert model.state.widths is None
    usual = model.design.settings.tuning
    near = fit_prediction(model)
    free = replace(model.design.settings, tuning=replace(usual, prediction=replace(usual.prediction, link_widths=())))
    alone = fit_prediction(replace(model, design=replace(model.design, settings=free)))
    assert near.model.state.widths == 3 * (near.model.state.widths or (0.0,))[:1]
    assert (near.model.state.widths or (0.0,))[0] in usual.prediction.link_widths
    assert near.held_out < alone.held_out


def first_model(recording: Recording, guards: Guards | None = None, baseline: Baseline | None = None) -> FittedModel:
    """Links and usual friction fitted to a recording."""
    design = prepare(recording, baseline, Settings(guards or Guards()), lambda message: None)
    assert not isinstance(design, Diagnosis)
    usual = [family for family in library() if family.facts.usual]
    return fit_background(design, usual, 0, lambda message: None)


def test_coloured_noise_is_whitened() -> None:
    noisy = cases.recording(coloured_noise, seconds=10.0)
    assert all(len(taps) > 1 for taps in fit_coloured_noise(first_model(noisy)).taps)
    off = fit_coloured_noise(first_model(noisy, replace(Guards(), prewhitening=False)))
    assert all(len(taps) == 1 for taps in off.taps)


def test_whitening_that_neglects_the_frequencies_of_the_motion_costs_predictions() -> None:
    model = first_model(cases.recording(friction_and_trifle))
    tuning, rows = model.design.settings.tuning.noise, np.ones(model.design.observed.rows)
    white = Noise((np.ones(1),) * 3, (cases.NOISE,) * 3, (rows,) * 3, (False,) * 3)
    slow = Noise((np.array([1.0, -0.99]),) * 3, (cases.NOISE,) * 3, (rows,) * 3, (False,) * 3)
    assert np.all(whitening_losses(model, white, white) == 0)
    assert np.all(whitening_losses(model, slow, white) > tuning.max_prediction_loss)
    chosen = choose_noise(slow, white, np.array([True, False, True]))
    assert [len(taps) for taps in chosen.taps] == [1, 2, 1]
