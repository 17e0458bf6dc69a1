"""Suites: enough problems of every kind, all solvable in principle, none ever changed, each under its own name."""

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from problem.contract import Problem, why_not_differentiable
from problem.registry import names, parse_problem
from problem.suite import definition_of, instances, suites

RECORDED = json.loads(Path(__file__).with_name("suite_values.json").read_text())
ALL = [name for suite in suites() for name in instances(suite)]


def built(name: str, **settings: object) -> Problem:
    return parse_problem({"preset": name, **settings}, "test").build()


def figures(name: str) -> list[float]:
    """Sums of the bounds; fitness, value and violation at a third of the way between them, and near the middle."""
    problem = built(name)
    width = problem.upper - problem.lower
    points = problem.lower + width * np.array([[1 / 3], [0.49]]) * np.linspace(0.8, 1.2, len(width))
    return [*np.stack([problem.lower, problem.upper]).sum(axis=1), *np.stack(problem.evaluate(points)).ravel()]


@pytest.mark.parametrize("name", ALL)
def test_no_problem_of_a_suite_is_ever_changed(name: str) -> None:
    assert figures(name) == pytest.approx(RECORDED[name], rel=1e-6)


def test_suite_1_has_24_problems_of_arms_of_3_6_and_7_joints_in_every_form_and_frame() -> None:
    names = instances("suite-1")
    assert len(names) == len(set(names)) == 24
    kinds = [name.removeprefix("suite-1/").replace("irb120-arm", "irb120arm").split("-") for name in names]
    arms, forms, harmonics, seconds, frames = map(set, zip(*kinds, strict=True))
    assert arms == {"irb120arm", "irb120", "panda"}
    assert forms == {"tool", "joint", "rest"}
    assert len(harmonics) >= 3
    assert len(seconds) >= 3
    assert frames == {"origin", "shifted"}


@pytest.mark.parametrize("name", [*instances("suite-1"), *instances("held-out-1")])
def test_the_name_of_a_problem_says_what_it_is(name: str) -> None:
    definition = definition_of(name)
    *_, form, harmonics, seconds, frame = name.split("-")
    assert harmonics == f"h{definition.harmonics}"
    assert seconds == f"t{definition.duration:g}"
    assert frame == ("origin" if definition.frame_seed is None else "shifted")
    assert form == ("tool" if definition.preset == "paper" else "rest" if definition.rest else "joint")


@pytest.mark.parametrize("name", instances("suite-2"))
def test_the_name_of_a_problem_of_suite_2_says_what_it_is(name: str) -> None:
    definition, problem = definition_of(name), built(name)
    arm, joints, columns = name.removeprefix("suite-2/").split("-")
    assert arm in definition.arm
    assert definition.joints == (3 if joints == "first3" else None)
    assert definition.unit_columns == (columns == "unit")
    assert (definition.harmonics, definition.duration, definition.rest) == (5, 10.0, False)
    assert why_not_differentiable(problem) == ""


def test_suite_2_has_six_arms_each_with_three_and_all_joints_and_both_kinds_of_columns() -> None:
    kinds = [name.removeprefix("suite-2/").split("-") for name in instances("suite-2")]
    assert [len(set(kind)) for kind in zip(*kinds, strict=True)] == [6, 2, 2]
    assert len({tuple(kind) for kind in kinds}) == len(kinds) == 24


def test_suite_3_is_suite_2_with_friction_columns() -> None:
    with_friction = {
        f"{name.replace('suite-2/', 'suite-3/')}-friction": definition_of(name).model_copy(
            update={"friction_columns": True}
        )
        for name in instances("suite-2")
    }
    assert {name: definition_of(name) for name in instances("suite-3")} == with_friction


def test_no_problem_that_is_held_out_stands_in_the_suite_too() -> None:
    shown = [definition_of(name).model_dump(exclude={"frame_seed"}) for name in instances("suite-1")]
    held_out = [definition_of(name).model_dump(exclude={"frame_seed"}) for name in instances("held-out-1")]
    assert len(held_out) == 12  # fewer could not tell nine algorithms apart: 36 pairs, 2 / 2^n
    assert not [definition for definition in held_out if definition in shown]


def test_every_problem_has_a_name_of_its_own_so_that_its_random_streams_are_its_own() -> None:
    assert [built(name).name for name in ALL] == ALL


def test_a_problem_of_a_suite_takes_another_way_to_treat_constraints_and_nothing_else() -> None:
    name = "suite-1/panda-rest-h5-t10-origin"
    ruled, penalised = built(name, penalty="feasibility_rules"), built(name)
    points = np.random.default_rng(0).uniform(ruled.lower, ruled.upper, (40, len(ruled.lower)))
    np.testing.assert_array_equal(ruled.evaluate(points).value, penalised.evaluate(points).value)
    told = refusal(built, name, harmonics=3)
    assert told == "unknown key 'harmonics' in test: known: preset, penalty, search_space, criterion"


@pytest.mark.parametrize("name", instances("suite-4"))
def test_suite_4_is_suite_2_with_collisions_and_a_floor(name: str) -> None:
    definition = definition_of(name)
    without = definition_of(name.replace("suite-4/", "suite-2/").removesuffix("-floor"))
    assert definition.collisions is not None
    assert definition.collisions.floor == 0.0
    assert definition.model_copy(update={"collisions": None}) == without
    assert why_not_differentiable(built(name)) == ""


def test_names_of_presets_leave_the_problems_of_suites_out() -> None:
    assert not [name for name in names() if "/" in name]


def test_an_unknown_problem_of_a_suite_is_told_with_the_nearest_name() -> None:
    told = refusal(built, "suite-1/irb120-joint-h5-t10-orgin")
    assert told.endswith("did you mean 'suite-1/irb120-joint-h5-t10-origin'?")
