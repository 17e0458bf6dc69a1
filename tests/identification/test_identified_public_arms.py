from pathlib import Path

import numpy as np
import pytest
from public_copies import needs_copies

from armlab.identification.components import usual_components, wrist_couplings
from armlab.identification.model import Model
from armlab.identification.structure import Structure
from armlab.identification.validation import run_error
from armlab.proof.open.real_identification.identify_recording import RECIPES, recipe_named, study_recording
from armlab.proof.open.real_identification.published import PublishedComparison, sum_weights
from armlab.recordings.public import PUBLIC_RECORDINGS, open_public_recording
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
    assert PublishedComparison("x", 1.0, 0.3, 2.0, 0.4).ratio == pytest.approx(2.0)


def test_every_public_recording_has_a_recipe() -> None:
    assert {recipe.name for recipe in RECIPES} == set(PUBLIC_RECORDINGS)


@needs_copies("emps")
def test_a_study_identifies_three_models_and_the_chosen_one_predicts_held_out_runs_best(tmp_path: Path) -> None:
    recording = open_public_recording("emps", tmp_path)
    study = study_recording(recipe_named("emps"), recording)
    (validate,) = recording.with_role("validate")
    errors = {
        name: run_error(each.model_, each.model_.signals(validate)).relative_percent
        for name, each in study.models.items()
    }
    assert errors["chosen"] < errors["friction"] < errors["rigid"]
    assert errors["rigid"] == pytest.approx(69, abs=2)
    assert study.seconds > 0
