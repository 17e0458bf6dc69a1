import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner
from simulated_arm import RATE_HZ, arm, run, structure, truth

from armlab.cli.identification import identify, predict
from armlab.cli.model import export_model
from armlab.cli.proof_real import coverage, real
from armlab.common.errors import InputError
from armlab.common.report.wording import format_number
from armlab.effects.parameters import ParameterValue
from armlab.identification.estimators.least_squares import EXCITED_TOLERANCE, WeightedLeastSquares
from armlab.identification.identifier import METHODS, Identifier
from armlab.identification.identifier_choice import choose_identifier
from armlab.identification.identify import impossible_warnings, overfit_warnings
from armlab.identification.model import Model
from armlab.identification.priors import NO_PULL
from armlab.identification.regression import Regression
from armlab.identification.torque_model import is_told
from armlab.identification.validation import JointError, RunError, filter_in_words
from armlab.recordings.cutoff_trial import choose_cutoff_hz
from armlab.recordings.recording import Run
from armlab.recordings.recording_file import Draft, DraftRun, write_recording

COLUMNS = {"time": "t", "position": ("q1", "q2", "q3"), "torque": ("tau1", "tau2", "tau3")}
NAMES = ("t", "q1", "q2", "q3", "tau1", "tau2", "tau3")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    model = structure()
    values = truth(model)
    runs = []
    for seed, role in ((0, "identify"), (1, "validate")):
        made = run(model, values, seed, noise=0.05, role=role)
        table = np.column_stack([made.time, made.position, made.torque])
        runs.append(DraftRun(f"run-{seed}.csv", made.role, NAMES, table))
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    return write_recording(Draft("irb120-arm", COLUMNS, units, tuple(runs)), tmp_path / "recording")


