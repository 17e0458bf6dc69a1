"""All real arms, on recordings that stand in for them: one page, one table, checks, and settings left out."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
from small_recordings import ARM, frame, recording_in

from armlab.common.arrays import Array
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.effects.parameters import ParameterValue
from armlab.proof.open.real_arms import checks, leave_one_out
from armlab.proof.open.real_arms.all_arms import prove_on_public_arms
from armlab.proof.open.real_arms.checks import level_check, mass_agreement
from armlab.proof.open.real_arms.direct_reading import DirectLevel, direct_levels
from armlab.proof.open.real_arms.judged_run import Percent, common_cutoff, judged_run
from armlab.proof.open.real_arms.leave_one_out import (
    USUAL,
    Change,
    ChosenOutcome,
    choose_change,
    inside_identification,
    joined_change,
    leave_arms_out,
    single_changes,
)
from armlab.proof.open.real_arms.one_arm import ModelLine, Progress, given_model, study_arm
from armlab.proof.open.real_identification import identify_recording as recipes
from armlab.proof.open.real_identification.identify_recording import Recipe
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording, Run
from problem.regressor import rigid_body_torque

QUICK = Recipe("kuka-kr300", {"run-1.csv": 3.0})


def silent(message: str) -> None:
    """No progress."""


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    recording_in(folder / "kuka-kr300", frame(0, 6, mass=0.4), frame(1, 6, mass=0.4))
    recording_in(folder / "emps", frame(2, 6), frame(3, 6))
    return folder


@pytest.fixture(scope="module", autouse=True)
def quick_recipes() -> Iterator[None]:
    """Recipes without counterbalance and payload, which the small arm does not have."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("armlab.proof.open.real_arms.all_arms.RECIPES", (QUICK, recipes.recipe_named("emps")))
        yield


