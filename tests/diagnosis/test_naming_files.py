"""Why a name is a finding or none: the log of the search and the tests, as a file and as an answer."""

import json
from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.result import Diagnosis, Member
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.evidence.pruning import first_failed_test
from armlab.diagnosis.torque.search.search import FailedTest, Step
from armlab.diagnosis.torque.stages import BY_PROBABILITY, BY_TESTS
from armlab.effects.contract import UNKNOWN
from armlab.report.torque.naming_files import (
    NAMES_FILE,
    STEPS_FILE,
    WeighedOutcome,
    names_texts,
    outcome_of,
    parse_place,
    steps_texts,
    why_lines,
)
from problem.motion import Motion

SURE = Evidence(0, 1e-9, 1e-9, 0.5, 1e-9, 0.5, 1.0, 0.5, 500.0)


def viscous(motion: Motion, time: Array) -> Array:
    return np.asarray(motion.velocity * [0.0, 0.8, 0.0])


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose(cases.recording(viscous, seconds=6.0))


def test_a_sure_effect_passes_and_each_failed_test_has_its_value_and_its_bound() -> None:
    settings = Settings()
    tuning = settings.tuning.pruning
    assert first_failed_test(SURE, settings) is None
    failing = {
        "significance": (replace(SURE, corrected=0.5), 0.5, tuning.level),
        "held-out gain": (replace(SURE, gain=0.0), 0.0, settings.tuning.surrogate.least_gain),
        "error of validation runs": (replace(SURE, growth_p=1e-6), 1e-6, tuning.level),
    }
    for name, (evidence, value, bound) in failing.items():
        failed = first_failed_test(evidence, settings)
        assert failed is not None
        assert (failed.test, failed.value, failed.bound) == (name, value, bound)


def test_the_file_holds_every_move_and_every_effect_that_is_not_in_the_model(found: Diagnosis) -> None:
    content = json.loads(steps_texts(found)[STEPS_FILE])
    assert [each["what"] for each in content["steps"]] == [each.what for each in found.steps]
    not_taken = {(each["effect"], each["joint"]) for each in content["not_taken"]}
    assert {("viscous_friction", 1), ("viscous_friction", 2)}.isdisjoint(not_taken)
    assert {("torque_offset", 1), ("backlash", 2), ("time_delay", None)} <= not_taken


def test_a_move_of_the_search_says_from_which_score_it_rises(found: Diagnosis) -> None:
    moves = [each for each in json.loads(steps_texts(found)[STEPS_FILE])["steps"] if each.get("score_before")]
    assert moves
    assert all(each["score_before"] < each["score"] for each in moves)


def test_each_weighed_finding_says_what_came_of_it(found: Diagnosis) -> None:
    other = replace(found.weighed[0][0], effect="backlash")
    both = replace(found, weighed=(*found.weighed, (other, found.weighed[0][-1])))
    listed = json.loads(names_texts(WeighedOutcome.of_diagnosis(both), Settings())[NAMES_FILE])["findings"]
    said = [(each["effect"], each["joint"], each["outcome"]) for each in listed]
    assert said == [("viscous_friction", 2, "named"), ("backlash", 2, "not stated")]
    assert outcome_of("coulomb_friction", found.claims[0].members) == "named"
    assert outcome_of(UNKNOWN.id, ()) == "unknown"
    assert outcome_of("backlash", (Member("backlash", 2, (2,), 0.6), Member("hysteresis", 2, (2,), 0.35))) == "class"


def test_a_finding_and_an_effect_that_no_search_takes_are_answered(found: Diagnosis) -> None:
    (first, *_) = why_lines(found, "viscous_friction", 2)
    assert first == "why viscous friction at joint 2: it is finding 1 of 1"
    (first, *_) = why_lines(found, "backlash", 3)
    assert first.startswith("why backlash at joint 3: not named: it would ")


def test_the_last_test_that_failed_is_the_answer_with_its_numbers(found: Diagnosis) -> None:
    failed = FailedTest("held-out gain", "held-out gain 1.2 %", 0.012, 0.03, "surrogate.least_gain")
    steps = (
        Step("+ backlash 3 (0.1,)", 5.0),
        Step("withdrawn: backlash 3: p = 0.5 after correction", 0.0, FailedTest("significance", "p = 0.5", 0.5, 0.01)),
        Step("withdrawn: backlash 3: held-out gain 1.2 %", 0.0, failed),
        Step("+ backlash 33", 5.0),
    )
    lines = list(why_lines(replace(found, steps=steps), "backlash", 3))
    assert lines[0].startswith(
        "why backlash at joint 3: not named: held-out gain is 0.012, and has to be at least 0.03 "
    )
    assert lines[0].endswith("(surrogate.least_gain)")
    assert lines[1:] == [f"  {each.what}" for each in steps[:3]]


@pytest.mark.parametrize("text", ["backlach@2", "backlash@4", "backlash@0", "backlash@x"])
def test_a_place_that_there_is_not_is_refused_in_one_line(found: Diagnosis, text: str) -> None:
    with pytest.raises(InputError, match=r"^--why [^\n]*$"):
        parse_place(text, found.recording.arm)


def test_a_whole_robot_has_no_joint(found: Diagnosis) -> None:
    assert parse_place("time_delay", found.recording.arm) == ("time_delay", None)


def test_every_stage_says_in_one_sentence_what_it_does() -> None:
    sentences = [each.sentence for each in (*BY_TESTS, *BY_PROBABILITY)]
    assert all(each.endswith(".") and len(each.split()) <= 25 for each in sentences)
    assert len(set(sentences)) == len(sentences)
