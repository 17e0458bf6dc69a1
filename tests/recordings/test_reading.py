"""How recordings are to be read: each mistake is found at its joint, and nothing where nothing is wrong."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import engine_cases as cases
import numpy as np
import pandas as pd
import pytest
import yaml
from recording_folders import ARM, POSITION, TORQUE, folder_with, frame, motion_at

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.common.errors import InputError
from armlab.recordings.check import check_recording
from armlab.recordings.load import load_recording
from armlab.recordings.reading import search
from armlab.recordings.reading.answer import Answer, lapse, read_rightly
from armlab.recordings.reading.corrected import correct_recording, corrected_texts
from armlab.recordings.reading.fit import Fitter
from armlab.recordings.reading.judge import DOUBT_SHARE, Errors, ReadingJudge, View
from armlab.recordings.reading.mistakes import (
    clock_error,
    contradicted_by,
    encoder_offset,
    improbability,
    late_torque,
    signs,
    take_back,
    unit_error,
    units,
)
from armlab.recordings.reading.mistakes import spring as with_spring
from armlab.recordings.reading.reading import OF_LINKS, Mistake, Reading, read_as_is
from armlab.recordings.reading.signals import thin_channels
from armlab.recordings.reading.signs import compare_joint_names, compare_standstill
from armlab.recordings.reading.singles import _is_quarter, search_singles
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording
from problem.motion import Motion
from problem.pseudo_inertia import least_eigenvalues
from problem.regressor import rigid_body_torque

TUNING = ReadingTuning()
LATE_S = 0.08
Change = Callable[[pd.DataFrame], None]


def recording_with(folder: Path, change: Change | None = None, settings: dict[str, Any] | None = None) -> Recording:
    """The three-joint arm, both runs changed alike."""
    folder_with(folder, frame(), settings)
    for file in ("run.csv", "check.csv"):
        table = pd.read_csv(folder / file)
        if change is not None:
            change(table)
        table.to_csv(folder / file, index=False)
    return load_recording(folder)


def answer_to(recording: Recording) -> Answer:
    return read_rightly(recording, recording.arm.parameters, TUNING)


def names_of(answer: Answer) -> list[str]:
    return [each.mistake.label for each in answer.findings]


def scale(columns: list[str], factor: float) -> Change:
    def change(table: pd.DataFrame) -> None:
        table[columns] *= factor

    return change


def exchange(first: str, second: str) -> Change:
    def change(table: pd.DataFrame) -> None:
        table[[first, second]] = table[[second, first]].to_numpy()

    return change


def shift(column: str, angle_deg: float) -> Change:
    def change(table: pd.DataFrame) -> None:
        table[column] += np.deg2rad(angle_deg)

    return change


def spring(joint: int, stiffness: float) -> Change:
    def change(table: pd.DataFrame) -> None:
        table[TORQUE[joint - 1]] += stiffness * table[POSITION[joint - 1]]

    return change


def both(first: Change, second: Change) -> Change:
    def change(table: pd.DataFrame) -> None:
        first(table)
        second(table)

    return change


def late(columns: list[str], seconds: float) -> Change:
    def change(table: pd.DataFrame) -> None:
        time = table["t"].to_numpy()
        for column in columns:
            table[column] = np.interp(time - seconds, time, table[column])

    return change


def test_a_recording_that_is_read_rightly_is_left_as_it_is(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "right")
    answer = answer_to(recording)
    assert answer.findings == ()
    assert answer.recording is recording
    assert answer.doubts == ()
    assert answer.looks == 1


CASES: dict[str, tuple[Change, str, dict[str, float]]] = {
    "torque sign": (scale(["tau2"], -1.0), "torque_sign@2", {}),
    "both signs": (lambda table: scale(["q3", "tau3"], -1.0)(table), "joint_direction@3", {}),
    "torque columns": (exchange("tau1", "tau3"), "channel_swap@1,3", {}),
    "zero by a quarter": (shift("q2", -90.0), "encoder_offset@2", {"offset": np.pi / 2}),
    "zero of another size": (shift("q2", 40.0), "encoder_offset@2", {"offset": np.deg2rad(-40)}),
    "degrees of one joint": (scale(["q1"], 180 / np.pi), "unit_error@1", {"factor": 180 / np.pi}),
    "mN m of one joint": (scale(["tau2"], 1000.0), "unit_error@2", {"factor": 1000.0}),
    "late torque": (late(TORQUE, 0.12), "time_delay", {"seconds": 0.12}),
}


@pytest.mark.parametrize("case", CASES)
def test_a_mistake_is_found_at_its_joint_and_taken_back(tmp_path: Path, case: str) -> None:
    change, label, numbers = CASES[case]
    right, wrong = recording_with(tmp_path / "right"), recording_with(tmp_path / "wrong", change)
    answer = answer_to(wrong)
    (found,) = answer.findings
    assert label in [found.mistake.label, *(f"{each.effect}@{each.joint}" for each in found.rivals)]
    for name, value in numbers.items():
        assert answer.findings[0].mistake.value(name) == pytest.approx(value, rel=0.05)
    for before, after in zip(right.runs if label == found.mistake.label else (), answer.recording.runs, strict=False):
        rows = np.searchsorted(before.time, after.time)
        assert after.torque == pytest.approx(before.torque[rows], abs=2.0)
        assert after.position == pytest.approx(before.position[rows], abs=0.06)


def test_gravity_of_another_direction_is_found_within_three_degrees(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    hanging = replace(recording, arm=replace(ARM, gravity=(0.0, 0.0, 9.81)))
    (finding,) = answer_to(hanging).findings
    assert finding.mistake.effect == "base_tilt"
    direction = np.array(finding.mistake.parameters[0][1]) / 9.81
    assert np.rad2deg(np.arccos(direction @ [0, 0, -1])) < 3


def test_torque_without_gravity_is_found(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    changed = tuple(replace(run, torque=run.torque - _gravity_torque(run.position)) for run in recording.runs)
    assert "gravity_compensated_torque" in names_of(answer_to(replace(recording, runs=changed)))


def test_gravity_of_the_links_is_added_where_a_drive_takes_it_out_and_a_load_is_carried(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    last = ARM.links[2]
    heavy = replace(last, mass=2 * last.mass, first_moment=tuple(2 * each for each in last.first_moment))
    runs = []
    for seed, run in enumerate(recording.runs):
        motion = motion_at(run.time, seed)
        loaded = rigid_body_torque(replace(ARM, links=(*ARM.links[:2], heavy)), motion) - rigid_body_torque(ARM, motion)
        runs.append(replace(run, torque=run.torque + loaded - _gravity_torque(run.position)))
    answer = answer_to(replace(recording, runs=tuple(runs)))
    assert [each.mistake.form for each in answer.findings] == [OF_LINKS]
    texts = corrected_texts(recording.folder, answer.reading, tmp_path / "corrected")
    (tmp_path / "corrected").mkdir()
    for name, text in texts.items():
        (tmp_path / "corrected" / name).write_text(text)
    read = load_recording(tmp_path / "corrected").runs[0]
    assert read.torque == pytest.approx(recording.runs[0].torque + _gravity_torque(read.position))


def _gravity_torque(position: np.ndarray) -> np.ndarray:
    still = np.zeros_like(position)
    return rigid_body_torque(ARM, Motion(position, still, still))


def test_two_mistakes_are_found_together(tmp_path: Path) -> None:
    change = both(scale(["tau3"], -1.0), shift("q2", -90.0))
    assert set(names_of(answer_to(recording_with(tmp_path / "rig", change)))) == {"torque_sign@3", "encoder_offset@2"}


def test_parts_of_one_mistake_become_one(tmp_path: Path) -> None:
    """Beside another unit of joint 1, joint 2 was first found with a wrong torque, then with a wrong direction."""
    change = both(scale(["q1"], 180 / np.pi), scale(["q2"], -1.0))
    assert set(names_of(answer_to(recording_with(tmp_path / "rig", change)))) == {"unit_error@1", "joint_direction@2"}


@pytest.mark.parametrize(("sigmas", "margin", "expected"), [(3.0, 0.0, 0.1), (-2.0, 0.0, 0.5), (1.0, 2.0, 0.1)])
def test_a_doubtful_gain_and_a_near_second_make_it_likely_that_no_name_is_right(
    sigmas: float, margin: float, expected: float
) -> None:
    assert lapse(sigmas, margin, replace(TUNING, lapse_odds=1.0)) == pytest.approx(expected)


def test_the_margin_is_that_of_the_next_best_mistake_of_another_name(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig", shift("q2", 90.0))
    judge = ReadingJudge.of(recording, TUNING)
    assert judge is not None
    start = judge.trial(read_as_is(recording, ARM.parameters))
    found = search.find_mistakes(judge, start)
    singles = search_singles(judge, start)
    others = [each for each in singles if each.reading.mistakes[-1].label != "encoder_offset@2"]
    second = min(others, key=lambda each: each.loss)
    assert found.margins == pytest.approx([judge.gain(second, found.best).near.total_sigmas])


def test_each_mistake_of_a_reading_costs_what_a_named_one_has_to_explain(tmp_path: Path) -> None:
    judge = ReadingJudge.of(recording_with(tmp_path), TUNING)
    assert judge is not None
    reading = read_as_is(judge.recording, None)
    once = reading.with_mistake(Mistake("torque_sign", 1))
    start, one, two = (judge.trial(each) for each in (reading, once, once.with_mistake(Mistake("torque_sign", 2))))
    each_costs = TUNING.least_evidence + judge.improbability(once)
    assert judge.cost(start) == start.loss
    assert judge.cost(one) - start.loss == pytest.approx(each_costs)
    assert judge.cost(two) - start.loss == pytest.approx(2 * each_costs)


def test_names_leave_a_probability_that_none_is_right(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig", shift("q2", 90.0))
    (sure,), (doubtful,) = (
        read_rightly(recording, recording.arm.parameters, replace(TUNING, lapse_odds=odds)).findings
        for odds in (1.0, 100.0)
    )
    (certain,) = read_rightly(recording, recording.arm.parameters, replace(TUNING, lapse_odds=0.0)).findings
    named = [each.probability + sum(rival.probability for rival in each.rivals) for each in (certain, sure, doubtful)]
    assert named[0] == pytest.approx(1.0)
    assert 0.9 < named[1] < 1.0
    assert (1 / named[2] - 1) / (1 / named[1] - 1) == pytest.approx(100.0)


def test_each_mistake_has_its_rivals_where_the_last_step_leaves_one_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The steps are counted: there may be no other one that finds nothing better."""
    steps = iter([lambda without, best: best, lambda without, best: without[0]])
    monkeypatch.setattr(search, "_better_in_place", lambda judge, without, lists, best: next(steps)(without, best))
    recording = recording_with(tmp_path / "rig", both(scale(["tau3"], -1.0), shift("q2", -90.0)))
    judge = ReadingJudge.of(recording, replace(TUNING, max_mistakes=2))
    assert judge is not None
    found = search.find_mistakes(judge, judge.trial(read_as_is(recording, ARM.parameters)))
    assert len(found.best.reading.mistakes) == len(found.without) == len(found.rivals) == 1


