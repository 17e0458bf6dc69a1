"""Plain least squares beside the model that predicts: delivered where it predicts the runs that identify better."""

from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest

from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.predict.prediction import filtered_residual
from armlab.diagnosis.torque.predict.yardstick import (
    Yardstick,
    fit_yardstick,
    predicts_better,
    squared_errors,
    with_claims,
)
from armlab.diagnosis.torque.rows.data import identification_runs, in_fixed_order, observe
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.recordings.plain_least_squares import PlainLayout, PlainModel
from armlab.recordings.recording import Recording, Run
from problem.arm import Arm
from problem.motion import Motion
from problem.robot_file import load_arm


def friction() -> Recording:
    """Friction that plain least squares can hold."""
    return cases.recording(lambda motion, time: 2.0 * np.sign(motion.velocity) + 3.0 * motion.velocity)


@pytest.fixture(scope="module")
def yardstick() -> Yardstick:
    found = fit_yardstick(recording.arm, observed)
    assert found is not None
    return found


recording = friction()
simulation = read_simulation(recording, None)
observed = observe(in_fixed_order(recording.runs), simulation.arm, simulation.inertial, Settings())


def test_the_model_that_goes_to_files_predicts_as_plain_least_squares_does(yardstick: Yardstick) -> None:
    model = yardstick.as_torque_model(identification_runs(observed))
    own, written = yardstick.residual(observed), filtered_residual(model, observed)
    rms = np.sqrt(np.mean(own**2, axis=0))
    np.testing.assert_allclose(np.sqrt(np.mean(written**2, axis=0)), rms, rtol=0.02)
    assert {part.effect for part in model.structure.components} >= {"coulomb_friction", "viscous_friction"}


def turned(arm: Arm, angle: float) -> Arm:
    """Each joint turned a little, as rounded angles of a robot file do: columns are nearly dependent then."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[1, 0, 0, 0], [0, cosine, -sine, 0], [0, sine, cosine, 0], [0, 0, 0, 1]])
    return replace(arm, joints=tuple(replace(each, before=each.before @ turn) for each in arm.joints))


@pytest.mark.parametrize("angle", [0.0, 1e-6, 1e-5])
@pytest.mark.parametrize("robot", ["irb120-arm", "kuka-kr300", "staubli-tx40"])
def test_the_model_that_goes_to_files_has_the_torque_of_any_plain_model(robot: str, angle: float) -> None:
    arm = turned(load_arm(robot), angle)
    time = np.arange(0, 8, 0.01)
    waves = np.random.default_rng(0).uniform(0.2, 1.0, (3, len(arm)))
    position = sum(wave * np.sin(wave * (number + 1) * time[:, None] + number) for number, wave in enumerate(waves))
    runs = [Run("run.csv", "identify", time, np.asarray(position), np.asarray(position) ** 2)]
    layout = PlainLayout(arm, tuple(range(len(arm))), np.ones(len(arm)))
    values = np.random.default_rng(1).uniform(0.1, 1.0, len(layout.names))
    model = Yardstick(PlainModel(layout, 5.0, values), 5.0).as_torque_model(runs)
    states = Motion(*np.random.default_rng(2).uniform(-1, 1, (3, 50, len(arm))))
    expected = layout.matrix(states) @ values
    np.testing.assert_allclose(model.torque(states), expected, atol=1e-6 * np.abs(expected).max())


def test_components_that_no_finding_names_are_not_claimed(yardstick: Yardstick) -> None:
    model = with_claims(yardstick.as_torque_model(identification_runs(observed)), [("coulomb_friction", 2)])
    claimed = [part for at, part in enumerate(model.structure.components) if at not in model.unclaimed]
    assert [(part.effect, part.joint) for part in claimed] == [("coulomb_friction", 2)]


def test_blocks_that_are_left_out_cost_a_little_more_than_those_that_are_fitted(yardstick: Yardstick) -> None:
    block = np.arange(observed.rows) * 6 // observed.rows
    squares = squared_errors(yardstick, observed, block)
    held_out = np.sqrt(squares / np.sum(observed.torque**2, axis=0))
    fitted = np.sqrt(np.mean(yardstick.residual(observed) ** 2, axis=0) / np.mean(observed.torque**2, axis=0))
    assert np.all(held_out < 3 * fitted)
    assert np.all(held_out > 0.2 * fitted)


def test_a_model_wins_by_more_than_a_small_share_in_the_mean_of_the_joints() -> None:
    equal = np.array([0.2, 0.4])
    assert not predicts_better(0.99**2 * equal, equal, 0.02)
    assert predicts_better(0.9**2 * equal, equal, 0.02)
    assert not predicts_better(equal * np.array([0.5, 2.1]), equal, 0.02)


def test_runs_that_are_too_short_have_no_yardstick() -> None:
    short = [replace(run.rows(slice(None, 12)), role="identify") for run in recording.runs[:1]]
    few = observe(short, simulation.arm, simulation.inertial, Settings())
    assert fit_yardstick(recording.arm, few) is None
