"""Cases of the closed loop in the truth machine, with a diagnosis and a design that are made up."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from refusals import refusal

from armlab.common.arrays import Array
from armlab.proof.blind.arms import make_machine
from armlab.proof.blind.formats import Manifest
from armlab.proof.blind.loop import case
from armlab.proof.blind.loop.case import Forecast, SecondMotion, Tools, play_case
from armlab.proof.blind.loop.recordings import (
    draw_case,
    poor_reference,
    simulate_first_recording,
    simulate_second_recording,
    write_loop_recording,
)
from armlab.proof.blind.loop.run import ANSWERS_FILE, LoopSettings, close_loop, play_cases, read_results, seal_loop
from armlab.proof.blind.sealed import read_checked_manifest
from armlab.recordings.load import load_recording

SECONDS, RATE_HZ = 2.0, 250.0


def gentle() -> Array:
    """A motion from rest to rest of all joints, (samples, 1 + joints)."""
    time = np.linspace(0, SECONDS, round(SECONDS * RATE_HZ) + 1)
    share = time / SECONDS
    swing = 64 * (share * (1 - share)) ** 3
    return np.column_stack([time, *(0.2 * number * swing for number in (1, 2, -1))])


def diagnose(recording: Path, out: Path) -> None:
    """A verdict that doubts at first and is sure with three runs, of an effect that nobody hid."""
    runs = yaml.safe_load((recording / "recording.yaml").read_text())["runs"]
    rivals = [] if len(runs) == 3 else [{"effect": "nothing", "joint": 1}]
    out.mkdir(parents=True)
    findings = [{"effect": "torque_ripple", "joint": 1, "rivals": rivals}]
    (out / "verdict.json").write_text(json.dumps({"findings": findings}))


def suspect(verdict: Path, robot: Path, recording: Path) -> list[list[Any]]:
    """No doubt."""
    return []


def move(kind: str, verdict: Path, robot: Path, recording: Path, seed: int) -> SecondMotion:
    """The same motion for every kind."""
    names = frozenset({("time_delay", None), ("viscous_friction", 2)})
    return SecondMotion(gentle(), (Forecast(names, 0.7, 0.1, 0.2),))


TOOLS = Tools(diagnose, suspect, move)


def test_poor_motions_stay_far_below_what_the_arm_may_do() -> None:
    made, time = make_machine("irb120-arm"), np.arange(0, 8, 1e-3)
    for seed in range(20):
        position = poor_reference(np.random.default_rng(seed), time, made)
        speed = np.abs(np.gradient(position, 1e-3, axis=0)).max(axis=0)
        assert (speed < 0.65 * made.speed).all()
        assert (position > made.range[0]).all()
        assert (position < made.range[1]).all()


def test_a_draw_depends_on_seed_case_and_attempt_alone() -> None:
    one, same, other = draw_case(1700, 3, 1), draw_case(1700, 3, 1), draw_case(1700, 3, 2)
    assert (one.pair, one.effect, one.target) == (same.pair, same.effect, same.target)
    assert one.plan.name != other.plan.name


def test_a_second_recording_holds_the_first_runs_and_the_motion_that_was_asked_for(tmp_path: Path) -> None:
    first = simulate_first_recording(draw_case(1700, 0, 0))
    write_loop_recording(first.simulated, tmp_path / "first", tmp_path / "first.json")
    write_loop_recording(
        simulate_second_recording(first, gentle(), "designed"), tmp_path / "both", tmp_path / "both.json"
    )
    for run in ("run-1.parquet", "run-2.parquet"):
        assert pd.read_parquet(tmp_path / "first" / run).equals(pd.read_parquet(tmp_path / "both" / run))
    recording = load_recording(tmp_path / "both")
    third, asked = recording.runs[2], gentle()
    wanted = np.column_stack([np.interp(third.time, asked[:, 0], column) for column in asked.T[1:]])
    assert third.role == "identify"
    assert np.abs(third.position - wanted).max() < 0.06  # servos follow imperfectly


def test_the_limits_for_second_motions_lie_within_those_of_the_arm(tmp_path: Path) -> None:
    write_loop_recording(
        simulate_first_recording(draw_case(1700, 0, 0)).simulated, tmp_path / "first", tmp_path / "first.json"
    )
    limits = yaml.safe_load((tmp_path / "first/limits.yaml").read_text())["joints"]
    made = make_machine("irb120-arm")
    assert [joint["velocity_limit"] for joint in limits] == pytest.approx((0.35 * made.speed).tolist())
    assert all(joint["position_limits"][0] > low for joint, low in zip(limits, made.range[0], strict=True))


def test_draws_without_doubt_are_passed_over_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case, "MAX_ATTEMPTS", 1)
    settings = LoopSettings(1, 1700)
    seal_loop(settings, tmp_path / "loop")
    list(play_cases(settings, tmp_path / "loop", TOOLS, 1))
    assert [each["start"] for each in read_results(settings, tmp_path / "loop")[0]["passed"]] == ["another class"]


def test_an_ambiguous_case_is_played_with_all_three_second_motions(tmp_path: Path) -> None:
    hidden = draw_case(1700, 0, 0)

    def told(recording: Path, out: Path) -> None:
        runs = yaml.safe_load((recording / "recording.yaml").read_text())["runs"]
        truth = {"effect": hidden.effect.effect, "joint": hidden.effect.place}
        rivals = [] if len(runs) == 3 else [{"effect": "torque_ripple", "joint": 1}]
        out.mkdir(parents=True)
        (out / "verdict.json").write_text(json.dumps({"findings": [{**truth, "rivals": rivals}]}))

    settings, out = LoopSettings(1, 1700), tmp_path / "loop"
    answers = seal_loop(settings, out)
    list(play_cases(settings, out, Tools(told, suspect, move), 1))
    found = read_results(settings, out)[0]
    assert found["start"] == "told"
    assert found["ends"] == {"designed": "right", "random": "right", "condition": "right"}
    assert found["forecast"] == {kind: [0.7, 0.1, 0.2] for kind in ("designed", "random", "condition")}
    close_loop(settings, out, answers)
    assert read_checked_manifest(out, Manifest)[0].cases == (found["name"],)
    assert seal_loop(settings, out) == answers
    assert not list(play_cases(settings, out, Tools(told, suspect, move), 1))  # nothing is left to do


def test_a_folder_of_another_seed_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "loop"
    (out / "cases").mkdir(parents=True)
    (out / "settings.json").write_text('{"cases": 1, "seed": 1}\n')
    assert "another set" in refusal(seal_loop, LoopSettings(1, 2), out)


def test_answers_that_were_changed_after_the_seal_are_refused(tmp_path: Path) -> None:
    settings = LoopSettings(1, 1700)
    answers = seal_loop(settings, tmp_path)
    path = tmp_path / "truth" / ANSWERS_FILE
    path.write_text(path.read_text().replace('"attempt": 0', '"attempt": 1'))
    assert "was changed" in refusal(close_loop, settings, tmp_path, answers)
    assert "other answers" in refusal(seal_loop, settings, tmp_path)


def test_a_design_that_cannot_help_leaves_the_question_open(tmp_path: Path) -> None:
    hidden = draw_case(1700, 0, 0)

    def told(recording: Path, out: Path) -> None:
        truth = {"effect": hidden.effect.effect, "joint": hidden.effect.place}
        out.mkdir(parents=True)
        rivals = [{"effect": "torque_ripple", "joint": 1}]
        (out / "verdict.json").write_text(json.dumps({"findings": [{**truth, "rivals": rivals}]}))

    for part in ("truth", "observations", "verdicts"):
        (tmp_path / part).mkdir()
    found = play_case(1700, 0, tmp_path, Tools(told, suspect, lambda *given: None))
    assert set(found["ends"].values()) == {"open"}


def test_a_design_that_fails_leaves_the_question_open_and_is_told(tmp_path: Path) -> None:
    hidden = draw_case(1700, 0, 0)

    def told(recording: Path, out: Path) -> None:
        truth = {"effect": hidden.effect.effect, "joint": hidden.effect.place}
        out.mkdir(parents=True)
        rivals = [{"effect": "torque_ripple", "joint": 1}]
        (out / "verdict.json").write_text(json.dumps({"findings": [{**truth, "rivals": rivals}]}))

    def broken(kind: str, verdict: Path, robot: Path, recording: Path, seed: int) -> SecondMotion:
        raise ValueError("no columns")

    for part in ("truth", "observations", "verdicts"):
        (tmp_path / part).mkdir()
    found = play_case(1700, 0, tmp_path, Tools(told, suspect, broken))
    assert set(found["ends"].values()) == {"open"}
    assert found["failed"] == dict.fromkeys(("designed", "random", "condition"), "no columns")