def invoke(command: object, *arguments: object) -> str:
    result = CliRunner().invoke(command, [str(each) for each in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_identify_tells_parameters_condition_number_and_errors_and_writes_model_and_page(
    recording: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    text = invoke(identify, recording, "--out", out)
    assert "viscous_friction, joint 1: coefficient = " in text
    assert "rotor_inertia, joint 1: no motion separates it from the links" in text
    assert "condition number" in text
    assert "run-1.csv             validate" in text
    model = Model.load(out / "model.yaml")
    assert model.provenance["runs"] == ("run-0.csv",)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "data:image/png" in page
    assert "viscous friction, joint 1: coefficient" in page
    assert '<td data-label="95 % interval">' in page


def test_predict_meets_the_recorded_torque_and_writes_what_it_predicts(recording: Path, tmp_path: Path) -> None:
    invoke(identify, recording, "--out", tmp_path / "out")
    text = invoke(predict, tmp_path / "out" / "model.yaml", recording, "--out", tmp_path / "torques")
    cutoff = format_number(Model.load(tmp_path / "out" / "model.yaml").cutoff_hz)
    assert text.startswith(f"errors of torque filtered below {cutoff} Hz:\n")
    assert re.search(r"run-1.csv: 0\.\d+ % in all, [\d.]+ % of torque as recorded", text)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"both filtered below {cutoff}\N{NO-BREAK SPACE}Hz" in page
    predicted = pd.read_csv(tmp_path / "torques" / "run-1.csv.predicted.csv")
    recorded = pd.read_csv(recording / "run-1.csv")
    inner = slice(int(RATE_HZ), -int(RATE_HZ))
    left = (predicted[["tau2"]] - recorded[["tau2"]]).to_numpy()[inner]
    assert np.std(left) < 0.5


def test_physical_links_go_all_the_way_to_a_simulator_file(recording: Path, tmp_path: Path) -> None:
    pytest.importorskip("clarabel")
    invoke(identify, recording, "--out", tmp_path / "out", "--method", "physical", "--tolerance", "0.5")
    text = invoke(export_model, tmp_path / "out" / "model.yaml", tmp_path / "arm.xml")
    assert "torque offset at joint 1 (0.4 N m); " in text
    assert "<mujoco" in (tmp_path / "arm.xml").read_text()


def test_a_tolerance_without_nominal_links_is_refused(recording: Path, tmp_path: Path) -> None:
    settings = yaml.safe_load((recording / "recording.yaml").read_text())
    robot = tmp_path / "recording" / "bare.yaml"
    rows = [{"name": f"j{i}", "type": "revolute", "a": 0.1, "d": 0.0, "alpha": 1.0} for i in range(len(arm()))]
    robot.write_text(yaml.safe_dump({"name": "bare", "dh_convention": "standard", "joints": rows}))
    (recording / "recording.yaml").write_text(yaml.safe_dump(settings | {"robot": "bare.yaml"}))
    with pytest.raises(InputError, match="--tolerance needs nominal `links`"):
        invoke(identify, recording, "--tolerance", "0.1")


def test_an_unknown_public_recording_names_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'unisa-ur10'"):
        invoke(real, "--only", "unisa-ur1", "--results", tmp_path, "--recordings", tmp_path)


def test_coverage_writes_what_it_measured(tmp_path: Path) -> None:
    (tmp_path / "coverage.json").write_text('{"superiority": {"kept": 1}}')
    text = invoke(coverage, "--experiments", 10, "--results", tmp_path, "--part", "identification")
    assert "in 10 experiments" in text
    found = json.loads((tmp_path / "coverage.json").read_text())
    assert found.keys() == {"seed", "coverage", "kinds", "superiority"}
    assert found["superiority"] == {"kept": 1}


def test_errors_say_which_torque_they_are_of() -> None:
    assert filter_in_words([]) == "as recorded"
    assert filter_in_words([8.0, 8.0]) == "filtered below 8 Hz"
    assert filter_in_words([8.0, 6.25]) == "filtered below 6.25 to 8 Hz"


def test_identify_says_which_cutoff_it_takes_and_takes_the_one_that_is_given(recording: Path, tmp_path: Path) -> None:
    text = invoke(identify, recording, "--out", tmp_path / "out")
    found = re.search(r"cut-off: ([\d.]+) Hz, which predicts best on blocks", text)
    assert found is not None
    assert f"errors of torque filtered below {format_number(float(found[1]))} Hz" in text
    given = invoke(identify, recording, "--cutoff-hz", 7.5, "--out", tmp_path / "given")
    assert "errors of torque filtered below 7.5 Hz" in given
    assert "cut-off: " not in given


def test_numbers_that_may_be_zero_are_listed_by_name_alone() -> None:
    told = ParameterValue("level", 2.0, (1.9, 2.1), "N.m")
    doubtful = ParameterValue("level", -3534.0, (-12360.0, 5290.0), "kg.m")
    assert (is_told(told), is_told(doubtful), is_told(replace(told, interval=None))) == (True, False, True)


def test_a_joint_that_leaves_twice_as_much_held_out_is_warned_of() -> None:
    def error(role: str, *percent: float) -> RunError:
        joints = tuple(JointError(number, 1.0, each, None) for number, each in enumerate(percent, 1))
        return RunError("run.csv", role, 1.0, 8.0, 1.0, joints)

    (line,) = overfit_warnings((error("identify", 15.0, 10.0), error("validate", 64.0, 19.0)))
    assert line.startswith("warning: joint 1 leaves 64 % of its torque held out and 15 % of what was fitted")


@pytest.mark.parametrize(("interval", "warned"), [((-0.1, -0.03), True), ((-0.1, 0.01), False)])
def test_a_rotor_inertia_below_zero_for_certain_is_warned_of(interval: tuple[float, float], warned: bool) -> None:
    number = ParameterValue("inertia", -0.07, interval, "kg.m2")
    part = SimpleNamespace(effect="rotor_inertia", label="rotor_inertia, joint 4")
    model = SimpleNamespace(structure=SimpleNamespace(components=(part,)), component_parameters=lambda _: (number,))
    assert any("cannot be below zero" in each for each in impossible_warnings(cast(Model, model))) == warned


def test_directions_that_the_motion_hardly_excites_stay_zero_and_keep_the_interval_of_a_fit() -> None:
    rng = np.random.default_rng(0)
    first = rng.standard_normal(400)
    matrix = np.column_stack([first, first + 1e-4 * rng.standard_normal(400)])
    data = Regression(matrix, 3.0 * first + 0.1 * rng.standard_normal(400), 1, (400,), 100.0, 0.1)
    free, excited = WeightedLeastSquares()(data), WeightedLeastSquares(tolerance=EXCITED_TOLERANCE)(data)
    assert np.abs(free.values).max() > 10
    np.testing.assert_allclose(excited.values, [1.5, 1.5], atol=0.05)
    np.testing.assert_allclose(excited.bread, free.bread, rtol=0.3)


def test_a_model_that_predicts_left_out_blocks_better_is_delivered_and_the_cost_of_consistency_is_told() -> None:
    model = structure()
    short = run(model, truth(model), 0, noise=3.0, seconds=1.5)
    choice = choose_identifier(arm(), [short], choose_cutoff_hz(arm(), [short]), "irb120-arm")
    assert "drawn to the links of the robot file" in choice.sentence
    assert re.search(r"a physically consistent model errs \d+ % more", choice.sentence)
    other = run(model, truth(model), 1, seconds=10.0)
    fitted = [each.fit([short]).model_ for each in (choice.identifier, Identifier(arm(), cutoff_hz=10.0))]
    assert total(fitted[0], other) < 0.5 * total(fitted[1], other)


def test_where_no_other_model_predicts_better_the_bodies_can_exist() -> None:
    pytest.importorskip("clarabel")
    model = structure()
    long = run(model, truth(model), 0, noise=0.05, seconds=20.0)
    choice = choose_identifier(arm(), [long], 10.0, "irb120-arm")
    assert choice.identifier.method == "physical"
    assert choice.identifier.fit([long]).model_.inertial is not None


def test_bodies_that_cannot_exist_are_delivered_where_the_arm_has_them() -> None:
    model = structure()
    values = truth(model)
    values[[name.startswith("coulomb") for name in model.names]] *= -0.2
    driven = run(model, values, 0, noise=0.05, seconds=20.0)
    choice = choose_identifier(arm(), [driven], 10.0, "irb120-arm")
    assert choice.identifier.method != "physical"
    assert choice.cost is not None
    assert choice.cost > 0.1


def test_an_arm_without_links_has_no_prior() -> None:
    bare = replace(arm(), links=None)
    model = structure()
    short = run(model, truth(model), 0, noise=3.0, seconds=1.5)
    assert choose_identifier(bare, [short], 10.0, "bare").identifier.pull == NO_PULL


def test_why_no_consistent_model_was_compared_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise InputError("bodies that can exist need a package")

    monkeypatch.setitem(METHODS, "physical", lambda fitted, pull: stopped)
    model = structure()
    choice = choose_identifier(arm(), [run(model, truth(model), 0, noise=0.05, seconds=5.0)], 10.0, "irb120-arm")
    assert choice.cost is None
    assert choice.sentence.endswith("no physically consistent model was compared: bodies that can exist need a package")


def total(model: Model, other: Run) -> float:
    return float(np.sqrt(np.mean((model.predict(other) - other.torque) ** 2)))
