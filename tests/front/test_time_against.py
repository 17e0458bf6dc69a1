"""This tree beside an earlier one, as `tools/time_against.py` measures it."""

from pathlib import Path

import pytest

from tools.time_against import describe_ratio, diagnosis_of, first_difference, parse_options, take_over_extensions

VERDICT = {
    "status": "mismatch",
    "findings": [
        {"effect": "payload", "joint": 3, "mass": 1.5},
        {"effect": "time_delay", "joint": None, "named": True},
    ],
}


def changed(**finding):
    return {**VERDICT, "findings": [{**VERDICT["findings"][0], **finding}, VERDICT["findings"][1]]}


def test_verdicts_whose_numbers_differ_in_the_seventh_digit_are_equal():
    assert first_difference(VERDICT, changed(mass=1.5 * (1 + 5e-7))) is None
    assert first_difference({"p_value": 0.0}, {"p_value": 1e-12}) is None


@pytest.mark.parametrize(
    ("now", "difference"),
    [
        (changed(mass=1.50001), "findings[0].mass: 1.5 before, 1.50001 now"),
        (changed(effect="coulomb_friction"), "findings[0].effect: 'payload' before, 'coulomb_friction' now"),
        (changed(joint=None), "findings[0].joint: 3 before, None now"),
        (changed(named=True), "findings[0] has named on one side only"),
        ({**VERDICT, "findings": VERDICT["findings"][:1]}, "length of findings: 2 before, 1 now"),
        ({**VERDICT, "findings": VERDICT["findings"][::-1]}, "findings[0] has mass, named on one side only"),
        ({"status": "none"}, "the document has findings on one side only"),
    ],
)
def test_the_first_difference_of_two_verdicts_is_told_with_its_place(now, difference):
    assert first_difference(VERDICT, now) == difference


def test_true_is_not_the_number_one():
    assert first_difference({"named": True}, {"named": 1}) == "named: True before, 1 now"


def test_a_ratio_is_of_the_least_times_and_its_range_of_single_rounds():
    assert describe_ratio([(10.0, 5.0), (8.0, 6.0), (16.0, 4.0)]) == "0.50 of before (0.25 to 0.75)"


def test_table_3_is_timed_unless_recordings_are_given():
    alone = parse_options(["abc"])
    assert (alone.commit, alone.diagnose, alone.as_read, alone.rounds) == ("abc", [], False, 3)
    several = parse_options(["abc", "--diagnose", "one", "two", "--as-read", "--rounds", "5"])
    assert (several.diagnose, several.as_read, several.rounds) == ([Path("one"), Path("two")], True, 5)


@pytest.mark.parametrize("words", [["--diagnose", "one"], ["abc", "--as-read"], ["abc", "--rounds", "0"]])
def test_options_that_say_nothing_to_time_are_refused(words):
    with pytest.raises(SystemExit):
        parse_options(words)


def test_a_recording_is_found_from_the_folder_of_the_other_tree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = diagnosis_of(Path("mine"), as_read=True).words(Path("/out"))
    assert words == ["diagnose", str(tmp_path / "mine"), "--out", "/out", "--as-read"]


def make_tree(folder, source, built):
    (folder / "problem").mkdir(parents=True)
    (folder / "problem/kernel.c").write_text(source)
    (folder / "problem/kernel_build.py").write_text("")
    if built:
        (folder / "problem/_kernel.abi3.so").write_text(source)
    return folder


@pytest.mark.parametrize(
    ("source", "built", "taken"), [("int a;", True, True), ("int b;", True, False), ("int a;", False, False)]
)
def test_only_an_extension_of_the_same_source_is_taken_over(tmp_path, source, built, taken):
    earlier = make_tree(tmp_path / "earlier", "int a;", built=False)
    assert take_over_extensions(make_tree(tmp_path / "now", source, built), earlier) is taken
    assert (earlier / "problem/_kernel.abi3.so").exists() is taken


def test_readings_are_timed_alone():
    assert parse_options(["abc", "--read", "one", "two"]).read == [Path("one"), Path("two")]
    with pytest.raises(SystemExit):
        parse_options(["abc", "--read", "one", "--diagnose", "two"])
