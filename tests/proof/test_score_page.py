"""What became of each case, the page of a score, and the gallery."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from click.testing import CliRunner
from made_answers import COULOMB, NULL, OUTSIDE, effect, judged, scored, truth
from made_verdicts import finding, perfect, verdict

from armlab.cli.main import main
from armlab.common.arrays import Array
from armlab.proof.blind.arms import make_machine
from armlab.proof.blind.formats import Truth
from armlab.proof.blind.score import held_out
from armlab.proof.blind.score.cases import MISSING_VERDICT, STEPS_FILE, JudgedCase
from armlab.proof.blind.score.figures import draw_confusion, draw_figures
from armlab.proof.blind.score.gallery import CASES_PER_GROUP, choose_items, tally_outcomes, write_gallery
from armlab.proof.blind.score.held_out import Gap, HeldOut, filter_held_out_run, measure_gap_closed, rms
from armlab.proof.blind.score.measures import Measure, arm_table, compute_measures, confusion_table
from armlab.proof.blind.score.outcomes import OUTCOME_GROUPS, list_misses, list_outcomes
from armlab.proof.blind.score.rows import make_rows
from armlab.proof.blind.score.score_page import SHOWN_MISS_COLUMNS, format_measure, judge_measure, render_page
from armlab.proof.blind.score.scoring import ROW_TABLES, write_page_again
from armlab.proof.blind.score.words import describe_hidden, describe_said
from armlab.proof.blind.simulate import rigid_torque
from problem.motion import Motion

ELSEWHERE = verdict("mismatch", (finding("backlash", 3),))
UNEXPLAINED = verdict("mismatch", unexplained=[{"joint": 1, "share": 0.5, "depends_on": ["position_1"]}])


@pytest.mark.parametrize(
    ("answer", "said", "groups"),
    [
        (COULOMB, perfect(COULOMB), ["named"]),
        (
            COULOMB,
            verdict("mismatch", (finding("stribeck_friction", 2, rivals=("coulomb_friction",)),)),
            ["class"],
        ),
        (COULOMB, verdict(), ["missed"]),
        (COULOMB, MISSING_VERDICT, ["missed"]),
        (COULOMB, ELSEWHERE, ["missed", "wrong claim"]),
        (COULOMB, verdict("mismatch", (finding("coulomb_friction", 3),)), ["wrong claim"]),
        (truth(effect("coulomb_friction", 2, 2.9)), verdict(), []),
        (OUTSIDE, perfect(OUTSIDE), ["unknown"]),
        (OUTSIDE, verdict(), ["not unknown"]),
        (NULL, verdict(), ["silent"]),
        (NULL, ELSEWHERE, ["false claim"]),
        (NULL, UNEXPLAINED, ["false unknown"]),
        (NULL, MISSING_VERDICT, ["no verdict"]),
    ],
)
def test_every_case_is_a_success_or_a_failure_of_one_kind(
    answer: Truth, said: dict[str, Any], groups: list[str]
) -> None:
    assert list_outcomes(scored((answer, said)))["group"].tolist() == groups


def test_the_gallery_takes_the_first_cases_of_each_group_in_the_order_of_the_manifest() -> None:
    table = scored(*((COULOMB, verdict() if number % 2 else perfect(COULOMB)) for number in range(8)))
    picked = choose_items(table).groupby("group")["case"].apply(list)
    assert CASES_PER_GROUP == 2
    assert picked["missed"] == ["c1", "c3"]
    assert picked["named"] == ["c0", "c2"]
    assert "| Not named | failure | 4 |" in tally_outcomes(table)


def test_each_miss_has_a_row_that_says_what_was_hidden_and_what_was_said() -> None:
    pairs = ((COULOMB, perfect(COULOMB)), (COULOMB, ELSEWHERE), (OUTSIDE, verdict()), (NULL, ELSEWHERE))
    cases = [judged(answer, said, f"c{number}") for number, (answer, said) in enumerate(pairs)]
    table = list_misses(cases, make_rows(cases))
    assert table["miss"].tolist() == ["missed", "not unknown", "wrong claim", "false claim"]
    assert table["case"].tolist() == ["c1", "c2", "c1", "c3"]
    missed = table.iloc[0]
    assert (missed["effect"], missed["law"], missed["joint"], missed["limits"]) == ("coulomb_friction", "x", 2, 8.0)
    assert (missed["hidden"], missed["said"]) == ("coulomb_friction, joint 2, 8.0 limits", "backlash, joint 3 [wrong]")


@pytest.mark.parametrize(
    ("steps", "why"),
    [
        (["+ payload 2"], "never in a model"),
        (["+ coulomb_friction 2", "- coulomb_friction 2"], "taken out by the search"),
        (
            ["+ coulomb_friction 2", "coulomb_friction 2 -> friction_curve 2 (3,)"],
            "friction_curve 2 (3,) took its place",
        ),
        (["withdrawn: coulomb_friction 2: p = 0.2", "+ coulomb_friction 21"], "p = 0.2"),
        (["friction_curve 2 -> coulomb_friction 2"], "in the model, not told"),
    ],
)
def test_a_miss_says_what_the_diagnosis_did_with_it_last(tmp_path: Path, steps: list[str], why: str) -> None:
    (tmp_path / STEPS_FILE).write_text(json.dumps({"steps": [{"what": each} for each in steps]}))
    case = replace(judged(COULOMB, verdict()), folder=tmp_path)
    assert list_misses([case], make_rows([case]))["why"].tolist() == [why]


def test_answers_and_verdicts_in_words() -> None:
    values = {"level": {"value": 2.2, "ci95": [1.9, 2.5], "unit": "N.m"}}
    right = finding("coulomb_friction", 2, values, ("stribeck_friction",))
    background = finding("viscous_friction", 1)
    answer = truth(effect("coulomb_friction", 2, level=2.0), background=(effect("viscous_friction", 1),))
    case = judged(answer, verdict("mismatch", (right, background)))
    assert describe_hidden(case) == "coulomb_friction (x), joint 2, 8.0 limits: level = 2"
    told = "coulomb_friction, joint 2: level = 2.2 (1.9 to 2.5) N m (or stribeck_friction)"
    assert describe_said(case) == f"{told}; 1 right finding of the background"
    assert describe_said(judged(NULL, verdict())) == "nothing is missing"


@pytest.mark.parametrize(
    ("value", "low", "high", "wanted", "said"),
    [
        (0.01, 0.0, 0.015, "at most 2 %", "met, surely"),
        (0.01, 0.0, 0.03, "at most 2 %", "met, perhaps"),
        (0.85, 0.8, 0.95, "at least 90 %", "**not met**, perhaps"),
        (0.85, 0.8, 0.89, "at least 90 %", "**not met**, surely"),
        (0.99, 0.97, 1.0, "90-98 %", "**not met**, perhaps"),
        (0.0, 0.0, 0.1, "none", "met"),
        (0.5, 0.4, 0.6, "", "-"),
        (None, None, None, "at most 2 %", "-"),
    ],
)
def test_a_figure_is_held_against_what_is_wanted_with_its_interval(
    value: float | None, low: float | None, high: float | None, wanted: str, said: str
) -> None:
    assert judge_measure(Measure("a", value, low, high, 100, wanted, "share")) == said


def test_shares_are_shown_in_per_cent_and_times_in_seconds() -> None:
    assert format_measure(Measure("a", 0.012, 0.005, 0.03, 300, "", "share")) == "1.2 % (0.5 to 3)"
    assert format_measure(Measure("a", 3.5, None, None, 300, "", "s")) == "3.5 s"
    assert format_measure(Measure("a", None, None, None, 0, "")) == "-"


def test_the_page_puts_what_is_wanted_beside_what_was_found_and_names_the_misses() -> None:
    cases = [judged(COULOMB, verdict(), "c0"), judged(NULL, verdict(), "c1")]
    table = make_rows(cases)
    result = {"cases": 2, "seed": 1, "manifest": "abc", "development": True}
    result["tiers"] = {"clean": [vars(each) for each in compute_measures(table, "clean")]}
    text = render_page(table, result, list_misses(cases, table), ["gap"])
    above = (
        "| right name or class of four, above 3 limits | at least 90 % | 0 % (0 to 79.3) | 1 | **not met**, surely |"
    )
    assert above in text
    assert "| nulls with a false claim | at most 2 % | 0 % (0 to 79.3) | 1 | met, perhaps |" in text
    assert "| missed | c0 | clean | irb120-arm | coulomb friction | x | 2 | 8 |" in text
    assert "Development set" in text
    assert "(gap.svg)" in text
    assert "(seconds.svg)" not in text


def test_the_longest_diagnosis_is_on_the_page_beside_the_median() -> None:
    cases = [replace(judged(NULL, verdict(), f"c{seconds}"), seconds=float(seconds)) for seconds in (1, 2, 9)]
    found = {each.id: each.value for each in compute_measures(make_rows(cases), "clean")}
    assert (found["seconds_median"], found["seconds_longest"]) == (2.0, 9.0)
    assert arm_table(make_rows(cases))[["cases", "seconds, median", "seconds, longest"]].to_numpy().tolist() == [
        [3, 2.0, 9.0]
    ]


def test_a_null_without_a_verdict_is_not_counted_as_silent_in_the_confusion() -> None:
    counts = confusion_table(scored((NULL, MISSING_VERDICT), (NULL, verdict())), "clean")
    assert counts.loc["nothing"].to_dict() == {"invalid": 1, "none": 1}


def test_right_answers_stand_on_the_diagonal_of_the_matrix() -> None:
    hidden = truth(effect("torque_ripple", 2))
    table = confusion_table(scored((COULOMB, perfect(COULOMB)), (hidden, ELSEWHERE), (OUTSIDE, verdict())), "clean")
    axes = draw_confusion(table, "made by hand").axes[0]
    rows = [each.get_text() for each in axes.get_yticklabels()]
    columns = [each.get_text() for each in axes.get_xticklabels()]
    assert rows == ["coulomb friction  (1)", "torque ripple  (1)", "viscous map  (1)"]
    assert columns == ["coulomb friction", "torque ripple", "backlash", "nothing said"]


def test_a_figure_with_nothing_to_show_does_not_stay_from_an_older_score(tmp_path: Path) -> None:
    (tmp_path / "detection.svg").write_text("old", encoding="utf-8")
    drawn = draw_figures(scored((NULL, verdict())), tmp_path)
    assert {path.name for path in drawn} == {path.name for path in tmp_path.iterdir()}
    assert "detection.svg" not in {path.name for path in drawn}


# --- a case with Coulomb friction of 2 N m at joint 1, made without any engine

LEVEL, NOISE, RATE_HZ = 2.0, 0.05, 250.0
SCARA = make_machine("scara")


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> JudgedCase:
    """With a verdict whose prediction is the true torque."""
    folder = tmp_path_factory.mktemp("friction")
    recording, clean, own = folder / "recording", folder / "clean.parquet", folder / "verdict"
    recording.mkdir()
    (recording / "robot.yaml").write_text(yaml.safe_dump(SCARA.settings()), encoding="utf-8")
    (recording / "recording.yaml").write_text(yaml.safe_dump(_settings()), encoding="utf-8")
    for number, frequencies in enumerate(((0.31, 0.47), (0.43, 0.29)), 1):
        time, position, torque = _run(frequencies)
        noisy = torque + np.random.default_rng(number).normal(0, NOISE, torque.shape)
        columns = {"t": time, "q1": position[:, 0], "q2": position[:, 1], "tau1": noisy[:, 0], "tau2": noisy[:, 1]}
        pq.write_table(pa.table(columns), recording / f"run-{number}.parquet")
    pq.write_table(pa.table({"tau1": torque[:, 0], "tau2": torque[:, 1]}), clean)
    (own / "predicted").mkdir(parents=True)
    predicted = pd.DataFrame({"t": time, "tau1": torque[:, 0], "tau2": torque[:, 1]})
    predicted.to_csv(own / "predicted" / "run-2.csv", index=False)
    hidden = truth(effect("coulomb_friction", 1, level=LEVEL))
    answer = hidden.model_copy(update={"case": "friction", "arm": "scara", "joints": 2})
    return JudgedCase(answer, perfect(answer), recording, clean, own, 1.0)


def _settings() -> dict[str, Any]:
    columns = {"time": "t", "position": ["q1", "q2"], "torque": ["tau1", "tau2"]}
    runs = [{"file": "run-1.parquet", "role": "identify"}, {"file": "run-2.parquet", "role": "validate"}]
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    robot = {"schema": "recording/1", "robot": "robot.yaml", "sample_rate_hz": RATE_HZ}
    return {**robot, "columns": columns, "units": units, "runs": runs}


def _run(frequencies: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Time, positions and true torque of ten seconds of sines."""
    time = np.arange(round(10 * RATE_HZ)) / RATE_HZ
    turns = 2 * np.pi * np.array(frequencies)
    waves = [derivative(np.outer(time, turns)) for derivative in (np.sin, np.cos, np.sin)]
    position, velocity, acceleration = waves[0], waves[1] * turns, -waves[2] * turns**2
    torque = rigid_torque(SCARA.arm, Motion(position, velocity, acceleration))
    torque[:, 0] += LEVEL * np.sign(velocity[:, 0])
    return time, position, torque