OTHER_SIGNALS = ("velocity", "link_position", "reference_position", "reference_velocity")


def add_other_signals(table: pd.DataFrame) -> None:
    """Further signals of each joint, all different; torque becomes a current."""
    for number, signal in enumerate(OTHER_SIGNALS):
        for joint in (1, 2, 3):
            table[f"{signal}{joint}"] = np.sin(table["t"] + number + 0.3 * joint)


def test_the_corrected_folder_holds_the_recording_read_rightly(tmp_path: Path) -> None:
    """Gains and a clock that the recording states already are kept."""
    columns = {signal: [f"{signal}{joint}" for joint in (1, 2, 3)] for signal in OTHER_SIGNALS}
    settings = {
        "columns": {"time": "t", "position": POSITION, "current": TORQUE} | columns,
        "units": {"time": "s", "position": "rad", "current": "A"}
        | {signal: "rad/s" if "velocity" in signal else "rad" for signal in OTHER_SIGNALS},
        "gains": [1.0, 2.0, 4.0],
        "timing": {"clock_factor": 1.1},
    }
    recording = recording_with(tmp_path / "wrong", add_other_signals, settings)
    reading = read_as_is(recording, ARM.parameters)
    mistakes = (
        Mistake("channel_swap", joints=(1, 3), form="torque"),
        Mistake("channel_swap", joints=(1, 2), form="position"),
        Mistake("joint_direction", 2, form="position"),
        Mistake("encoder_offset", 3, parameters=(("offset", 0.5, "rad"),)),
        Mistake("time_delay", parameters=(("seconds", 0.1, "s"),)),
        Mistake("clock_error", parameters=(("factor", 1.25, ""),)),
        Mistake("base_tilt", parameters=(("gravity", (0.0, 0.0, 9.81), "m/s2"),)),
    )
    for mistake in mistakes:
        reading = take_back(reading, mistake, recording)
    folder = tmp_path / "out" / "corrected"
    folder.mkdir(parents=True)
    for name, text in corrected_texts(recording.folder, reading, folder).items():
        (folder / name).write_text(text)
    again, wanted = load_recording(folder), correct_recording(recording, reading)
    assert again.arm.gravity == (0.0, 0.0, 9.81)
    for one, other in zip(again.runs, wanted.runs, strict=True):
        assert one.time == pytest.approx(other.time, abs=1e-9)
        assert one.torque == pytest.approx(other.torque, abs=1e-9)
        for signal in ("position", *OTHER_SIGNALS):
            assert getattr(one, signal) == pytest.approx(getattr(other, signal), abs=1e-9), signal


