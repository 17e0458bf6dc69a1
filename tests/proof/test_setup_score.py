"""The score of setup findings: what a probability is of, and how it is compared with what is right."""

import json
from pathlib import Path
from typing import Any

import pytest

from armlab.proof.blind.score.stated import StatedClaim
from armlab.proof.blind.setup.lapse import likeliest_odds_ratio
from armlab.proof.blind.setup.setup_score import SetupOutcome, score_setup

CASE = {"seed": 1001, "source": "real", "index": 0, "kind": "alone", "recording": "staubli-tx40", "physics": []}


def _name(effect: str, joint: int | None, probability: float) -> dict[str, Any]:
    return {"effect": effect, "joint": joint, "probability": probability}


def _outcome(folder: Path, true: dict[str, Any], names: list[dict[str, Any]], joints: int = 6) -> SetupOutcome:
    """One mistake, and one finding: its name and its rivals."""
    mistake = {"joints": [], "form": "", "size": 0.0, "gravity": [], **true}
    truth = {**CASE, "mistakes": [mistake], "seen": [True], "arm_joints": joints}
    finding = {**names[0], "kind": "setup", "joints": [], "parameters": {}, "class": names}
    verdict = {"status": "mismatch", "findings": [finding]}
    for part, content in (("truth/one", truth), ("verdicts/one/verdict", verdict)):
        path = folder / f"{part}.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(content), encoding="utf-8")
    return score_setup(folder, ["one"], folder / "score").outcomes[0]


def test_a_probability_is_of_all_names_that_count_as_the_claimed_one(tmp_path: Path) -> None:
    names = [_name("torque_sign", 2, 0.5), _name("joint_direction", 2, 0.3), _name("unit_error", 2, 0.1)]
    (claim,) = _outcome(tmp_path, {"effect": "joint_direction", "joint": 2, "form": "position"}, names).stated
    assert claim.right
    assert claim.probability == pytest.approx(0.8)
    assert claim.all_names == pytest.approx(0.9)


def test_the_same_name_at_another_joint_is_another_name(tmp_path: Path) -> None:
    names = [_name("encoder_offset", 2, 0.6), _name("encoder_offset", 3, 0.3)]
    (claim,) = _outcome(tmp_path, {"effect": "encoder_offset", "joint": 3}, names).stated
    assert (claim.right, claim.in_class) == (False, True)
    assert claim.probability == pytest.approx(0.6)


def test_all_joints_of_an_arm_of_one_are_that_joint(tmp_path: Path) -> None:
    names = [_name("unit_error", 1, 0.5), _name("unit_error", None, 0.4)]
    (claim,) = _outcome(tmp_path, {"effect": "unit_error", "joint": 1, "form": "position"}, names, joints=1).stated
    assert claim.right
    assert claim.probability == pytest.approx(0.9)


def _claims(right: int, wrong: int) -> list[StatedClaim]:
    """Findings of one name that state a lapse of 1 in 11, odds of 1 to 10."""
    hits = [True] * right + [False] * wrong
    return [StatedClaim("torque_sign", 10 / 11, each, each, 10 / 11) for each in hits]


@pytest.mark.parametrize(("right", "wrong", "expected"), [(20, 2, 1.0), (20, 4, 2.0), (40, 1, 0.25)])
def test_the_likeliest_odds_are_those_of_wrong_names_over_those_that_are_stated(
    right: int, wrong: int, expected: float
) -> None:
    assert likeliest_odds_ratio(_claims(right, wrong)) == pytest.approx(expected, rel=1e-3)


def test_findings_that_state_no_probability_say_nothing_of_a_lapse() -> None:
    assert likeliest_odds_ratio([StatedClaim("torque_sign", None, True, True)]) is None
