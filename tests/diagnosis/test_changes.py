"""What changed between recordings: nothing, friction in both directions, a load; and recordings of two robots."""

import json
import re
from dataclasses import replace
from datetime import date
from functools import cache
from itertools import combinations
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose
from public_copies import needs_copies
from refusals import refusal
from scipy.signal import savgol_filter
from shipped_schemas import check_against_schema
from small_recordings import ARM, VISCOUS, frame, motion_at, recording_in

from armlab.cli.main import main
from armlab.common.errors import DataError
from armlab.common.statistics import adjust_by_holm
from armlab.diagnosis.changes import soundness
from armlab.diagnosis.changes.comparison import Comparison, compare, compare_with, look_plainly
from armlab.diagnosis.changes.friction_level import ALL_FRICTION
from armlab.diagnosis.changes.numbers import Change, as_share_of_first, laws_of
from armlab.diagnosis.changes.pooled import pool_plainly, unite_candidates
from armlab.diagnosis.result import Rival
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.predict.found_model import model_found
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.effects.contract import Scene
from armlab.effects.drive import TorqueGain, TorqueGainBySign
from armlab.effects.friction import CoulombFriction, LevelsAndSlopes, Slopes, ViscousFriction
from armlab.proof.open.relations.variants import delayed, one_run, scaled
from armlab.recordings.load import load_recording
from armlab.recordings.plain_least_squares import compare_plain
from armlab.recordings.public import fetch_recording
from armlab.recordings.recording import Recording
from armlab.report.changes.comparison_report import (
    _amount,
    _surest_first,
    comparison_lines,
    comparison_sentences,
    deciding_steps,
    detectable_sentence,
    make_comparison_file,
)
from problem.regressor import rigid_body_torque

pytestmark = pytest.mark.usefixtures("each_diagnosed_once")

LESS = (VISCOUS[0], VISCOUS[1] - 0.3, VISCOUS[2])


@cache
def recording(name: str, seed: int, viscous: tuple[float, ...] = VISCOUS, mass: float = 0.0) -> Recording:
    runs = [frame(seed + each, 6, viscous, mass) for each in range(2)]
    return load_recording(recording_in(Path(mkdtemp()) / name, *runs))


def test_the_laws_in_common_do_not_depend_on_the_order_of_the_recordings() -> None:
    """One law at a place, the widest form, without those that it contains: the way back mirrors the way there."""
    narrow = [CoulombFriction.at(ARM, 1), Slopes.at(ARM, 1), ViscousFriction.at(ARM, 2)]
    wide = [LevelsAndSlopes.at(ARM, 1)]
    models = [SimpleNamespace(structure=SimpleNamespace(components=own)) for own in (narrow, wide)]
    diagnoses = [SimpleNamespace(model=model) for model in models]
    there, back = unite_candidates(diagnoses), unite_candidates(diagnoses[::-1])
    assert there == back == (LevelsAndSlopes.at(ARM, 1), ViscousFriction.at(ARM, 2))


def test_a_gain_has_no_level_where_the_recordings_have_it_by_sign_in_common() -> None:
    """Its change is told alone, since two numbers of the wider form are no level of one."""
    by_sign, gain = TorqueGainBySign.at(ARM, 2), TorqueGain.at(ARM, 2)
    pooled = SimpleNamespace(design=SimpleNamespace(blocks=[SimpleNamespace(candidate=by_sign)]))
    group = SimpleNamespace(candidate=gain, laws=(), parts=(), whole_law=False, common=np.array([0, 1]))
    table = SimpleNamespace(groups=[group], contrast=np.array([[-0.5], [0.5]]))
    ((law, numbers, _),) = laws_of(pooled, table, (), SimpleNamespace(group=0, values=np.array([0.1])))
    assert not law.known
    assert_allclose(numbers, [[-0.05], [0.05]])


@cache
def comparison(kind: str) -> Comparison:
    old = recording("cold", 0)
    new = {
        "itself": lambda: old,
        "same": lambda: recording("again", 10),
        "warm": lambda: recording("warm", 10, LESS),
        "loaded": lambda: recording("loaded", 10, VISCOUS, 0.5),
    }
    return compare(old, new[kind]())


def changed(found: Comparison) -> list[Change]:
    return [each for each in found.changes if each.changed and each.parameter != ALL_FRICTION]


def test_a_recording_compared_with_itself_has_no_difference_in_any_parameter() -> None:
    found = comparison("itself")
    assert found.status == "same"
    assert max(abs(each.difference) / each.detectable for each in found.changes) < 1e-6


