"""What probabilities are learnt from: which of the weighed names are right, and that no set that judges takes part."""

import json
from pathlib import Path
from typing import Any

import pytest
from made_answers import COULOMB, NULL, OUTSIDE, judged
from made_verdicts import verdict

from armlab.common.errors import InputError
from armlab.proof.blind.formats import Truth
from armlab.proof.blind.score.cases import JudgedCase
from armlab.proof.blind.score.weighed_names import check_development, label_findings


def weighed(answer: Truth, folder: Path, names: list[tuple[str, float]], kind: str = "found") -> JudgedCase:
    """A case with one weighed finding at joint 2: names with their probabilities, and none of them."""
    listed: list[dict[str, Any]] = [
        {"effect": name, "joint": 2, "probability": chance, "numbers": {f"is {name}": 1.0}} for name, chance in names
    ]
    none = {"effect": "unknown", "joint": 2, "probability": 0.1, "numbers": {f"{kind} none": 1.0}}
    (folder / "names.json").write_text(json.dumps({"findings": [{"names": [*listed, none]}]}), encoding="utf-8")
    case = judged(answer, verdict())
    object.__setattr__(case, "folder", folder)
    return case


@pytest.mark.parametrize(
    ("answer", "kind", "right"),
    [
        (COULOMB, "found", (True, False, False)),
        (NULL, "found", (False, False, True)),
        (OUTSIDE, "found", (False, False, True)),
        (OUTSIDE, "structure", (False, False, True)),
    ],
)
def test_a_name_is_right_as_a_claim_is_and_else_none_is(
    answer: Truth, kind: str, right: tuple[bool, ...], tmp_path: Path
) -> None:
    case = weighed(answer, tmp_path, [("coulomb_friction", 0.6), ("payload", 0.3)], kind)
    (found,) = label_findings(case, 1970)
    assert found.right == right
    assert not found.background


def test_a_verdict_that_weighed_nothing_has_nothing_to_learn_from(tmp_path: Path) -> None:
    case = judged(NULL, verdict())
    object.__setattr__(case, "folder", tmp_path)
    assert list(label_findings(case, 1970)) == []


def test_a_set_that_judges_is_refused(tmp_path: Path) -> None:
    check_development(1970, tmp_path)
    with pytest.raises(InputError, match="has the seed 5000: take a development set"):
        check_development(5000, tmp_path)
