"""The story of a verdict: causes, their order, and shares that sum to at most one."""

import numpy as np
import pytest

from armlab.diagnosis.story import MAX_WORDS, Chapter, add_in_order, story_sentence
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named


def test_the_largest_cause_is_added_first_and_falls_sum_to_the_whole_fall() -> None:
    start = np.array([3.0, 1.0, 0.0])
    falls = add_in_order(start, {"small": np.array([0.0, 1.0, 0.0]), "large": np.array([3.0, 0.0, 0.0])})
    assert list(falls) == ["large", "small"]
    assert falls == pytest.approx({"large": 9.0, "small": 1.0})


def test_torques_that_explain_the_same_error_do_not_count_it_twice() -> None:
    start = np.array([2.0, 0.0])
    falls = add_in_order(start, {"one": np.array([1.5, 0.0]), "other": np.array([0.5, 0.0])})
    assert sum(falls.values()) == pytest.approx(4.0)


def test_the_sentence_names_the_causes_and_has_at_most_thirty_words() -> None:
    chapters = [
        Chapter("friction", (1, 2, 3, 4, 5, 6), 0.85, (0, 1), ("coulomb_friction", "viscous_friction")),
        Chapter("gravity and springs", (2,), 0.05, (2,), ("cable_stiffness",)),
        *(Chapter("transmission", (joint,), 0.01, (2 + joint,), ("backlash",)) for joint in range(1, 7)),
    ]
    sentence = story_sentence(chapters, 6)
    assert sentence.startswith(
        "85 % of the error comes from friction at all 6 joints, 5 % from cable stiffness at joint 2"
    )
    assert len(sentence.split()) <= MAX_WORDS


def test_one_of_several_causes_never_explains_all() -> None:
    chapters = [Chapter("links", (2,), 0.998, (0,), ("payload",)), Chapter("unknown", (1,), 0.02, (1,), ("unknown",))]
    assert story_sentence(chapters, 3) == (
        "98 % of the error comes from payload of link 2, 2 % from something without a name at joint 1."
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