def test_two_recordings_of_an_unchanged_robot_are_the_same() -> None:
    found = comparison("same")
    assert found.status == "same"
    assert changed(found) == []
    first, second = comparison_sentences(found)
    assert first == "Nothing changed between cold and again that the recordings show."
    assert "Smaller changes than these would not have been seen" in second


def test_of_a_change_of_play_the_surest_number_leads_and_all_friction_is_one() -> None:
    def row(parameter: str, difference: float) -> SimpleNamespace:
        return SimpleNamespace(
            effect="backlash",
            joint=1,
            parameter=parameter,
            difference=difference,
            interval=(difference - 1, difference + 1),
        )

    gap, way, whole = row("gap", 0.1), row("way", 3.0), row(ALL_FRICTION, 5.0)
    named = SimpleNamespace(effect="backlash", joint=1, form=None, changes=(gap, way))
    comparison = SimpleNamespace(changes=(gap, way, whole))
    ordered = _surest_first(cast(Comparison, comparison), cast(Any, named))
    assert [each.parameter for each in ordered] == [ALL_FRICTION, "way", "gap"]


@pytest.mark.parametrize(("detectable", "text"), [(0.5, "25 %"), (2.0, "100 %"), (6.0, "4-fold")])
def test_a_level_that_would_have_to_change_by_more_than_itself_is_told_as_a_multiple(
    detectable: float, text: str
) -> None:
    change = SimpleNamespace(
        effect="coulomb_friction",
        parameter="level",
        changed=False,
        detectable=detectable,
        levels=(2.0, 2.0),
        unit="N.m",
    )
    sentence = detectable_sentence(cast(Comparison, SimpleNamespace(changes=(change,))))
    assert sentence.endswith(f"Coulomb friction {text}.")


def test_levels_in_common_are_those_of_the_robot() -> None:
    """A torque constant that may drift makes them wider, not smaller.

    Joint 3 comes out 1.2 % high from one recording alone, where all rows count.
    """
    rows = [each for each in comparison("same").changes if each.effect == "viscous_friction"]
    assert len(rows) == len(ARM)
    for each in rows:
        assert each.levels is not None
        assert each.joint is not None
        assert np.mean(each.levels) == pytest.approx(VISCOUS[each.joint - 1], rel=0.015)


def test_friction_that_fell_is_named_with_its_percent() -> None:
    found = comparison("warm")
    assert found.status == "changed"
    assert [(each.effect, each.joint) for each in found.findings] == [("viscous_friction", 2)]
    (change,) = changed(found)
    assert (change.effect, change.joint, change.parameter) == ("viscous_friction", 2, "coefficient")
    low, high = change.interval
    assert low < -0.3 < high
    assert high - low < 0.05
    assert change.old == pytest.approx(VISCOUS[1], abs=0.03)
    assert change.ratio is not None
    assert change.ratio[1] < LESS[1] / VISCOUS[1] < change.ratio[2]
    first, second = comparison_sentences(found)
    assert re.search(r"viscous friction at joint 2 \(.*%", first)
    assert len(f"{first} {second}".split()) <= 70


def test_the_other_way_round_the_change_is_the_mirror_image() -> None:
    (forward,) = comparison("warm").findings
    (back,) = compare(recording("warm", 10, LESS), recording("cold", 0)).findings
    assert (forward.effect, forward.joint) == (back.effect, back.joint)
    assert forward.changes[0].difference == pytest.approx(-back.changes[0].difference, rel=1e-3)


def test_a_changed_load_is_a_payload() -> None:
    (load,) = comparison("loaded").findings
    assert (load.effect, load.joint) == ("payload", 3)
    assert [(each.effect, each.joint) for each in load.rivals][-1] == ("inertial_parameter_error", 3)