@pytest.fixture(scope="module")
def results(recordings: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    folder = tmp_path_factory.mktemp("results")
    return folder, list(prove_on_public_arms(folder, recordings, ("kuka-kr300",)))


def test_the_table_has_a_line_for_each_baseline_and_run_with_every_model(results: tuple[Path, list[str]]) -> None:
    table = pd.read_csv(results[0] / "arms.csv")
    assert table[["arm", "baseline", "run"]].values.tolist() == [
        ["kuka-kr300", "nominal", "run-1.csv"],
        ["kuka-kr300", "refit", "run-1.csv"],
    ]
    errors = table.iloc[0]
    for torque in ("recorded", "filtered"):
        assert errors[f"rigid_given_{torque}"] > errors[f"rigid_refitted_{torque}"] > 5 * errors[f"named_{torque}"]
        assert errors[f"diagnose_{torque}"] <= errors[f"plain_friction_{torque}"] * 1.2
    assert errors["named_share_filtered"] == pytest.approx(1, abs=0.1)
    assert errors["best_known"] == 3.0
    assert errors["time_ratio"] == pytest.approx(errors["diagnose_seconds"] / errors["identify_seconds"], rel=1e-3)


def test_the_page_tells_findings_with_intervals_checks_and_what_each_run_says_alone(
    results: tuple[Path, list[str]],
) -> None:
    folder, lines = results
    page = (folder / "arms.md").read_text()
    assert lines[-3:] == [str(folder / name) for name in ("arms.md", "arms.csv", "arms.svg")]
    assert "| viscous friction | joint 2 | `tau_2 += " in page
    assert "| kuka-kr300 | nominal | friction at joint 2 is named | yes | " in page
    assert "### kuka-kr300, each run alone" in page
    assert "| kuka-kr300 | nominal | runs that alone tell of a load agree on it and its link | " in page
    assert "<svg" in (folder / "arms.svg").read_text()


def test_every_look_at_a_run_that_validates_is_logged(results: tuple[Path, list[str]]) -> None:
    looks = [json.loads(line) for line in (results[0] / "validation_looks.jsonl").read_text().splitlines()]
    assert {each["run"] for each in looks} == {"run-1.csv"}
    assert [each["model"] for each in looks] == [
        "identify",
        "diagnose, nominal",
        "diagnose, refit",
        "diagnose, nominal, run-0.csv alone",
    ]


def test_an_unknown_recording_is_refused_before_anything_is_done(tmp_path: Path) -> None:
    message = refusal(lambda: list(prove_on_public_arms(tmp_path / "results", tmp_path, ("kuka",))))
    assert "unknown recording 'kuka'" in message
    assert not (tmp_path / "results").exists()


def test_all_models_of_a_run_are_judged_by_one_filter_as_recorded_and_filtered(recordings: Path) -> None:
    recording = load_recording(recordings / "emps")
    cutoff = common_cutoff(recording)
    judged = judged_run(recording.runs[1], cutoff)
    model = given_model(recording, cutoff)
    error = judged.run.torque - rigid_body_torque(ARM, model.signals(judged.run).motion, ARM.parameters)
    rows = judged.low_pass.rows
    expected = Percent(
        float(100 * np.linalg.norm(error[rows]) / np.linalg.norm(judged.run.torque[rows])),
        float(100 * np.linalg.norm(judged.low_pass(error)) / np.linalg.norm(judged.low_pass(judged.run.torque))),
    )
    assert_allclose(
        [judged.percent(model).recorded, judged.percent(model).filtered], [expected.recorded, expected.filtered]
    )


def test_named_share_is_what_names_close_of_what_the_whole_model_closes() -> None:
    errors = {"rigid_refitted": Percent(50, 40), "named": Percent(20, 10), "diagnose": Percent(10, 5)}
    line = ModelLine("a", "refit", "b", 10.0, errors, None, 2.0, 1.0, 0.2, 1)
    assert line.reading_ratio == pytest.approx(0.25)
    assert line.named_share("recorded") == pytest.approx(30 / 40)
    assert line.named_share("filtered") == pytest.approx(30 / 35)
    assert replace(line, errors={**line.errors, "diagnose": Percent(60, 60)}).named_share("recorded") is None
    assert line.time_ratio == 0.5


# --- checks


def test_friction_is_asked_for_only_where_leaving_it_out_raises_the_error(tmp_path: Path) -> None:
    runs = [frame(seed, 6, viscous=(0.8, 0.0, 0.5)) for seed in (0, 1)]
    column = [f"tau{joint}" for joint in (1, 2, 3)]
    for run in runs:  # joint 2 has no friction at all
        torque, without = run[column].to_numpy(), run.copy()
        without["tau2"] = torque[:, 1] - friction_of_joint_2(run)
        run[column] = without[column]
    recording = load_recording(recording_in(tmp_path / "emps", *runs))
    study = study_arm(Recipe("emps", {}), recording, Looks(tmp_path / "looks.jsonl"), silent)
    asked = {each.asked for each in checks.check_arm(study) if each.asked.startswith("friction")}
    assert asked == {"friction at joint 1 is named", "friction at joint 3 is named"}


def friction_of_joint_2(run: pd.DataFrame) -> Array:
    """Coulomb friction of 1.5 N m by the sign of the velocity."""
    return 1.5 * np.sign(np.gradient(run["q2"].to_numpy(), run["t"].to_numpy()))


def test_coupled_drives_are_read_from_the_transmission(recordings: Path) -> None:
    recording = load_recording(recordings / "emps")
    assert checks.coupled_joints(recording) == ()
    mixed = np.eye(3)
    mixed[2, 1] = 0.3
    coupled = replace(recording, transmission=replace(recording.transmission, position=mixed))
    assert checks.coupled_joints(coupled) == ((2, 3), (3, 2))


def sliding_run(level: tuple[float, float], gap: float = 0.004) -> Run:
    """A sine of 25 mm at 1 Hz; the force has a level each way and vanishes while play is taken up."""
    time = np.arange(0, 6, 1 / 500)
    position, velocity = 0.025 * np.sin(2 * np.pi * time), np.cos(2 * np.pi * time)
    travelled = 0.025 + np.where(velocity > 0, position, -position)
    force = np.where(travelled > gap, np.where(velocity > 0, level[0], -level[1]), 0.0)
    return Run("a.csv", "identify", time, position[:, None], force[:, None])


def test_the_level_is_read_from_the_middle_of_whole_strokes_by_direction() -> None:
    forward, back = direct_levels(sliding_run((400.0, 300.0)))
    assert (forward.direction, forward.median, forward.strokes) == (1, 400.0, 5)
    assert (back.direction, back.median, back.lowest, back.highest) == (-1, 300.0, 300.0, 300.0)


def test_a_level_agrees_where_its_interval_overlaps_what_the_force_shows() -> None:
    read = (DirectLevel("a", 1, 400, 390, 410, 5), DirectLevel("a", -1, 300, 290, 310, 5))

    def overlaps(name: str, low: float, high: float) -> bool:
        return checks._overlaps(ParameterValue(name, (low + high) / 2, (low, high), "N"), read)

    assert overlaps("level", 305, 320)
    assert overlaps("positive", 409, 500)
    assert not overlaps("positive", 300, 320)
    assert not overlaps("level", 411, 500)


def test_an_interval_contains_the_medians_of_the_directions_in_which_its_level_acts() -> None:
    forward, back = DirectLevel("a", 1, 400, 390, 410, 5), DirectLevel("a", -1, 300, 290, 310, 5)
    both = ParameterValue("level", 350, (295, 405), "N")
    assert all(checks._contains(both, each) for each in (forward, back))
    assert not checks._contains(ParameterValue("positive", 350, (295, 405), "N"), back)
    assert not checks._contains(ParameterValue("level", 350, (301, 399), "N"), forward)


def test_a_damper_without_a_named_level_is_answered_with_no(recordings: Path) -> None:
    recording = load_recording(recordings / "emps")
    diagnosis = Diagnosis(recording, read_simulation(recording, "refit"), "none", "nothing is missing")
    found = level_check("emps", "refit", diagnosis, (DirectLevel("a", 1, 400, 390, 410, 5),))
    assert found.holds is False
    assert found.found.startswith("no level named")


def test_masses_agree_where_their_intervals_allow_one_mass() -> None:
    def mass(value: float, half: float) -> ParameterValue:
        return ParameterValue("mass", value, (value - half, value + half), "kg")

    assert "they agree" in mass_agreement([mass(150.0, 10.0), mass(155.0, 10.0), mass(149.0, 8.0)])[0]
    assert "they do not agree" in mass_agreement([mass(100.0, 10.0), mass(180.0, 10.0)])[0]
    assert mass_agreement([mass(100.0, 10.0)])[1] is None


# --- leave one out


def outcome(error: float) -> ChosenOutcome:
    """An outcome with one run."""
    return ChosenOutcome({"a": Percent(error, error)})


TRIED = {"search.rounds": (1, 3), "solver.crowd_penalty": (2.0,)}


def test_the_change_with_the_least_logarithm_over_arms_is_chosen_and_equals_stay_usual() -> None:
    usual, less, more, penalty = single_changes(TRIED)
    outcomes = {
        usual: [outcome(10), outcome(1)],
        less: [outcome(9), outcome(2)],
        more: [outcome(11), outcome(0.5)],
        penalty: [outcome(10), outcome(1)],
    }
    assert choose_change(outcomes) == more
    assert choose_change({usual: [outcome(1)], less: [outcome(1)]}) == USUAL
    assert choose_change({usual: [outcome(1)], less: [ChosenOutcome(None)]}) == USUAL
    assert joined_change(outcomes) == (("search.rounds", 3),)


def test_the_best_values_of_all_numbers_are_joined() -> None:
    usual, less, more, penalty = single_changes(TRIED)
    outcomes = {usual: [outcome(3)], less: [outcome(2)], more: [outcome(4)], penalty: [outcome(1)]}
    assert joined_change(outcomes) == (("search.rounds", 1), ("solver.crowd_penalty", 2.0))


def test_the_choice_sees_no_run_that_validates(recordings: Path) -> None:
    recording = load_recording(recordings / "emps")
    inside = inside_identification(recording)
    assert [each.role for each in inside.runs] == ["identify", "validate"]
    assert {each.file for each in inside.runs} == {"run-0.csv"}
    assert_allclose(np.concatenate([each.time for each in inside.runs]), recording.runs[0].time)


def test_leave_one_out_judges_each_arm_logs_its_looks_and_continues_where_it_was_interrupted(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(leave_one_out, "TRIED_VALUES", {"search.rounds": (1,)})
    done: list[Change] = []
    stop_after = 3

    def counted(recording: Recording, change: Change, progress: Progress) -> ChosenOutcome:
        if len(done) == stop_after:
            raise KeyboardInterrupt
        done.append(change)
        return ChosenOutcome({run.name: Percent(9, 8 - len(change)) for run in recording.with_role("validate")})

    monkeypatch.setattr(leave_one_out, "examine", counted)
    with pytest.raises(KeyboardInterrupt):
        list(leave_arms_out(tmp_path, recordings))
    stop_after = 100
    *told, page, table = leave_arms_out(tmp_path, recordings)
    assert done == [USUAL, (("search.rounds", 1),)] * 4  # both arms inside, then both judge: nothing is done twice
    assert told[0] == ("kuka-kr300 left out: search.rounds=1; run-1.csv 8.00 % with usual settings, 7.00 % with these")
    assert "| emps | run-1.csv | search.rounds=1 | 9.00 / 8.00 | 9.00 / 7.00 |" in Path(page).read_text()
    assert pd.read_csv(table)["chosen_filtered"].tolist() == [7, 7]
    looks = (tmp_path / "validation_looks.jsonl").read_text().splitlines()
    assert len(looks) == 4
    list(leave_arms_out(tmp_path, recordings))
    assert (tmp_path / "validation_looks.jsonl").read_text().splitlines() == looks


def test_an_outcome_is_the_error_of_the_whole_model_with_the_change_on_what_is_held_out(recordings: Path) -> None:
    inside = inside_identification(load_recording(recordings / "emps"))
    found = leave_one_out.examine(inside, (("search.rounds", 1),), silent)
    assert found.errors is not None
    assert list(found.errors) == ["run-0.csv part 2"]
    assert 0 < found.errors["run-0.csv part 2"].filtered < 10


def test_leave_one_out_of_a_single_arm_is_refused(tmp_path: Path) -> None:
    assert "at least two" in refusal(lambda: list(leave_arms_out(tmp_path, tmp_path, ("emps",))))
