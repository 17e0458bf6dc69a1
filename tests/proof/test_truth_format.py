"""truth/1: files and models say the same, and the shipped schema is the model's."""

import json
from pathlib import Path

import pytest
from hidden_cases import case
from jsonschema import Draft202012Validator
from made_answers import COULOMB, NULL, OUTSIDE

from armlab.common.errors import InputError
from armlab.proof.blind.case_files import write_case
from armlab.proof.blind.effects.bodies import Payload
from armlab.proof.blind.effects.friction import Stribeck
from armlab.proof.blind.formats import TRUTH_SCHEMA_FILE, Truth, read_model, truth_schema, write_model


def test_the_shipped_schema_is_that_of_the_model() -> None:
    shipped = json.loads(TRUTH_SCHEMA_FILE.read_text(encoding="utf-8"))
    assert shipped == truth_schema(), f"write armlab.proof.blind.formats.truth_schema() to {TRUTH_SCHEMA_FILE}"


def test_a_written_answer_is_valid_and_reads_the_same(tmp_path: Path) -> None:
    payload = Payload(2, 1.5, 6.0, "compact", {"x": 0.01, "y": 0.0, "z": 0.05, "radius": 0.05})
    stribeck = Stribeck(1, 0.5, 4.0, "gauss", {"level": 1.0, "velocity": 0.1, "exponent": 0.8})
    write_case(case(payload, stribeck), tmp_path / "recording", tmp_path / "truth.json")
    content = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    Draft202012Validator(truth_schema()).validate(content)
    truth = read_model(Truth, tmp_path / "truth.json")
    assert [effect.effect for effect in truth.injected] == ["payload", "stribeck_friction"]
    assert truth.injected[0].parameters["centre"].value == (0.01, 0.0, 0.05)
    write_model(truth, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "truth.json").read_bytes()


@pytest.mark.parametrize("answer", [NULL, COULOMB, OUTSIDE])
def test_answers_written_by_hand_are_valid(answer: Truth) -> None:
    Draft202012Validator(truth_schema()).validate(answer.model_dump(mode="json", by_alias=True))


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("schema", "truth/2", "'schema' in .*: should be 'truth/1'"),
        ("tier", "dirty", "'tier' in .*: should be 'clean' or 'realistic'"),
        ("joint", 3, "unknown key 'joint' in .*: did you mean 'joints'?"),
    ],
)
def test_another_content_is_refused_by_its_key(tmp_path: Path, key: str, value: object, complaint: str) -> None:
    content = COULOMB.model_dump(mode="json", by_alias=True)
    (tmp_path / "truth.json").write_text(json.dumps({**content, key: value}), encoding="utf-8")
    with pytest.raises(InputError, match=complaint):
        read_model(Truth, tmp_path / "truth.json")
