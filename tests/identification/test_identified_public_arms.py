from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from public_copies import needs_copies

from armlab.identification.components import usual_components, wrist_couplings
from armlab.identification.model import Model
from armlab.identification.real.published import Comparison, sum_weights
from armlab.identification.real.report import LOOKS_FILE, identify_public
from armlab.identification.real.study import RECIPES
from armlab.identification.structure import Structure
from armlab.recordings.public import PUBLIC_RECORDINGS
from problem.robot_file import load_arm


def tx40() -> Model:
    arm = load_arm("staubli-tx40")
    structure = Structure(arm, usual_components(arm) + wrist_couplings(arm)).separable()[0]
    own = np.arange(1.0, structure.size - len(structure.base) + 1)
    return Model("staubli-tx40", structure, np.concatenate([structure.base.values(arm.parameters), own]))


@pytest.mark.parametrize(
    "expression",
    [
        "Izz1 + 1.0*Ia1 + 1.0*Iyy2 + 1.0*Iyy3 + 0.07*mz3 + 0.05185*m3 + 0.05185*m4 + 0.05185*m5 + 0.05185*m6",
        "mx2 + 0.225*m3 + 0.225*m4 + 0.225*m5 + 0.225*m6",
        "my5 - 1.0*mz6",
    ],
)
def test_published_sums_have_the_value_that_the_links_give(expression: str) -> None:
    model = tx40()
    names = {
        name.replace("mc", "m"): value
        for name, value in zip(model.arm.parameter_names, model.arm.parameters, strict=True)
    }
    names |= {"Ia1": 0.0}  # in the links' own inertia
    terms = (term.split("*") for term in expression.replace("- ", "+ -").split(" + "))
    expected = sum(float(np.prod([float(word) for word in term[:-1]])) * names[term[-1]] for term in terms)
    assert sum_weights(model, expression) @ model.values == pytest.approx(expected, abs=1e-9)


def test_a_coupling_is_the_mean_of_what_both_joints_show() -> None:
    model = tx40()
    couplings = [i for i, part in enumerate(model.structure.components) if part.effect == "joint_coupling"]
    values = [model.values[model.structure.slices[i]][0] for i in couplings]
    assert sum_weights(model, "fvm6") @ model.values == pytest.approx(np.mean(values))


def test_a_sum_that_torques_do_not_tell_is_refused() -> None:
    with pytest.raises(ValueError, match="no sum of base parameters"):
        sum_weights(tx40(), "m1")


def test_differences_are_told_in_combined_standard_errors() -> None:
    assert Comparison("x", 1.0, 0.3, 2.0, 0.4).ratio == pytest.approx(2.0)


def test_every_public_recording_has_a_recipe() -> None:
    assert {recipe.name for recipe in RECIPES} == set(PUBLIC_RECORDINGS)


@needs_copies("emps")
def test_real_writes_the_table_and_logs_each_look_at_validation_data(tmp_path: Path) -> None:
    lines = list(identify_public(tmp_path / "results", tmp_path / "recordings", ["emps"]))
    assert "pulses.csv" in lines[2]
    table = pd.read_csv(tmp_path / "results" / "identification.csv")
    assert list(table.columns) == ["recording", "model", "run", "relative_error_percent"]
    errors = table.set_index(["model", "run"])["relative_error_percent"]
    assert errors["chosen", "pulses.csv"] < errors["friction", "pulses.csv"] < errors["rigid", "pulses.csv"]
    looks = (tmp_path / "results" / LOOKS_FILE).read_text().splitlines()
    assert len(looks) == 3
    assert all("pulses.csv" in look for look in looks)
    assert_allclose(errors["rigid", "identify.csv"], 69.5, atol=1)