def test_a_change_whose_name_is_not_sure_is_told_by_its_class() -> None:
    (load,) = comparison("loaded").findings
    near, far = Rival("encoder_offset", 2, (2,), deficit=1.0), Rival("coulomb_friction", 1, (1,), deficit=4.0)
    unsure = replace(load, probability=1 / (1 + np.exp(-1) + np.exp(-4)), rivals=(near, far, *load.rivals))
    assert sum(each.probability for each in unsure.members) == pytest.approx(1)
    first, _ = comparison_sentences(replace(comparison("loaded"), findings=(unsure,)))
    assert "this changed: payload at link 3 or encoder offset at joint 2 (mass" in first
    text = " ".join(" ".join(comparison_lines(replace(comparison("loaded"), findings=(unsure,)))).split())
    assert "could also be Coulomb friction at joint 1 and inertial parameter error at link 3" in text
    decides = (
        "next: To tell payload at link 3 from encoder offset at joint 2 or Coulomb friction at joint 1: repeat the"
    )
    assert decides in text
    assert not list(deciding_steps(comparison("loaded")))  # an error of the link is the same whatever moves
    one_place = replace(load, effect="torque_offset", joint=2, probability=1 / (1 + np.exp(-1)), rivals=(near,))
    first, _ = comparison_sentences(replace(comparison("loaded"), findings=(one_place,)))
    assert "torque offset or encoder offset at joint 2 (" in first


def test_what_plain_least_squares_sees_beyond_eight_standard_errors_is_never_the_same() -> None:
    """And where nothing changed, it sees nothing there: else it would be no yardstick."""
    old, simulation = recording("cold", 0), read_simulation(recording("cold", 0), None)
    nulls = [recording("again", 10), recording("again-2", 80)]
    more = [recording(f"friction-{size}", 82, (VISCOUS[0], size, VISCOUS[2])) for size in (0.2, 0.6, 1.5, 3.0)]
    more += [recording(f"load-{mass}", 84, VISCOUS, mass) for mass in (0.25, 1.0, 3.0)]
    beyond = 0
    for new in (*nulls, *more):
        plain = compare_plain(old.arm, old.runs, new.runs)
        seen = look_plainly([old, new], simulation, Settings())
        assert seen is not None
        if new in nulls:
            assert np.abs(plain.in_errors).max() < 8
            assert not seen.sound.named
        elif np.abs(plain.in_errors).max() > 8:
            beyond += 1
            assert seen.sound.named
    assert beyond > 2


def test_both_laws_of_friction_that_changed_are_one_cause_with_a_row_each() -> None:
    """Coulomb friction grows by 0.5 N m, and viscous friction falls by 0.3 N m s/rad."""
    old, less = recording("cold", 0), recording("warm", 10, LESS)
    grown = []
    for run in less.runs:
        drag = 0.5 * np.tanh(np.gradient(run.position[:, 1], run.time) / 0.02)
        grown.append(run.with_signals(run.time, {"torque": run.torque + np.outer(drag, [0, 1, 0])}))
    (named,) = compare(old, replace(less, runs=tuple(grown))).findings
    assert named.joint == 2
    sizes = {each.effect: each.interval for each in named.changes}
    assert sizes.keys() == {"coulomb_friction", "viscous_friction"}
    assert sizes["coulomb_friction"][0] < 0.5 < sizes["coulomb_friction"][1]
    assert sizes["viscous_friction"][0] < -0.3 < sizes["viscous_friction"][1]


def test_a_single_run_that_tells_nothing_of_its_scatter_needs_more_evidence() -> None:
    old, new = recording("cold", 0), recording("again", 10)
    simulation = read_simulation(old, None)
    alone = pool_plainly([one_run(old, old.runs[0]), new], simulation, Settings())
    assert alone.tuning.level < pool_plainly([old, new], simulation, Settings()).tuning.level


def test_intervals_of_unchanged_parameters_hold_zero() -> None:
    quiet = [each for each in comparison("warm").changes if not each.changed]
    assert len(quiet) > 15
    assert np.mean([each.interval[0] < 0 < each.interval[1] for each in quiet]) > 0.7


def test_a_change_is_as_large_as_what_would_have_been_seen_says() -> None:
    rows = [each for each in comparison("same").changes if (each.effect, each.joint) == ("viscous_friction", 2)]
    assert 0 < rows[0].detectable < 0.3


def test_a_drift_of_the_offset_within_runs_is_no_change_of_the_offset(tmp_path: Path) -> None:
    def drifting(seed: int) -> list[pd.DataFrame]:
        out = []
        for run in range(2):
            table = frame(seed + run, 6)
            wave = np.random.default_rng(seed + run).normal(0, 1, 4)
            share = np.arange(len(table)) / len(table)
            table["tau2"] += 0.2 * sum(size * np.cos(np.pi * order * share) for order, size in enumerate(wave))
            out.append(table)
        return out

    old = load_recording(recording_in(tmp_path / "old", *drifting(0)))
    new = load_recording(recording_in(tmp_path / "new", *drifting(10)))
    assert compare(old, new).status == "same"