def test_the_transmission_that_is_kept_is_that_of_the_recorded_channels(tmp_path: Path) -> None:
    """Each channel has a gain of its own, and the torques of two joints are exchanged."""
    settings = {"columns": {"time": "t", "position": POSITION, "current": TORQUE}, "gains": [1.0, 2.0, 4.0]}
    recording = recording_with(
        tmp_path / "rig", None, settings | {"units": {"time": "s", "position": "rad", "current": "A"}}
    )
    reading = read_as_is(recording, ARM.parameters)
    reading = take_back(reading, Mistake("channel_swap", joints=(1, 3), form="torque"), recording)
    corrected, given = correct_recording(recording, reading), recording.transmission
    current = recording.runs[0].torque @ np.linalg.inv(given.torque * given.gains).T
    kept = corrected.transmission
    assert corrected.runs[0].torque == pytest.approx(current @ (kept.torque * kept.gains).T)
    assert kept.gains.tolist() == [1.0, 2.0, 4.0]


def test_delays_that_were_stated_are_those_of_the_new_clock(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig", settings={"timing": {"clock_factor": 1.1, "torque_delay": 0.2}})
    reading = read_as_is(recording, ARM.parameters)
    reading = clock_error(late_torque(reading, 0, 0.1), 1.25)
    timing = yaml.safe_load(corrected_texts(recording.folder, reading, tmp_path)["recording.yaml"])["timing"]
    assert timing["clock_factor"] == pytest.approx(1.375)
    assert timing["torque_delay"] == pytest.approx([0.26, 0.16, 0.16])


def test_a_mistake_is_the_same_when_it_is_taken_back_by_its_name(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    reading = read_as_is(recording, ARM.parameters)
    for made in (
        next(iter(signs(reading))),
        encoder_offset(reading, 1, 0.5),
        late_torque(reading, None, 0.1),
        with_spring(reading, 2),
    ):
        again = take_back(reading, made.mistakes[-1], recording)
        assert np.array_equal(again.torque, made.torque)
        assert np.array_equal(again.offset, made.offset)
        assert np.array_equal(again.delay, made.delay)
        assert again.springs == made.springs
    with pytest.raises(ValueError, match="no such mistake"):
        take_back(reading, Mistake("magic"), recording)


@pytest.mark.parametrize(("joint", "stiffness"), [(1, 30.0), (2, 30.0), (3, 100.0)])
def test_a_spring_is_no_mistake(tmp_path: Path, joint: int, stiffness: float) -> None:
    """Wrong signs, late torque or other links may fit an arm with a spring better."""
    answer = answer_to(recording_with(tmp_path / "rig", spring(joint, stiffness)))
    assert names_of(answer) == []
    assert answer.share < 0.1


def test_a_mistake_is_found_beside_a_spring(tmp_path: Path) -> None:
    change = both(spring(1, 30.0), scale(["tau2"], -1.0))
    answer = answer_to(recording_with(tmp_path / "rig", change))
    assert names_of(answer) == ["torque_sign@2"]
    assert answer.reading is not None
    assert np.array_equal(answer.reading.torque, np.diag([1.0, -1.0, 1.0]))


def test_fitted_bodies_can_exist_and_friction_takes_energy(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    rows = thin_channels(recording, TUNING)
    assert rows is not None
    (score,) = Fitter(rows.judge, TUNING).scores(read_as_is(recording, ARM.parameters), (TUNING.free_width,), True)
    assert all(least_eigenvalues(values).min() > 0 for values in score.values)
    assert score.own[:, :, :3].min() >= 0


def test_what_frees_the_joints_of_their_links_is_no_unit(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig")
    judge = ReadingJudge.of(recording, TUNING)
    assert judge is not None
    start = judge.trial(read_as_is(recording, ARM.parameters))
    assert not any(judge.is_accepted(start, each) for each in search_singles(judge, start))


def test_travel_speaks_for_the_unit_that_makes_it_usual(tmp_path: Path) -> None:
    """An unknown load makes a joint that hardly moves explain more; only a joint that travels too far is in degrees."""
    for factor, wanted in ((1.0, set[str]()), (180 / np.pi, {"unit_error@1"})):
        recording = recording_with(tmp_path / f"{factor:.0f}", scale(["q1"], factor))
        judge = ReadingJudge.of(recording, TUNING)
        assert judge is not None
        degrees = [
            each
            for each in units(read_as_is(recording, ARM.parameters))
            if each.mistakes[-1].form == "position"
            and each.mistakes[-1].value("factor") > 1
            and each.mistakes[-1].joint
        ]
        assert len(degrees) == 3
        commonest = improbability(degrees[0].mistakes[-1], 3) / judge.independent
        assert {each.mistakes[-1].label for each in degrees if judge.improbability(each) < commonest} == wanted


def test_travel_alone_names_nothing(tmp_path: Path) -> None:
    """In a short recording few stretches tell something, and a joint that stands would be in another unit."""
    judge = ReadingJudge.of(recording_with(tmp_path / "rig", scale(["q1"], 180 / np.pi)), TUNING)
    assert judge is not None
    judge.__dict__["independent"] = 2.0
    start = read_as_is(judge.recording, ARM.parameters)
    degrees = unit_error(start, 0, "position", 180 / np.pi)
    told = improbability(degrees.mistakes[-1], 3) / 2 - judge.improbability(degrees)
    assert told == pytest.approx(DOUBT_SHARE * TUNING.least_evidence)


@pytest.mark.parametrize("seconds", [1.0, 2.5])
def test_a_short_run_beside_a_long_one_hides_no_mistake(tmp_path: Path, seconds: float) -> None:
    """Blocks follow the length of the runs: none is empty. A run that is too short is left out."""
    folder = folder_with(tmp_path / "rig", frame(seconds=300.0))
    frame(1, seconds=seconds).to_csv(folder / "check.csv", index=False)
    settings = yaml.safe_load((folder / "recording.yaml").read_text())
    for run in settings["runs"]:
        run["role"] = "identify"
    (folder / "recording.yaml").write_text(yaml.safe_dump(settings))
    for file in ("run.csv", "check.csv"):
        table = pd.read_csv(folder / file)
        table["tau2"] *= -1
        table.to_csv(folder / file, index=False)
    recording = load_recording(folder)
    rows = thin_channels(recording, TUNING)
    assert rows is not None
    assert all(np.bincount(each.block).min() > 0 for each in (rows.search, rows.judge))
    assert names_of(answer_to(recording)) == ["torque_sign@2"]


@pytest.mark.parametrize("angle", [165.0, -165.0, 195.0])
def test_a_zero_near_half_a_turn_is_half_a_turn_where_the_data_do_not_tell(tmp_path: Path, angle: float) -> None:
    """No torque depends on the zero of a joint whose axis is vertical."""
    recording = recording_with(tmp_path / "rig")
    judge = ReadingJudge.of(recording, TUNING)
    assert judge is not None
    start = read_as_is(recording, ARM.parameters)
    turned, refined = (judge.trial(encoder_offset(start, 0, np.deg2rad(each))) for each in (180.0, angle))
    assert _is_quarter(judge, turned, refined, angle)


def test_degrees_are_those_of_joints_that_turn() -> None:
    """An arm with a slide between two joints that turn."""
    joints = tuple(replace(each, kind="prismatic" if at == 1 else each.kind) for at, each in enumerate(ARM.joints))
    eye = np.eye(3)
    order = (0, 1, 2)
    arm = replace(ARM, joints=joints)
    reading = Reading(eye, np.zeros(3), eye, eye, order, order, 1.0, np.zeros(3), arm, None)
    positions = [each for each in units(reading) if each.mistakes[-1].form == "position"]
    scaled = {
        (each.mistakes[-1].label, each.mistakes[-1].value("factor")): np.diag(each.position) for each in positions
    }
    assert scaled["unit_error", 180 / np.pi] == pytest.approx([np.pi / 180, 1, np.pi / 180])
    assert scaled["unit_error@2", 1000.0] == pytest.approx([1, 1e-3, 1])
    assert ("unit_error@2", 180 / np.pi) not in scaled


def test_a_mistake_that_too_many_others_fit_is_a_doubt_and_nothing_is_corrected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armlab.recordings.reading.answer.MAX_CLASS_NAMES", 0)
    recording = recording_with(tmp_path / "rig", scale(["tau2"], -1.0))
    answer = read_rightly(recording, recording.arm.parameters, TUNING)
    assert answer.findings == ()
    assert answer.recording is recording
    assert [(each.effect, each.joints) for each in answer.doubts] == [("torque_sign", (2,))]
    assert "push" in answer.doubts[0].measurement


def slow_noise(table: pd.DataFrame) -> None:
    """What no law explains: a quarter of each torque."""
    rng = np.random.default_rng(0)
    for name in TORQUE:
        slow = np.interp(table["t"], np.arange(0, 9, 0.1), rng.normal(size=90))
        table[name] += 0.25 * table[name].std() * slow


def test_what_an_arm_leaves_of_its_own_is_no_mistake_and_hides_none(tmp_path: Path) -> None:
    rightly = answer_to(recording_with(tmp_path / "right", slow_noise))
    assert names_of(rightly) == []
    assert rightly.share > 0.1
    wrongly = answer_to(recording_with(tmp_path / "wrong", both(scale(["tau2"], -1.0), slow_noise)))
    assert names_of(wrongly) == ["torque_sign@2"]


def test_columns_that_bear_the_names_of_other_joints_are_named() -> None:
    findings = compare_joint_names(["position_joint2", "position_joint1", "q3"], ARM, "position")
    assert [each.joint for each in findings] == [1, 2]
    assert "joint 2" in findings[0].text


def test_torque_at_standstill_against_gravity_is_a_line_of_the_check(tmp_path: Path) -> None:
    def hold(table: pd.DataFrame) -> None:
        table.loc[:300, POSITION] = [0.0, 1.2, 0.0]
        table.loc[:300, TORQUE] = 0.0

    recording = recording_with(tmp_path / "rig", hold)
    found = compare_standstill(recording, ARM.parameters, replace(TUNING, min_standstill_load=0.2))
    assert {each.kind for each in found} == {"standstill"}


def test_the_check_says_how_a_recording_is_to_be_read(tmp_path: Path) -> None:
    recording_with(tmp_path / "wrong", scale(["tau2"], -1.0))
    lines = [each.text for _, each in check_recording(tmp_path / "wrong").findings if each.kind == "setup"]
    assert len(lines) == 1
    assert "the torque of joint 2 has the other sign" in lines[0]


def test_delays_for_another_number_of_joints_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="torque_delay should hold one number or 3, not 2"):
        recording_with(tmp_path / "rig", settings={"timing": {"torque_delay": [0.1, 0.2]}})


def test_a_recording_may_say_how_its_arm_is_mounted(tmp_path: Path) -> None:
    recording = recording_with(tmp_path / "rig", settings={"gravity": [0.0, 0.0, 9.81]})
    assert recording.arm.gravity == (0.0, 0.0, 9.81)
    assert yaml.safe_load((tmp_path / "rig" / "recording.yaml").read_text())["gravity"] == [0.0, 0.0, 9.81]


def test_friction_of_coupled_axes_is_that_of_their_drives(tmp_path: Path) -> None:
    """Motor 3 turns with both axes: q3 = m3 - m2, and its torque acts on both. Read as stated, nothing is left over."""
    coupled = np.array([[1.0, 0, 0], [0, 1, 0], [0, -1, 1]])
    settings = {"transmission": {"position": coupled.tolist(), "torque": np.linalg.inv(coupled).T.tolist()}}

    def to_motors(table: pd.DataFrame) -> None:
        table["q3"] += table["q2"]
        speed = np.gradient(table["q3"], table["t"])
        table["tau2"] -= table["tau3"]
        table["tau3"] += 20 * np.tanh(speed / 0.02) + 5 * speed

    answer = answer_to(recording_with(tmp_path / "rig", to_motors, settings))
    assert names_of(answer) == []
    assert answer.share < 0.05


def test_readings_are_judged_on_instants_that_took_no_part_in_the_search(tmp_path: Path) -> None:
    rows = thin_channels(recording_with(tmp_path / "rig"), TUNING)
    assert rows is not None
    searched, judged = (
        set(zip(each.run.tolist(), each.stamps.tolist(), strict=True)) for each in (rows.search, rows.judge)
    )
    assert not searched & judged
    assert len(judged) > 3 * len(searched) > 0


def test_what_rises_counts_twice_and_what_is_not_sure_counts_nothing() -> None:
    """Three joints fall by 1, 0.5 and -0.2 in every block; then the blocks differ by 0.4 at the first one."""
    falls = np.array([1.0, 0.5, -0.2])
    after = Errors(np.full(3, 0.1), np.zeros((4, 3)))
    sure = View.between(Errors(0.1 * np.exp(falls), np.tile(falls, (4, 1))), after, 0.01, 4)
    assert sure.least_gain(2.0, of_one_joint=False) == pytest.approx(1.0 + 0.5 - 2 * 0.2)
    assert sure.least_gain(2.0, of_one_joint=True) == pytest.approx(1.0)
    blocks = np.tile(falls, (4, 1)) + 0.4 * np.array([[1, 0, 0], [-1, 0, 0], [1, 0, 0], [-1, 0, 0]])
    unsure = View.between(Errors(0.1 * np.exp(falls), blocks), after, 0.01, 4)
    deviation = 0.4 * np.sqrt(4 / 3) / 2  # of the mean of four
    assert unsure.least_gain(2.0, of_one_joint=False) == pytest.approx(1.1 - 2 * deviation)


def test_a_joint_that_leaves_little_contradicts_another_sign_or_column_of_position_or_torque_alone() -> None:
    """Where both change together its friction stays, a wrong factor hides in it, and a zero shows at other joints."""
    contradicted = {
        Mistake("torque_sign", 2): {2},
        Mistake("joint_direction", 2, form="position"): {2},
        Mistake("joint_direction", 2, form="position and torque"): set(),
        Mistake("channel_swap", joints=(1, 3), form="torque"): {1, 3},
        Mistake("channel_swap", joints=(1, 3), form="position and torque"): set(),
        Mistake("channel_order", joints=(1, 3, 4, 2), form="position"): {2, 3, 4},
        Mistake("axis_coupling", joints=(2, 3), form="position"): {3},
        Mistake("unit_error", 2, form="position"): set(),
        Mistake("encoder_offset", 2): set(),
    }
    assert {mistake: set(contradicted_by(mistake)) for mistake in contradicted} == contradicted


def presliding(motion: Motion, time: Array) -> Array:
    """Friction of 10 N m that turns over a fiftieth of each joint's travel."""
    return np.column_stack([10.0 * dahl_state(each, 0.02 * np.ptp(each)) for each in motion.position.T])


def sliding(motion: Motion, time: Array) -> Array:
    """Friction of 10 N m that turns at once."""
    return 10.0 * np.sign(motion.velocity)


def test_friction_that_turns_over_a_way_is_no_late_torque() -> None:
    assert answer_to(cases.recording(presliding, seconds=10.0)).mistakes == ()


def test_late_torque_is_told_beside_friction_that_turns_at_once() -> None:
    recording = cases.recording(sliding, seconds=10.0)
    rows = round(LATE_S * cases.RATE_HZ)
    runs = tuple(
        replace(run, torque=np.roll(run.torque, rows, axis=0)).rows(slice(rows, None)) for run in recording.runs
    )
    (found,) = answer_to(replace(recording, runs=runs)).mistakes
    assert found.mistake.effect == "time_delay"
    assert found.mistake.value("seconds") == pytest.approx(LATE_S, rel=0.2)
