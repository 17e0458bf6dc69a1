"""The tier of real recordings: measures and page of tables that are made up, and recordings that are not there."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd
import pytest
from made_cases import write_made_cases

from armlab.common.errors import InputError
from armlab.proof.blind import sealed
from armlab.proof.blind.real.real_page import render_page, write_score
from armlab.proof.blind.real.real_score import RealTables, read_tables, real_measures, recording_table, reliability_of
from armlab.proof.blind.sealed import TIME_FILE
from armlab.proof.tiers import real as proving
from armlab.proof.tiers.real import RealSet, prove_real
from armlab.recordings.public import PUBLIC_RECORDINGS

SET = RealSet(("emps", "kuka-kr300"), 2, 1001)
CASES = """\
recording,case,way,kind,concealed,sought,strength,answer,said,seconds,refused
emps,1,injected,payload,payload of 2 kg,payload of 2 kg,4.0,named,"payload, link 1 (0.95)",2,
emps,2,injected,torque offset,offset of 2 N,offset of 2 N,5.0,absorbed,,2,
kuka-kr300,1,injected,time delay,late by 3 ms,late by 3 ms,3.0,class,"channel skew, joint 2 (0.60) or time delay",9,
kuka-kr300,2,withheld,friction,without friction of joint 2,"friction, joint 2",12.0,missed,"backlash, joint 3 (0.75)",9,
"""
CLAIMS = """\
recording,case,concealed,strength,claim,verdict,class_size,probability
emps,1,payload of 2 kg,4.0,"payload, link 1",right,1,0.95
kuka-kr300,1,late by 3 ms,3.0,"channel skew, joint 2",class,2,0.6
kuka-kr300,2,without friction of joint 2,12.0,"backlash, joint 3",wrong,1,0.75
kuka-kr300,2,without friction of joint 2,12.0,"unknown, joint 1",unknown,1,0.9
"""
RECORDINGS = 'recording,reference,control\nemps,36.6 Hz,–\nkuka-kr300,1.75 Hz,"unknown, joint 3"\n'


def _write_tables(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("cases.csv", CASES), ("claims.csv", CLAIMS), ("recordings.csv", RECORDINGS)):
        (folder / name).write_text(text)


@pytest.fixture
def tables(tmp_path: Path) -> RealTables:
    _write_tables(tmp_path / "tables")
    return read_tables(tmp_path / "tables")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Stands in for the command that makes, diagnoses and judges, with copies of `emps` alone; lists its arguments."""
    given: list[list[str]] = []

    def run(arguments: Sequence[str]) -> Iterator[str]:
        given.append(list(arguments))
        if "--make" in arguments:
            write_made_cases(Path(arguments[arguments.index("--make") + 1]), "emps", SET.cases)
        else:
            _write_tables(Path(arguments[arguments.index("--out") + 1]))
        yield "done"

    def answer(arguments: Sequence[str], out: Path) -> None:
        given.append(list(arguments))
        out.mkdir(parents=True)
        (out / TIME_FILE).write_text('{"seconds": 1}')

    own = PUBLIC_RECORDINGS["emps"]
    monkeypatch.setattr(proving, "_run_command", run)
    monkeypatch.setattr(proving, "is_available", lambda recording: recording is own)
    monkeypatch.setattr(sealed, "answer", answer)
    return given


def test_measures_count_names_classes_and_wrong_names_and_what_needs_no_name_not_at_all(tables: RealTables) -> None:
    found = {each.measure.id: each.measure for each in real_measures(tables)}
    assert (found["right_name_or_class"].value, found["right_name_or_class"].number) == (2 / 3, 3)
    assert found["right_name"].value == 1 / 3
    assert found["right_name_or_class"].wanted == ""
    wrong = found["wrong_names_beyond_background"]
    assert (wrong.value, wrong.number, wrong.wanted) == (1 / 4, 4, "at most 5 %")
    assert [found[f"right_when_{name}"].value for name in ("doubtful", "likely", "sure")] == [0, 0, 1]
    assert found["brier_skill"].number == 3
    assert found["missing_verdicts"].value == 0


def test_no_skill_is_counted_against_a_base_rate_of_one(tables: RealTables) -> None:
    found = {each.measure.id: each.measure for each in real_measures(tables.of("emps"))}
    assert found["brier_skill"].value is found["log_skill"].value is None
    assert found["right_when_sure"].value == 1