def test_all_friction_of_a_joint_is_told_as_one_level() -> None:
    (level,) = [each for each in comparison("warm").changes if each.parameter == ALL_FRICTION]
    time = np.arange(1200) / 200
    speed = np.concatenate([motion_at(time, seed).velocity[:, 1] for seed in (0, 1, 10, 11)])
    mean = 1.5 * np.sign(speed) + (VISCOUS[1] - 0.15) * speed
    change = -0.3 * float(speed @ mean) / float(np.sqrt(len(mean) * (mean @ mean)))
    assert level.difference == pytest.approx(change, rel=0.1)
    assert level.interval[0] < change < level.interval[1]


DAMPER_LAWS = {"coulomb_friction", "viscous_friction", "presliding_hysteresis", "backlash", "asymmetric_friction"}


@needs_copies(*(f"friction-damper-{tension}-lb" for tension in (20, 25, 35, 80)))
@pytest.mark.parametrize("tensions", list(combinations((20, 25, 35, 80), 2)))
def test_a_damper_at_another_tension_has_other_friction_and_no_other_fault(
    tensions: tuple[int, int], tmp_path: Path
) -> None:
    """The interval of new over old level holds the ratio of the forces themselves, run by run."""
    names = [f"friction-damper-{each}-lb" for each in tensions]
    opened = [load_recording(fetch_recording(name, tmp_path / name)) for name in names]
    found = compare(opened[0], opened[1], baseline="refit")
    assert found.findings
    assert {each.effect for each in found.findings} <= DAMPER_LAWS
    (level,) = [each for each in found.changes if each.parameter == ALL_FRICTION]
    assert level.ratio is not None
    for old, new in zip(opened[0].runs, opened[1].runs, strict=True):
        assert level.ratio[1] < np.sqrt(np.mean(new.torque**2) / np.mean(old.torque**2)) < level.ratio[2]


def test_where_the_runs_of_one_recording_differ_as_much_nothing_is_sure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soundness, "runs_differ_as_much", lambda *_: True)
    found = compare(recording("cold", 0), recording("warm", 10, LESS))
    assert found.status == "inconclusive"
    assert found.doubtful is not None
    assert (found.doubtful.effect, found.doubtful.joint) == ("viscous_friction", 2)
    first, second = comparison_sentences(found)
    assert first == "No change between cold and warm is sure."
    assert second.startswith("Perhaps viscous friction at joint 2")
    assert "record more runs" in second
    assert make_comparison_file(found).doubtful is not None


@needs_copies("emps")
def test_the_friction_that_differs_between_two_runs_is_what_constant_speed_shows(tmp_path: Path) -> None:
    """The force at constant speed is read without any model."""
    whole = load_recording(fetch_recording("emps", tmp_path / "emps"))
    found = compare(*(one_run(whole, run) for run in whole.runs))
    (named,) = found.findings
    changes = {each.parameter: np.array(each.interval) for each in named.changes}
    sides = ("positive", "negative")
    assert set(changes) <= {"level", "coefficient", *sides, *(f"{side}_slope" for side in sides)}
    forces, speeds = [], []
    for run in whole.runs:
        step = float(np.median(np.diff(run.time)))
        speed, acceleration = (savgol_filter(run.position[:, 0], 101, 2, deriv=each, delta=step) for each in (1, 2))
        steady = (np.abs(speed) > 0.08) & (np.abs(acceleration) < 0.03)
        forces.append(np.mean(np.sign(speed[steady]) * run.torque[steady, 0]))
        speeds.append(np.mean(np.abs(speed[steady])))
    level, slopes = (changes.get(name, np.zeros(2)) for name in ("level", "coefficient"))
    if "positive" in changes:
        both = (changes["positive"] + changes["negative"]) / 2
        if "positive_slope" in changes:
            level, slopes = both, (changes["positive_slope"] + changes["negative_slope"]) / 2
        else:
            slopes = both
    low, high = level + slopes * np.mean(speeds)
    assert low < forces[1] - forces[0] < high


def test_notes_say_which_columns_are_not_used() -> None:
    old, new = recording("cold", 0), recording("again", 10)
    runs = tuple(replace(run, simulated_torque=run.torque, simulated_position=run.position) for run in new.runs)
    notes = compare(old, replace(new, runs=runs)).notes
    assert ["simulated_torque" in notes[0], "simulated_position" in notes[1]] == [True, True]


