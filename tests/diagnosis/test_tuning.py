"""Tuning numbers: their names, units and sources, other values, and the page that lists them."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import engine_cases as cases
import pytest
from click.testing import CliRunner
from small_recordings import frame, recording_in

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.diagnosis.settings import Settings, vary
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.tuning import Tuning, changed_numbers, parse_change, tuning_numbers, tuning_page
from armlab.diagnosis.tuning_counts import count_constants, count_tuning, deciding_numbers
from armlab.report.verdict_files import verdict_texts

ROOT = Path(__file__).parents[2]


def test_every_number_says_what_it_means_and_where_it_comes_from() -> None:
    for each in tuning_numbers(Tuning()):
        assert each.meaning, each.name
        assert each.source, each.name
        values = each.value if isinstance(each.value, tuple) else (each.value,)
        assert all(each.least <= value <= each.most for value in values), each.name


def test_every_number_is_used() -> None:
    folders = (ROOT / "armlab" / "diagnosis", ROOT / "armlab" / "recordings" / "reading")
    files = [each for folder in folders for each in folder.rglob("*.py") if each.name != "tuning.py"]
    code = "\n".join(each.read_text(encoding="utf-8") for each in files)
    names = [each.name.split(".")[1] for each in tuning_numbers(Tuning())]
    assert [name for name in names if not re.search(rf"\.{name}\b", code)] == []


def test_a_count_tells_named_constants_from_code() -> None:
    tree = ast.parse("A, B = 1.5, -2\nC: int = 3\nD = True\nE = A + 1\nF = (4, 'x')\ndef g() -> int:\n    return 7\n")
    assert count_constants(tree) == 4


def test_the_counts_hold_each_number_once() -> None:
    counts = count_tuning()
    assert counts.numbers == len(list(tuning_numbers(Tuning())))
    assert 0 < counts.deciding < counts.by_eye < counts.numbers


def test_the_sentences_of_how_a_name_is_claimed_hold_every_number_that_decides() -> None:
    page = (Path(__file__).parents[2] / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    sentences = page.split("**In ten sentences**")[1].split("\n\n`armlab")[0]
    named = set(re.findall(r"`([a-z]+\.[a-z_]+)`", sentences))
    assert named == set(deciding_numbers())


def test_another_value_changes_one_number_and_nothing_else() -> None:
    changed = vary(Settings(), "noise.max_order", 8)
    assert changed_numbers(changed.tuning) == {"noise.max_order": 8}
    assert replace(changed, tuning=Tuning()) == Settings()
    assert Settings().tuning.noise.max_order == 12


def test_a_whole_number_may_stand_for_a_real_one_and_a_single_value_for_a_list() -> None:
    assert vary(Settings(), "data.cutoff_hz", 30).tuning.data.cutoff_hz == 30.0
    assert vary(Settings(), "links.uncertainty_grid", 0.1).tuning.links.uncertainty_grid == (0.1,)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("noise.maxorder", 8, r"noise.maxorder: no such tuning number, did you mean 'noise.max_order'\?"),
        ("max_order", 8, "max_order: no such tuning number"),
        ("noise.max_order", 8.5, "noise.max_order: 8.5 should be a whole number, like 12"),
        ("noise.max_order", True, "noise.max_order: True should be a whole number"),
        ("noise.max_order", (8, 9), "noise.max_order: 8,9 should be a whole number"),
        ("data.cutoff_hz", "fast", "data.cutoff_hz: fast should be a number, like 40"),
        ("data.cutoff_hz", float("nan"), "data.cutoff_hz: nan should be 0.1 at least"),
        ("pruning.level", 2.0, "pruning.level: 2 should be 1e-12 at least, 1 at most"),
        ("surrogate.sign_widths", (0.1, 0.2), r"0.1,0.2 should be numbers \(3 at least\)"),
    ],
)
def test_a_wrong_name_or_value_is_refused_in_one_line(name: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        vary(Settings(), name, value)
    assert "\n" not in str(error.value)


def test_a_change_is_written_as_name_and_value() -> None:
    assert parse_change("noise.max_order=8") == ("noise.max_order", 8)
    assert parse_change("surrogate.memories_s=0.1,0.5") == ("surrogate.memories_s", (0.1, 0.5))
    for text in ("noise.max_order", "noise.max_order=", "noise.max_order=many"):
        with pytest.raises(InputError, match=r"should be like noise\.max_order=8"):
            parse_change(text)


def test_a_changed_number_stands_in_the_provenance_and_a_usual_one_does_not(tmp_path: Path) -> None:
    recording = cases.recording(seconds=6.0)
    usual, changed = (diagnose(recording, settings=each) for each in (None, vary(Settings(), "noise.max_order", 8)))
    assert "noise.max_order" not in usual.settings
    assert "noise.max_order: 8" in verdict_texts(changed, tmp_path)["model.yaml"]


def _refusal(*arguments: str) -> str:
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    return result.output


def test_a_diagnosis_refuses_a_number_that_there_is_not(tmp_path: Path) -> None:
    told = "noise.order: no such tuning number, did you mean 'noise.max_order'?"
    out, folder = ["--out", str(tmp_path / "out")], str(recording_in(tmp_path / "recording", frame(0, 2.0)))
    assert told in _refusal("diagnose", folder, *out, "--set", "noise.order=8")
    old = ["--compare", folder, "--set", "noise.max_order=8"]
    assert "leave out --set or --compare" in _refusal("diagnose", folder, *out, *old)


def test_the_command_prints_the_page_of_all_tuning_numbers() -> None:
    told = CliRunner().invoke(main, ["tools", "tuning"])
    assert told.exit_code == 0
    assert told.output.startswith(tuning_page())
    assert f"tuning numbers {count_tuning().numbers}, " in told.output
    assert all(f"`{each.name}`" in told.output for each in tuning_numbers(Tuning()))