def test_reliability_has_a_row_a_bin_with_its_interval(tables: RealTables) -> None:
    bins = reliability_of(tables)
    assert bins["mean"].tolist() == [0.6, 0.75, 0.95]
    assert bins["share"].tolist() == [0, 0, 1]
    assert (bins["low"] <= bins["share"]).all()
    assert (bins["share"] <= bins["high"]).all()


def test_each_recording_has_a_row(tables: RealTables) -> None:
    rows = recording_table(tables).set_index("recording")
    assert rows["wrong names"].to_dict() == {"emps": 0, "kuka-kr300": 1}
    assert rows["named or in a class"].to_dict() == {"emps": 1, "kuka-kr300": 1}
    assert rows.loc["kuka-kr300", "stated, mean"] == pytest.approx(0.675)


def test_the_page_shows_what_is_wanted_and_lists_wrong_names_and_misses(tables: RealTables) -> None:
    page = render_page(1001, tables)
    assert "Development set, not judged. 4 cases of 2 recordings, seed 1001." in page
    assert "| wrong names among new claims | at most 5 % | 25 % " in page
    assert "| kuka-kr300 | without friction of joint 2 | 12 | backlash, joint 3 | 0.75 |" in page
    assert "| missed | 0 | 0 | 1 | 1 |" in page
    assert "Judged set." in render_page(5000, tables)


def test_a_page_without_any_new_claim_can_be_drawn(tables: RealTables, tmp_path: Path) -> None:
    silent = RealTables(tables.cases, tables.claims.iloc[:0], tables.recordings)
    assert len(write_score(1001, silent, tmp_path)) == 6


def test_recordings_that_are_not_on_this_machine_are_left_out(asked: list[list[str]], tmp_path: Path) -> None:
    lines = list(prove_real(SET, tmp_path / "work", tmp_path / "results", 1))
    assert "kuka-kr300 is left out: it is neither in the folder ARMLAB_RECORDINGS nor in the cache" in lines
    made, *diagnosed, judged = asked
    for arguments in (made, judged):
        assert arguments[:8] == ["proof", "real-concealed", "--only", "emps", "--seed", "1001", "--cases", "2"]
    assert [arguments[:3] for arguments in diagnosed] == [["proof", "real-concealed", "--observation"]] * 3
    assert not any(str(tmp_path / "work") in word for arguments in diagnosed for word in arguments)
    names = {path.name for path in (tmp_path / "results").iterdir()}
    assert names == {"real.md", "cases.csv", "claims.csv", "recordings.csv", "reliability.svg", "strength.svg"}
    assert pd.read_csv(tmp_path / "results" / "cases.csv")["answer"].tolist() == [
        "named",
        "absorbed",
        "class",
        "missed",
    ]


def test_without_any_recording_the_tier_is_skipped_with_a_reason(
    asked: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proving, "is_available", lambda recording: False)
    lines = list(prove_real(SET, tmp_path / "work", tmp_path / "results", 1))
    assert lines[-1] == "tier real is skipped: no recording of a real arm is on this machine"
    assert not asked
    assert not (tmp_path / "results").exists()


def test_a_judged_score_is_logged_once_and_others_never(asked: list[list[str]], tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    found = RealSet(("emps",), 2, 1001)
    list(prove_real(found, tmp_path / "other", tmp_path / "results", 1))
    assert not log.exists()
    for _ in range(2):
        list(proving.REAL.prove(found, tmp_path / "other", tmp_path / "results", 1, "a" * 40, log))
    assert "| wrong names among claims beyond background | 0.25 of 4 |" in (tmp_path / "log.md").read_text()
    (entry,) = (json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines())
    assert (entry["set"], entry["seed"], entry["cases"]) == ("real", 1001, 4)
    assert entry["score"]["real"]["wrong_names_beyond_background"][0] == 0.25


def test_a_command_that_fails_says_why() -> None:
    with pytest.raises(
        InputError, match=r"armlab proof real-concealed: .*unknown recording 'epms': did you mean 'emps'"
    ):
        list(proving._run_command(["proof", "real-concealed", "--only", "epms", "--seed", "1001", "--make", "made"]))