def test_the_old_model_predicts_its_own_robot() -> None:
    old = comparison("same").diagnoses[0]
    time = np.arange(800) / 200
    motion = motion_at(time, 77)
    zero = np.zeros(motion.position.shape)
    torque = model_found(old).torque_in(Scene("run", time, motion, ARM, ARM.parameters, zero))
    truth = rigid_body_torque(ARM, motion) + np.array(VISCOUS) * motion.velocity
    truth += np.array([1.0, 1.5, 0.7]) * np.sign(motion.velocity)
    assert np.all(np.sqrt(np.mean((torque - truth) ** 2, axis=0)) < 0.1)


def test_another_robot_is_refused_in_one_line(tmp_path: Path) -> None:
    turned = recording_in(tmp_path / "turned", frame(0, 8), frame(1, 8), robot="irb120-arm")
    other = load_recording(turned)
    shorter = ARM.first(2)
    message = refusal(compare, recording("cold", 0), Recording(other.folder, "x", shorter, (), other.transmission))
    assert "not the same geometry" in message


def test_a_recording_that_allows_no_verdict_allows_no_comparison(tmp_path: Path) -> None:
    short = load_recording(recording_in(tmp_path / "short", frame(0, 0.8), frame(1, 0.8)))
    found = compare(recording("cold", 0), short)
    assert found.status == "inconclusive"
    assert "too short" in " ".join(comparison_sentences(found))


def test_links_and_friction_answer_alone_where_motion_is_too_short_for_more(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: object) -> None:
        raise DataError("joint 1 is never in motion for 1.8 s on end")

    monkeypatch.setattr("armlab.diagnosis.changes.comparison.pool_recordings", refuse)
    diagnoses = comparison("same").diagnoses
    old, again = recording("cold", 0), recording("again", 10)
    assert compare_with((old, again), lambda: diagnoses, None, ()).status == "same"
    monkeypatch.setattr("armlab.diagnosis.changes.comparison.look_plainly", lambda *given: None)
    refused = compare_with((old, again), lambda: diagnoses, None, ())
    assert (refused.status, refused.reason) == ("inconclusive", "joint 1 is never in motion for 1.8 s on end")


def test_json_and_terminal_tell_the_change(tmp_path: Path) -> None:
    content = json.loads(make_comparison_file(comparison("warm")).to_json())
    check_against_schema(content, "comparison")
    assert [each["parameter"] for each in content["changes"] if each["changed"]] == ["coefficient", ALL_FRICTION]
    assert [(each["effect"], each["joint"]) for each in content["findings"]] == [("viscous_friction", 2)]
    assert sum(each["probability"] for each in content["findings"][0]["class"]) == pytest.approx(1)
    text = " ".join(comparison_lines(comparison("warm")))
    assert "viscous friction at joint 2" in text
    assert max(map(len, comparison_lines(comparison("warm")))) < 180


def test_holm_multiplies_the_smallest_by_all_and_keeps_the_order() -> None:
    assert_allclose(adjust_by_holm(np.array([0.04, 0.01, 0.5])), [0.08, 0.03, 0.5])
    assert_allclose(adjust_by_holm(np.array([0.02, 0.01])), [0.02, 0.02])