def test_friction_is_left_by_the_simulation_and_not_by_the_verdict_that_has_it(friction: JudgedCase) -> None:
    run = filter_held_out_run(friction)
    assert run.after is not None
    assert rms(run.given)[0] == pytest.approx(LEVEL, rel=0.05)
    assert rms(run.refit)[0] > 0.5 * LEVEL
    assert rms(run.friction)[0] < 0.1 * LEVEL
    assert rms(run.after) == pytest.approx(rms(run.floor), rel=0.05)
    assert measure_gap_closed(friction).closed == pytest.approx(1, abs=0.02)


def test_the_gap_beyond_plain_friction_is_counted_where_friction_is_in_the_background(
    friction: JudgedCase, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = {"given": 10.0, "refit": 4.0, "friction": 2.0, "after": 1.5, "floor": 1.0}
    constant = {name: np.full((5, 1), value) for name, value in left.items()}
    monkeypatch.setattr(
        held_out, "filter_held_out_run", lambda case: HeldOut(np.arange(5.0), np.zeros((5, 1)), **constant)
    )
    realistic = replace(
        friction, truth=friction.truth.model_copy(update={"background": (effect("viscous_friction", 1),)})
    )
    assert measure_gap_closed(realistic) == Gap(pytest.approx(2.5 / 3), pytest.approx(0.5), "counted")
    assert measure_gap_closed(friction).beyond is None


def test_a_picture_is_small_and_the_same_to_the_byte(friction: JudgedCase, tmp_path: Path) -> None:
    for name in ("first", "second"):
        write_gallery([friction], make_rows([friction]), tmp_path / name)
    pictures = [sorted((tmp_path / name / "gallery").glob("*.png")) for name in ("first", "second")]
    assert [path.name for path in pictures[0]] == ["friction-joint-1.png"]
    assert pictures[0][0].read_bytes() == pictures[1][0].read_bytes()
    assert pictures[0][0].stat().st_size < 60_000
    text = (tmp_path / "first" / "gallery.md").read_text(encoding="utf-8")
    assert f"### {OUTCOME_GROUPS['named'].title}: 1 of 1 clean" in text
    assert "*hidden:* coulomb_friction (x), joint 1, 8.0 limits: level = 2" in text
    assert "![friction](gallery/friction-joint-1.png)" in text


def test_a_verdict_without_a_prediction_has_a_picture_too(friction: JudgedCase, tmp_path: Path) -> None:
    silent = replace(friction, verdict=MISSING_VERDICT, folder=tmp_path / "nowhere")
    write_gallery([silent], make_rows([silent]), tmp_path)
    assert (tmp_path / "gallery" / "friction-joint-1.png").is_file()
    assert "### Not named: 1 of 1 clean" in (tmp_path / "gallery.md").read_text(encoding="utf-8")


def test_a_page_is_written_again_from_the_tables_of_a_score(tmp_path: Path) -> None:
    rows = scored((COULOMB, perfect(COULOMB)), (NULL, verdict()), (OUTSIDE, verdict()))
    for name in ROW_TABLES:
        getattr(rows, name).to_csv(tmp_path / f"{name}.csv", index=False)
    missed = pd.DataFrame(columns=[*SHOWN_MISS_COLUMNS])
    missed.to_csv(tmp_path / "misses.csv", index=False)
    tiers = {"clean": [asdict(each) for each in compute_measures(rows, "clean")]}
    result = {"development": True, "cases": 3, "seed": 1, "manifest": "0" * 64, "tiers": tiers}
    (tmp_path / "score.json").write_text(json.dumps(result))
    result = CliRunner().invoke(main, ["score", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "score.md").read_text() == render_page(rows, write_page_again(tmp_path), missed, [])
    (tmp_path / "claims.csv").unlink()
    assert "holds no whole score" in CliRunner().invoke(main, ["score", str(tmp_path)]).output
