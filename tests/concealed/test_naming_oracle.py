"""The oracle of names: it names what is large and unlike anything else, and mistakes what another law imitates."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armlab.common.errors import InputError
from armlab.concealed.effects.channels import Gain
from armlab.concealed.effects.friction import Viscous
from armlab.concealed.naming_oracle import OracleAnswer, ask_oracle
from armlab.concealed.naming_oracle_page import write_oracle
from armlab.concealed.plan import draw_plan
from armlab.concealed.sizing import limit_noncentrality, simulate_case

PLAN_INDEX = next(index for index in range(60) if draw_plan(1003, index, "clean", True, True).machine.name == "scara")


def answer_to(hidden: object) -> OracleAnswer:
    plan = draw_plan(1003, PLAN_INDEX, "clean", only_nulls=True, development=True)
    (answer,) = ask_oracle(simulate_case(plan, (hidden,)), 0.0)  # type: ignore[arg-type]
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


def test_a_gain_of_a_horizontal_arm_is_mistaken_for_what_scales_its_torque() -> None:
    found = answer_to(Gain(1, 0.02, 1.0, "factor", {"direction": 1.0, "knee": 0.0, "peak": 0.0}))
    size = found.multiple * np.sqrt(limit_noncentrality(2))  # of the effect itself, in standard deviations
    assert found.distance < 0.8 * size  # a body at the same link explains a third of its power, or more
    assert found.rival in ("payload", "inertial_parameter_error", "rotor_inertia")


def test_a_law_that_holds_the_right_one_as_a_limit_is_no_rival() -> None:
    found = answer_to(Viscous(0, 0.05, 100.0, "linear", {"phase": 0.0}))
    assert found.rival not in ("stribeck_friction", "friction_curve", "asymmetric_friction", "friction_drift")


def test_the_page_stands_beside_the_score_of_the_same_set_alone(tmp_path: Path) -> None:
    answer = OracleAnswer(
        "a", "clean", "payload", "compact", 2, False, 5.0, 2.0, 0.9, "rotor_inertia", 2, 3.0, 0.93, 1.0
    )
    row = {"case": "a", "tier": "clean", "effect": "payload", "joint": 2, "named_first": False, "named_class": True}
    pd.DataFrame([row]).to_csv(tmp_path / "effects.csv", index=False)
    _, page = write_oracle([answer], tmp_path, tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    assert "| payload | 1 | 2.0 | 93 % | 100 % | 0 % | 100 % | rotor inertia, 3.0 |" in text
    assert "| **of the library, below 3 limits, recorded** | 1 | 2.0 | 93 % |" in text
    pd.DataFrame([{**row, "case": "b"}]).to_csv(tmp_path / "effects.csv", index=False)
    with pytest.raises(InputError, match="the score of another set"):
        write_oracle([answer], tmp_path, tmp_path / "again")
    with pytest.raises(InputError, match="holds no score"):
        write_oracle([answer], tmp_path / "out", tmp_path / "again")