def test_the_command_writes_page_and_json(tmp_path: Path) -> None:
    old = recording_in(tmp_path / "old", frame(0, 6), frame(1, 6))
    new = recording_in(tmp_path / "new", frame(2, 6, LESS), frame(3, 6, LESS))
    arguments = ["diagnose", "--compare", str(old), str(new), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert {each.name for each in (tmp_path / "out").iterdir()} == {"comparison.json", "comparison.html"}
    page = (tmp_path / "out" / "comparison.html").read_text()
    assert "What changed between old and new" in page
    assert f"armlab {' '.join(arguments)}" in page
    assert json.loads((tmp_path / "out" / "comparison.json").read_text())["status"] == "changed"


def worn(viscous: float, seed: int) -> Recording:
    return recording(f"worn-{seed}", seed, (VISCOUS[0], viscous, VISCOUS[2]))


def test_friction_that_changes_once_has_a_change_point() -> None:
    found = compare(*(worn(size, 20 + number) for number, size in enumerate((1.0, 1.0, 1.0, 1.4, 1.4))))
    (trend,) = found.trends
    assert (trend.movement.effect, trend.movement.joint, trend.kind) == ("viscous_friction", 2, "step")
    assert trend.change_point == 3
    assert_allclose(trend.values, [1.0, 1.0, 1.0, 1.4, 1.4], atol=0.03)
    content = json.loads(make_comparison_file(found).to_json())
    check_against_schema(content, "comparison")
    assert content["trends"][0]["change_point"] == 3
    assert "changes once" in " ".join(comparison_lines(found))


def test_friction_that_grows_steadily_has_a_slope_per_day() -> None:
    days = [date(2026, 1, day) for day in (1, 11, 21, 31)]
    found = compare(*(worn(1 + 0.1 * number, 40 + number) for number in range(4)), dates=days)
    (trend,) = found.trends
    assert trend.kind == "slope"
    assert trend.slope == pytest.approx(0.01, abs=0.001)


def test_dates_have_to_be_as_many_as_recordings() -> None:
    message = refusal(compare, recording("cold", 0), recording("again", 10), dates=[date(2026, 1, 1)])
    assert "1 dates for 2 recordings" in message


def _change(first: float, last: float, ratio: tuple[float, float, float] | None) -> Change:
    """Of a first moment. ratio: with its interval."""
    interval = (last - first - 0.01, last - first + 0.01)
    return Change("payload", 1, (1,), "mcx", (first, last), last - first, interval, ratio, "kg.m", 1e-6, 0.01, True)


def test_a_change_is_told_in_percent_only_where_that_is_well_known() -> None:
    assert _amount(_change(0.1, 0.16, (1.6, 1.3, 2.0))) == "first moment x from 0.1 to 0.16 kg m, +60 % (+30 to +100 %)"
    wide = _change(0.1, 0.16, (1.6, 0.1, 30.0))
    assert _amount(wide, short=True) == "first moment x from 0.1 to 0.16 kg m"
    assert _amount(wide) == "first moment x from 0.1 to 0.16 kg m, a difference of 0.06 (0.05 to 0.07) kg m"
    assert _amount(_change(0.1, -2e-5, None), short=True) == "first moment x from 0.1 to 0 kg m"


@pytest.mark.parametrize(
    ("seconds", "told"), [(0.02, "20 (10 to 30) ms later"), (-0.02, "20 (10 to 30) ms earlier"), (0.005, "seconds")]
)
def test_a_shift_in_time_is_told_as_later_or_earlier(seconds: float, told: str) -> None:
    interval = (seconds - 0.01, seconds + 0.01)
    shift = Change("time_delay", None, (), "seconds", None, seconds, interval, None, "s", 1e-6, 0.01, True)
    assert _amount(shift).startswith(told)


@pytest.mark.parametrize("scale", [0.5, 0.9, 2.0])
def test_torque_that_is_read_by_another_scale_has_that_gain_and_nothing_else(scale: float) -> None:
    old = recording("cold", 0)
    found = compare(old, scaled(old, 1, scale))
    (gain,) = found.findings
    assert (gain.effect, gain.joint) == ("torque_gain_error", 2)
    (change,) = gain.changes
    assert change.ratio is not None
    assert change.ratio[1] < scale < change.ratio[2]
    assert gain.parameters[0].value == pytest.approx(change.ratio[0])
    assert change.ratio[0] == pytest.approx(scale, rel=0.03)


@pytest.mark.parametrize("seconds", [0.01, -0.05])
def test_torque_that_is_recorded_later_has_that_delay_and_nothing_else(seconds: float) -> None:
    old = recording("cold", 0)
    found = compare(old, delayed(old, seconds))
    (late,) = found.findings
    assert (late.effect, late.joint) == ("time_delay", None)
    (change,) = late.changes
    assert change.difference == pytest.approx(seconds, rel=0.1)


@pytest.mark.parametrize(("difference", "share"), [(0.4, 0.5), (-0.4, -1 / 3), (2.0, None), (-3.0, None)])
def test_a_scale_is_a_share_of_the_first_recording_where_that_has_torque(
    difference: float, share: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armlab.diagnosis.changes.numbers.mean_of_scale", lambda *given: np.ones(1))
    table: Any = SimpleNamespace(groups=[SimpleNamespace(candidate=TorqueGain.at(ARM, 2))])
    tested: Any = SimpleNamespace(group=0)
    found = as_share_of_first(table, table, tested, np.array([difference]), np.eye(1))
    assert (found is None) == (share is None)
    if found is not None:
        assert found[0] == pytest.approx([share])
        assert found[1] == pytest.approx(np.eye(1) / (1 - difference / 2) ** 4)
