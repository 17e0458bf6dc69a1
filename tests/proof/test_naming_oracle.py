"""The oracle of names: it names what is large and unlike anything else, and mistakes what another law imitates."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.proof.blind import naming_oracle
from armlab.proof.blind.effects.channels import Skew, TorqueGain
from armlab.proof.blind.effects.friction import Coulomb, EarlyFriction, Viscous
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.naming_oracle import OracleAnswer, ask_oracle
from armlab.proof.blind.plan import draw_plan
from armlab.proof.blind.score.distance import distance_table, read_oracle_table, remove_oracle
from armlab.proof.blind.score.scoring import SCORE_FILE
from armlab.proof.blind.sizing import limit_noncentrality, simulate_case
from armlab.proof.tiers.naming_oracle_page import (
    ask_about_set,
    collect_answers,
    draw_cases,
    read_scored_effects,
    write_oracle,
)
from armlab.proof.tiers.torque import make_set_settings

PLAN_INDEX = next(index for index in range(60) if draw_plan(1003, index, "clean", True, True).machine.name == "scara")


def answer_to(*hidden: HiddenEffect) -> OracleAnswer:
    """What the oracle says of the last one."""
    plan = draw_plan(1003, PLAN_INDEX, "clean", only_nulls=True, development=True)
    *_, answer = ask_oracle(simulate_case(plan, hidden), 0.0)
    return answer


def test_a_large_effect_is_named_and_a_tiny_one_is_not() -> None:
    large = answer_to(Viscous(0, 2.0, 100.0, "linear", {"phase": 0.0}))
    tiny = answer_to(Viscous(0, 2e-4, 100.0, "linear", {"phase": 0.0}))
    assert large.multiple > 20
    assert large.right_name > 0.99
    assert tiny.multiple < 0.5
    assert tiny.right_name < large.right_name
    assert large.right_class >= large.right_name
    assert tiny.distance < large.distance


def test_a_rival_that_cannot_be_simulated_coarsely_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    simulated, runs = naming_oracle.simulate_runs, list[int]()

    def run_away_at_first(*arguments: Any) -> Any:
        runs.append(1)
        if len(runs) == 1:
            raise FloatingPointError("the simulated arm runs away")
        return simulated(*arguments)

    effect = Viscous(0, 2.0, 100.0, "linear", {"phase": 0.0})
    case = simulate_case(draw_plan(1003, PLAN_INDEX, "clean", only_nulls=True, development=True), (effect,))
    monkeypatch.setattr(naming_oracle, "simulate_runs", run_away_at_first)
    (found,) = ask_oracle(case, 0.0)
    assert len(runs) > 2
    assert found.right_name > 0.99


def test_a_gain_of_a_horizontal_arm_is_mistaken_for_what_scales_its_torque() -> None:
    found = answer_to(TorqueGain(1, 0.02, 1.0, "factor", {"direction": 1.0, "knee": 0.0, "peak": 0.0}))
    size = found.multiple * np.sqrt(limit_noncentrality(2))  # of the effect itself, in standard deviations
    assert found.distance < 0.8 * size  # a body at the same link explains a third of its power, or more
    assert found.rival in ("payload", "inertial_parameter_error", "rotor_inertia")


def test_a_law_that_holds_the_right_one_as_a_limit_is_no_rival() -> None:
    found = answer_to(Viscous(0, 0.05, 100.0, "linear", {"phase": 0.0}))
    assert found.rival not in ("stribeck_friction", "friction_curve", "asymmetric_friction", "friction_drift")


def test_friction_that_begins_early_is_a_rival_of_early_channels_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armlab.proof.blind.naming_oracle.LAWS", (Viscous, EarlyFriction))
    friction = Coulomb(0, 3.0, 100.0, "sign", {"width": 0.02})
    early, late = (
        answer_to(friction, Skew(0, 2e-3, 1.0, "shift", {"direction": direction})) for direction in (-1.0, 1.0)
    )
    assert (early.rival, early.rival_joint) == ("early_friction", 1)
    assert late.rival == "viscous_friction"
    assert early.distance < 0.5 * late.distance
    assert early.multiple_away < 0.5 * early.multiple_recorded  # most of it is the step of friction at reversals


ANSWER = OracleAnswer(
    "a", "clean", "payload", "compact", 2, False, 5.0, 2.0, 1.5, 0.9, "rotor_inertia", 2, 3.0, 0.93, 1.0
)
EFFECT = {"case": "a", "tier": "clean", "effect": "payload", "joint": 2, "named_first": False, "named_class": True}


def test_the_page_stands_beside_the_score_of_the_same_set_alone(tmp_path: Path) -> None:
    _, page = write_oracle([ANSWER], (1, 3), pd.DataFrame([EFFECT]), tmp_path)
    text = page.read_text(encoding="utf-8")
    assert "1, drawn at random, of the 3 cases of the set were asked about." in text
    assert "| payload | 1 | 2.0 | 1.5 | 93 % | 100 % | 0 % | 100 % | rotor inertia, 3.0 |" in text
    assert "| **of the library, below 3 limits, recorded** | 1 | 2.0 | 1.5 | 93 % |" in text
    with pytest.raises(InputError, match="of different sets"):
        write_oracle([ANSWER], (1, 3), pd.DataFrame([{**EFFECT, "case": "b"}]), tmp_path)


def test_a_score_shows_its_distance_to_the_oracle(tmp_path: Path) -> None:
    write_oracle([ANSWER], (1, 1), None, tmp_path)
    known = read_oracle_table(tmp_path, pd.DataFrame([EFFECT]))
    assert known is not None
    assert "right name or class of four, above 3 limits | 100 % | 100 % | 100 % | 1 |" in distance_table(known)
    with pytest.raises(InputError, match="of different sets"):
        read_oracle_table(tmp_path, pd.DataFrame([{**EFFECT, "joint": 1}]))
    remove_oracle(tmp_path)
    assert read_oracle_table(tmp_path, pd.DataFrame([EFFECT])) is None


def test_an_interrupted_command_asks_only_what_has_no_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = make_set_settings(6, 1003, "clean", "mixed", True)
    monkeypatch.setattr("armlab.proof.tiers.naming_oracle_page.simulate_case", lambda plan: plan)
    monkeypatch.setattr(
        "armlab.proof.tiers.naming_oracle_page.ask_oracle", lambda plan, _: [replace(ANSWER, case=plan.name)]
    )
    some, every = draw_cases(settings, 2), draw_cases(settings, 6)
    assert (len(some), every) == (2, [*range(6)])
    first = next(ask_about_set(settings, some, tmp_path / "work", 1))
    rest = list(ask_about_set(settings, every, tmp_path / "work", 1))
    assert first in {settings.plan(number).name for number in some}
    assert sorted([first, *rest]) == sorted(settings.plan(number).name for number in range(6))
    hiding = [plan.name for plan in map(settings.plan, range(6)) if plan.kind not in ("null", "decoy")]
    assert [each.case for each in collect_answers(settings, every, tmp_path / "work")] == hiding


def test_the_score_of_another_set_is_refused_before_the_work(tmp_path: Path) -> None:
    settings = make_set_settings(6, 1003, "clean", "mixed", True)
    with pytest.raises(InputError, match="holds no whole score"):
        read_scored_effects(settings, tmp_path)
    pd.DataFrame([EFFECT]).to_csv(tmp_path / "effects.csv", index=False)
    for seed in (1003, 1004):
        (tmp_path / SCORE_FILE).write_text(f'{{"seed": {seed}, "cases": 6}}', encoding="utf-8")
        if seed == settings.seed:
            assert len(read_scored_effects(settings, tmp_path)) == 1
    with pytest.raises(InputError, match="another set: seed 1004"):
        read_scored_effects(settings, tmp_path)


@pytest.mark.parametrize("given", [True, False])
def test_the_command_removes_its_own_folder_and_none_of_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: bool
) -> None:
    page = "armlab.proof.tiers.naming_oracle_page"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"{page}.simulate_case", lambda plan: plan)
    monkeypatch.setattr(f"{page}.ask_oracle", lambda plan, _: [replace(ANSWER, case=plan.name)])
    work = tmp_path / ("mine" if given else ".armlab/oracle/1003")
    words = ["proof", "oracle", "--cases", "1", "--seed", "1003", "--development", "--jobs", "1", "--out", "out"]
    result = CliRunner().invoke(main, words + (["--work", str(work)] if given else []))
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "oracle.md").exists()
    assert work.exists() == given
