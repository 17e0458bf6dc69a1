"""The story of a verdict: causes, their order, and shares that sum to at most one."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from armlab.diagnosis.result import Claim
from armlab.diagnosis.story import MAX_WORDS, Chapter, add_in_order, finding_shares, story_sentence
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named
from problem.presets import load_arm

ARM = load_arm("irb120-arm")


def test_the_largest_cause_is_added_first_and_falls_sum_to_the_whole_fall() -> None:
    start = np.array([3.0, 1.0, 0.0])
    falls = add_in_order(start, {"small": np.array([0.0, 1.0, 0.0]), "large": np.array([3.0, 0.0, 0.0])})
    assert list(falls) == ["large", "small"]
    assert falls == pytest.approx({"large": 9.0, "small": 1.0})


def test_torques_that_explain_the_same_error_do_not_count_it_twice() -> None:
    start = np.array([2.0, 0.0])
    falls = add_in_order(start, {"one": np.array([1.5, 0.0]), "other": np.array([0.5, 0.0])})
    assert sum(falls.values()) == pytest.approx(4.0)


def test_an_unknown_that_the_model_leaves_counts_once() -> None:
    rows = np.arange(400)
    named, left = np.sin(rows)[:, None], np.cos(rows)[:, None]
    facts: dict[str, Any] = {"joint": 1, "joints": (1,), "parameters": (), "equation": "", "evidence": None}
    claims = (
        Claim("payload", prediction=named, **facts),
        Claim("unknown", prediction=left, left_out=left, **facts),
    )
    observed = SimpleNamespace(
        torque=named + left, joints=1, rows=len(rows), of_role=lambda role, joint: [slice(0, len(rows))]
    )
    fit = (SimpleNamespace(noise_floor=0.0),)
    diagnosis = cast(Any, SimpleNamespace(observed=observed, final=left, claims=claims, fit=fit))
    assert finding_shares(diagnosis) == pytest.approx((0.5, 0.5), abs=0.01)


def test_the_sentence_names_the_causes_and_has_at_most_thirty_words() -> None:
    chapters = [
        Chapter("friction", (1, 2, 3, 4, 5, 6), 0.85, (0, 1), ("Coulomb friction", "viscous friction")),
        Chapter("gravity and springs", (2,), 0.05, (2,), ("cable stiffness",)),
        *(Chapter("transmission", (joint,), 0.01, (2 + joint,), ("backlash",)) for joint in range(1, 7)),
    ]
    sentence = story_sentence(chapters, load_arm("irb120"))
    assert sentence.startswith(
        "85 % of the error comes from friction at all 6 joints, 5 % from cable stiffness at joint 2"
    )
    assert len(sentence.split()) <= MAX_WORDS


def test_one_of_several_causes_never_explains_all() -> None:
    chapters = [
        Chapter("links", (2,), 0.998, (0,), ("payload",)),
        Chapter("unknown", (1,), 0.02, (1,), ("something unknown",)),
    ]
    assert story_sentence(chapters, ARM) == (
        "98 % of the error comes from payload at link 2, 2 % from something without a name at joint 1."
    )


def test_a_cause_that_is_told_alone_explains_more_than_99_percent() -> None:
    chapters = [
        Chapter("transmission", (2,), 0.9997, (0,), ("backlash",)),
        Chapter("drive", (2,), 0.0003, (1,), ("torque offset",)),
    ]
    assert story_sentence(chapters, ARM) == "More than 99 % of the error comes from backlash at joint 2."


def test_the_sentence_names_joints_as_the_robot_file_does_and_doubts_what_may_be_nothing() -> None:
    names = ("shoulder_pan", "shoulder_lift", "elbow")
    arm = replace(ARM, joints=tuple(replace(one, name=name) for one, name in zip(ARM.joints, names, strict=True)))
    chapters = [
        Chapter("friction", (1, 2), 0.9, (0,), ("viscous friction",)),
        Chapter("links", (3,), 0.06, (1,), ("less mass than modelled",), doubtful=True),
    ]
    assert story_sentence(chapters, arm) == (
        "90 % of the error comes from viscous friction at shoulder_pan and shoulder_lift, "
        "6 % from perhaps less mass than modelled at the link of elbow."
    )


@pytest.mark.parametrize(
    ("effect", "cause"),
    [
        ("coulomb_friction", "friction"),
        ("torque_offset", "drive"),
        ("payload", "links"),
        ("gravity_compensator", "gravity and springs"),
        ("joint_coupling", "transmission"),
        ("time_delay", "timing"),
        ("external_contact", "contact"),
        ("base_tilt", "geometry"),
    ],
)
def test_each_effect_has_a_cause(effect: str, cause: str) -> None:
    assert effect_named(effect).cause == cause


def test_an_effect_of_a_plug_in_gets_its_cause_from_its_facts() -> None:
    assert Effect("lip_seal", "friction of a seal", dissipates=True).cause == "friction"
    assert UNKNOWN.cause == "unknown"
